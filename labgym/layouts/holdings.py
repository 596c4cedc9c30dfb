"""Holdings: the pieces of each asset that exist, and the purchases that are allowed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

Purchases = Literal["none", "required", "any"]
"""What may be bought: nothing, what protocols and safety require, or also what makes the laboratory fuller."""


@dataclass(frozen=True)
class Holdings:
    """The pieces that exist, and what may be bought.

    Attributes:
        counts: number of pieces by asset name.
        purchases: what may be bought beyond them.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    purchases: Purchases = "required"

    def including(self, standing: Iterable[str]) -> Holdings:
        """Return the same holdings with pieces that certainly exist, listed or not: the asset of each."""
        counts = dict(self.counts)
        for name, count in Counter(standing).items():
            counts[name] = max(counts.get(name, 0), count)
        return Holdings(counts, self.purchases)

    def missing(self, placed: Iterable[str]) -> dict[str, int]:
        """Return how many pieces of each asset must be bought for some pieces, by asset name.

        Args:
            placed: the asset of each piece.
        """
        counts = Counter(placed)
        lacks = {name: count - self.counts.get(name, 0) for name, count in sorted(counts.items())}
        return {name: lack for name, lack in lacks.items() if lack > 0}

    def left(self, placed: Iterable[str]) -> dict[str, int]:
        """Return how many pieces of each asset exist beyond some pieces, by asset name."""
        counts = Counter(placed)
        rest = {name: count - counts[name] for name, count in sorted(self.counts.items())}
        return {name: count for name, count in rest.items() if count > 0}

    def adds(self, name: str, placed: Iterable[str]) -> bool:
        """Return whether one more piece of an asset, which nothing requires, may be placed besides some pieces."""
        return self.purchases == "any" or sum(each == name for each in placed) < self.counts.get(name, 0)

    def equips(self, name: str, placed: Iterable[str]) -> bool:
        """Return whether one more piece of equipment, which safety requires, may be placed besides some pieces."""
        return self.purchases != "none" or self.adds(name, placed)
