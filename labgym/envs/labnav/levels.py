"""Nuisances that several tasks share: people, and errors of odometry, wheels and sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from labgym.envs.parts.actuation import LOCOBOT

STEP, TURN = 0.25, math.radians(30.0)
"""Amounts of the discrete actions to which published errors belong: meters and radians."""
NOISE: dict[str, Any] = {"lidar": 0.03, "color": 25.5, "redwood": True}
"""Errors of the sensors: meters, 0.1 of the range of colors, and those of Redwood."""


def people(area: float, **others: Any) -> dict[str, Any]:
    """Return the condition "people" with one person per `area` m², and further arguments of it."""
    return {"kind": "people", "density": 1.0 / area, **others}


def slip(factor: float) -> tuple[float, float]:
    """Return errors of the wheels, `scale` and `veer`, as a multiple of 3% and 2 degrees per meter."""
    return 0.03 * factor, 2.0 * factor


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


def drift(errors: Mapping[str, Any], wheels: float, **others: Any) -> dict[str, Any]:
    """Return fields of a level with errors of the odometry, the wheels (as `slip`) and all sensors."""
    return {"odometry": errors, "slip": slip(wheels), **NOISE, **others}
