"""The compiled crowd moves as the interpreted one, to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.conditions import crowd
from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import Crowd
from labgym.envs.conditions.orca import Disc
from labgym.envs.world import world_of

WORLD = world_of(island_laboratory())


def people(rng, count, model):
    """Return people at free places, some of whom overlap; half yield, and some walk in pairs."""
    places = []
    while len(places) < count:
        place = rng.uniform((0.4, 0.4), (7.6, 5.6)).tolist()
        if WORLD.paths.free(*place):
            places.append(place)
    roles = [
        {
            "start": place,
            "yields": bool(number % 2),
            "group": number // 2 if count % 2 else number,
            "stops": [[*places[k], 0.3, 0.5] for k in rng.integers(0, count, 3)] if number else [],
        }
        for number, place in enumerate(places)
    ]
    return cast_of({"people": roles, "model": model, "speed": 1.0 if count % 3 else 1.4})


@pytest.mark.parametrize(("count", "model"), [(1, "orca"), (4, "orca"), (9, "orca"), (16, "orca"), (4, "social_force")])
def test_the_compiled_crowd_moves_as_the_interpreted_one_to_the_bit(count, model, monkeypatch):
    pytest.importorskip("numba")
    rng = np.random.default_rng(count)
    compiled, plain = (Crowd(WORLD, people(np.random.default_rng(count), count, model)).copy() for _ in range(2))
    kernel = crowd.compiled_velocities()
    assert kernel is not None
    x, y, rest = 4.0, 1.0, 0.0
    for step in range(250):
        moves = step % 40 >= 15
        vx, vy = rng.normal(0.0, 0.5, 2).tolist() if moves else (0.0, 0.0)
        x, y, rest = min(max(x + 0.1 * vx, 0.4), 7.6), min(max(y + 0.1 * vy, 0.4), 5.6), 0.0 if moves else rest + 0.1
        robot = Disc(x, y, vx, vy, 0.27)
        monkeypatch.setattr(crowd, "compiled_velocities", lambda: kernel)
        compiled.step(robot, rest)
        monkeypatch.setattr(crowd, "compiled_velocities", lambda: None)
        plain.step(robot, rest)
        assert repr(compiled.walkers) == repr(plain.walkers)  # repr tells -0.0 from 0.0
