"""Arguments that the vector environments share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from labgym.counts import ENVIRONMENT_KB, MAX_STEPS, check_memory, whole_number
from labgym.errors import OptionError


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


def check_running(ended: NDArray[np.bool_]) -> None:
    """Refuse a step in which an environment has ended and was not reset, without autoreset.

    Args:
        ended: whether the episode of each environment has ended.

    Raises:
        OptionError: one has ended.
    """
    if ended.any():
        raise OptionError(
            f"environment {int(ended.argmax())} has ended, and autoreset_mode DISABLED resets none: call "
            "reset(options={'reset_mask': terminated | truncated}) before step()"
        )


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
