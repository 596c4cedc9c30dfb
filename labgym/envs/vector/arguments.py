"""Arguments that the vector environments share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from labgym.counts import ENVIRONMENT_KB, MAX_STEPS, check_memory, whole_number
from labgym.envs.config import PointNavConfig
from labgym.errors import OptionError


class PointNavVectorEnv(VectorEnv[Any, Any, NDArray[Any]]):
    """Base of the vector environments on threads and in processes: their arguments, spaces and resets.

    Attributes:
        autoreset_mode: when an environment whose episode ended is reset.

    Args:
        num_envs: number of environments. config: of each.
        autoreset_mode: NEXT_STEP, SAME_STEP or DISABLED, as in Gymnasium.
        max_episode_steps: number of steps after which an episode is truncated; None for no limit.

    Raises:
        OptionError: a value is out of range.
    """

    def __init__(
        self,
        num_envs: int,
        config: PointNavConfig,
        autoreset_mode: AutoresetMode | str,
        max_episode_steps: int | None,
    ) -> None:
        self._limit = None if max_episode_steps is None else whole_number("max_episode_steps", max_episode_steps)
        self.autoreset_mode = mode_of(autoreset_mode)
        self.render_mode = config.render_mode
        modes = [] if config.render_mode is None else [config.render_mode]
        self.metadata = {"render_modes": modes, "render_fps": 10, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = spaces.Dict({sensor.name: sensor.space for sensor in config.observed})
        self.single_action_space = config.actions.space(config.robot)
        self.num_envs = environment_count(num_envs, self.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._begun = False
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)

    def _renewed(
        self, seed: int | Sequence[int | None] | None, options: Mapping[str, Any] | None
    ) -> tuple[list[int | None], NDArray[np.bool_], dict[str, Any]]:
        """Return the seeds, which environments a reset begins anew, and its other options.

        Raises:
            OptionError: a value does not fit; or before a first reset, the mask leaves out an environment.
        """
        seeds, (mask, others) = seeds_of(seed, self.num_envs), split_mask(options, self.num_envs)
        if not self._begun and not mask.all():
            raise OptionError("the first reset() begins the episodes of all environments: pass no reset_mask")
        return seeds, mask, others

    def _check_running(self) -> None:
        """Refuse a step before the first reset, or without autoreset in an environment that has ended.

        Raises:
            OptionError: `reset` is due.
        """
        if not self._begun:
            raise OptionError("call reset() before step()")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise OptionError(
                f"environment {int(self._ended.argmax())} has ended, and autoreset_mode DISABLED resets none: call "
                "reset(options={'reset_mask': terminated | truncated}) before step()"
            )


def kernel_has(config: PointNavConfig) -> bool:
    """Return whether the planar kernel has all parts of a configuration."""
    if config.physics != "planar":
        return False
    from labgym.envs.vector.env import check_kernel

    try:
        check_kernel(config)
    except OptionError:
        return False
    return True


def environment_count(number: object, space: spaces.Space[Any]) -> int:
    """Return the number of environments, after a check that they fit into memory.

    Args:
        number: of environments. space: of the observation of one.

    Raises:
        OptionError: not a whole number of at least 1, or too many for the memory of this machine.
    """
    count = whole_number("num_envs", number, most=MAX_STEPS)
    check_memory("num_envs", count, 1000 * ENVIRONMENT_KB + OBSERVATION_COPIES * space_bytes(space))
    return count


OBSERVATION_COPIES = 3
"""Observations of an environment in memory at a time: the current, the returned and the last one of an episode."""


def space_bytes(space: spaces.Space[Any]) -> int:
    """Return the bytes of an element of a space that consists of arrays."""
    if isinstance(space, spaces.Dict):
        return sum(space_bytes(each) for each in space.spaces.values())
    return math.prod(space.shape or ()) * np.dtype(space.dtype).itemsize


def mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return the autoreset mode that a value stands for.

    Raises:
        OptionError: not a mode of Gymnasium.
    """
    try:
        return AutoresetMode(mode)
    except ValueError:
        names = " or ".join(repr(each.value) for each in AutoresetMode)
        raise OptionError(f"autoreset_mode is {str(mode)[:40]!r}, expected {names}") from None


def split_mask(options: Mapping[str, Any] | None, count: int) -> tuple[NDArray[np.bool_], dict[str, Any]]:
    """Return which environments a reset begins anew, and its other options.

    Args:
        options: of the reset; "reset_mask", one truth value for each environment, chooses some, as in Gymnasium.

    Raises:
        OptionError: the mask has another shape or type, or chooses no environment.
    """
    others = dict(options or {})
    mask = others.pop("reset_mask", None)
    if mask is None:
        return np.ones(count, dtype=np.bool_), others
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (count,) or not mask.any():
        shown = " ".join(repr(mask).split())[:60]
        raise OptionError(f"reset_mask is {shown}, expected a NumPy array of {count} truth values, at least one True")
    return mask.copy(), others


def seeds_of(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """Return the seed of each environment.

    Args:
        seed: of the first environment, and those of the others follow; or one for each.

    Raises:
        OptionError: the number of seeds is not that of the environments.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, int | np.integer):
        return [int(seed) + row for row in range(count)]
    if len(seed) != count:
        raise OptionError(f"{len(seed)} seeds for {count} environments: pass one for each, or a single one")
    return list(seed)
