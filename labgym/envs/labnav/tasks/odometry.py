"""Task "odometry": S L* / max(P, L*)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from labgym.envs.labnav.levels import drift, locobot, robothor, slip
from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, register, spl


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return SPL."""
    return spl(result.success, result.shortest, result.path_length)


_HARD = {"lidar": 0.05, "lengths": (12.0, 25.0)}

TASK = register(
    LabNavTask(
        "odometry",
        "find a goal that is announced once, by wheels and sensors that err",
        {
            1: Level(**drift(robothor(1.0), 1.0)),
            2: Level(**drift(locobot("ilqr", 0.5), 2.0, **_HARD)),
            3: Level(**drift(locobot("ilqr", 1.0), 2.0, **_HARD)),
        },
        score,
        easy=Level(odometry=robothor(0.1), slip=slip(0.1), lidar=0.003, lengths=EASY_LENGTHS),
    )
)
