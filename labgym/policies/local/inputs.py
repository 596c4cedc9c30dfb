"""The input of the network: path, room, people and motion around the robot, as the navigation stack sees them."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import Array, rotate, to_local
from labgym.navigation import Pose
from labgym.policies.stack.controller import rollouts
from labgym.policies.stack.costmap import Costmap
from labgym.policies.stack.people import TrackedPerson
from labgym.policies.stack.planner import PLAN_SPACING_M, PlannedPath

Vector = NDArray[np.float32]

FREE_RAYS, FREE_REACH_M, RAY_END_M = 48, 3.0, 0.02
"""Directions in which the free distance is computed, its greatest value, and the clearance at which it ends, meters."""
MARCH_STEPS = 10
"""Greatest number of steps along a ray, each as long as the clearance there."""
ALONG_M = (0.15, 0.3, 0.5, 0.75, 1.0, 1.4, 1.9, 2.5)
"""Distances along the path of the points that the network sees, meters."""
ACROSS_M = (-0.12, 0.0, 0.12)
"""Distances across the path at which the clearance is looked up, meters."""
SPEED_SHARES, TURN_SHARES, ARC_STEPS = (0.3, 0.6, 1.0), (-0.8, -0.45, -0.2, 0.0, 0.2, 0.45, 0.8), 10
"""Velocities of the arcs as shares of the greatest ones, and control steps for which they are followed."""
MOST_PEOPLE, PEOPLE_RANGE_M = 5, 6.0
"""Number of people that the network sees, and the distance beyond which they do not count, meters."""
WINDOW_STEPS = (10, 30, 80)
"""Control steps over which the robot's way is measured."""
COMMANDS = 2
"""Number of latest actions that the network sees."""
NEAR_PEOPLE_M = 0.6
"""Distance of a person's center at which the robot nearly touches, meters."""

SIZES = {
    "free": 2 * FREE_RAYS,
    "path": 2 * len(ALONG_M) + 4,
    "room": (len(ALONG_M) + 1) * len(ACROSS_M),
    "arcs": len(SPEED_SHARES) * len(TURN_SHARES),
    "people": 7 * MOST_PEOPLE,
    "motion": 2 + 2 * COMMANDS + len(WINDOW_STEPS),
    "knowledge": 8,
}
"""Lengths of the parts of the input, in their order."""
SIZE = sum(SIZES.values())


def place_of(part: str) -> slice:
    """Return the place of a part of `SIZES` in the input."""
    names = list(SIZES)
    begin = sum(SIZES[name] for name in names[: names.index(part)])
    return slice(begin, begin + SIZES[part])


@dataclass(frozen=True)
class TaskKnowledge:
    """The knowledge of the robot about its task, for the whole drive.

    Attributes:
        drifts, docks, glass, peopled, mismounted: whether the odometry drifts, the goal is a docking pose, there are
            panes, people walk, and the sensors are a little off their places.
        freeboard: of the beaker, meters; 0 without. acceleration: limit along the way, m/s2.
        stops: whether the robot has to rest at its goal.
    """

    drifts: bool
    docks: bool
    glass: bool
    peopled: bool
    mismounted: bool
    freeboard: float
    acceleration: float
    stops: bool

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers that the network sees."""
        flags = (self.drifts, self.docks, self.glass, self.peopled, self.mismounted, self.stops)
        return (*map(float, flags), 50.0 * self.freeboard, self.acceleration)


class LatestMotion:
    """The latest motion of the robot.

    Args:
        robot: its control step.
    """

    def __init__(self, robot: RobotSpec = ROBOT) -> None:
        self._dt = robot.control_dt
        self._places: deque[tuple[float, float]] = deque(maxlen=max(WINDOW_STEPS) + 1)
        self._commands: deque[tuple[float, float]] = deque([(0.0, 0.0)] * COMMANDS, maxlen=COMMANDS)

    def moved(self, pose: Pose) -> None:
        """Note the pose in a control step."""
        self._places.append((pose[0], pose[1]))

    def commanded(self, action: tuple[float, float]) -> None:
        """Note an action."""
        self._commands.append(action)

    @property
    def values(self) -> list[float]:
        """The latest actions, newest last, and the distances to where the robot was, meters."""
        here = self._places[-1]
        ways = [math.dist(here, self._places[max(0, len(self._places) - 1 - window)]) for window in WINDOW_STEPS]
        return [*(value for command in self._commands for value in command), *ways]


@dataclass(frozen=True, eq=False)
class StackState:
    """The state of the navigation stack in a control step.

    Attributes:
        plan: the path. left: its length to the place of rest, meters.
        pose, velocity: of the robot when its command takes effect.
        costmap: clearance. people: those that are tracked.
    """

    plan: PlannedPath
    left: float
    pose: Pose
    velocity: tuple[float, float]
    costmap: Costmap
    people: tuple[TrackedPerson, ...]


def network_input(
    state: StackState, motion: LatestMotion, knowledge: TaskKnowledge, robot: RobotSpec = ROBOT
) -> Vector:
    """Return the input, (SIZE,).

    All places are in the frame of the robot when its command takes effect. A clearance is that of the chassis, as a
    share of the distance below which it matters.

    Args:
        state: of the stack. motion: of late. knowledge: of the task. robot: its dimensions and limits.
    """
    plan, pose, velocity, left = state.plan, state.pose, state.velocity, state.left
    ahead = _ahead(plan)
    turns = _headings(ahead, plan.points[-1] - plan.points[-2])
    margin = robot.chassis_radius
    arcs = _arcs(pose, velocity, robot)
    points = np.concatenate([_beside(ahead, turns), arcs.reshape(-1, 2)])
    clearance = state.costmap.clearance(points) - margin
    room, least = np.split(clearance, [SIZES["room"]])
    free = _free(pose, state.costmap)
    path = to_local(ahead[1:], pose) / np.array(ALONG_M)[:, None]
    error = float(turns[0]) - pose[2]
    parts: list[Sequence[float] | Array] = [
        free / FREE_REACH_M,
        np.exp(-np.maximum(free - margin, 0.0) / 0.3),
        path.ravel(),
        [min(left, FREE_REACH_M) / FREE_REACH_M, math.exp(-max(left, 0.0) / 0.3), math.cos(error), math.sin(error)],
        np.clip(room / 0.2, -1.0, 1.5),
        np.clip(least.reshape(-1, ARC_STEPS).min(axis=1) / 0.1, -1.0, 2.0),
        _seen(state.people, pose),
        [velocity[0], velocity[1] / robot.w_max, *motion.values],
        knowledge.values,
    ]
    return np.concatenate([np.asarray(part, dtype=np.float32) for part in parts])


def _ahead(plan: PlannedPath) -> Array:
    """Return the robot's place on the path and the points at `ALONG_M` after it, (n + 1, 2); the last one repeats."""
    points, _ = plan.ahead(ALONG_M[-1] + 2.0 * PLAN_SPACING_M)
    chosen = [0, *(min(round(length / PLAN_SPACING_M), len(points) - 1) for length in ALONG_M)]
    return np.asarray(points[chosen])


