"""The grid planner without the map: it draws its own from the depth camera while it drives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import RANGE
from labgym.geometry import wrap_angle
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, Pose, distance_field
from labgym.policies.blockage import Blockage
from labgym.policies.depth_map import DepthMap, KnownFloor
from labgym.policies.grid_planner import GridPlanner, PlannerOptions
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import PathTracker, velocities_to_action

Array = NDArray[np.float64]
Point = tuple[float, float]


SETTLED = 0.5
"""Turn rate under which it sets off after the look around, rad/s: faster, it would swing off its path."""


@dataclass(frozen=True)
class OnlineMapOptions:
    """How the map is used.

    Attributes:
        unknown: by how many times its length a path over unseen floor costs more than over free floor.
        radii: clearances to plan with, metres: the next one where the one before finds no way to the goal.
        comfort: clearance beyond which more is not sought, metres; wider than on the true map, since the camera sees
            things smaller than the boxes that stop the robot.
        replan: control steps after which a path over unseen floor is planned anew though nothing blocks it.
        margin: unseen floor around what was seen on which a path may be planned, metres.
        bump: half the width of the obstacle that is entered where the robot is stopped by what it does not see, radians
            about its axis.
    """

    unknown: float = 0.5
    radii: tuple[float, ...] = (PLANNING_RADIUS, ROBOT.chassis_radius + 0.01)
    comfort: float = 0.6
    replan: int = 10
    margin: float = 1.0
    bump: float = 0.5


class OnlineMapPolicy(Policy):
    """Maps what the camera shows, plans over it, and takes unseen floor for passable at a price. Not privileged.

    It turns on the spot at the start, towards the goal first, until the cheapest way to the goal leads over floor that
    it has seen, or it has looked all around. While it drives it plans anew at once when something comes into view that
    is in the way, and once a second as long as its path leads over unseen floor. Where the map leaves no way to the
    goal it heads for a frontier: the reachable unseen cell for which the way there and the straight line on to the goal
    are shortest. Where it is stopped by what it does not see (too low, too high, or seen smaller than it is) it enters
    an obstacle and backs off.
    """

    name: ClassVar[str] = "online_map"
    observation: ClassVar[Sensors] = "depth"

    def __init__(self, options: OnlineMapOptions | None = None) -> None:
        self._options = options or OnlineMapOptions()
        self._robot: RobotSpec = ROBOT
        self._goal: Point = (0.0, 0.0)
        self._map = DepthMap(RANGE)
        self._route = _Route.none()
        self._look: _LookAround | None = None
        self._blockage = Blockage()
        self._age = 0

    def reset(self, episode: EpisodeStart) -> None:
        """Begin with an empty map in the start frame."""
        self._robot, self._goal = episode.robot, episode.goal
        self._map = DepthMap(math.hypot(*episode.goal) + RANGE, episode.robot)
        self._route = _Route.none()
        self._look = _LookAround(math.atan2(episode.goal[1], episode.goal[0]), episode.robot)
        self._blockage = Blockage(episode.robot)
        self._age = self._options.replan

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Enter the picture, plan where that is due, and follow the path."""
        x, y, yaw = (float(value) for value in observation["odometry"])
        pose: Pose = (x, y, yaw)
        fresh = self._map.add(observation["depth"], pose)
        self._age += 1
        v, w = (float(value) for value in observation["velocity"])
        if self._look is not None:
            self._look.over = self._look.over or self._has_looked(self._look, pose)
            if not self._look.over:
                return self._look.turn()
            if abs(w) > SETTLED:
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
        """Return the path that is followed; None while it looks around and where there is none."""
        return self._route.path if self._look is None and len(self._route.path) else None

    def _has_looked(self, look: _LookAround, pose: Pose) -> bool:
        """Whether the look around is over: the way to the goal is seen, or there is no more to see."""
        whole = look.whole(pose[2])
        if whole or (look.at_goal and self._age >= self._options.replan // 2):
            self._plan(pose)
        return whole or self._route.seen

    def _plan(self, pose: Pose) -> None:
        """Plan from a pose over what is known."""
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
        """Return the points just ahead of the chassis, where it must have been stopped, (n, 2)."""
        angles = pose[2] + np.linspace(-self._options.bump, self._options.bump, 9)
        reach = self._robot.chassis_radius + self._map.resolution / 2.0
        return np.array(pose[:2]) + reach * np.column_stack([np.cos(angles), np.sin(angles)])


class _Route:
    """A path under way.

    Attributes:
        path: (n, 2) metres; n = 0 for a route that leads nowhere.
        seen: whether it leads over seen floor alone, all the way.
    """

    def __init__(self, path: Array, radius: float, floor: KnownFloor | None) -> None:
        self.path, self._radius = path, radius
        self._tracker: PathTracker | None = None
        self.seen = floor is not None and not _crosses(path, floor)

    @classmethod
    def none(cls) -> _Route:
        """Return a route that leads nowhere."""
        return cls(np.empty((0, 2)), 0.0, None)

    def meets(self, points: Array) -> bool:
        """Whether one of some points (n, 2) is nearer to it than its clearance."""
        if len(points) == 0 or len(self.path) < 2:
            return False
        start, step = self.path[:-1], np.diff(self.path, axis=0)
        offset = points[:, None, :] - start
        along = np.clip((offset * step).sum(axis=2) / np.maximum((step**2).sum(axis=1), 1e-12), 0.0, 1.0)
        away = np.linalg.norm(offset - along[..., None] * step, axis=2)
        return bool(away.min() < self._radius)

    def follow(self, pose: Pose, speed: float, robot: RobotSpec) -> NDArray[np.floating[Any]]:
        """Return the action that follows it; where there is nowhere to go, turn on the spot."""
        if len(self.path) == 0:
            return velocities_to_action(0.0, robot.w_max, robot)
        if self._tracker is None:
            self._tracker = PathTracker(self.path, robot)
        return self._tracker.action(pose, speed)


class _LookAround:
    """A turn on the spot, first towards the goal and on in that sense, until everything around was in view.

    Attributes:
        over: whether it is.
    """

    def __init__(self, bearing: float, robot: RobotSpec) -> None:
        self._robot = robot
        self._sense = math.copysign(1.0, bearing)
        self._to_goal = abs(bearing) - robot.camera_hfov / 2.0
        # A turn of a circle less the field of view would just close far away; the lens is ahead of the axis, so that
        # it would leave a slit nearby.
        self._circle = 2.0 * math.pi - robot.camera_hfov / 2.0
        self._turned, self._yaw = 0.0, 0.0
        self.over = False

    @property
    def at_goal(self) -> bool:
        """Whether the goal's bearing has come into view."""
        return self._turned >= self._to_goal

    def whole(self, yaw: float) -> bool:
        """Whether all directions have been in view, now that the heading is this, radians."""
        self._turned += self._sense * wrap_angle(yaw - self._yaw)
        self._yaw = yaw
        return self._turned >= self._circle

    def turn(self) -> NDArray[np.floating[Any]]:
        """Return the action that turns on."""
        return velocities_to_action(0.0, self._sense * self._robot.w_max, self._robot)


def frontier(free: OccupancyGrid, unknown: NDArray[np.bool_], here: Point, goal: Point) -> Point | None:
    """Return the unseen cell through which the goal seems nearest, of those that can be reached.

    Args:
        free: the dilated grid.
        unknown: (ny, nx), its cells that were not seen.
        here: where the robot is.
        goal: where it wants to.

    Returns:
        The centre of the reachable unseen cell with the least sum of the grid path to it and the straight distance from
        it to the goal. Where no unseen cell can be reached, of the reachable cell nearest to the goal. None where the
        robot itself does not fit.
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
    """Whether a path (n, 2) leads over unseen cells."""
    pieces = []
    for start, end in pairwise(path):
        count = max(2, math.ceil(math.dist(start, end) / (floor.grid.resolution / 2.0)))
        pieces.append(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
    points = np.concatenate([path[-1:], *pieces])
    cells = np.floor((points - floor.grid.origin) / floor.grid.resolution).astype(np.intp)
    return bool(floor.unknown[cells[:, 1], cells[:, 0]].any())
