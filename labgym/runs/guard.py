"""Every call names the code and the data of its coordinator; a worker with others refuses it."""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from labgym.errors import LabgymError
from labgym.runs.code import code_digest

Digests = Mapping[str, Callable[[], str]]
"""Functions of modules, each of which returns a digest, by the name that a refusal prints."""


@dataclass(frozen=True)
class Guard:
    """The digests of the coordinator.

    Attributes:
        digests: name, function and the coordinator's digest.
    """

    digests: tuple[tuple[str, Callable[[], str], str], ...]

    @classmethod
    def of(cls, digests: Digests) -> Guard:
        """Return the guard of this process: its code and further digests."""
        functions: dict[str, Callable[[], str]] = {"code": code_digest, **digests}
        return cls(tuple((name, function, function()) for name, function in functions.items()))

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Return the result of a call if this process has the coordinator's digests.

        Raises:
            LabgymError: a digest differs.
        """
        for name, digest, expected in self.digests:
            if (own := digest()) != expected:
                raise LabgymError(
                    f"the worker on {socket.gethostname()} has another {name} (digest {own[:12]}, expected "
                    f"{expected[:12]}): install the same version of labgym and the same assets there"
                )
        return function(*arguments)
