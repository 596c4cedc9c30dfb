"""The compiled parts of the clairvoyant find what the interpreted ones find, to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.policies.clairvoyant import reaction, rehearsal, smoothing, space_time
from labgym.policies.clairvoyant.clearance import ClearanceField
from labgym.policies.clairvoyant.reference import Reference
from labgym.policies.clairvoyant.route import Gait, Limits, Route
from labgym.policies.clairvoyant.worth import Worth

pytest.importorskip("numba")
FIELD = ClearanceField(island_laboratory())


def both(monkeypatch, module, call):
    """Return what a call returns with a compiled function and without."""
    assert module.kernels() is not None
    compiled = call()
    monkeypatch.setattr(module, "kernels", lambda: None)
    return compiled, call()


@pytest.mark.parametrize("seed", range(5))
def test_a_rehearsal(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 120)) if seed else 1
    poses, velocities = np.cumsum(rng.normal(0.0, 0.06, (count, 3)), axis=0), rng.normal(0.3, 0.5, (count, 2))
    reference = Reference(0.3, 0.1, poses, velocities)
    pose, velocity = tuple((poses[0] + rng.normal(0.0, 0.02, 3)).tolist()), tuple(rng.normal(0.0, 0.3, 2).tolist())
    compiled, plain = both(monkeypatch, rehearsal, lambda: rehearsal.rehearsed(reference, pose, velocity, 0.2))
    assert len(plain.poses) == count + 1
    assert compiled.poses.tobytes() == plain.poses.tobytes()
    assert compiled.velocities.tobytes() == plain.velocities.tobytes()


@pytest.mark.parametrize("seed", range(5))
def test_the_cost_of_a_path_and_its_gradient(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    path = rng.uniform((0.5, 0.5), (7.5, 5.5)) + np.cumsum(
        rng.normal(0.02, 0.1, (int(rng.integers(6, 300)), 2)), axis=0
    )
    band = smoothing.Band(*rng.uniform(0.01, 2.0, 6).tolist())
    compiled, plain = both(monkeypatch, smoothing, lambda: smoothing._cost(path, 0.097, FIELD, band))
    assert compiled[0] == plain[0]
    assert compiled[1].tobytes() == plain[1].tobytes()


@pytest.mark.parametrize("seed", range(3))
def test_a_way_around_people(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    people = rng.uniform((0.5, 0.5), (7.5, 5.5), (1, 3, 2)) + np.cumsum(rng.normal(0.0, 0.1, (20, 3, 2)), axis=0)

    def way():
        return space_time.SpaceTime(FIELD, np.array([7.0, 1.0]), 0.2).way(np.array([1.0, 5.0]), people, 0.66, 1.0, 0.5)

    compiled, plain = both(monkeypatch, space_time, way)
    assert len(plain) > 10
    assert compiled.tobytes() == plain.tobytes()


class Passers:
    """People who walk straight on."""

    def __init__(self, places, strides) -> None:
        self._places, self._strides, self._tick = places, strides, 0

    @property
    def places(self):
        return self._places + self._strides * self._tick

    @property
    def following(self):
        return self._places + self._strides * (self._tick + 1)

    def step(self, x, y, vx, vy, turn):
        self._tick += 1


@pytest.mark.parametrize("seed", range(8))
def test_a_drive_that_gives_way(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    route = Route.of(np.cumsum(rng.normal(0.25, 0.2, (12, 2)), axis=0), Limits())
    places = route.points[rng.integers(0, len(route.points), seed)] + rng.normal(0.0, 1.5, (seed, 2))
    strides = rng.normal(0.0, 0.05, (seed, 2))
    gait = Gait(6 + seed % 4, 0.125, (1.0,) if seed % 2 else (0.5, 0.3, 0.2))
    before = np.zeros((len(gait.weights), 2))

    def drive(least=-np.inf):
        people = Passers(places, strides)
        return reaction.reacting(route, people, Worth(route.length), 0.63, gait, before, least=least)

    compiled, plain = both(monkeypatch, reaction, drive)
    assert (compiled is None) == (plain is None)
    if plain is not None:
        assert compiled.places.tobytes() == plain.places.tobytes()
        assert compiled.speeds.tobytes() == plain.speeds.tobytes()
        assert (compiled.near, compiled.points) == (plain.near, plain.points)
        assert drive(plain.points) is None
        assert drive(plain.points - 1e-9).places.tobytes() == plain.places.tobytes()
