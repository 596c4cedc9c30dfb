"""Condition "station": the furniture at the goal stands a little off its place on the map, and its moves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.counts import is_finite
from labgym.envs.checks import count, positive
from labgym.envs.parts.protocols import Condition, Motion, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import LabgymError, OptionError
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration, rotate, wrap_angle
from labgym.layouts import Layout, Placement
from labgym.layouts.placement import FLOOR, placed_box
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, Pose, goal_pose
from labgym.navigation.barriers import Barriers

if TYPE_CHECKING:
    from labgym.envs.conditions.passing import Company

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


@registered("condition", "station")
class Station(Condition):
    """A docking station off its mapped pose.

    The piece of furniture at the goal, with all that stands on it, is moved and turned about its middle. The move is
    drawn evenly from a disc of radius `distance` and from turns up to `angle`; a pose that overlaps anything or where
    the robot cannot dock is drawn again. Furniture that fits tightly between others moves straight out of its row.
    `Task.pair` leads to the true docking pose, `Task.announced` to that of the map. The data has `station`, the id of
    the placement, and `shift`, [dx, dy, turn] in the room frame, meters and radians.

    The outcome has `position`, the distance to the true docking pose in meters, and `heading`, the absolute error of
    the heading in radians, both now; and `docked`, whether the robot has been at rest for `rest` seconds.

    Attributes:
        distance: greatest displacement, meters. angle: greatest turn, radians. rest: seconds.
        tries: poses drawn before the station moves straight out of its row.
    """

    distance: float = 0.10
    angle: float = math.radians(6.0)
    rest: float = 1.0
    tries: int = 200
    name: str = "station"

    def __post_init__(self) -> None:
        positive(self, "distance", "angle", "rest", zero=True)
        count(self, "tries")

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return a station and its move.

        Raises:
            OptionError: the goal is at no piece of furniture, or this cannot move.
        """
        name = station_of(task)
        for out in (False, True):
            for _ in range(self.tries):
                shift = self._shift(task, name, rng, out)
                if free(task, name, shift):
                    return {"station": name, "shift": list(shift)}
        raise OptionError(f"station {name!r} has no room to move by up to {self.distance:g} m: choose another goal")

    def _shift(self, task: Task, name: str, rng: np.random.Generator, out: bool) -> Shift:
        """Return a random move, in any direction or straight out of the row."""
        far, angle, turn = math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
        if out:
            front = task.layout.box(name).front
            dx, dy, turn = front[0] * far, front[1] * far, 0.0
        else:
            dx, dy = far * math.cos(angle), far * math.sin(angle)
        return round(self.distance * dx, 4), round(self.distance * dy, 4), round(self.angle * float(turn), 4)

    def prepare(self, task: Task, data: Any) -> Task:
        """Return the task with the station at its true pose.

        Raises:
            OptionError: the data is no move of a placement of the layout, or the robot cannot dock there.
        """
        name, shift = shift_of(task, data)
        layout = moved(task.layout, name, shift)
        goal = docking_pose(task, name, shift)
        pair = replace(task.pair, goal=goal)
        return replace(
            task,
            layout=layout,
            pair=pair,
            old_map=task.layout if task.old_map is None else task.old_map,
            announced=task.pair if task.announced is None else task.announced,
        )

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Docking:  # noqa: ARG002
        """Return the docking of an episode."""
        return Docking(state.task.pair.goal, self.rest, state.pose)


class Docking(Presence):
    """How near the robot is to the true docking pose, and whether it rests there."""

    visible = False

    def __init__(self, goal: Pose, rest: float, pose: Pose) -> None:
        self._goal, self._rest = goal, rest
        # The kernel holds this array: it is written in place.
        self._pose, self._resting = pose, np.zeros(1)

    def attend(self, company: Company) -> Company:
        """Return a company with the dock."""
        return company._replace(resting=self._resting)

    def substep(self, motion: Motion) -> str:
        """Follow the robot by one physics step."""
        from labgym.envs.conditions.passing import rested  # loads numba, which takes half a second

        (forward, turn), left = motion.velocity, motion.sideways
        self._resting[0] = rested(float(self._resting[0]), forward, left, turn, motion.dt)
        self.follow(motion)
        return ""

    def follow(self, motion: Motion) -> None:
        """Follow the robot after physics steps, after each of which `rested` has counted."""
        self._pose = motion.pose

    @property
    def outcome(self) -> dict[str, Any]:
        """The errors now, and whether they are those at rest."""
        # Sums of physics steps are rounded.
        docked = bool(self._resting[0] >= self._rest - 1e-9)
        return {**errors(self._pose, self._goal), "docked": docked}


def errors(pose: Sequence[float], goal: Sequence[float]) -> dict[str, float]:
    """Return the distance of two poses, meters, and the absolute difference of their headings, radians."""
    return {"position": math.dist(pose[:2], goal[:2]), "heading": abs(wrap_angle(pose[2] - goal[2]))}
