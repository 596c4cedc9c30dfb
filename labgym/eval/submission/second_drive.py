"""The random part of a submission that is driven again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")
SHARE = 0.1
"""Share of the episodes of a large result that is driven again."""
FEWEST = 60
"""At least this many episodes are driven again: all of a smaller result."""
FORGED = 3
"""Number of forged rows whose probability to go unseen is stated."""


def drawn_again(keys: Sequence[T], seed: int) -> tuple[T, ...]:
    """Return the keys of the episodes that are driven again, in their order: a random tenth, but at least 60."""
    count = min(len(keys), max(FEWEST, math.ceil(SHARE * len(keys) - 1e-9)))
    chosen = np.random.default_rng(seed).choice(len(keys), size=count, replace=False)
    return tuple(keys[index] for index in sorted(chosen.tolist()))


def unseen(episodes: int, again: int, forged: int = FORGED) -> float:
    """Return the probability that none of some forged rows is among the episodes that are driven again.

    Args:
        episodes: number of all. again: number of those that are driven again. forged: number of forged rows.
    """
    forged = min(forged, episodes)
    return math.comb(episodes - forged, again) / math.comb(episodes, again)


def driven_again(again: int, episodes: int, policy: str, seed: int) -> str:
    """Return the sentence of a verdict on the episodes that were driven again."""
    if again == episodes:
        return f"all {again} episodes driven again with {policy!r}"
    chance = unseen(episodes, again)
    return (
        f"{again} of {episodes} episodes driven again with {policy!r}, chosen with --seed {seed}: {FORGED} forged rows "
        f"that pass the other checks go unseen with a probability of {100.0 * chance:.0f}%"
    )
