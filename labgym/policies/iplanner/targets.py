"""Where the paths of training samples should end: at points, or where the cost-to-go has fallen enough."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.policies.data import Dataset
from labgym.policies.iplanner.config import IPlannerLossOptions
from labgym.policies.iplanner.cost_to_go import CostToGo, goals_of

Floats = NDArray[np.float32]

BATCH = 256
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
    parts = zip(torch.split(places, BATCH), torch.split(field, BATCH), strict=True)
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
