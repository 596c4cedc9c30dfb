"""Plan on a map that is built from depth images while driving."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import RANGE
from labgym.geometry import Array, wrap_angle
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, Pose, distance_field
from labgym.navigation.search_kernel import prepare
from labgym.policies.arrival import ArrivingPolicy
from labgym.policies.blockage import BlockageDetector
from labgym.policies.depth_map import DepthMap, KnownFloor
from labgym.policies.grid_planner import GridPlanner, PlannerOptions
from labgym.policies.options import NonNegative, PolicyOptions, Positive
from labgym.policies.policy import EpisodeStart, Observation, Sensors
from labgym.policies.tracking import PathTracker, velocities_to_action

Point = tuple[float, float]


SETTLED_TURN_RATE = 0.5
"""Turn rate below which the robot sets off after looking around, rad/s: faster, it would leave its path."""


class OnlineMapOptions(PolicyOptions):
    """Options of `OnlineMapPolicy`.

    Attributes:
        unknown: extra cost per meter of unseen floor, as a multiple of length.
        radii: clearances to plan with, meters, in order: the next one is used if the previous one finds no path.
        comfort: clearance beyond which more has no benefit, meters; larger than on the true map, because the camera
            sees objects smaller than the boxes that stop the robot.
        replan: control steps after which a path over unseen floor is replanned even if nothing blocks it.
        margin: width of unseen floor around the seen floor on which a path may be planned, meters.
        bump: half the angular width of the obstacle that is added where an unseen obstacle stops the robot, radians
            about its axis.
    """

    unknown: NonNegative = 0.5
    radii: Annotated[tuple[Positive, ...], Field(min_length=1)] = (PLANNING_RADIUS, ROBOT.chassis_radius + 0.01)
    comfort: Positive = 0.6
    replan: Annotated[int, Field(ge=1)] = 10
    margin: NonNegative = 1.0
    bump: NonNegative = 0.5


class OnlineMapPolicy(ArrivingPolicy):
    """Maps the floor with the depth camera and plans on the map; unseen floor is passable at a cost. Not privileged.

    The robot turns in place at the start, towards the goal first, until the cheapest path to the goal lies on seen
    floor or it has looked all around. While it drives, it replans at once if a new obstacle blocks the path, and once
    a second while the path crosses unseen floor. If the map leaves no path to the goal, it heads for a frontier: the
    reachable unseen cell with the shortest path to it plus straight line from it to the goal. If an unseen obstacle
    stops it (too low, too high, or larger than it looks), it adds an obstacle to the map and backs off.

    Args:
        options: an `OnlineMapOptions` or a mapping of those that differ from the defaults.

    Raises:
        UnknownNameError: an option does not exist.
        OptionError: an option is outside its limits.
    """

    name: ClassVar[str] = "online_map"
    observation: ClassVar[Sensors] = "depth"

    options_type: ClassVar[type[PolicyOptions]] = OnlineMapOptions

    def __init__(self, options: OnlineMapOptions | Mapping[str, Any] | None = None) -> None:
        # Episodes run in copies of this process.
        prepare()
        self._options = OnlineMapOptions.of(options)
        self._robot: RobotSpec = ROBOT
        self._goal: Point = (0.0, 0.0)
        self._map = DepthMap(RANGE)
        self._route = _Route.none()
        self._look: _LookAround | None = None
        self._blockage = BlockageDetector()
        self._age = 0

    def reset(self, episode: EpisodeStart) -> None:
        """Begin with an empty map in the start frame."""
        super().reset(episode)
        self._goal = episode.goal
        self._map = DepthMap(math.hypot(*episode.goal) + RANGE, episode.robot, noisy=episode.task.noise)
        self._route = _Route.none()
        self._look = _LookAround(math.atan2(episode.goal[1], episode.goal[0]), episode.robot)
        self._blockage = BlockageDetector(episode.robot)
        self._age = self._options.replan

    def drive(self, observation: Observation, pose: Pose) -> NDArray[np.floating[Any]]:
        """Add the depth image to the map, replan if due, and follow the path."""
        fresh = self._map.add(observation["depth"], pose)
        self._age += 1
        v, w = (float(value) for value in observation["velocity"])
        if self._look is not None:
            self._look.over = self._look.over or self._has_looked(self._look, pose)
            if not self._look.over:
                return self._look.turn()
            if abs(w) > SETTLED_TURN_RATE:
                return velocities_to_action(0.0, 0.0, self._robot)
            self._look = None
        if self._blockage.blocked(v):
            self._map.occupy(self._bumped(pose))
            self._route, self._age = _Route.none(), self._options.replan
        if self._blockage.backing:
            return self._blockage.back_off()
        if (self._age >= self._options.replan and not self._route.seen) or self._route.meets(fresh):
            self._plan(pose)
        action = self._route.follow(pose, v, self._robot)
        self._blockage.note(self._robot.twist(*action)[0])
        return action

    def planned_path(self) -> Array | None:
        """Return the path that is followed; None while the robot looks around and if there is no path."""
        return self._route.path if self._look is None and len(self._route.path) else None

    def _has_looked(self, look: _LookAround, pose: Pose) -> bool:
        """Return whether looking around is over: the path to the goal is seen, or everything around is."""
        whole = look.whole(pose[2])
        if whole or (look.at_goal and self._age >= self._options.replan // 2):
            self._plan(pose)
        return whole or self._route.seen

    def _plan(self, pose: Pose) -> None:
        """Plan from a pose on the map so far."""
        here = (pose[0], pose[1])
        floor = self._map.known([here, self._goal], self._options.margin)
        surcharge = np.where(floor.unknown, self._options.unknown, 0.0)
        self._age = 0
        for radius in self._options.radii:
            planner = GridPlanner(floor.grid, PlannerOptions(radius, self._options.comfort), surcharge)
            path = planner.plan(here, self._goal)
            if path is not None:
                break
        else:
            inside = planner.snapped(here)
            target = None if inside is None else frontier(planner.free, floor.unknown, inside, self._goal)
            path = None if target is None else planner.plan(here, target)
        self._route = _Route.none() if path is None else _Route(path, radius, floor)

    def _bumped(self, pose: Pose) -> Array:
        """Return points (n, 2) just ahead of the chassis, where the unseen obstacle must be."""
        angles = pose[2] + np.linspace(-self._options.bump, self._options.bump, 9)
        reach = self._robot.chassis_radius + self._map.resolution / 2.0
        return np.array(pose[:2]) + reach * np.column_stack([np.cos(angles), np.sin(angles)])


class _Route:
    """A path that is being followed.

    Attributes:
        path: (n, 2) meters; n = 0 for an empty route.
        seen: whether all of it lies on seen floor.
    """

    def __init__(self, path: Array, radius: float, floor: KnownFloor | None) -> None:
        self.path, self._radius = path, radius
        self._tracker: PathTracker | None = None
        self.seen = floor is not None and not _crosses(path, floor)

    @classmethod
    def none(cls) -> _Route:
        """Return an empty route."""
        return cls(np.empty((0, 2)), 0.0, None)

    def meets(self, points: Array) -> bool:
        """Return whether one of the points (n, 2) is nearer to the path than its clearance."""
        if len(points) == 0 or len(self.path) < 2:
            return False
        start, step = self.path[:-1], np.diff(self.path, axis=0)
        offset = points[:, None, :] - start
        along = np.clip((offset * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-12), 0.0, 1.0)
        away = np.linalg.norm(offset - along[..., None] * step, axis=2)
        return bool(away.min() < self._radius)

    def follow(self, pose: Pose, speed: float, robot: RobotSpec) -> NDArray[np.floating[Any]]:
        """Return the action that follows the path; for an empty route, a turn in place."""
        if len(self.path) == 0:
            return velocities_to_action(0.0, robot.w_max, robot)
        if self._tracker is None:
            self._tracker = PathTracker(self.path, robot)
        return self._tracker.action(pose, speed)


class _LookAround:
    """A turn in place, towards the goal and on in that direction, until everything around was in view.

    Attributes:
        over: whether the turn has ended.
    """

    def __init__(self, bearing: float, robot: RobotSpec) -> None:
        self._robot = robot
        self._side = math.copysign(1.0, bearing)
        self._to_goal = abs(bearing) - robot.camera_hfov / 2.0
        # A circle less the field of view would close the view only far away: the lens is ahead of the axis, which
        # leaves a slit nearby.
        self._circle = 2.0 * math.pi - robot.camera_hfov / 2.0
        self._turned, self._yaw = 0.0, 0.0
        self.over = False

    @property
    def at_goal(self) -> bool:
        """Whether the goal's bearing has come into view."""
        return self._turned >= self._to_goal

    def whole(self, yaw: float) -> bool:
        """Record the heading, radians, and return whether all directions have been in view."""
        self._turned += self._side * wrap_angle(yaw - self._yaw)
        self._yaw = yaw
        return self._turned >= self._circle

    def turn(self) -> NDArray[np.floating[Any]]:
        """Return the action that continues the turn."""
        return velocities_to_action(0.0, self._side * self._robot.w_max, self._robot)


