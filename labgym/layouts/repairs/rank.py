"""The order of layouts during a repair: nothing missing, fewer faults, wide ways, fewer warnings, a higher fitness."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from labgym.layouts.model import Layout
from labgym.layouts.rules.egress import MARGIN, narrow_ways
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol

DIGITS = 9
"""Decimals of the fitness that count."""


@dataclass(frozen=True, order=True)
class Rank:
    """How bad a layout is; less is better, the fields in their order.

    Attributes:
        missing: number of required assets that are not placed.
        cost: v(L) plus the number of facility errors.
        narrow: number of exits from which a way out is narrower than required, measured strictly: the rule lets ways
            pass that are up to 35 mm narrower, and pushes open doors aside. 0 without navigation.
        warnings: number of facility warnings.
        shortfall: 1 - F.
    """

    missing: int
    cost: int
    narrow: int
    warnings: int
    shortfall: float

    @classmethod
    def of(cls, assessment: Assessment) -> Rank:
        """Return the rank of a layout, given its assessment with navigation."""
        shortfall = round(1.0 - assessment.fitness, DIGITS)
        narrow = len(narrow_ways(assessment.arrangement, margin=MARGIN, leaves=True)) if assessment.navigation else 0
        return cls(len(assessment.missing or ()), assessment.cost, narrow, len(assessment.warnings), shortfall)

    def keeps(self, other: Rank) -> bool:
        """Whether ways are as wide, and warnings as few, as in another layout."""
        return self.narrow <= other.narrow and self.warnings <= other.warnings

    @property
    def sound(self) -> bool:
        """Whether the layout has no violation and no facility error, and nothing is missing."""
        return not self.missing and not self.cost


@dataclass(frozen=True)
class State:
    """A layout with its assessment, by default with navigation, and its rank."""

    layout: Layout
    assessment: Assessment
    protocol: Protocol | None
    navigation: bool = True

    @classmethod
    def of(cls, layout: Layout, protocol: Protocol | None, profile: str | Profile, navigation: bool = True) -> State:
        """Assess a layout; without navigation also all its later versions."""
        return cls(layout, evaluate_layout(layout, protocol, profile, navigation), protocol, navigation)

    def with_layout(self, layout: Layout) -> State:
        """Return the state of another version of the layout."""
        profile, earlier = self.assessment.profile, self.assessment
        assessment = evaluate_layout(layout, self.protocol, profile, self.navigation, earlier)
        return State(layout, assessment, self.protocol, self.navigation)

    @property
    def profile(self) -> Profile:
        """The thresholds."""
        return self.assessment.profile

    @cached_property
    def rank(self) -> Rank:
        """The rank of the layout."""
        return Rank.of(self.assessment)
