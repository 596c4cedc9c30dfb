"""The people of a forecast move as the crowd, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import Crowd
from labgym.envs.conditions.crowd_arrays import arrays_of
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


@pytest.mark.parametrize("count", [2, 4, 5, 9, 16])
def test_the_people_of_a_forecast_move_as_the_crowd_to_the_bit(count):
    pytest.importorskip("numba")
    rng = np.random.default_rng(count)
    plain = Crowd(WORLD, people(rng, count, "orca"))
    compiled = arrays_of(plain)
    assert compiled is not None
    planned, x, y, rest = 0, 4.0, 1.0, 0.0
    for step in range(400):
        moves = step % 40 >= 15
        vx, vy = rng.normal(0.0, 0.5, 2).tolist() if moves else (0.0, 0.0)
        x, y, rest = min(max(x + 0.1 * vx, 0.4), 7.6), min(max(y + 0.1 * vy, 0.4), 5.6), 0.0 if moves else rest + 0.1
        robot = Disc(x, y, vx, vy, 0.27)
        before = [walker.path for walker in plain.walkers]
        plain.step(robot, rest)
        compiled.step(robot, rest)
        planned += sum(walker.path not in ((), path) for walker, path in zip(plain.walkers, before, strict=True))
        assert compiled.places.tobytes() == np.array(plain.places).tobytes()  # tells -0.0 from 0.0
        if step == 150:
            at_150 = compiled
            compiled = compiled.copy()
    assert planned >= count - 1
    assert at_150.places.tobytes() != compiled.places.tobytes()


def test_a_forecast_by_another_model_is_that_of_the_crowd():
    assert arrays_of(Crowd(WORLD, people(np.random.default_rng(4), 4, "social_force"))) is None


@pytest.mark.parametrize("scale", [1e-300, 1e-3, 1.0, 20.0])
def test_the_compiled_distance_is_that_of_python(scale):
    pytest.importorskip("numba")
    from labgym.envs.conditions.walk_kernel import distance

    ends = np.random.default_rng(0).normal(0.0, scale, (2000, 4)).tolist()
    ends += [[1.0, 2.0, 1.0, 2.0], [0.0, 0.0, 3.0, 4.0], [1.0, 0.0, 1.0, -7.5]]
    assert [distance(*each) for each in ends] == [math.dist(each[:2], each[2:]) for each in ends]
