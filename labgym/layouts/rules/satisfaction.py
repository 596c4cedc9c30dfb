"""How well one instance of a chemical rule is met, and how instances make a score."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.layouts.rules.thresholds import WORST


@dataclass(frozen=True)
class Instance:
    """One instance of a chemical rule: a pair to keep apart, a reagent to store, glassware to keep from the edge.

    Attributes:
        ids: placements that take part.
        distance: what the rule measures, meters; None for storage.
        limit: the distance under which the satisfaction is 0 (d_low), meters; 0 without a limit.
        satisfaction: in [0, 1]; 0 if a participant is out of bounds or collides.
        hard: whether it counts in v(L): a pair under d_low, a reagent that is not stored.
        note: hazard or reason, for messages.
    """

    rule: str
    ids: tuple[str, ...]
    distance: float | None
    limit: float
    satisfaction: float
    hard: bool
    note: str = ""


def penalised(instances: Sequence[Instance], faulty: frozenset[str]) -> tuple[Instance, ...]:
    """Apply the geometry penalty: an instance with a participant in `faulty` scores 0."""
    return tuple(
        instance if faulty.isdisjoint(instance.ids) else replace(instance, satisfaction=0.0) for instance in instances
    )


def mean(instances: Sequence[Instance]) -> float | None:
    """Return the mean satisfaction, None without instances."""
    return sum(instance.satisfaction for instance in instances) / len(instances) if instances else None


def worst_mean(instances: Sequence[Instance], worst: int = WORST) -> float | None:
    """Return the mean of the worst few satisfactions, None without instances."""
    lowest = sorted(instance.satisfaction for instance in instances)[:worst]
    return sum(lowest) / len(lowest) if lowest else None
