"""A trained network as the leader of drives of a new dataset: DAgger (Ross, Gordon and Bagnell 2011)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.documents import canonical_hash
from labgym.envs.sensors import Camera
from labgym.layouts import Layout
from labgym.policies.data.situations import DriveFrame, Guide
from labgym.policies.learned.weights import CONFIG, WEIGHTS
from labgym.policies.navdp.diffusion import TrajectorySampler
from labgym.policies.navdp.network import Bytes, frame, load_navdp
from labgym.runs.manifest import file_digest
from labgym.scenes import RayScene

TRAJECTORIES = 6
"""Trajectories that are drawn in a frame."""


@dataclass(frozen=True)
class NavDPLeader:
    """Leads drives by a network's trajectory of the highest value, without a map of obstacles.

    Attributes:
        folder: of `config.json` and `weights.safetensors`, which all workers can read.
        digest: of both files.
    """

    folder: Path
    digest: str

    @classmethod
    def of(cls, folder: Path) -> NavDPLeader:
        """Return the leader with the network in a folder.

        Raises:
            DocumentError: the network cannot be read.
        """
        load_navdp(folder)
        return cls(folder.absolute(), canonical_hash([file_digest(folder / name) for name in (CONFIG, WEIGHTS)]))

    def guide(self, layout: Layout, seed: int) -> Guide:
        """Return the guide of drives in a layout."""
        return _Guide(self.folder, layout, seed)


class _Guide:
    def __init__(self, folder: Path, layout: Layout, seed: int) -> None:
        torch.set_num_threads(1)
        self._sampler = TrajectorySampler(load_navdp(folder))
        self._options = self._sampler.network.config.network
        self._camera, self._rays = Camera(), RayScene(layout)
        self._frames: deque[Bytes] = deque(maxlen=self._options.memory)
        self._generator = torch.Generator().manual_seed(seed)

    def __call__(self, seen: DriveFrame) -> NDArray[np.float64]:
        if seen.frame == 0:
            self._frames.clear()
        options = self._options
        rgb, depth = self._camera.colour_and_depth(self._rays, seen.pose)
        self._frames.append(frame(rgb, depth, options.shrink))
        frames = [self._frames[0]] * (options.memory - len(self._frames)) + list(self._frames)
        drawn = self._sampler.draw(frames, seen.goal, TRAJECTORIES, 0.0, self._generator)
        best = drawn.trajectories[int(np.argmax(drawn.values))]
        return np.vstack([np.zeros((1, 2)), best])
