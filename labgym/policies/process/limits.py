"""Limits of a policy's process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from labgym.counts import is_finite
from labgym.errors import OptionError, UnknownNameError


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

    call_seconds: float = 300.0
    load_seconds: float = 600.0
    memory_gb: float = 8.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not is_finite(value) or value <= 0.0:
                raise OptionError(f"policy limit {field.name} is {value!r}, expected a positive number")

    @classmethod
    def named(cls, values: Mapping[str, Any]) -> ProcessLimits | None:
        """Return limits by name, the defaults for those that are missing; None if all are.

        Raises:
            UnknownNameError: no limit has that name.
            OptionError: a limit is not a positive number.
        """
        names = [field.name for field in fields(cls)]
        for name in values.keys() - set(names):
            raise UnknownNameError("policy limit", name, names)
        return cls(**values) if values else None

    @property
    def memory_bytes(self) -> int:
        """Largest memory, bytes."""
        return int(self.memory_gb * 1e9)
