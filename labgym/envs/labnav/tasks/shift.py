"""Task "shift": mean over all drives of S_i L*_i / max(P_i, L*_i), half of it for one that ends out of its dock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from labgym.envs.labnav.levels import drift, people, robothor
from labgym.envs.labnav.task import LabNavTask, Level, Result, ScoreWeights, leg_score, register
from labgym.envs.labnav.tasks import moved, odometry


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return the mean score of all drives; those that were not begun score 0."""
    scores = (leg_score(leg.success, leg.docked, leg.shortest, leg.path_length) for leg in result.legs)
    return math.fsum(scores) / result.goals


def _level(errors: Level, freeboard: float, changes: Mapping[str, Any], *walking: Mapping[str, Any]) -> Level:
    """Return a level with the errors of another one, a beaker, and the conditions "changes" and "people"."""
    payload = {"kind": "leg_payload", "beaker": {"freeboard": freeboard}}
    conditions = (changes, payload, *walking)
    return replace(errors, conditions=conditions, lengths=(0.5, 60.0), detour=0.0, goals=(5, 10), rooms=(2, 4))


_HALF, _WHOLE = Level(**drift(robothor(0.5), 0.5)), Level(**drift(robothor(1.0), 1.0))
_ONE = moved.changes(most=1)

TASK = register(
    LabNavTask(
        "shift",
        "drive to all places of a protocol, without a reset",
        {
            1: _level(_HALF, 0.020, _ONE),
            2: _level(_HALF, 0.020, _ONE, people(20.0)),
            3: _level(_WHOLE, 0.010, moved.changes(), people(8.0)),
        },
        score,
        easy=replace(_level(odometry.TASK.easy, 0.050, *moved.TASK.easy.conditions), goals=(2, 4), rooms=(1, 3)),
        touched=("person",),
        docks=True,
        chain=True,
        weights=ScoreWeights(time=0.1, people=0.0, length=1.0),
        dock_slack=0.07,
    )
)
