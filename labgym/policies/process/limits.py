"""Limits of a policy's process."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from labgym.errors import OptionError


@dataclass(frozen=True)
class ProcessLimits:
    """Limits of a policy's process. A policy that exceeds one fails its episode; below them they affect no result.

    Attributes:
        call_seconds: longest time of one call of `reset` or `act`, seconds.
        load_seconds: longest time of importing and constructing the policy, seconds.
        memory_gb: largest memory of the process and its descendants in RAM, in units of 10^9 bytes.

    Raises:
        OptionError: a limit is not a positive number.
    """

    call_seconds: float = 120.0
    load_seconds: float = 600.0
    memory_gb: float = 8.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
                raise OptionError(f"policy limit {field.name} is {value!r}, expected a positive number")

    @property
    def memory_bytes(self) -> int:
        """Largest memory, bytes."""
        return int(self.memory_gb * 1e9)
