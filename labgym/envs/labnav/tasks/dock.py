"""Task "dock": clip(ln(1 / e) / ln 10, 0, 1), e = max(position error / 0.10 m, heading error / 0.10 rad)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, docking_error, register

MOUNTING = (0.02, 1.5)
"""Errors of the places of the sensors, drawn for each episode: meters and degrees."""


def dock(rests: bool, position: float, heading: float) -> float:
    """Return clip(ln(1 / e) / ln 10, 0, 1); 0 for a robot that does not rest there, or touched something."""
    error = docking_error(position, heading)
    if not rests or error >= 1.0:
        return 0.0
    return min(-math.log10(error), 1.0) if error > 0.0 else 1.0


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return the decades of the docking error."""
    return dock(result.success, result.final_distance, result.final_heading)


def _level(distance: float, degrees: float, lidar: float = 0.03) -> Level:
    return Level(
        ({"kind": "station", "distance": distance, "angle": math.radians(degrees)},),
        lengths=(4.0, 25.0),
        lidar=lidar,
        mounting=MOUNTING,
    )


TASK = register(
    LabNavTask(
        "dock",
        "dock at a station that is off its mapped pose",
        {1: _level(0.05, 3.0), 2: _level(0.15, 9.0, 0.05), 3: _level(0.20, 12.0, 0.08)},
        score,
        easy=replace(_level(0.01, 0.5, 0.003), lengths=EASY_LENGTHS, mounting=(0.002, 0.15)),
        docks=True,
    )
)
