"""Statistics of protocols: numbers of reagents, instruments, steps and moves (table 1 of the paper)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from labgym.errors import OptionError
from labgym.protocols.model import Protocol


@dataclass(frozen=True)
class Summary:
    """Mean, minimum, maximum and sample standard deviation (n - 1; 0 for a single value) of a count."""

    mean: float
    minimum: int
    maximum: int
    deviation: float


@dataclass(frozen=True)
class Statistics:
    """Summaries over a set of protocols; a move is a change of location between two steps."""

    count: int
    reagents: Summary
    instruments: Summary
    steps: Summary
    moves: Summary


def statistics(protocols: Iterable[Protocol]) -> Statistics:
    """Return the statistics of protocols.

    Raises:
        OptionError: no protocols.
    """
    chosen = list(protocols)
    if not chosen:
        raise OptionError("statistics need at least one protocol, got none")
    return Statistics(
        count=len(chosen),
        reagents=_summary([len(protocol.reagents) for protocol in chosen]),
        instruments=_summary([len(protocol.instruments) for protocol in chosen]),
        steps=_summary([len(protocol.steps) for protocol in chosen]),
        moves=_summary([protocol.moves for protocol in chosen]),
    )


def _summary(values: list[int]) -> Summary:
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return Summary(float(np.mean(values)), min(values), max(values), deviation)
