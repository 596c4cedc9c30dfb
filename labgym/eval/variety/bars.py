"""The bars of a split: what its figures must reach so that the benchmark cannot be learned by heart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from labgym.eval.variety.figures import GroupFigures

BLIND_FLOORS = 90
"""Number of other floors whose furniture the blind policies know."""


@dataclass(frozen=True)
class Bar:
    """A limit and the value of a split.

    Attributes:
        name: what is limited.
        value: the split's value; None without one.
        limit: the limit. relation: how the value must relate to it.
        digits: decimals that are printed.
    """

    name: str
    value: float | None
    limit: float
    relation: Literal[">=", "<", "="]
    digits: int = 2

    @property
    def reached(self) -> bool:
        """Whether the value is on the right side of the limit."""
        if self.value is None:
            return False
        return {">=": self.value >= self.limit, "<": self.value < self.limit, "=": self.value == self.limit}[
            self.relation
        ]


def bars(figures: GroupFigures) -> tuple[Bar, ...]:
    """Return the bars of a split with its values."""
    episodes = figures.accepted
    return (
        Bar("median length of the shortest path, m", episodes.length, 8.0, ">="),
        Bar("share of episodes with a detour of at least 1.1", episodes.detour_1, 0.60, ">="),
        Bar("share of episodes with a detour of at least 1.3", episodes.detour_3, 0.30, ">="),
        Bar("share of episodes whose widest way is under 0.90 m", episodes.widest_neck, 0.30, ">="),
        Bar("episodes under 2 m", float(episodes.short), 0.0, "=", 0),
        Bar("share of episodes driven blind, by the mean of other floors", episodes.blind, 0.40, "<"),
        Bar("share of episodes driven blind, by distance from walls", episodes.blind_walls, 0.40, "<"),
        Bar("overlap of furniture of two floors of a family", figures.overlap, 0.45, "<"),
        Bar("share of hoods on the rarest wall", figures.rarest_wall, 0.10, ">="),
    )
