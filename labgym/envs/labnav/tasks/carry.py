"""Task "carry": S OT / clip(T, OT, 8 OT) * clip(2 - n_max / freeboard, 0, 1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from labgym.envs.conditions.payload import beaker_of
from labgym.envs.labnav.levels import drift, locobot, people
from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, ScoreWeights, register, timed


def carry(success: bool, shortest: float, time: float, rise: float, freeboard: float) -> float:
    """Return the timed score less what the liquid rose: all of it up to the freeboard, none from twice as high.

    Args:
        success, shortest, time: as for `timed`.
        rise: greatest rise of the liquid at the wall, n_max, meters. freeboard: meters.
    """
    return timed(success, shortest, time) * min(max(2.0 - rise / freeboard, 0.0), 1.0)


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:
    """Return the timed score less what the liquid rose; without a beaker the timed score."""
    if "payload" not in conditions:
        return timed(result.success, result.shortest, result.time)
    freeboard, rise = beaker_of(conditions["payload"]).freeboard, float(outcomes["payload"]["highest"])
    return carry(result.success, result.shortest, result.time, rise, freeboard)


def _level(freeboard: float, area: float = 20.0, **others: Any) -> Level:
    return Level(({"kind": "payload", "beaker": {"freeboard": freeboard}}, people(area)), **others)


TASK = register(
    LabNavTask(
        "carry",
        "carry an open beaker without spilling",
        {
            1: _level(0.020),
            2: _level(0.010),
            3: _level(0.010, **drift(locobot("ilqr", 1.0), 2.0, lidar=0.05)),
        },
        score,
        easy=_level(0.050, 80.0, lengths=EASY_LENGTHS),
        weights=ScoreWeights(people=0.0),
    )
)
