"""A dataset as the iPlanner-style network is trained on it, in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.policies.data import Dataset
from labgym.policies.iplanner.config import IPlannerLossOptions


@dataclass(frozen=True, eq=False)
class IPlannerSamples:
    """A dataset of n samples as tensors.

    Attributes:
        depth: (n, 72, 128) uint16, millimeters.
        pose: (n, 3) in the room frame.
        goal: (n, 2) in the robot frame, meters.
        target: (n, 2) where each path should end, robot frame, meters.
        reach: (n,) length of the way to the target, meters.
        place: (n,) index of each sample's maps.
    """

    depth: Tensor
    pose: Tensor
    goal: Tensor
    target: Tensor
    reach: Tensor
    place: Tensor

    @classmethod
    def of(cls, data: Dataset, options: IPlannerLossOptions) -> IPlannerSamples:
        """Return the samples of a dataset."""
        target = targets(data, options.horizon)
        return cls(
            depth=torch.from_numpy(data.depth),
            pose=torch.from_numpy(data.pose),
            goal=torch.from_numpy(data.goal),
            target=torch.from_numpy(target),
            reach=torch.from_numpy(reaches(data, target, options)),
            place=torch.from_numpy(data.place),
        )


def targets(data: Dataset, horizon: float | None) -> NDArray[np.float32]:
    """Return the point a horizon along each expert path, or the goal if that is nearer: (n, 2) float32, meters."""
    if horizon is None:
        return data.goal
    last = data.path.shape[1] - 1
    along = np.minimum(horizon / np.maximum(data.length, 1e-6), 1.0) * last
    before = np.minimum(along.astype(np.int64), last - 1)
    share = (along - before)[:, None]
    row = np.arange(len(data))
    points = (1.0 - share) * data.path[row, before] + share * data.path[row, before + 1]
    return np.asarray(points, dtype=np.float32)


def reaches(data: Dataset, target: NDArray[np.float32], options: IPlannerLossOptions) -> NDArray[np.float32]:
    """Return the length of the way to each target (n, 2): along the expert path, or straight as published; (n,)."""
    if not options.along or options.horizon is None:
        return np.asarray(np.linalg.norm(target, axis=1), dtype=np.float32)
    return np.minimum(data.length, np.float32(options.horizon))
