"""Limits of a policy's process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from labgym.errors import UnknownNameError
from labgym.policies.options import PolicyOptions

Limit = Annotated[float, Field(gt=0.0, strict=True)]


class ProcessLimits(PolicyOptions):
    """Limits of a policy's process. A policy that exceeds one fails its episode; below them they affect no result.

    Attributes:
        call_seconds: longest time of one call of `reset` or `act`, seconds.
        load_seconds: longest time of importing and constructing the policy, seconds.
        memory_gb: largest memory of the process and its descendants in RAM, in units of 10^9 bytes.

    Raises:
        OptionError: a limit is not a positive number.
    """

    call_seconds: Limit = 300.0
    load_seconds: Limit = 600.0
    memory_gb: Limit = 8.0

    @classmethod
    def named(cls, values: Mapping[str, Any]) -> ProcessLimits | None:
        """Return limits by name, the defaults for those that are missing; None if all are.

        Raises:
            UnknownNameError: no limit has that name.
            OptionError: a limit is not a positive number.
        """
        for name in values.keys() - cls.model_fields.keys():
            raise UnknownNameError("policy limit", name, cls.model_fields)
        return cls(**values) if values else None

    @property
    def memory_bytes(self) -> int:
        """Largest memory, bytes."""
        return int(self.memory_gb * 1e9)
