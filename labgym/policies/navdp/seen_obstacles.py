"""Obstacles that the camera has seen, and checks of trajectories and control steps against them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import RANGE
from labgym.geometry import Array
from labgym.navigation import OccupancyGrid, Pose
from labgym.policies.depth_map import DepthMap
from labgym.policies.distance_field import DistanceField

MAP_REACH_M = 2.0 * RANGE
"""The map covers this distance along x and y on both sides of its center, meters."""


class SeenObstacles:
    """A map of everything that the depth camera has shown; it moves along with the robot.

    The map lies in the frame of the poses. When the robot leaves the middle of it, the map is centered anew on the
    robot; obstacles more than 20 m away are then forgotten.

    Args:
        robot: gives the pose and field of view of the camera.
        noisy: whether the camera has errors (`DepthMap`).
    """

    def __init__(self, robot: RobotSpec = ROBOT, noisy: bool = False) -> None:
        self._robot, self._noisy = robot, noisy
        self._map = DepthMap(MAP_REACH_M, robot, noisy=noisy)
        self._centre = np.zeros(2)

    def add(self, depth: NDArray[np.floating], pose: Pose) -> None:
        """Add a depth image taken from a pose.

        Args:
            depth: planar depth, 72 x 128 meters. pose: (x, y, yaw) of the robot.
        """
        away = np.array(pose[:2]) - self._centre
        if np.abs(away).max() > MAP_REACH_M - RANGE:
            self._follow(np.round(away / self._map.resolution) * self._map.resolution)
        self._map.add(depth, (pose[0] - self._centre[0], pose[1] - self._centre[1], pose[2]))

    def around(self, place: tuple[float, float], reach: float) -> DistanceField:
        """Return the distances to the obstacles in a square.

        Args:
            place: center of the square, meters. reach: half its side, meters.
        """
        grid = self._map.window((place[0] - self._centre[0], place[1] - self._centre[1]), reach)
        x, y = self._centre + grid.origin
        return DistanceField.of_cells(OccupancyGrid(grid.occupied, grid.resolution, (float(x), float(y))), reach)

    def _follow(self, shift: Array) -> None:
        """Move the center of the map by whole cells, (2,) meters."""
        grid = self._map.window((0.0, 0.0), MAP_REACH_M)
        rows, columns = np.nonzero(grid.occupied)
        xs, ys = grid.centres()
        self._map = DepthMap(MAP_REACH_M, self._robot, noisy=self._noisy)
        self._map.occupy(np.column_stack([xs[columns], ys[rows]]) - shift)
        self._centre = self._centre + shift


Velocity = tuple[float, float]

CHECK_SPACING_M = 0.05
"""Distance between the places at which a way is checked, at most, meters."""

CLEARANCE_SLACK_M = 0.01
"""A robot that is nearer to an obstacle than it should be may come nearer by this, meters: the cells are coarse."""

STEPS_PER_CONTROL = 2
"""Number of times in a control step at which the motion is computed."""

SPEED_SHARES = (1.0, 0.75, 0.5, 0.25)
"""Shares of the wanted speed that are tried before the robot stops."""


def clear_ways(ways: Array, clearance: DistanceField, radius: float, ahead: float) -> NDArray[np.bool_]:
    """Return which ways (n, k, 2) keep the distance `radius` from obstacles over their first `ahead` meters, (n,).

    A robot that starts nearer than the radius may leave, but not come nearer.

    Args:
        ways: points from the robot's place on, in the frame of the clearance, meters.
        clearance: distances to the obstacles.
        radius: distance to keep, meters.
        ahead: length that is checked, meters.
    """
    step = np.diff(ways, axis=1)
    lengths = np.sqrt((step**2).sum(axis=2))
    pieces = max(1, math.ceil(float(lengths.max(initial=0.0)) / CHECK_SPACING_M))
    shares = np.arange(1, pieces + 1) / pieces
    places = ways[:, :-1, None] + shares[:, None] * step[:, :, None]
    driven = (np.cumsum(lengths, axis=1) - lengths)[..., None] + shares * lengths[..., None]
    needed = np.minimum(radius, clearance.at(ways[:, 0]) - CLEARANCE_SLACK_M)[:, None, None]
    return np.asarray(((clearance.at(places) >= needed) | (driven > ahead)).all(axis=(1, 2)))


def checked_velocities(
    wanted: Velocity, present: Velocity, pose: Pose, clearance: DistanceField, radius: float, robot: RobotSpec
) -> Velocity:
    """Return the velocities with the greatest share of a wanted speed from which the robot can still brake in time.

    A share has the curvature of the whole. If none is clear, the robot brakes and turns as wanted.

    Args:
        wanted: forward velocity and turn rate, m/s and rad/s; only a forward velocity above 0 is checked.
        present: velocities of the robot.
        pose: of the robot, in the frame of the clearance.
        clearance: distances to the obstacles.
        radius: distance to keep, meters.
        robot: limits of the robot.
    """
    v, w = wanted
    if v <= 0.0:
        return wanted
    for share in SPEED_SHARES:
        way = braking_way((share * v, share * w), present, pose, robot)
        if clear_ways(way[None], clearance, radius, math.inf)[0]:
            return share * v, share * w
    return 0.0, w


def braking_way(wanted: Velocity, present: Velocity, pose: Pose, robot: RobotSpec) -> Array:
    """Return the places (n, 2) of a robot that drives one control step as wanted and then brakes and turns on.

    Args:
        wanted, present: forward velocity and turn rate, m/s and rad/s. The robot changes them by its limits.
        pose: (x, y, yaw) of the robot.
        robot: limits of the robot.
    """
    x, y, yaw = pose
    v, w = present
    dt = robot.control_dt / STEPS_PER_CONTROL
    places = [(x, y)]
    for k in range(STEPS_PER_CONTROL + math.ceil(robot.v_max / robot.acceleration / dt) + 1):
        target = wanted[0] if k < STEPS_PER_CONTROL else 0.0
        v += min(max(target - v, -robot.acceleration * dt), robot.acceleration * dt)
        w += min(max(wanted[1] - w, -robot.turn_acceleration * dt), robot.turn_acceleration * dt)
        yaw += w * dt
        x, y = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw)
        places.append((x, y))
    return np.array(places)
