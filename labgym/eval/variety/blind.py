"""Blind policies: they know the walls of a floor and where furniture stands on other floors, and drive unseeing.

A floor on which they succeed can be driven by heart: nothing has to be seen. They are as good as their knowledge
allows: the path has the greatest probability of being free, if its parts are independent. The knowledge is of one of
two kinds: `blind_map` lays the other floors over this one, door on door; `wall_map` counts how often furniture stands
at each distance from a wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.envs.episode import SUCCESS_DISTANCE
from labgym.envs.robot import ROBOT
from labgym.eval.variety.sketch import STEP, FloorSketch
from labgym.geometry import OrientedBox, rotate, wrap_angle
from labgym.navigation import PLANNING_RADIUS
from labgym.navigation.clearance import Obstacles

PRIOR = 4.0
"""Weight of the mean over a whole floor where few other floors reach, in floors."""
LENGTH = 0.02
"""Cost of each meter in addition to the risk of a collision: of two ways that are equally free it takes the shorter."""
TOUCHING, CLEAR = 0.25, 0.35
"""Distances from furniture at which the robot of 0.27 m counts as touching it, and as clear; the grid's error is up to
7 cm."""
SNAP = 0.3
"""Distance by which an end too near to a wall may be moved to a free point, meters."""
FAR = 8.0
"""Distance from walls beyond which `wall_map` makes no difference, meters."""
SUBPIXELS = 4
"""Binary digits after the point of corners that are drawn on a grid."""

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Point = tuple[float, float]


@dataclass(frozen=True)
class BlindMap:
    """The knowledge of a blind policy about a floor.

    Attributes:
        low: coordinates of the first grid point.
        free: (ny, nx) whether the robot keeps clear of walls.
        risk: (ny, nx) probability that the robot touches furniture.
    """

    low: Array
    free: Mask
    risk: Array

    def paths(self, start: Point, goals: Sequence[Point]) -> list[Array | None]:
        """Return for each goal the path (n, 2) that is most probably free; None if walls leave no way."""
        source = self._node(start)
        if source is None or not goals:
            return [None] * len(goals)
        lengths, before = dijkstra(self._graph(), directed=False, indices=source, return_predecessors=True)
        paths: list[Array | None] = []
        for goal in goals:
            node = self._node(goal)
            if node is None or not math.isfinite(lengths[node]):
                paths.append(None)
                continue
            nodes = [node]
            while nodes[-1] != source:
                nodes.append(int(before[nodes[-1]]))
            rows, columns = np.divmod(np.array(nodes[::-1]), self.free.shape[1])
            between = self.low + STEP * np.column_stack([columns, rows])
            paths.append(np.concatenate([[start], between[1:-1], [goal]]))
        return paths

    def _graph(self) -> csr_matrix:
        """Return the moves between neighboring free points, weighted by risk and length."""
        hazard = LENGTH - np.log1p(-np.minimum(self.risk, 1.0 - 1e-9))
        ny, nx = self.free.shape
        number = np.arange(ny * nx).reshape(ny, nx)
        rows, columns, weights = [], [], []
        for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
            a = np.s_[: ny - dy, max(-dx, 0) : nx - max(dx, 0)]
            b = np.s_[dy:, max(dx, 0) : nx + min(dx, 0)]
            open_ = self.free[a] & self.free[b]
            rows.append(number[a][open_])
            columns.append(number[b][open_])
            weights.append(STEP * math.hypot(dx, dy) * (hazard[a] + hazard[b])[open_] / 2.0)
        edges = np.concatenate(rows), np.concatenate(columns)
        return coo_matrix((np.concatenate(weights), edges), shape=(ny * nx, ny * nx)).tocsr()

    def _node(self, point: Point) -> int | None:
        """Return the number of the free grid point nearest to a point, None if it is farther than `SNAP`."""
        ny, nx = self.free.shape
        column, row = ((np.array(point) - self.low) / STEP).round().astype(int).tolist()
        reach = math.ceil(SNAP / STEP)
        rows, columns = np.mgrid[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        rows, columns = np.minimum(rows, ny - 1).ravel(), np.minimum(columns, nx - 1).ravel()
        away = np.hypot(self.low[0] + STEP * columns - point[0], self.low[1] + STEP * rows - point[1])
        away[~self.free[rows, columns]] = math.inf
        nearest = int(away.argmin())
        return int(rows[nearest] * nx + columns[nearest]) if away[nearest] <= SNAP else None


def blind_map(floor: FloorSketch, others: Sequence[FloorSketch]) -> BlindMap:
    """Return what the blind policy knows of a floor: its walls, and the mean of other floors' furniture.

    The other floors are laid over this one with their main doors on its main door. The risk at a point is the share of
    those floors, of all that reach the point, on which the robot would touch furniture there.
    """
    count, touched = (np.zeros(floor.walls.shape) for _ in range(2))
    for other in others:
        there = _aligned(other, floor)
        covered = _covered(other, floor)
        count += covered
        away = distances(there, floor.low, floor.walls.shape)
        touched += covered * _touching(away)
    mean = touched.sum() / max(count.sum(), 1.0)
    risk = (touched + PRIOR * mean) / (count + PRIOR)
    return BlindMap(floor.low, np.asarray(floor.walls >= PLANNING_RADIUS), risk)


def wall_map(floor: FloorSketch, others: Sequence[FloorSketch]) -> BlindMap:
    """Return what a policy knows that has learned how far from walls furniture stands.

    The risk at a point is the mean probability, over the points of other floors at its distance from the nearest wall,
    that the robot would touch furniture there.
    """
    touched, count = np.zeros(round(FAR / STEP) + 1), np.zeros(round(FAR / STEP) + 1)
    for other in others:
        bins = _wall_bins(other)
        count += np.bincount(bins[other.walls > 0.0], minlength=len(count))
        risk = _touching(distances(other.obstacles, other.low, other.walls.shape))
        touched += np.bincount(bins[other.walls > 0.0], risk[other.walls > 0.0], len(count))
    mean = touched.sum() / max(count.sum(), 1.0)
    profile = (touched + PRIOR * mean) / (count + PRIOR)
    return BlindMap(floor.low, np.asarray(floor.walls >= PLANNING_RADIUS), profile[_wall_bins(floor)])


def is_free(floor: FloorSketch, path: Array) -> bool:
    """Whether the robot drives a path without touching furniture, until it is near enough to the end to succeed."""
    before = np.linalg.norm(path - path[-1], axis=1) > SUCCESS_DISTANCE
    last = int(np.flatnonzero(before)[-1]) + 1 if before.any() else 0
    obstacles = Obstacles(floor.obstacles)
    if last == 0:
        return True
    return bool(obstacles.segments_clear(path[:last], path[1 : last + 1], ROBOT.chassis_radius).all())


def blind_drives(
    floor: FloorSketch,
    others: Sequence[FloorSketch],
    drives: Sequence[tuple[Point, Point]],
    knowledge: Callable[[FloorSketch, Sequence[FloorSketch]], BlindMap] = blind_map,
) -> list[bool]:
    """Return whether a blind policy drives each pair of points of a floor without touching furniture."""
    known = knowledge(floor, others)
    starts: dict[Point, list[int]] = {}
    for k, (start, _) in enumerate(drives):
        starts.setdefault(start, []).append(k)
    free = [False] * len(drives)
    for start, numbers in starts.items():
        paths = known.paths(start, [drives[k][1] for k in numbers])
        for k, path in zip(numbers, paths, strict=True):
            free[k] = path is not None and is_free(floor, path)
    return free


def _touching(away: Array) -> Array:
    """Return the probability that the robot touches furniture at given distances from it, in meters."""
    return np.asarray(np.clip((CLEAR - away) / (CLEAR - TOUCHING), 0.0, 1.0))


def _wall_bins(floor: FloorSketch) -> NDArray[np.intp]:
    """Return the distance of each grid point from the nearest wall, (ny, nx), in steps of the grid up to FAR."""
    return np.asarray(np.minimum(floor.walls.astype(np.float64), FAR) / STEP).round().astype(np.intp)


def distances(boxes: Sequence[OrientedBox], low: Array, shape: tuple[int, int]) -> Array:
    """Return the distance of grid points from the nearest box, (ny, nx) meters; exact to about 7 cm."""
    image = np.ones(shape, dtype=np.uint8)
    for box in boxes:
        corners = (box.corners() - low) / STEP * 2**SUBPIXELS
        cv2.fillConvexPoly(image, corners.round().astype(np.int32), (0,), shift=SUBPIXELS)
    return np.asarray(cv2.distanceTransform(image, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * STEP, dtype=np.float64)


def _aligned(other: FloorSketch, floor: FloorSketch) -> list[OrientedBox]:
    """Return the obstacles of another floor with its main door on this floor's."""
    x, y, turn = _motion(other, floor)
    moved = []
    for box in other.obstacles:
        dx, dy = rotate(box.x, box.y, turn)
        moved.append(OrientedBox(x + dx, y + dy, box.width, box.depth, box.yaw + turn))
    return moved


