"""The furniture at a goal, and its moves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.counts import is_finite
from labgym.envs.robot import ROBOT
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import LabgymError, OptionError
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration, rotate, wrap_angle
from labgym.layouts import Layout, Placement
from labgym.layouts.placement import FLOOR, placed_box
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, Pose, goal_pose
from labgym.navigation.barriers import Barriers

Shift = tuple[float, float, float]
"""Displacement (dx, dy) in the room frame, meters, and turn about the middle, radians."""
FARTHEST, WIDEST = 1.0, math.pi
"""Largest displacement and turn in the data of an episode."""
NEAR = 1e-3
"""The goal of a drive is at a piece of furniture if it is this near to its goal pose, meters."""
TOUCHING = 1e-3
"""Overlap of neighbors that counts as touching, meters."""


def station_of(task: Task) -> str:
    """Return the id of the furniture on the floor at whose front the drive of a task ends.

    Raises:
        OptionError: the goal is at no furniture.
    """
    layout, (x, y, _) = task.layout, task.pair.goal
    for placement in layout.placements:
        root = layout.root(placement.id)
        if root.support != FLOOR:
            continue
        box, parent = layout.box(placement.id), None if root.id == placement.id else layout.box(root.id)
        pose = goal_pose(box, parent)
        if math.dist(pose[:2], (x, y)) < NEAR:
            return root.id
    raise OptionError(
        f"the goal ({x:.2f}, {y:.2f}) is at no piece of furniture, {STAND_OFF:g} m before its front: choose a goal pair"
    )


def shift_of(task: Task, data: Any) -> tuple[str, Shift]:
    """Return the station and its move from plain data.

    Raises:
        OptionError: the data is something else, or no placement on the floor has that id.
    """
    if not isinstance(data, Mapping) or set(data) != {"station", "shift"}:
        raise OptionError(f"station is {str(data)[:60]!r}, expected a mapping of station and shift")
    name, shift = data["station"], data["shift"]
    if not isinstance(name, str) or name not in task.layout.by_id or task.layout.placement(name).support != FLOOR:
        raise OptionError(f"station {str(name)[:60]!r} is no placement on the floor of layout {task.layout.id!r}")
    numbers: list[Any] = list(shift) if isinstance(shift, list | tuple) and len(shift) == 3 else []
    if (
        not numbers
        or not all(map(is_finite, numbers))
        or math.hypot(*numbers[:2]) > FARTHEST
        or abs(numbers[2]) > WIDEST
    ):
        raise OptionError(
            f"shift is {str(shift)[:60]}, expected [dx, dy, turn], at most {FARTHEST:g} m and {WIDEST:.2f} rad"
        )
    dx, dy, turn = (float(each) for each in numbers)
    return name, (dx, dy, turn)


def moved(layout: Layout, name: str, shift: Shift) -> Layout:
    """Return a layout with a placement, and all that it carries, moved."""
    turned = _moved(layout, name, shift)
    try:
        return layout.replace(placements=tuple(turned.get(each.id, each) for each in layout.placements))
    except LabgymError as error:
        raise OptionError(f"station: {error}") from None


def docking_pose(task: Task, name: str, shift: Shift) -> Pose:
    """Return the goal of a drive when the furniture at it is moved: the goal moves with it.

    Raises:
        OptionError: the robot cannot get there.
    """
    pose = _turned(task.pair.goal, task.layout.box(name), shift)
    if Barriers.of(moved(task.layout, name, shift)).clearance(np.array([pose[:2]]))[0] < PLANNING_RADIUS:
        raise OptionError(f"station {name!r}: the robot would touch something at ({pose[0]:.2f}, {pose[1]:.2f})")
    return pose


def free(task: Task, name: str, shift: Shift) -> bool:
    """Whether a station overlaps nothing after a move, and the robot can still start and dock."""
    layout = task.layout
    own = _moved(layout, name, shift)
    others = [box for each in layout.placements if each.id not in own for box in _boxes(layout, each)]
    others += layout.floor.solids
    before = [layout.box(each) for each in own]
    after = [placed_box(placement, layout.asset(placement.id)) for placement in own.values()]
    overlap = _penetration(after, others)
    if (overlap > np.maximum(_penetration(before, others), 0.0) + TOUCHING).any():
        return False
    flat = layout.box(name)
    corners = replace(placed_box(own[name], layout.asset(name)), z0=0.0, z1=0.0).corners()
    if not layout.floor.inside(corners).all() and layout.floor.inside(flat.corners()).all():
        return False
    try:
        goal = docking_pose(task, name, shift)
    except OptionError:
        return False
    changed = moved(layout, name, shift)
    start = Barriers.of(changed).clearance(np.array([task.pair.start[:2]]))[0]
    if start < ROBOT.chassis_radius:
        return False
    return math.isfinite(world_of(changed).shortest_length(replace(task.pair, goal=goal)))


def _boxes(layout: Layout, placement: Placement) -> list[OrientedBox]:
    return [layout.box(placement.id), *layout.open_parts(placement.id)]


def _penetration(boxes: list[OrientedBox], others: list[OrientedBox]) -> Any:
    return pairwise_penetration(BoxArray.of(boxes), BoxArray.of(others))


def _moved(layout: Layout, name: str, shift: Shift) -> dict[str, Placement]:
    """Return a placement and all that it carries after a move, by id."""
    center = layout.box(name)
    own = [each for each in layout.placements if layout.root(each.id).id == name]
    result = {}
    for placement in own:
        x, y, z = placement.position
        a, b, yaw = _turned((x, y, placement.yaw), center, shift)
        result[placement.id] = placement.model_copy(update={"position": (a, b, z), "yaw": yaw})
    return result


def _turned(pose: Pose, center: OrientedBox, shift: Shift) -> Pose:
    """Return a pose that moves with furniture whose middle is given."""
    dx, dy, turn = shift
    a, b = rotate(pose[0] - center.x, pose[1] - center.y, turn)
    return center.x + dx + a, center.y + dy + b, wrap_angle(pose[2] + turn)