def _headings(points: Array, last: Array) -> Array:
    """Return the heading of a path at points on it, (n, 2), (n,) radians.

    Beyond the end of the path its last point is repeated; the heading there is that of its last segment, `last`, (2,).
    """
    steps = np.diff(points, axis=0)
    steps[~steps.any(axis=1)] = last
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    return np.append(headings, headings[-1])


def _beside(points: Array, headings: Array) -> Array:
    """Return the points next to the path at which the clearance is looked up, (n, 2)."""
    normals = np.column_stack([-np.sin(headings), np.cos(headings)])
    return np.asarray((points[:, None] + np.array(ACROSS_M)[:, None] * normals[:, None]).reshape(-1, 2))


def _arcs(pose: Pose, velocity: tuple[float, float], robot: RobotSpec) -> Array:
    """Return the places along arcs of even velocities, (arcs, ARC_STEPS, 2)."""
    speeds, rates = np.array(SPEED_SHARES) * robot.v_max, np.array(TURN_SHARES) * robot.w_max
    arcs = np.stack(np.meshgrid(speeds, rates, indexing="ij"), axis=-1).reshape(-1, 1, 2)
    return rollouts(pose, velocity, np.repeat(arcs, ARC_STEPS, axis=1), robot.control_dt)[..., :2]


def _free(pose: Pose, costmap: Costmap) -> Array:
    """Return the distance to what is nearest in each direction, from ahead counter-clockwise, (FREE_RAYS,) meters."""
    bearings = pose[2] + 2.0 * math.pi / FREE_RAYS * np.arange(FREE_RAYS)
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    free = np.zeros(FREE_RAYS)
    going = np.ones(FREE_RAYS, dtype=bool)
    for _ in range(MARCH_STEPS):
        step = costmap.clearance(np.array(pose[:2]) + free[going, None] * directions[going])
        free[going] = np.minimum(free[going] + np.maximum(step, 0.0), FREE_REACH_M)
        going[going] = (step > RAY_END_M) & (free[going] < FREE_REACH_M)
        if not going.any():
            break
    return free


def _seen(people: tuple[TrackedPerson, ...], pose: Pose) -> list[float]:
    """Return the nearest people: present, place, velocity in the map's frame turned into the robot's, walking, near."""
    nearest = sorted((math.dist(person.place, pose[:2]), person.place, person) for person in people)
    values: list[float] = []
    for away, place, person in nearest[:MOST_PEOPLE]:
        if away < PEOPLE_RANGE_M:
            x, y = rotate(place[0] - pose[0], place[1] - pose[1], -pose[2])
            vx, vy = rotate(*person.velocity, -pose[2])
            near = math.exp(-max(away - NEAR_PEOPLE_M, 0.0) / 0.5)
            values += [1.0, x / 3.0, y / 3.0, vx, vy, float(person.walking), near]
    return values + [0.0] * (SIZES["people"] - len(values))
