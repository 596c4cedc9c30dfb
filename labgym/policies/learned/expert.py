"""The privileged expert that networks imitate: it plans on the true floor and tracks its path."""

from __future__ import annotations

import math
from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from labgym.envs.robot import turn_towards
from labgym.envs.tasks import Task
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, Pose, occupancy
from labgym.navigation.grid_search import followed, grid_graph
from labgym.policies.grid_planner import clearance_field
from labgym.policies.tracking import PathTracker, TrackingOptions

REPLAN_DISTANCE_M = 0.30
"""Distance from its path beyond which the expert replans, meters."""

COMFORT_M = 0.50
"""Clearance beyond which more has no benefit, meters."""

AVERSION = 2.0
"""Extra cost per meter at the planning radius compared with `COMFORT_M`, as a multiple of length."""

SMOOTHING_CELLS = 7
"""Cells over which a path is averaged."""

Cell = tuple[int, int]

KEPT_LAYOUTS = 256
"""Number of layouts whose paths are kept; those of a large floor take about 2 MB."""


class Atlas:
    """Paths to goals from every free cell of a layout; each goal is searched once and its result cached."""

    def __init__(self, layout: Layout) -> None:
        grid = occupancy(layout)
        self._grid = grid.dilated(PLANNING_RADIUS)
        self._inside = np.argwhere(~self._grid.occupied)
        lack = np.clip((COMFORT_M - clearance_field(grid)) / (COMFORT_M - PLANNING_RADIUS), 0.0, 1.0)
        self._graph = grid_graph(self._grid, 1.0 + AVERSION * lack**2)
        self._next: dict[Cell, NDArray[np.int32]] = {}

    def path(self, start: tuple[float, float], goal: tuple[float, float]) -> NDArray[np.float64] | None:
        """Return a path (n, 2) in room coordinates, meters, that prefers clearance; None if no path exists.

        An end where the robot does not fit is joined to the nearest free cell by a straight piece.
        """
        if len(self._inside) == 0:
            return None
        source, target = self._nearest(start), self._nearest(goal)
        width = self._grid.shape[1]
        if target not in self._next:
            self._next[target] = dijkstra(
                self._graph, directed=False, indices=target[0] * width + target[1], return_predecessors=True
            )[1].astype(np.int32)
        cells = followed(self._next[target], source[0] * width + source[1], target[0] * width + target[1])
        if cells is None:
            return None
        rows, columns = np.divmod(np.array(cells), width)
        xs, ys = self._grid.centres()
        return np.concatenate([[start], _smooth(np.column_stack([xs[columns], ys[rows]])), [goal]])

    def _nearest(self, point: tuple[float, float]) -> Cell:
        row, column = self._grid.cell_of(*point)
        if not self._grid.free(*point):
            row, column = self._inside[np.argmin(((self._inside - (row, column)) ** 2).sum(axis=1))]
        return int(row), int(column)


class Atlases:
    """The atlases of the layouts that were driven last, which experts of one process share."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, Atlas] = OrderedDict()

    def of(self, layout: Layout) -> Atlas:
        """Return the atlas of a layout."""
        atlas = self._kept.get(layout.hash) or Atlas(layout)
        self._kept[layout.hash] = atlas
        self._kept.move_to_end(layout.hash)
        if len(self._kept) > KEPT_LAYOUTS:
            self._kept.popitem(last=False)
        return atlas


class Expert:
    """Gives the expert's action at any pose of a drive; replans when the robot has left its path.

    Args:
        atlases: paths by layout; experts of one process may share them.
        options: of the tracker of its paths.
    """

    def __init__(self, atlases: Atlases, options: TrackingOptions | None = None) -> None:
        self._atlases, self._options = atlases, options
        self._task: Task | None = None
        self._path: NDArray[np.float64] | None = None
        self._tracker: PathTracker | None = None

    def restart(self) -> None:
        """Forget the path: an episode ended, and the next one may have the same task."""
        self._task = None

    def action(self, task: Task, pose: Pose, speed: float) -> NDArray[np.float64]:
        """Return the action (2,) at a pose in the room frame: a turn in place if no path leads to the goal.

        Args:
            task: the current drive; a new one starts a new path.
            pose: (x, y, yaw).
            speed: forward velocity, m/s.
        """
        if task is not self._task or (self._path is not None and _distance(self._path, *pose[:2]) > REPLAN_DISTANCE_M):
            self._task = task
            self._path = self._atlases.of(task.layout).path(pose[:2], task.pair.goal[:2])
            self._tracker = None if self._path is None else PathTracker(self._path, options=self._options)
        return turn_towards(1.0) if self._tracker is None else self._tracker.action(pose, speed)


def _smooth(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a path (n, 2) averaged over neighboring points, its ends kept."""
    if len(path) < SMOOTHING_CELLS:
        return path
    half = SMOOTHING_CELLS // 2
    padded = np.concatenate([np.repeat(path[:1], half, 0), path, np.repeat(path[-1:], half, 0)])
    kernel = np.full(SMOOTHING_CELLS, 1.0 / SMOOTHING_CELLS)
    return np.column_stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(2)])


def _distance(path: NDArray[np.float64], x: float, y: float) -> float:
    """Return the distance from a point to a polyline (n, 2), meters."""
    if len(path) == 1:
        return math.dist(path[0], (x, y))
    starts, steps = path[:-1], np.diff(path, axis=0)
    along = ((x, y) - starts) * steps
    share = np.clip(along.sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-12), 0.0, 1.0)
    nearest = starts + share[:, None] * steps
    return float(np.hypot(nearest[:, 0] - x, nearest[:, 1] - y).min())
