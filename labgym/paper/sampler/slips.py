"""Decides which errors are made, each with a separate random number."""

from __future__ import annotations

import hashlib
from collections import Counter
from zlib import crc32

import numpy as np

from labgym.layouts.request import Request
from labgym.paper.sampler.rates import Rates

STREAM = 0x5A
"""Sub-stream of the seed from which the sampler draws."""


class Slips:
    """The errors of one proposal.

    Every decision has a separate random number, drawn from the seed, the protocols, the kind of error and what it
    concerns. A higher rate therefore keeps the errors of a lower one and adds others, and the rates of two kinds do not
    influence each other's draws.

    Attributes:
        counts: number of errors made so far by kind.
    """

    def __init__(self, request: Request, rates: Rates) -> None:
        digest = hashlib.sha256(request.protocol.id.encode()).digest()[:8]
        self.rates = rates
        self.counts: Counter[str] = Counter()
        self._entropy = [request.seed, STREAM, int.from_bytes(digest, "big")]

    def generator(self, kind: str, subject: str, draw: int = 0) -> np.random.Generator:
        """Return the random numbers of one decision."""
        return np.random.default_rng([*self._entropy, crc32(kind.encode()), crc32(subject.encode()), draw])

    def happens(self, kind: str, subject: str) -> bool:
        """Decide whether an error is made, and count it if so.

        Args:
            kind: field of `Rates`.
            subject: what the error would concern: the id of a piece, the name of a reagent.
        """
        rate: float = getattr(self.rates, kind)
        happens = float(self.generator(kind, subject).random()) < rate
        self.counts[kind] += happens
        return happens

    def between(self, kind: str, subject: str, limits: tuple[float, float]) -> float:
        """Return the size of an error, between two limits."""
        return float(self.generator(kind, subject, 1).uniform(*limits))

    def choice(self, kind: str, subject: str, count: int) -> int:
        """Return which of several an error takes, 0 to count - 1."""
        return int(self.generator(kind, subject, 2).integers(count))


def errors_of(slips: Slips) -> dict[str, int]:
    """Return the number of errors by kind, for the kinds that occurred."""
    return {kind: count for kind, count in sorted(slips.counts.items()) if count}
