"""A floor as a lidar has seen it: where rays passed and ended, what moves there, and where there is glass."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import LIDAR_RAYS
from labgym.geometry import Array
from labgym.navigation import Pose
from labgym.policies.distance_field import NODE_DISTANCE_M, DistanceField
from labgym.policies.stack.costmap import Index

SEEN_RANGE_M = 6.0
"""Rays count up to this distance, meters."""
END_MARGIN_M = 0.15
"""Length before the end of a ray that may belong to what it met, meters."""
INSIDE_FREE_M = 0.15
"""A return that is farther than this from all that rays have not passed belongs to something that moves, meters."""
STANDING_RETURNS = 30
"""Number of scans with a return in a cell after which a thing stands there."""
PANE_RANGE_M = 5.0
"""Distance up to which rays are compared with earlier returns, meters."""
PANE_COSINES = math.cos(math.radians(60.0)), math.cos(math.radians(12.0))
"""Cosines of the least and the greatest angle between a ray that ended at a place and one that passes it, if there is a
pane: rays along the surface of a solid thing and over its corners do not count."""
MOST_PANE_RETURNS = 20_000
"""Greatest number of returns that are compared with later rays."""


class SeenFloor:
    """The cells that rays have passed, and those in which something stands.

    Args:
        field: whose nodes are the centers of the cells.
    """

    def __init__(self, field: DistanceField) -> None:
        self._origin, self._step = np.array(field.origin), field.resolution
        self._passed: NDArray[np.uint8] = np.zeros(field.values.shape, np.uint8)
        self._returns: NDArray[np.uint16] = np.zeros(field.values.shape, np.uint16)
        self._angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS)

    def observe(self, pose: Pose, ranges: Array, points: Array) -> None:
        """Take in a scan: ranges (180,) in meters, and its returns (n, 2) in the map's frame, meters."""
        ends = np.minimum(ranges, SEEN_RANGE_M) - END_MARGIN_M
        # Between two rays lies what both have passed.
        ends = np.maximum(np.min([np.roll(ends, shift) for shift in (-1, 0, 1)], axis=0), 0.0)
        angles = self._angles + pose[2]
        corners = np.array(pose[:2]) + ends[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        low, high = corners.min(axis=0), corners.max(axis=0)
        (left, top), (right, bottom) = (np.rint((edge - self._origin) / self._step).astype(int) for edge in (low, high))
        (top, left), (bottom, right) = self._inside(top, left), self._inside(bottom, right)
        inside = np.zeros((bottom - top + 1, right - left + 1), np.uint8)
        shape = np.rint((corners - self._origin) / self._step).astype(np.int32) - (left, top)
        cv2.fillPoly(inside, [shape.astype(np.int32)], 1)
        passed = inside.astype(bool)
        self._passed[top : bottom + 1, left : right + 1][passed] = 1
        self._returns[top : bottom + 1, left : right + 1][passed] = 0
        near = np.hypot(points[:, 0] - pose[0], points[:, 1] - pose[1]) < SEEN_RANGE_M
        self._returns.reshape(-1)[np.unique(self._cells(points[near]))] += 1

    def moving(self, pose: Pose, points: Array) -> NDArray[np.bool_]:
        """Return which returns, (n, 2) meters in the map's frame, are where the floor was free, (n,)."""
        row, column = divmod(int(self._cells(np.array([pose[:2]]))[0]), self._passed.shape[1])
        half = round((SEEN_RANGE_M + 1.0) / self._step)
        top, left = max(0, row - half), max(0, column - half)
        window = self._passed[top : row + half, left : column + half]
        inside = cv2.distanceTransform(window, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * self._step
        cells = self._cells(points)
        rows, columns = cells // self._passed.shape[1] - top, cells % self._passed.shape[1] - left
        within = (rows >= 0) & (columns >= 0) & (rows < window.shape[0]) & (columns < window.shape[1])
        deep = np.zeros(len(points), dtype=bool)
        deep[within] = inside[rows[within], columns[within]] > INSIDE_FREE_M
        return np.asarray(deep & (self._returns.reshape(-1)[cells] < STANDING_RETURNS))

    def _inside(self, row: int, column: int) -> tuple[int, int]:
        """Return row and column of the nearest cell of the grid."""
        ny, nx = self._passed.shape
        return min(max(row, 0), ny - 1), min(max(column, 0), nx - 1)

    def _cells(self, points: Array) -> Index:
        """Return the numbers of the cells that contain points (n, 2), row by row."""
        ny, nx = self._passed.shape
        places = np.rint((points - self._origin) / self._step).astype(np.intp)
        return np.asarray(np.clip(places[:, 1], 0, ny - 1) * nx + np.clip(places[:, 0], 0, nx - 1))


class PaneReturns:
    """Returns of panes: rays ended at a place, and rays from another side pass it."""

    def __init__(self) -> None:
        self._cells: set[tuple[int, int]] = set()
        self._points: Array = np.empty((0, 2))
        self._origins: Array = np.empty((0, 2))

    def observe(self, pose: Pose, ranges: Array, points: Array) -> tuple[Array, Array]:
        """Take in a scan, and return earlier returns that prove to be of panes.

        Args:
            pose: of the robot in the map's frame. ranges: (180,) of the scan, meters.
            points: (n, 2) its returns in the map's frame, meters.

        Returns:
            The returns (m, 2) and the places (m, 2) from which they were seen, meters.
        """
        passed = self._passed(pose, ranges)
        found = self._points[passed], self._origins[passed]
        self._points, self._origins = self._points[~passed], self._origins[~passed]
        fresh = []
        for k, cell in enumerate(map(tuple, np.floor(points / NODE_DISTANCE_M).astype(int).tolist())):
            if cell not in self._cells and len(self._cells) < MOST_PANE_RETURNS:
                self._cells.add(cell)
                fresh.append(k)
        self._points = np.concatenate([self._points, points[fresh]])
        self._origins = np.concatenate([self._origins, np.tile(pose[:2], (len(fresh), 1))])
        return found

    def _passed(self, pose: Pose, ranges: Array) -> NDArray[np.bool_]:
        """Return which earlier returns the rays of a scan pass, (n,)."""
        offset = self._points - pose[:2]
        away = np.maximum(np.hypot(*offset.T), 1e-9)
        ray = np.round((np.arctan2(*offset.T[::-1]) - pose[2] + math.pi) / (2.0 * math.pi) * LIDAR_RAYS).astype(np.intp)
        least = np.min([ranges[(ray + shift) % LIDAR_RAYS] for shift in (-1, 0, 1)], axis=0)
        before = self._points - self._origins
        cosine = (before * offset).sum(axis=1) / (np.maximum(np.hypot(*before.T), 1e-9) * away)
        turned = (np.abs(cosine) > PANE_COSINES[0]) & (np.abs(cosine) < PANE_COSINES[1])
        return np.asarray((least > away + END_MARGIN_M) & (away < PANE_RANGE_M) & turned)
