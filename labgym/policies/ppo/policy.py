"""The policy that drives from trained weights."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.policies.learned.weights import WEIGHTS, load_weights
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.ppo.inputs import DriveMemory, Sensor
from labgym.policies.ppo.network import Actor


class PPOPolicy(Policy):
    """Drives on lidar, goal, velocity and odometry with the mean action of a network trained by PPO.

    Args:
        weights: folder of `weights.safetensors`; None uses the published ones.
        actor: a network to use in place of a folder.

    Raises:
        DocumentError: the weights cannot be read.
    """

    name: ClassVar[str] = "ppo"
    observation: ClassVar[Sensors] = "lidar"
    sensor: ClassVar[Sensor] = "lidar"

    def __init__(self, weights: str | Path | None = None, actor: Actor | None = None) -> None:
        self._folder = None if actor else Path(weights) if weights else artefacts("policies") / f"ppo-{self.sensor}"
        self._actor = actor or load_weights(Actor(self.sensor), self._folder or "")
        self._memory = DriveMemory(self.sensor)

    def reset(self, episode: EpisodeStart) -> None:  # noqa: ARG002 - the goal comes with every observation
        """Forget the previous drive."""
        self._memory.reset()

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the network's mean action, clipped."""
        vector = self._memory.vector(observation, observation["odometry"])
        with torch.inference_mode():
            action = self._actor(torch.from_numpy(vector)[None])[0].clamp(-1.0, 1.0)
        return np.asarray(action.numpy(), dtype=np.float64)

    def files(self) -> tuple[Path, ...]:
        """Return the file of the weights."""
        return () if self._folder is None else (self._folder / WEIGHTS,)


class PPODepthPolicy(PPOPolicy):
    """Drives on the depth camera in place of the lidar; obstacles seen earlier are remembered in the odometry frame."""

    name: ClassVar[str] = "ppo-depth"
    observation: ClassVar[Sensors] = "depth"
    sensor: ClassVar[Sensor] = "depth"


DRIVERS: dict[Sensor, type[PPOPolicy]] = {"lidar": PPOPolicy, "depth": PPODepthPolicy}
"""The policy of each sensor."""
