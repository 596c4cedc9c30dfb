"""A model saved by stable-baselines3, as a policy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS
from labgym.errors import (
    LabgymError,
    OptionError,
    check_name,
    one_line,
    optional_package,
)
from labgym.policies.adapters.inputs import check_archive, check_trust, checked_action, checked_file, sensors_for
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors

ALGORITHMS = ("A2C", "DDPG", "PPO", "SAC", "TD3")
"""Algorithms of stable-baselines3 with continuous actions."""

SHAPES: dict[str, tuple[tuple[int, ...], ...]] = {
    "goal": ((3,),),
    "velocity": ((2,),),
    "lidar": ((LIDAR_RAYS,),),
    "depth": ((IMAGE_SHAPE[0] * IMAGE_SHAPE[1],),),
    "rgb": ((*IMAGE_SHAPE, 3), (3, *IMAGE_SHAPE)),
}
"""Shapes of the environment's observations; models trained on images have them channels first."""

FLAT: dict[Sensors, tuple[str, ...]] = {"lidar": ("goal", "lidar", "velocity"), "depth": ("depth", "goal", "velocity")}
"""Keys in the order in which `gymnasium.wrappers.FlattenObservation` concatenates them."""


class StableBaselines3Policy(Policy):
    """Acts with a model of stable-baselines3.

    The model must be trained on `LabPointNav-v0`: on its `Dict` of observations (or some of its keys) or on the vector
    of `FlattenObservation`, without normalization outside of the model.

    stable-baselines3 unpickles parts of the file, and a pickle can run any code. A file from outside labgym is
    therefore loaded in a box only (`labgym.policies.process.box`), unless `trust` is set.

    Args:
        path: path of the .zip file.
        algorithm: "A2C", "DDPG", "PPO", "SAC" or "TD3".
        trust: load the file outside of a box, although loading may run code that is in it.
        deterministic: act with the mean of the model's distribution; False samples from it.

    Raises:
        LabgymError: the file is foreign and neither boxed nor trusted, or cannot be loaded.
        OptionError: the model was trained on other observations or actions.
        MissingDependencyError: stable-baselines3 is not installed.
    """

    name: ClassVar[str] = "sb3"

    def __init__(
        self, path: str | Path, algorithm: str = "PPO", trust: bool = False, deterministic: bool = True
    ) -> None:
        check_name("stable-baselines3 algorithm", algorithm, ALGORITHMS)
        self._path = checked_file(path)
        check_trust(self._path, trust, "stable-baselines3 archive", "stable-baselines3 unpickles parts of it")
        check_archive(self._path)
        self._algorithm, self._model = algorithm, _load(self._path, algorithm)
        if not isinstance(self._model.action_space, spaces.Box) or self._model.action_space.shape != (2,):
            raise OptionError(f"{path}: its action space is {self._model.action_space}, expected a Box of shape (2,)")
        self._deterministic, self._rng = deterministic, np.random.default_rng(0)
        self._keys, self._flat = _keys(self._model.observation_space, str(path))
        self.observation = sensors_for(self._keys, str(path))  # type: ignore[misc] # the file decides, not the class

    def reset(self, episode: EpisodeStart) -> None:
        """Store the episode's random generator."""
        self._rng = episode.rng

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the model's mean or sampled action, clipped.

        Raises:
            LabgymError: the model's output is not an action.
        """
        import torch

        inputs: Any = {key: np.asarray(observation[key]) for key in self._keys}
        if self._flat:
            inputs = np.concatenate([np.ravel(inputs[key]) for key in self._keys]).astype(np.float32)
        with torch.random.fork_rng(devices=[], enabled=not self._deterministic):
            if not self._deterministic:
                torch.manual_seed(int(self._rng.integers(2**62)))
            action, _ = self._model.predict(inputs, deterministic=self._deterministic)
        return checked_action(action, str(self._path))

    def parameters(self) -> Mapping[str, Any]:
        """Return the options; the file counts by its bytes."""
        return {"algorithm": self._algorithm, "deterministic": self._deterministic}

    def files(self) -> tuple[Path, ...]:
        """Return the model's file."""
        return (self._path,)


def _load(path: Path, algorithm: str) -> Any:
    with optional_package("stable-baselines3", f"policy {str(path)!r}", "train"):
        import stable_baselines3
    try:
        return getattr(stable_baselines3, algorithm).load(path, device="cpu")
    except Exception as error:
        reason = one_line(error, 160)
        raise LabgymError(f"policy {str(path)!r} is not a {algorithm} model of stable-baselines3 ({reason})") from error


def _keys(space: spaces.Space[Any], source: str) -> tuple[tuple[str, ...], bool]:
    """Return the observations that a model takes and whether it takes them as one vector."""
    if isinstance(space, spaces.Dict):
        for key, part in space.spaces.items():
            check_name(f"{source}: observation of the model", key, SHAPES)
            if part.shape not in SHAPES[key]:
                raise OptionError(f"{source}: {key} has shape {part.shape}, expected {SHAPES[key][0]}")
        return tuple(space.spaces), False
    for keys in FLAT.values():
        if space.shape == (sum(SHAPES[key][0][0] for key in keys),):
            return keys, True
    raise OptionError(f"{source}: its observation space is {str(space)[:80]}, expected that of LabPointNav-v0")
