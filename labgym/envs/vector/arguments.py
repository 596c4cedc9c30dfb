"""Arguments that the vector environments share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

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
        OptionError: not NEXT_STEP or SAME_STEP.
    """
    modes = {each.value: each for each in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)}
    autoreset = modes.get(mode.value if isinstance(mode, AutoresetMode) else mode)
    if autoreset is None:
        raise OptionError(f"autoreset_mode is {str(mode)[:40]!r}, expected NEXT_STEP or SAME_STEP")
    return autoreset


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
