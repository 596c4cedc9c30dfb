"""Drives that must be possible: from step to step, and from the doors of each room in use to the first step there."""

from __future__ import annotations

import math

from labgym.geometry import wrap_angle
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import DriveRule
from labgym.navigation.feasibility import Leg, legs
from labgym.navigation.goals import Pose, location_pose
from labgym.navigation.plan import PLANNING_RADIUS
from labgym.protocols import Protocol

ENTRY_DISTANCE_M = PLANNING_RADIUS + 0.05
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
    entries: list[Leg] = []
    for entrance in arrangement.building.entrances:
        first_stop = first.get(entrance.space)
        if first_stop is None:
            continue
        x, y, yaw = entrance.pose
        start: Pose = (
            x - ENTRY_DISTANCE_M * math.sin(yaw),
            y + ENTRY_DISTANCE_M * math.cos(yaw),
            wrap_angle(yaw + math.pi / 2.0),
        )
        entries.append((entrance.label, first_stop, start, location_pose(layout, first_stop)))
    return entries


TRANSITIONS = DriveRule(
    name="transitions",
    metric="step_nav",
    requires="The robot gets from the place of each step of the protocol to that of the next",
    source="LabBuilder paper, navigation metrics",
    legs=lambda site: [] if site.protocol is None else legs(site.arrangement.layout, site.protocol),
)
ENTRIES = DriveRule(
    name="entries",
    metric="door_nav",
    requires="The robot gets from each door of a room in use to the first step there",
    source="planning practice: robots come from other rooms",
    legs=lambda site: [] if site.protocol is None else entry_legs(site.arrangement, site.protocol),
)
