"""The drives of a floor: from its exits and places of work to other places of work."""

from __future__ import annotations

import math

import numpy as np

from labgym.geometry import wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.rules.building import building_of
from labgym.navigation import STAND_OFF, Pose, TriedPair, draw_drives, goal_poses

STREAM = 3
"""Sub-stream of a floor's seed from which its drives are drawn."""
ENTRY = "entry"
"""Name of the start poses inside the exits, with a number."""


def floor_drives(layout: Layout, seed: int, count: int) -> tuple[TriedPair, ...]:
    """Draw drives until `count` are accepted or none is left; return all that were tried.

    Args:
        layout: a floor with its clutter.
        seed: the floor's seed.
        count: number of drives to accept.
    """
    generator = np.random.default_rng([seed, STREAM])
    return draw_drives(layout, entry_poses(layout), places_of_work(layout), count, generator)


def entry_poses(layout: Layout) -> dict[str, Pose]:
    """Return a start pose inside each exit: 0.60 m from the door, facing into the floor."""
    poses: dict[str, Pose] = {}
    for entrance in building_of(layout).entrances:
        if entrance.exit:
            x, y, yaw = entrance.pose
            here = x - STAND_OFF * math.sin(yaw), y + STAND_OFF * math.cos(yaw)
            poses[f"{ENTRY}-{len(poses) + 1}"] = (*here, wrap_angle(yaw + math.pi / 2.0))
    return poses


def places_of_work(layout: Layout) -> dict[str, Pose]:
    """Return the goal poses of all protocols of a layout, by location."""
    return {name: pose for one in layout.protocols for name, pose in goal_poses(layout, one).items()}
