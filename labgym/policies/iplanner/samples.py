"""A dataset as the iPlanner-style network is trained on it, in memory."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from labgym.policies.data import Dataset
from labgym.policies.iplanner.config import IPlannerLossOptions
from labgym.policies.iplanner.targets import Targets, targets_of


@dataclass(frozen=True, eq=False)
class IPlannerSamples:
    """A dataset of n samples as tensors.

    Attributes:
        depth: (n, 72, 128) uint16, millimeters.
        pose: (n, 3) in the room frame.
        goal: (n, 2) in the robot frame, meters.
        place: (n,) index of each sample's maps.
        targets: where each path should end.
    """

    depth: Tensor
    pose: Tensor
    goal: Tensor
    place: Tensor
    targets: Targets

    @classmethod
    def of(cls, data: Dataset, options: IPlannerLossOptions) -> IPlannerSamples:
        """Return the samples of a dataset."""
        return cls(
            depth=torch.from_numpy(data.depth),
            pose=torch.from_numpy(data.pose),
            goal=torch.from_numpy(data.goal),
            place=torch.from_numpy(data.place),
            targets=targets_of(data, options),
        )
