"""A layered costmap: the old map, and obstacles that the lidar marks and clears."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.geometry import Array, to_local
from labgym.navigation import OccupancyGrid, Pose
from labgym.policies.distance_field import DistanceField

Index = NDArray[np.intp]

UNEXPLAINED_M = 0.10
"""Distance from everything in the map beyond which a return is an obstacle that the map lacks, meters."""
OFF_MAP_M = 0.02
"""Distance from the map beyond which the returns of the present scan are obstacles for the controller, meters: the map
has a thing there, but not in this place."""
HIT_EVIDENCE, MISS_EVIDENCE, MOST_EVIDENCE = 3, 1, 15
"""Evidence that a return adds to its cell, that a ray through the cell removes, and the most that a cell can have."""
CLEARING_MARGIN_M = 0.15
"""Distance by which the rays around a cell must end behind it to clear it, meters."""
MARKING_RANGE_M = 6.0
"""Returns beyond this distance neither mark nor clear, meters."""
HALF_WINDOW_M = 4.0
"""Half side of the window around the robot in which distances to marks are computed for the controller, meters."""
WINDOW_SHIFT_M = 0.5
"""Way of the robot after which the window is moved, meters."""
RIDGE_EVIDENCE, RIDGE_SHARE = 1.0, 0.9
"""Least smoothed evidence of a cell that scans are matched with, and its least share of the greatest next to it: noise
smears a surface over several cells, and the ridge of the evidence is where it is."""
MATCHED_HALF_WINDOW_M, FARTHEST_MATCH_M = 8.0, 0.6
"""Half side of the window of marks around the robot that scans are matched with, and the greatest distance from one in
it, meters."""
CROP_MARGIN_M = 2.0
"""Width of the unseen floor around marks and ends in which a path may be planned, meters."""
FARTHEST_MARK_M = 3.0
"""Distance that stands for no mark within the window, meters."""
RETURN_RANGE_M = 0.6
"""Distance beyond which returns of the present scan do not count, meters."""


class Costmap:
    """Clearance over the floor, from the old map and from what the lidar has seen since.

    A return that the map does not explain marks its cell. A cell whose bearing the lidar sees through loses evidence
    and is free again when none is left: after at most 1.5 s for a cell that was marked for long.

    Args:
        static: distances to the obstacles of the old map.
        seen: distances to what the lidar sees in it.
        exact: whether pose and lidar are exact, so that a return off the map by centimeters means something.
        clearing: whether rays clear marks; False where they pass through obstacles, as through glass.
        cropped: whether plans need only the region of marks and ends; beyond it nothing is known.

    Attributes:
        evidence: (ny, nx) int16, cells around the nodes of `static`; above 0 is marked.
        unexplained: (m, 2) returns of the latest scan that the map does not explain, meters.
    """

    def __init__(
        self,
        static: DistanceField,
        seen: DistanceField,
        exact: bool = True,
        clearing: bool = True,
        cropped: bool = False,
    ) -> None:
        self._static, self._seen, self._exact, self._clearing = static, seen, exact, clearing
        self._cropped = cropped
        self._loose: cKDTree | None = None
        self._returns: Array = np.empty((0, 2))
        self.evidence: NDArray[np.int16] = np.zeros(static.values.shape, np.int16)
        self._marks: Index = np.empty(0, dtype=np.intp)
        self._guesses: Index = np.empty(0, dtype=np.intp)
        self._near = np.full((1, 1), FARTHEST_MARK_M, dtype=np.float32)
        self.unexplained: Array = np.empty((0, 2))
        self._corner, self._middle, self._stale = (0, 0), (math.inf, math.inf), True

    def observe(self, pose: Pose, ranges: Array, points: Array, ignored: NDArray[np.bool_]) -> Array:
        """Mark and clear by a scan, and return the new obstacles, (m, 2) meters in the map's frame.

        Args:
            pose: of the robot in the map's frame.
            ranges: (180,) of the scan, meters.
            points: (n, 2) returns in the map's frame, meters.
            ignored: (n,) whether a return belongs to something that moves and must not mark.
        """
        if self._clearing and len(self._marks):
            self._clear(pose, ranges)
        near = np.hypot(points[:, 0] - pose[0], points[:, 1] - pose[1]) < MARKING_RANGE_M
        off = np.where(near & ~ignored, self._seen.at(points), -math.inf)
        new = points[off > UNEXPLAINED_M]
        loose = points[off > OFF_MAP_M] if self._exact else new
        self._returns = loose
        self._loose = cKDTree(loose) if len(loose) else None
        evidence = self.evidence.reshape(-1)
        cells = self._flat(new)
        fresh = evidence[cells] <= 0
        self.unexplained = new
        hit = np.unique(cells)
        evidence[hit] = np.minimum(evidence[hit] + HIT_EVIDENCE, MOST_EVIDENCE)
        self._remember(np.union1d(self._marks, hit))
        self._look(pose)
        return np.asarray(new[fresh])

    def clearance(self, points: Array) -> Array:
        """Return the distance from points (n, 2) near the robot to the nearest obstacle, (n,) meters."""
        least = self._static.at(points)
        if len(self._marks) or len(self._guesses):
            rows, columns = self._cells(points)
            ny, nx = self._near.shape
            rows = np.minimum(np.maximum(rows - self._corner[0], 0), ny - 1)
            columns = np.minimum(np.maximum(columns - self._corner[1], 0), nx - 1)
            least = np.minimum(least, self._near[rows, columns])
        if self._loose is None:
            return np.asarray(least)
        return np.asarray(np.minimum(least, self._loose.query(points, distance_upper_bound=RETURN_RANGE_M)[0]))

    def guess(self, points: Array) -> None:
        """Set the places (n, 2) at which something is assumed to be, meters, in place of those before."""
        guesses = np.unique(self._flat(points))
        self._stale = self._stale or not np.array_equal(guesses, self._guesses)
        self._guesses = guesses
        if len(points):
            # Cells are too coarse for what the robot slides along.
            self._loose = cKDTree(np.concatenate([self._returns, points]))

    def everywhere(self, ends: Array, marks: bool = True, guesses: bool = True) -> tuple[OccupancyGrid, Array]:
        """Return the occupied cells, and the clearance at the center of every cell, (ny, nx) meters.

        Args:
            ends: (n, 2) places that the region must contain, meters.
            marks: whether to include what the lidar has marked. guesses: whether to include what is assumed.
        """
        static, step = self._static, self._static.resolution
        top, left, bottom, right = self._region(ends)
        marked = (self.evidence > 0) & marks
        if guesses:
            marked.reshape(-1)[self._guesses] = True
        marked, known = marked[top:bottom, left:right], static.values[top:bottom, left:right]
        clearance = np.minimum(known, _distances(marked, step))
        origin = static.origin[0] + step * (left - 0.5), static.origin[1] + step * (top - 0.5)
        return OccupancyGrid(clearance <= 0.0, step, origin), clearance

    def _region(self, ends: Array) -> tuple[int, int, int, int]:
        """Return the first and last rows and columns that a plan between ends needs: top, left, bottom, right."""
        ny, nx = self._static.values.shape
        if not self._cropped:
            return 0, 0, ny, nx
        rows, columns = np.divmod(np.concatenate([self._marks, self._guesses, self._flat(ends)]), nx)
        margin = round(CROP_MARGIN_M / self._static.resolution)
        top, left = max(0, int(rows.min()) - margin), max(0, int(columns.min()) - margin)
        return top, left, min(ny, int(rows.max()) + margin), min(nx, int(columns.max()) + margin)

    def marks_around(self, pose: Pose) -> DistanceField:
        """Return the distances to the surfaces around a pose that several scans have seen: ridges of the evidence."""
        (x, y), step = self._static.origin, self._static.resolution
        half = round(MATCHED_HALF_WINDOW_M / step)
        (row,), (column,) = self._cells(np.array([pose[:2]]))
        top, left = max(0, int(row) - half), max(0, int(column) - half)
        evidence = np.maximum(self.evidence[top : int(row) + half, left : int(column) + half], 0)
        smooth = cv2.GaussianBlur(evidence.astype(np.float32), (0, 0), 1.0)
        greatest = cv2.dilate(smooth, np.ones((3, 3), np.uint8))
        ridges = (smooth > RIDGE_EVIDENCE) & (smooth >= RIDGE_SHARE * greatest)
        values = np.minimum(_distances(ridges, step), FARTHEST_MATCH_M).astype(np.float64)
        return DistanceField(values, (x + step * (left - 0.5), y + step * (top - 0.5)), step, first=0.5)

    def forget(self, pose: Pose, radius: float) -> None:
        """Remove the marks within a radius of the robot, meters."""
        x, y = self._places(self._marks).T
        near = np.hypot(x - pose[0], y - pose[1]) < radius
        self.evidence.reshape(-1)[self._marks[near]] = 0
        self._remember(self._marks)
        self._look(pose)

    def _clear(self, pose: Pose, ranges: Array) -> None:
        """Take evidence from the marked cells that the rays around them pass."""
        local = to_local(self._places(self._marks), pose)
        away = np.hypot(local[:, 0], local[:, 1])
        bearing = np.arctan2(local[:, 1], local[:, 0])
        ray = np.round((bearing + math.pi) / (2.0 * math.pi) * LIDAR_RAYS).astype(np.intp)
        least = np.min([ranges[(ray + offset) % LIDAR_RAYS] for offset in (-1, 0, 1)], axis=0)
        passed = (least > away + CLEARING_MARGIN_M) & (away < min(MARKING_RANGE_M, RANGE))
        self.evidence.reshape(-1)[self._marks[passed]] -= MISS_EVIDENCE

    def _remember(self, marks: Index) -> None:
        """Keep those of some cells that are marked."""
        marks = marks[self.evidence.reshape(-1)[marks] > 0]
        self._stale = self._stale or not np.array_equal(marks, self._marks)
        self._marks = marks

    def _look(self, pose: Pose) -> None:
        """Compute the distances to the marks around a pose, if they or the pose have changed enough."""
        if not self._stale and math.dist(pose[:2], self._middle) < WINDOW_SHIFT_M:
            return
        step = self._static.resolution
        (row,), (column,) = self._cells(np.array([pose[:2]]))
        half = round(HALF_WINDOW_M / step)
        top, left = max(0, int(row) - half), max(0, int(column) - half)
        bottom, right = int(row) + half, int(column) + half
        marked = self.evidence[top:bottom, left:right] > 0
        if len(self._guesses):
            rows, columns = np.divmod(self._guesses, self._static.values.shape[1])
            inside = (rows >= top) & (rows < bottom) & (columns >= left) & (columns < right)
            marked[rows[inside] - top, columns[inside] - left] = True
        self._corner, self._middle, self._stale = (top, left), pose[:2], False
        self._near = _distances(marked, step)

    def _cells(self, points: Array) -> tuple[Index, Index]:
        """Return rows and columns of the cells that contain points (n, 2)."""
        ny, nx = self._static.values.shape
        x0, y0 = self._static.origin
        columns = np.rint((points[:, 0] - x0) / self._static.resolution).astype(np.intp)
        rows = np.rint((points[:, 1] - y0) / self._static.resolution).astype(np.intp)
        return np.minimum(np.maximum(rows, 0), ny - 1), np.minimum(np.maximum(columns, 0), nx - 1)

    def _flat(self, points: Array) -> Index:
        """Return the numbers of the cells that contain points (n, 2), row by row."""
        rows, columns = self._cells(points)
        return np.asarray(rows * self._static.values.shape[1] + columns)

    def _places(self, cells: Index) -> Array:
        """Return the centers of cells, (n, 2) meters."""
        rows, columns = np.divmod(cells, self._static.values.shape[1])
        x0, y0 = self._static.origin
        step = self._static.resolution
        return np.column_stack([x0 + step * columns, y0 + step * rows])


def _distances(marked: NDArray[np.bool_], step: float) -> NDArray[np.float32]:
    """Return the distance from each cell's center to the nearest marked cell's, meters, at most `FARTHEST_MARK_M`."""
    if not marked.any():
        return np.full(marked.shape, FARTHEST_MARK_M, dtype=np.float32)
    cells = cv2.distanceTransform((~marked).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(np.minimum(np.asarray(cells, dtype=np.float32) * np.float32(step), np.float32(FARTHEST_MARK_M)))
