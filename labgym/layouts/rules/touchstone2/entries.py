"""Every door is a start of navigation: from the doors of each room in use the robot reaches the first step there."""

from __future__ import annotations

import math

from labgym.geometry import wrap_angle
from labgym.layouts.rules.arrangement import Arrangement
from labgym.navigation.feasibility import Leg
from labgym.navigation.goals import Pose, location_pose
from labgym.navigation.plan import PLANNING_RADIUS
from labgym.protocols import Protocol

INSIDE = PLANNING_RADIUS + 0.05
"""Distance of the robot's center from the inner face of the wall when it has come in, meters."""


def entry_legs(arrangement: Arrangement, protocol: Protocol) -> list[Leg]:
    """Return the drives from doors: from each door or passage into a space of a location to the first location there.

    The robot starts just inside the opening, 0.35 m from the wall. Names of doors come first in the legs.
    """
    layout, first = arrangement.layout, dict[int, str]()
    for location in protocol.locations:
        target = layout.find(location)
        if target is not None and target.id in arrangement.index:
            root = layout.root(target.id).id
            first.setdefault(arrangement.spaces[arrangement.row(root)], location)
    legs: list[Leg] = []
    for entrance in arrangement.building.entrances:
        first_stop = first.get(entrance.space)
        if first_stop is None:
            continue
        x, y, yaw = entrance.pose
        start: Pose = (
            x - INSIDE * math.sin(yaw),
            y + INSIDE * math.cos(yaw),
            wrap_angle(yaw + math.pi / 2.0),
        )
        legs.append((entrance.label, first_stop, start, location_pose(layout, first_stop)))
    return legs
