"""The compiled dynamic program finds the interpreted one's schedules, to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from labgym.policies.clairvoyant import schedule
from labgym.policies.clairvoyant.route import Gait, Limits, Route
from labgym.policies.clairvoyant.worth import Worth

WORTHS = ((0.3, 0.3, 0.0), (0.1, 0.0, 1.0), (1.0, 0.1, 0.0))


@pytest.mark.parametrize("seed", range(6))
def test_the_compiled_schedule_is_the_interpreted_one_to_the_bit(seed, monkeypatch):
    pytest.importorskip("numba")
    assert schedule.kernels() is not None
    rng = np.random.default_rng(seed)
    route = Route.of(np.cumsum(rng.normal(0.2, 0.3, (12, 2)), axis=0), Limits())
    strides = np.cumsum(rng.normal(0.0, 0.05, (int(rng.integers(1, 200)), 1, 2)), axis=0)
    people = route.points[rng.integers(0, len(route.points), (1, seed))] + rng.normal(0.0, 0.5, (1, seed, 2)) + strides
    arguments = (
        route,
        schedule.Crossing(people, 0.63),
        Worth(route.length, *WORTHS[seed % 3]),
        Gait(6 + seed % 4, 0.125),
        float(rng.uniform(0.0, 0.3)),
        float(rng.uniform(0.0, 1.0)),
    )
    compiled = schedule.best_schedule(*arguments)
    monkeypatch.setattr(schedule, "kernels", lambda: None)
    plain = schedule.best_schedule(*arguments)
    assert (compiled is None) == (plain is None)
    if compiled is not None and plain is not None:
        assert compiled.places.tobytes() == plain.places.tobytes()
        assert compiled.speeds.tobytes() == plain.speeds.tobytes()
        assert (compiled.near, compiled.points) == (plain.near, plain.points)
