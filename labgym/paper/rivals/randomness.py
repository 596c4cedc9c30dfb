"""Random numbers of a request, and the ids that fixed objects use."""

from __future__ import annotations

import hashlib
from collections import Counter

import numpy as np

from labgym.layouts.request import Request


def generator_of(request: Request, stream: int) -> np.random.Generator:
    """Return the random generator of a request's seed, its protocol and a sub-stream."""
    entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
    return np.random.default_rng([request.seed, entropy, stream])


def numbers_in_use(request: Request) -> Counter[str]:
    """Return the greatest number in the ids of fixed objects, by asset: LabBench_2 uses the numbers up to 2."""
    counts: Counter[str] = Counter()
    for placement in request.fixed:
        name, _, number = placement.id.rpartition("_")
        if number.isdecimal():
            counts[name] = max(counts[name], int(number))
    return counts