def _covered(other: FloorSketch, floor: FloorSketch) -> Mask:
    """Return at which grid points of a floor another floor has floor, if their main doors coincide."""
    x, y, turn = _motion(other, floor)
    ny, nx = floor.walls.shape
    points = np.stack(np.meshgrid(np.arange(nx), np.arange(ny)), axis=-1) * STEP + floor.low - (x, y)
    cosine, sine = math.cos(-turn), math.sin(-turn)
    local = points @ np.array([[cosine, sine], [-sine, cosine]])
    columns, rows = ((local - other.low) / STEP).round().astype(int).transpose(2, 0, 1)
    held = (rows >= 0) & (columns >= 0) & (rows < other.walls.shape[0]) & (columns < other.walls.shape[1])
    rows, columns = np.where(held, rows, 0), np.where(held, columns, 0)
    return np.asarray(held & (other.walls[rows, columns] > 0.0))


def _motion(other: FloorSketch, floor: FloorSketch) -> tuple[float, float, float]:
    """Return the motion (x, y, turn) that brings another floor's main door onto this one's."""
    turn = wrap_angle(float(floor.entrance[2] - other.entrance[2]))
    dx, dy = rotate(float(other.entrance[0]), float(other.entrance[1]), turn)
    return float(floor.entrance[0]) - dx, float(floor.entrance[1]) - dy, turn
