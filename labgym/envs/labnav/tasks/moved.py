"""Task "moved": S L* / max(P, L*) * m_r L* / (m_r L* + sum m_i d_i)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from labgym.envs.labnav.levels import robothor
from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, register, spl
from labgym.envs.robot import ROBOT


def effort(shortest: float, pushes: Iterable[tuple[float, float]], mass: float = ROBOT.mass) -> float:
    """Return m_r L* / (m_r L* + sum m_i d_i).

    Args:
        shortest: L*, meters.
        pushes: mass in kg and way in meters of each thing that was pushed.
        mass: of the robot, kg.
    """
    own = mass * shortest
    return own / (own + math.fsum(each * way for each, way in pushes))


def moved(success: bool, shortest: float, driven: float, pushes: Iterable[tuple[float, float]]) -> float:
    """Return SPL times the effort."""
    return spl(success, shortest, driven) * effort(shortest, pushes)


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return SPL times the effort of pushing."""
    pushes = [(float(thing["mass"]), float(thing["way"])) for thing in outcomes["changes"]["pushed"].values()]
    return moved(result.success, result.shortest, result.path_length, pushes)


def changes(**arguments: Any) -> dict[str, Any]:
    """Return the condition "changes" with its arguments."""
    return {"kind": "changes", **arguments}


def _level(condition: Mapping[str, Any], **others: Any) -> Level:
    return Level((condition,), **{"lengths": (4.0, 25.0)} | others)


TASK = register(
    LabNavTask(
        "moved",
        "drive by a map from before things moved",
        {
            1: _level(changes(most=1)),
            2: _level(changes(spacing=3.0, late=True), odometry=robothor(1.0), lidar=0.03),
            3: _level(changes(spacing=2.0, late=True), odometry=robothor(2.0), lidar=0.05),
        },
        score,
        easy=_level(changes(most=1, kinds=("stool",)), lengths=EASY_LENGTHS),
    )
)
