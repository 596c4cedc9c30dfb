"""The privileged driver that is copied first: shortest paths on the true map, and the tracking controller."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.envs.tasks import Task
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, OccupancyGrid, Pose, occupancy
from labgym.policies.grid_planner import clearance_field
from labgym.policies.tracking import PathTracker, turn_towards

STRAY = 0.30
"""Distance off its path from which the expert plans anew, metres."""
COMFORT = 0.50
"""Clearance beyond which more is not sought, metres."""
AVERSION = 2.0
"""How many times its length a path at the planning radius costs more than one at `COMFORT`."""
SMOOTHING = 7
"""Cells over which a path is averaged."""

Cell = tuple[int, int]


class Atlas:
    """The ways to a goal from every free cell of a layout: one search a goal, kept for all later drives to it."""

    def __init__(self, layout: Layout) -> None:
        grid = occupancy(layout)
        self._grid = grid.dilated(PLANNING_RADIUS)
        self._inside = np.argwhere(~self._grid.occupied)
        lack = np.clip((COMFORT - clearance_field(grid)) / (COMFORT - PLANNING_RADIUS), 0.0, 1.0)
        self._graph = _moves(self._grid, 1.0 + AVERSION * lack**2)
        self._next: dict[Cell, NDArray[np.int32]] = {}

    def path(self, start: tuple[float, float], goal: tuple[float, float]) -> NDArray[np.float64] | None:
        """Return a path (n, 2) in room coordinates, metres, that keeps clear where it can; None where there is none.

        An end where the robot does not fit is joined by a straight piece to the nearest free cell.
        """
        if len(self._inside) == 0:
            return None
        source, target = self._nearest(start), self._nearest(goal)
        width = self._grid.shape[1]
        if target not in self._next:
            self._next[target] = dijkstra(
                self._graph, directed=False, indices=target[0] * width + target[1], return_predecessors=True
            )[1].astype(np.int32)
        onward, cell, end = self._next[target], source[0] * width + source[1], target[0] * width + target[1]
        cells = [cell]
        while cell != end:
            cell = int(onward[cell])
            if cell < 0:
                return None
            cells.append(cell)
        rows, columns = np.divmod(np.array(cells), width)
        xs, ys = self._grid.centres()
        return np.concatenate([[start], _smooth(np.column_stack([xs[columns], ys[rows]])), [goal]])

    def _nearest(self, point: tuple[float, float]) -> Cell:
        row, column = self._grid.cell_of(*point)
        if not self._grid.free(*point):
            row, column = self._inside[np.argmin(((self._inside - (row, column)) ** 2).sum(axis=1))]
        return int(row), int(column)


class Expert:
    """Says at any pose of a drive what a driver with the map would do; plans anew when the robot has left its path.

    Args:
        atlases: by layout id, filled as needed; experts of one process may share them.
    """

    def __init__(self, atlases: dict[str, Atlas]) -> None:
        self._atlases = atlases
        self._task: Task | None = None
        self._path: NDArray[np.float64] | None = None
        self._tracker: PathTracker | None = None

    def action(self, task: Task, pose: Pose, speed: float) -> NDArray[np.float64]:
        """Return the action (2,) from a pose in the room frame; where no path leads to the goal, turning on the spot.

        Args:
            task: the drive under way; another one than before begins a new path.
            pose: (x, y, yaw).
            speed: forward velocity, m/s.
        """
        if task is not self._task or (self._path is not None and _distance(self._path, *pose[:2]) > STRAY):
            if task.layout.id not in self._atlases:
                self._atlases[task.layout.id] = Atlas(task.layout)
            self._task = task
            self._path = self._atlases[task.layout.id].path(pose[:2], task.pair.goal[:2])
            self._tracker = None if self._path is None else PathTracker(self._path)
        return turn_towards(1.0) if self._tracker is None else self._tracker.action(pose, speed)


def _moves(grid: OccupancyGrid, costs: NDArray[np.float64]) -> csr_matrix:
    """Return the graph of moves to eight neighbours without cutting corners, weighted by length and mean cost."""
    free = ~grid.occupied
    number = np.arange(free.size).reshape(free.shape)
    block = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    sources, targets, weights = [], [], []
    for a, b, allowed, length in (
        (np.s_[:, :-1], np.s_[:, 1:], free[:, :-1] & free[:, 1:], 1.0),
        (np.s_[:-1], np.s_[1:], free[:-1] & free[1:], 1.0),
        (np.s_[:-1, :-1], np.s_[1:, 1:], block, math.sqrt(2.0)),
        (np.s_[:-1, 1:], np.s_[1:, :-1], block, math.sqrt(2.0)),
    ):
        sources.append(number[a][allowed])
        targets.append(number[b][allowed])
        weights.append(length * (costs[a] + costs[b])[allowed] / 2.0)
    shape = (free.size, free.size)
    return coo_matrix((np.concatenate(weights), (np.concatenate(sources), np.concatenate(targets))), shape).tocsr()


def _smooth(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a path (n, 2) averaged over neighbouring points, its ends kept."""
    if len(path) < SMOOTHING:
        return path
    half = SMOOTHING // 2
    padded = np.concatenate([np.repeat(path[:1], half, 0), path, np.repeat(path[-1:], half, 0)])
    kernel = np.full(SMOOTHING, 1.0 / SMOOTHING)
    return np.column_stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(2)])


def _distance(path: NDArray[np.float64], x: float, y: float) -> float:
    """Return the distance from a point to a polyline (n, 2), metres."""
    if len(path) == 1:
        return math.dist(path[0], (x, y))
    starts, steps = path[:-1], np.diff(path, axis=0)
    along = ((x, y) - starts) * steps
    share = np.clip(along.sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-12), 0.0, 1.0)
    nearest = starts + share[:, None] * steps
    return float(np.hypot(nearest[:, 0] - x, nearest[:, 1] - y).min())
