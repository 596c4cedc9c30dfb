"""A dataset as the NavDP-style network is trained on it, in memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.policies.data.read import Dataset, load_dataset, pictures
from labgym.policies.navdp.config import NavDPConfig
from labgym.policies.navdp.frames import frame
from labgym.policies.navdp.trajectory import first_part, steps_of

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class NavDPSamples:
    """A dataset of n samples as tensors.

    Attributes:
        frames: (n, h, w, 4) uint8 of `frame_shape`.
        memory: (n, memory) index of the frames that a sample sees, the oldest first, its own last; a drive that is
            younger than that repeats its first frame.
        goal: (n, 2) in the robot frame, meters.
        pose: (n, 3) in the room frame.
        place: (n,) index of each sample's maps.
        path: (n, points + 1, 2) of the expert, robot frame, meters.
        steps: (n, points, 3), the path as steps.
    """

    frames: Tensor
    memory: Tensor
    goal: Tensor
    pose: Tensor
    place: Tensor
    path: Tensor
    steps: Tensor

    @classmethod
    def read(cls, folder: str | Path, config: NavDPConfig) -> tuple[NavDPSamples, Dataset]:
        """Read a dataset; return its samples and the dataset itself.

        Raises:
            DocumentError: the manifest is missing or broken.
            OptionError: no shard of it is finished.
            MissingDependencyError: pyarrow is not installed.
        """
        dataset = load_dataset(folder, config.training.samples)
        path = first_part(
            torch.from_numpy(dataset.path),
            torch.from_numpy(dataset.length),
            config.loss.horizon,
            config.network.points,
        )
        images, shrink = zip(pictures(folder, len(dataset)), dataset.depth, strict=True), config.network.shrink
        samples = cls(
            frames=torch.from_numpy(np.stack([frame(rgb, depth / 1000.0, shrink) for rgb, depth in images])),
            memory=torch.from_numpy(memory_of(dataset.drive, config.network.memory)),
            goal=torch.from_numpy(dataset.goal),
            pose=torch.from_numpy(dataset.pose),
            place=torch.from_numpy(dataset.place),
            path=path,
            steps=steps_of(path, config.diffusion.scale),
        )
        return samples, dataset

    def remembered(self, chosen: Tensor, mirrored: Tensor) -> Tensor:
        """Return the frames (b, memory, h, w, 4) that samples (b,) see; mirrored ones (b,) left for right."""
        frames = self.frames[self.memory[chosen]]
        return torch.where(mirrored[:, None, None, None, None], frames.flip(3), frames)


def memory_of(drives: Indices, count: int) -> Indices:
    """Return the samples whose frames each sample remembers, (n, count), the oldest first, itself last.

    Args:
        drives: (n,) number of each sample's drive; the samples of a drive are adjacent and in temporal order.
        count: number of frames.
    """
    row = np.arange(len(drives))
    first = np.maximum.accumulate(np.where(np.diff(drives, prepend=-1) != 0, row, 0))
    indices: Indices = np.maximum(row[:, None] - np.arange(count - 1, -1, -1), first[:, None])
    return indices
