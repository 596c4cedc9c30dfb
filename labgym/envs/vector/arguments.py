"""Arguments that the vector environments share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from gymnasium.vector import AutoresetMode

from labgym.errors import OptionError


def whole(name: str, number: object) -> int:
    """Return a whole number of at least 1.

    Raises:
        OptionError: it is something else.
    """
    if isinstance(number, bool) or not isinstance(number, int | np.integer) or number < 1:
        raise OptionError(f"{name} is {number!r}, expected a whole number of at least 1")
    return int(number)


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