def frontier(free: OccupancyGrid, unknown: NDArray[np.bool_], here: Point, goal: Point) -> Point | None:
    """Return the reachable unseen cell through which the way to the goal seems shortest.

    Args:
        free: the dilated grid.
        unknown: (ny, nx), its unseen cells.
        here: the robot's place, meters.
        goal: the goal, meters.

    Returns:
        Center of the reachable unseen cell with the smallest sum of the grid path to it and the straight distance from
        it to the goal. If no unseen cell is reachable, center of the reachable cell nearest to the goal. None if the
        robot does not fit at its own place.
    """
    length = distance_field(free, here)
    xs, ys = free.centres()
    beyond = np.hypot(xs[None, :] - goal[0], ys[:, None] - goal[1])
    cost = np.where(unknown, length + beyond, math.inf)
    if not np.isfinite(cost).any():
        cost = np.where(np.isfinite(length), beyond, math.inf)
    row, column = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return free.centre_of(int(row), int(column)) if math.isfinite(cost[row, column]) else None


def _crosses(path: Array, floor: KnownFloor) -> bool:
    """Return whether a path (n, 2) crosses unseen cells."""
    pieces = []
    for start, end in pairwise(path):
        count = max(2, math.ceil(math.dist(start, end) / (floor.grid.resolution / 2.0)))
        pieces.append(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
    points = np.concatenate([path[-1:], *pieces])
    cells = np.floor((points - floor.grid.origin) / floor.grid.resolution).astype(np.intp)
    return bool(floor.unknown[cells[:, 1], cells[:, 0]].any())
