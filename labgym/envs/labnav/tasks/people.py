"""Task "people": 0.4 S + 0.3 S OT / max(T, OT) + 0.3 S max(0, 1 - seconds nearer than 1.0 m / OT)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from labgym.envs.labnav.levels import people as walking
from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, ScoreWeights, ideal_time, register

WEIGHTS = (0.4, 0.3, 0.3)
"""Of success, time and distance from people."""


def people(success: bool, shortest: float, time: float, near: float) -> float:
    """Return the weighted sum of success, time and distance from people.

    Args:
        success: whether the goal was reached without touching a person.
        shortest: L*, meters. time: T, seconds. near: seconds nearer than 1.0 m to a person, center to center.
    """
    if not success:
        return 0.0
    ideal = ideal_time(shortest)
    terms = (1.0, ideal / max(time, ideal), max(0.0, 1.0 - near / ideal))
    return math.fsum(weight * term for weight, term in zip(WEIGHTS, terms, strict=True))


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return the weighted sum of success, time and distance from people."""
    return people(result.success, result.shortest, result.time, float(outcomes["people"]["close_seconds"]))


def _level(area: float, lengths: tuple[float, float] = (4.0, 10.0), **others: Any) -> Level:
    return Level((walking(area, **others),), lengths=lengths)


TASK = register(
    LabNavTask(
        "people",
        "drive among people, half of whom do not see the robot",
        {1: _level(20.0), 2: _level(8.0), 3: _level(8.0, (8.0, 16.0), yielding=0.25, speed=1.2)},
        score,
        easy=_level(80.0, EASY_LENGTHS),
        weights=ScoreWeights(WEIGHTS[1], WEIGHTS[2]),
    )
)
