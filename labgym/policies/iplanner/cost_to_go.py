"""Targets of training paths, and cost-to-go fields: lengths of the robot's shortest paths, differentiable."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from torch import Tensor

from labgym.errors import OptionError
from labgym.geometry import Array
from labgym.navigation import PLANNING_RADIUS
from labgym.navigation.geodesic import geodesic_fields
from labgym.policies.data import Dataset
from labgym.policies.data.maps import Maps
from labgym.policies.iplanner.config import IPlannerLossOptions
from labgym.policies.learned.map_stack import MapStack, to_world

Floats = NDArray[np.float32]

SEED_CELLS = 2
"""Free cells get their straight distance to a goal up to this many cells beyond the nearest of them."""

EDGE_CELLS = 4
"""Cells that a field reaches beyond the free space."""

GOAL_ROUNDING_M = 0.01
"""Goals of a map that are equal when rounded to this are one, meters: each frame has its goal in its own frame."""


class CostToGo:
    """The costs to go to the goals of a dataset, sampled at points in the room frame.

    In free space the value is the length of the shortest path of the disc to the goal. Elsewhere, inside obstacles and
    off the map, it is the value of the nearest free cell plus the distance to it, so that the gradient leads back to
    that cell.

    Args:
        maps: of the layouts.
        goals: of each layout, (k, 2) in the room frame, meters.

    Raises:
        OptionError: the disc fits nowhere in a layout.
    """

    def __init__(self, maps: tuple[Maps, ...], goals: tuple[Array, ...]) -> None:
        cropped: list[Maps] = []
        fields: list[Floats] = []
        for number, (each, places) in enumerate(zip(maps, goals, strict=True)):
            if not bool((each.distance >= PLANNING_RADIUS).any()):
                raise OptionError(f"map {number} of the dataset has no free cell; make it again with: labgym data")
            around = _cropped(each)
            cropped += [around] * len(places)
            fields += list(cost_to_go(around, places))
        self._fields = MapStack(cropped, fields, "bilinear", "edge")
        sizes = np.array([each.distance.shape[::-1] for each in cropped])
        half = torch.tensor([each.resolution / 2.0 for each in cropped])[:, None]
        self._low = torch.tensor([each.origin for each in cropped], dtype=torch.float32) + half
        self._high = self._low + torch.from_numpy(sizes - 1).float() * 2.0 * half

    def at(self, points: Tensor, field: Tensor) -> Tensor:
        """Return the costs to go (b, n), meters.

        Args:
            points: (b, n, 2) in the room frame, meters.
            field: (b,) index of the goal of each row of points, in the order of `goals`.
        """
        within = torch.minimum(torch.maximum(points, self._low[field][:, None]), self._high[field][:, None])
        beyond: Tensor = torch.linalg.vector_norm(points - within, dim=2)
        return self._fields.at(within, field) + beyond


def cost_to_go(maps: Maps, goals: Array) -> Floats:
    """Return the costs to go from every cell to goals (k, 2): (k, ny, nx) float32, meters.

    Where the disc does not fit at a goal, paths end at the nearest free cells and go on straight.
    """
    free = maps.distance >= PLANNING_RADIUS
    ny, nx = free.shape
    xs, ys = (maps.origin[axis] + (np.arange(count) + 0.5) * maps.resolution for axis, count in ((0, nx), (1, ny)))
    straight = np.hypot(xs - goals[:, 0, None, None], ys[:, None] - goals[:, 1, None, None])
    nearest = np.where(free, straight, np.inf).min(axis=(1, 2))[:, None, None]
    starts = np.where(straight <= nearest + SEED_CELLS * maps.resolution, straight, np.inf)
    fields = geodesic_fields(free, starts, maps.resolution)
    return np.stack([_continued(field, maps.resolution) for field in fields]).astype(np.float32)


def goals_of(data: Dataset) -> tuple[tuple[Array, ...], NDArray[np.int64]]:
    """Return the goals of each layout, (k, 2) in the room frame, and the index of each sample's goal, (n,).

    The index counts the goals of all layouts one after the other.
    """
    local, pose = (torch.from_numpy(array.astype(np.float64)) for array in (data.goal, data.pose))
    ends = to_world(local[:, None], pose)[:, 0].numpy()
    keys = np.column_stack([data.place, np.rint(ends / GOAL_ROUNDING_M).astype(np.int64)])
    _, first, field = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    goals = tuple(ends[first[data.place[first] == place]] for place in range(len(data.maps)))
    return goals, field.reshape(-1).astype(np.int64)


def _cropped(maps: Maps) -> Maps:
    """Return the maps around the free space, with up to `EDGE_CELLS` cells on every side."""
    rows, columns = np.nonzero(maps.distance >= PLANNING_RADIUS)
    (top, bottom), (left, right) = (
        (max(int(index.min()) - EDGE_CELLS, 0), int(index.max()) + EDGE_CELLS + 1) for index in (rows, columns)
    )
    window = np.s_[top:bottom, left:right]
    origin = maps.origin[0] + left * maps.resolution, maps.origin[1] + top * maps.resolution
    return replace(maps, cost=maps.cost[window], distance=maps.distance[window], origin=origin)


def _continued(field: Array, resolution: float) -> Array:
    """Return a field (ny, nx), where it is inf replaced by the value of the nearest other cell plus the distance."""
    away, nearest = distance_transform_edt(np.isinf(field), return_indices=True)
    return np.asarray(field[tuple(nearest)] + resolution * away)


BATCH_SAMPLES = 256
"""Samples whose cost-to-go is looked up at a time: each look-up copies a field."""


class Targets(ABC):
    """The targets of n samples.

    Attributes:
        reach: (n,) length of the way to each target, meters.
    """

    reach: Tensor

    @abstractmethod
    def miss(self, chosen: Tensor, local: Tensor, world: Tensor) -> Tensor:
        """Return the distance (b,) by which paths miss their targets, meters, differentiable.

        Args:
            chosen: (b,) index of each path's sample.
            local: (b, 2) ends of the paths in the robot frame, meters.
            world: (b, 2) the same ends in the room frame.
        """


class PointTargets(Targets):
    """Paths should end at points (n, 2) in the robot frame, meters."""

    def __init__(self, points: Floats, reach: Floats) -> None:
        self.points, self.reach = torch.from_numpy(points), torch.from_numpy(reach)

    def miss(self, chosen: Tensor, local: Tensor, world: Tensor) -> Tensor:  # noqa: ARG002
        """Return the distance between the ends and their points."""
        distance: Tensor = torch.linalg.vector_norm(self.points[chosen] - local, dim=1)
        return distance


class CostToGoTargets(Targets):
    """Paths should end where the cost-to-go has fallen to a level.

    Args:
        fields: cost-to-go fields.
        field: (n,) index of each sample's field.
        level: (n,) cost-to-go at the end of each path, meters.
        reach: (n,) length of the way to there, meters.
    """

    def __init__(self, fields: CostToGo, field: Tensor, level: Tensor, reach: Tensor) -> None:
        self._fields, self._field, self._level, self.reach = fields, field, level, reach

    def miss(self, chosen: Tensor, local: Tensor, world: Tensor) -> Tensor:  # noqa: ARG002
        """Return the difference between the cost-to-go at the ends and what it should be there.

        More progress than asked for counts as a miss, too: it is possible only through an obstacle.
        """
        return (self._fields.at(world[:, None], self._field[chosen])[:, 0] - self._level[chosen]).abs()


def targets_of(data: Dataset, options: IPlannerLossOptions) -> Targets:
    """Return the targets of a dataset's samples.

    Raises:
        OptionError: the target is the cost-to-go, and a layout has no space for the robot's disc.
    """
    straight = np.asarray(np.linalg.norm(data.goal, axis=1), dtype=np.float32)
    if options.target == "goal":
        return PointTargets(data.goal, straight)
    if options.target == "expert":
        ends = points_along(data, options.horizon)
        along = np.minimum(data.length, np.float32(options.horizon))
        return PointTargets(ends, along if options.along else np.asarray(np.linalg.norm(ends, axis=1), np.float32))
    goals, index = goals_of(data)
    fields, field = CostToGo(data.maps, goals), torch.from_numpy(index)
    places = torch.from_numpy(data.pose[:, :2])
    parts = zip(torch.split(places, BATCH_SAMPLES), torch.split(field, BATCH_SAMPLES), strict=True)
    start = torch.cat([fields.at(points[:, None], which)[:, 0] for points, which in parts])
    fall = start.clamp(max=options.horizon)
    reach = fall if options.along else torch.from_numpy(straight).clamp(max=options.horizon)
    return CostToGoTargets(fields, field, start - fall, reach)


def points_along(data: Dataset, horizon: float) -> Floats:
    """Return the point a horizon along each expert path, or the goal if that is nearer: (n, 2) float32, meters."""
    last = data.path.shape[1] - 1
    along = np.minimum(horizon / np.maximum(data.length, 1e-6), 1.0) * last
    before = np.minimum(along.astype(np.int64), last - 1)
    share = (along - before)[:, None]
    row = np.arange(len(data))
    points = (1.0 - share) * data.path[row, before] + share * data.path[row, before + 1]
    return np.asarray(points, dtype=np.float32)
