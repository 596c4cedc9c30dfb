"""On which walls hoods stand, named from the main door."""

from __future__ import annotations

import math

from labgym.eval.variety.sketch import main_entrance
from labgym.layouts import Layout

WALLS = ("back", "left", "front", "right")
"""Walls as seen from the main door: the back wall is opposite, the door is in the front wall."""


def hood_walls(layout: Layout) -> list[str]:
    """Return the wall behind each hood of a layout, by the nearest of the four directions from the main door."""
    ahead = main_entrance(layout).pose[2] + math.pi / 2.0
    walls = []
    for placement in layout.placements:
        if layout.asset(placement.id).fume_hood:
            behind = layout.box(placement.id).yaw - math.pi / 2.0
            walls.append(WALLS[round((behind - ahead) / (math.pi / 2.0)) % 4])
    return walls
