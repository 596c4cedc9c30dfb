"""The compiled functions of this package: the same bits as the interpreted ones, sooner."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Kernels(NamedTuple):
    """The compiled functions: each has its arguments and results in its own module."""

    advance: Callable[..., None]
    before: Callable[..., NDArray[np.float32]]
    choice: Callable[..., int]
    follow: Callable[..., Array]
    located: Callable[..., tuple[float, float, float, float]]
    terms: Callable[..., tuple[Array, ...]]


@cache
def kernels() -> Kernels | None:
    """Return the compiled functions, None without numba, which the extra `fast` installs."""
    try:
        from labgym.policies.clairvoyant.reaction_kernel import choice, located
        from labgym.policies.clairvoyant.rehearsal_kernel import follow
        from labgym.policies.clairvoyant.schedule_kernel import advance
        from labgym.policies.clairvoyant.smoothing_kernel import terms
        from labgym.policies.clairvoyant.space_time_kernel import before
    except ImportError:
        return None
    return Kernels(advance, before, choice, follow, located, terms)
