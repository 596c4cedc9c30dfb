"""Task "odometry": S L* / max(P, L*)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, register, spl
from labgym.envs.parts.actuation import LOCOBOT

NOISE: dict[str, Any] = {"lidar": 0.03, "color": 25.5, "redwood": True}
"""Errors of the sensors: meters, 0.1 of the range of colors, and those of Redwood."""
STEP, TURN = 0.25, math.radians(30.0)
"""Amounts of the discrete actions to which published errors belong: meters and radians."""


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return SPL."""
    return spl(result.success, result.shortest, result.path_length)


def robothor(factor: float) -> dict[str, float]:
    """Return RoboTHOR's errors of an action, 5 mm and 0.5 degrees, as variances that add along the way."""
    along, turn = 0.005 * factor / math.sqrt(STEP), math.sqrt(2.0 * math.pi / TURN)
    return {"along": along, "heading": 0.5 * factor / math.sqrt(STEP), "turning": 0.5 * factor * turn}


def locobot(controller: str, factor: float) -> dict[str, float]:
    """Return the errors of a LoCoBot in Habitat, mean and variance of an action, as means and variances that add."""
    table = LOCOBOT[controller]
    (step, step_variance), (veer, veer_variance) = table.ahead, table.turned
    turn, turn_variance = table.turned_turning
    circle = 2.0 * math.pi / TURN
    return {
        "along": factor * math.sqrt(step_variance / STEP),
        "heading": factor * math.degrees(math.sqrt(veer_variance / STEP)),
        "turning": factor * math.degrees(math.sqrt(turn_variance * circle)),
        "stretch": factor * step / STEP,
        "veer": factor * math.degrees(veer / STEP),
        "overturn": factor * turn / TURN,
    }


def level(errors: Mapping[str, Any], slip: float) -> Level:
    """Return a level with errors of the odometry, and of the wheels as multiples of 3% and 2 degrees per meter."""
    return Level(odometry=errors, slip=(0.03 * slip, 2.0 * slip), **NOISE)


TASK = register(
    LabNavTask(
        "odometry",
        "find a goal that is announced once, by wheels and sensors that err",
        {1: level(robothor(0.5), 0.5), 2: level(robothor(1.0), 1.0), 3: level(locobot("ilqr", 0.5), 2.0)},
        score,
        easy=Level(odometry=robothor(0.1), slip=(0.003, 0.2), lidar=0.003, lengths=EASY_LENGTHS),
    )
)
