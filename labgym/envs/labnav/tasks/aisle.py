"""Task "aisle": S OT / clip(T, OT, 8 OT)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from labgym.envs.labnav.levels import people
from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, register, timed


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return the share of the ideal time in the time taken."""
    return timed(result.success, result.shortest, result.time)


PARKED = {"kind": "parked"}


def _level(reaches: float, stops: float, **others: Any) -> Level:
    fields: dict[str, Any] = {"conditions": (PARKED,), "detour": 1.3, "neck": (reaches, stops)}
    return Level(**fields | others)


TASK = register(
    LabNavTask(
        "aisle",
        "drive fast through a neck that is little wider than the robot",
        {
            1: _level(0.40, 0.45, detour=1.0, lengths=(4.0, 15.0)),
            2: _level(0.35, 0.40),
            3: _level(0.31, 0.35, conditions=(PARKED, people(20.0))),
        },
        score,
        easy=Level((PARKED,), lengths=EASY_LENGTHS),
    )
)
