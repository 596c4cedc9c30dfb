"""Goal poses in front of devices, and the goal pairs of a protocol."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from labgym import protocols
from labgym.errors import LabgymError
from labgym.geometry import OrientedBox, wrap_angle
from labgym.navigation.plan import STAND_OFF, FloorPlan
from labgym.protocols import Protocol

Pose = tuple[float, float, float]

SAME_PLACE = 1e-3
"""Goal poses that are nearer than this count as the same, meters."""
ANYWHERE = "anywhere"
"""Location of an end of a drive that is not the goal pose of an asset."""


@dataclass(frozen=True)
class GoalPair:
    """From the goal pose of one step's location to that of the next.

    Attributes:
        index: position in the tuple that `goal_pairs` returns.
        start, goal: (x, y, yaw) in the room frame; meters, radians; yaw is the robot's heading.
        start_location, goal_location: asset names, or `ANYWHERE`.
    """

    index: int
    start: Pose
    goal: Pose
    start_location: str
    goal_location: str


def goal_pose(target: OrientedBox, parent: OrientedBox | None = None) -> Pose:
    """Return the pose from which the robot works at a device (paper, appendix on navigation pose generation).

    The robot's center is 0.60 m in front of the middle of the device's front, and the robot faces the device: with
    front = (-sin yaw, cos yaw), position = c + (depth / 2 + 0.60) front and heading = -front. If the device stands on
    an object with a larger footprint, the pose is in front of that object.

    Args:
        target: the device.
        parent: the object that carries it; None if it stands on the floor.

    Returns:
        (x, y, yaw): meters, and the heading in (-pi, pi].
    """
    box = target
    if parent is not None and parent.width * parent.depth > target.width * target.depth:
        box = parent
    reach = box.depth / 2.0 + STAND_OFF
    fx, fy = box.front
    return box.x + reach * fx, box.y + reach * fy, wrap_angle(box.yaw - math.pi / 2.0)


def location_pose(plan: FloorPlan, location: str) -> Pose:
    """Return the goal pose of the first placement of an asset.

    Raises:
        LabgymError: the asset is not placed.
    """
    target = plan.find(location)
    if target is None:
        raise LabgymError(f"{location} is a location of the protocol, but the layout does not contain it: add it")
    root = plan.root(target.id)
    return goal_pose(plan.box(target.id), None if root.id == target.id else plan.box(root.id))


def goal_poses(plan: FloorPlan, protocol: Protocol | str | Path | None = None) -> dict[str, Pose]:
    """Return the goal pose of each of a protocol's locations, in the order of their first visit.

    Args:
        plan: the layout.
        protocol: a protocol, its id or its .json file; by default the layout's first.

    Raises:
        UnknownNameError: neither the layout nor the library has a protocol of that id.
        LabgymError: a location is not placed, or no protocol is given and the layout has none.
    """
    return {location: location_pose(plan, location) for location in resolve_protocol(plan, protocol).locations}


def goal_pairs(plan: FloorPlan, protocol: Protocol | str | Path | None = None) -> tuple[GoalPair, ...]:
    """Return the goal pairs of consecutive steps; pairs of zero length are dropped.

    Args and errors as in `goal_poses`.
    """
    protocol = resolve_protocol(plan, protocol)
    poses = goal_poses(plan, protocol)
    pairs: list[GoalPair] = []
    for here, there in pairwise(protocol.route):
        start, goal = poses[here], poses[there]
        if not same_place(start, goal):
            pairs.append(GoalPair(len(pairs), start, goal, here, there))
    return tuple(pairs)


def same_place(start: Pose, goal: Pose) -> bool:
    """Whether two poses are within 1 mm of each other."""
    return math.dist(start[:2], goal[:2]) <= SAME_PLACE


def resolve_protocol(plan: FloorPlan, protocol: Protocol | str | Path | None) -> Protocol:
    """Return the protocol that an argument names.

    Args:
        plan: the layout.
        protocol: a `Protocol`, the id of one of the plan's protocols or of the library, or a .json file; None for the
            plan's first.

    Raises:
        UnknownNameError: neither the plan nor the library has a protocol of that id.
        DocumentError: the file is not a protocol.
        LabgymError: `protocol` is None and the plan has none.
    """
    embedded = next((one for one in plan.protocols if one.id == protocol), None)
    if embedded is not None:
        return embedded
    if protocol is not None:
        return protocols.resolve(protocol)
    if plan.protocol is None:
        raise LabgymError(
            "the layout has no protocol: give --protocol FILE, in Python protocol= (a Protocol, an id or a .json file)"
        )
    return plan.protocol
