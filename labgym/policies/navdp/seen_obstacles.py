"""Obstacles that the camera has seen, also those that have left its view, and the distances to them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import RANGE
from labgym.navigation import OccupancyGrid, Pose
from labgym.policies.depth_map import DepthMap

Array = NDArray[np.float64]

REACH = 2.0 * RANGE
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
        self._map = DepthMap(REACH, robot, noisy=noisy)
        self._centre = np.zeros(2)

    def add(self, depth: NDArray[np.floating], pose: Pose) -> None:
        """Add a depth image taken from a pose.

        Args:
            depth: planar depth, 72 x 128 meters. pose: (x, y, yaw) of the robot.
        """
        away = np.array(pose[:2]) - self._centre
        if np.abs(away).max() > REACH - RANGE:
            self._follow(np.round(away / self._map.resolution) * self._map.resolution)
        self._map.add(depth, (pose[0] - self._centre[0], pose[1] - self._centre[1], pose[2]))

    def around(self, place: tuple[float, float], reach: float) -> Clearance:
        """Return the distances to the obstacles in a square.

        Args:
            place: center of the square, meters. reach: half its side, meters.
        """
        grid = self._map.window((place[0] - self._centre[0], place[1] - self._centre[1]), reach)
        x, y = self._centre + grid.origin
        return Clearance(OccupancyGrid(grid.occupied, grid.resolution, (float(x), float(y))), reach)

    def _follow(self, shift: Array) -> None:
        """Move the center of the map by whole cells, (2,) meters."""
        grid = self._map.window((0.0, 0.0), REACH)
        rows, columns = np.nonzero(grid.occupied)
        xs, ys = grid.centres()
        self._map = DepthMap(REACH, self._robot, noisy=self._noisy)
        self._map.occupy(np.column_stack([xs[columns], ys[rows]]) - shift)
        self._centre = self._centre + shift


class Clearance:
    """Distances to the nearest occupied cell of a grid, interpolated between the centers of the cells.

    The distance is negative inside an obstacle, so that its slope leads out of the obstacle. A place outside the grid
    has the distance of the nearest place inside.

    Args:
        grid: the obstacles; outside, the floor counts as free.
        farthest: greatest distance, meters.
    """

    def __init__(self, grid: OccupancyGrid, farthest: float) -> None:
        self._grid = grid
        outside, inside = (
            np.maximum(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) - 0.5, 0.0)
            for mask in (~grid.occupied, grid.occupied)
        )
        meters = (outside.astype(np.float64) - inside.astype(np.float64)) * grid.resolution
        self._distance: Array = np.clip(meters, -farthest, farthest)

    def at(self, points: Array) -> Array:
        """Return the distances at points (..., 2), meters; shape (...)."""
        (row, up), (column, right) = self._cells(points)
        return np.asarray(self._mixed(row, column, up, right))

    def slope(self, points: Array) -> Array:
        """Return the gradients of the distance at points (..., 2), without unit; shape (..., 2)."""
        (row, up), (column, right) = self._cells(points)
        d = self._distance
        low, high = d[row, column + 1] - d[row, column], d[row + 1, column + 1] - d[row + 1, column]
        left, far = d[row + 1, column] - d[row, column], d[row + 1, column + 1] - d[row, column + 1]
        along_x, along_y = low + up * (high - low), left + right * (far - left)
        return np.stack([along_x, along_y], axis=-1) / self._grid.resolution

    def _mixed(self, row: NDArray[np.intp], column: NDArray[np.intp], up: Array, right: Array) -> Array:
        d = self._distance
        low = d[row, column] + right * (d[row, column + 1] - d[row, column])
        high = d[row + 1, column] + right * (d[row + 1, column + 1] - d[row + 1, column])
        mixed: Array = low + up * (high - low)
        return mixed

    def _cells(self, points: Array) -> tuple[tuple[NDArray[np.intp], Array], tuple[NDArray[np.intp], Array]]:
        """Return the lower cell and the share of the next one, for rows and for columns."""
        cells = []
        for axis, count in ((1, self._distance.shape[0]), (0, self._distance.shape[1])):
            place = (points[..., axis] - self._grid.origin[axis]) / self._grid.resolution - 0.5
            place = np.clip(place, 0.0, count - 1.0)
            lower = np.minimum(place.astype(np.intp), count - 2)
            cells.append((lower, place - lower))
        return cells[0], cells[1]
