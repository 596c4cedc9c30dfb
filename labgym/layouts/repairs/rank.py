"""The order of layouts during a repair: nothing missing, fewer faults, wide ways, fewer warnings, a higher fitness."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, total_ordering

from labgym.layouts.adjust import WAYS, RepairBudget
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.model import Layout
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import MARGIN, blocked_places, narrow_exits
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol

DIGITS = 9
"""Decimals of the fitness that count."""
ORDER = ("missing", "cost", "narrow", "warnings", "shortfall")
"""Properties of a rank, the first one that differs decides."""


def narrowness(arrangement: Arrangement) -> int:
    """Return the number of exits whose ways out are too narrow, measured strictly, and of blocked places of work.

    The rule lets ways pass that are up to 35 mm narrower, pushes open doors aside, and does not consider places of work
    that lie in an obstacle.
    """
    return len(narrow_exits(arrangement, margin=MARGIN, leaves=True)) + len(blocked_places(arrangement))


def discouraged(assessment: Assessment, walks: bool = True) -> int:
    """Return the number of facility warnings; a hood that is nearer to a door than 1 m counts twice.

    Args:
        walks: whether walks to emergency showers count.
    """
    issues = [issue for issue in assessment.warnings if walks or issue.rule != "shower_walk"]
    at_doors = sum(issue.rule == "hood_door" and issue.limit == HOOD_DOOR_LEAST for issue in issues)
    return len(issues) + at_doors


@total_ordering
@dataclass(frozen=True, eq=False)
class Rank:
    """How bad an assessed layout is; less is better, the properties in their order.

    A comparison computes only the properties that decide it: ways and warnings take as long as all the rest.
    """

    assessment: Assessment

    @cached_property
    def missing(self) -> int:
        """Number of required assets that are not placed."""
        return len(self.assessment.lacking)

    @cached_property
    def cost(self) -> int:
        """v(L) plus the number of facility errors."""
        return self.assessment.cost

    @cached_property
    def narrow(self) -> int:
        """Narrow exits and blocked places of work, as `narrowness` counts them; 0 without navigation."""
        return narrowness(self.assessment.arrangement) if self.assessment.navigation else 0

    @cached_property
    def warnings(self) -> int:
        """Number of facility warnings, as `discouraged` counts them."""
        return discouraged(self.assessment)

    @cached_property
    def shortfall(self) -> float:
        """1 - F."""
        return round(1.0 - self.assessment.fitness, DIGITS)

    def __eq__(self, other: object) -> bool:
        """Whether all properties are equal."""
        return self._compared(other) == 0 if isinstance(other, Rank) else NotImplemented

    def __lt__(self, other: Rank) -> bool:
        """Whether the first property that differs is less."""
        return self._compared(other) < 0

    def __hash__(self) -> int:
        """Return a hash of the properties."""
        return hash(tuple(getattr(self, name) for name in ORDER))

    def __repr__(self) -> str:
        """Return the properties by name."""
        return f"Rank({', '.join(f'{name}={getattr(self, name):g}' for name in ORDER)})"

    def _compared(self, other: Rank) -> int:
        """Return -1, 0 or 1."""
        for name in ORDER if self is not other else ():
            own, others = getattr(self, name), getattr(other, name)
            if own != others:
                return -1 if own < others else 1
        return 0

    def keeps(self, other: Rank) -> bool:
        """Whether ways are as wide, and warnings as few, as in another layout."""
        return self.narrow <= other.narrow and self.warnings <= other.warnings

    def clears(self, other: Rank) -> bool:
        """Whether less is missing, the cost is lower or ways are wider than in another layout, in this order."""
        own = (self.missing, self.cost)
        return own < (other.missing, other.cost) or (own == (other.missing, other.cost) and self.narrow < other.narrow)

    @property
    def sound(self) -> bool:
        """Whether the layout has no violation and no facility error, and nothing is missing."""
        return not self.missing and not self.cost


@dataclass(frozen=True)
class RepairState:
    """A layout with its assessment, by default with navigation, and its rank.

    Every assessment of a later version is charged to the same work.

    Attributes:
        seeded: whether the layout is drawn by a seed, which must keep its layout: added objects then prefer the first
            furniture of the layout, as they did in the first version of the generator.
    """

    layout: Layout
    assessment: Assessment
    protocol: Protocol | None
    navigation: bool = True
    work: RepairBudget = field(default_factory=RepairBudget, compare=False)
    seeded: bool = False
    parts: dict[str, Assessment] = field(default_factory=dict, compare=False, repr=False)
    """The assessment of the last part of the layout that was assessed for another protocol."""

    @classmethod
    def of(
        cls,
        layout: Layout,
        protocol: Protocol | None,
        rules: str | RuleSet,
        navigation: bool = True,
        seeded: bool = False,
    ) -> RepairState:
        """Assess a layout; without navigation also all its later versions."""
        assessment = evaluate_layout(layout, protocol, rules, navigation)
        return cls(layout, assessment, protocol, navigation, seeded=seeded)

    def with_layout(self, layout: Layout) -> RepairState:
        """Return the state of another version of the layout."""
        rules, earlier = self.assessment.rules, self.assessment
        assessment = evaluate_layout(layout, self.protocol, rules, self.navigation, earlier)
        self.work.spend(assessment, 1 + WAYS if self.navigation else 1)
        return replace(self, layout=layout, assessment=assessment)

    def assessed(self, layout: Layout, protocol: Protocol | None) -> Assessment:
        """Return the assessment without ways of a version of the layout, or of a part of it."""
        earlier = self.assessment if protocol == self.protocol else self.parts.get("last", self.assessment)
        assessment = evaluate_layout(layout, protocol, self.assessment.rules, earlier=earlier)
        if protocol != self.protocol:
            self.parts["last"] = assessment
        self.work.spend(assessment)
        return assessment

    def with_layout_at_most(self, layout: Layout, cost: int) -> RepairState | None:
        """Return the state of another version of the layout, None if its cost exceeds a limit even without ways.

        Ways take most of the time of an assessment; they are not planned for versions above the limit.
        """
        assessment = self.assessed(layout, self.protocol)
        if assessment.cost > cost:
            return None
        if self.navigation:
            assessment = assessment.with_navigation(self.assessment)
            self.work.spend(assessment, WAYS)
        return replace(self, layout=layout, assessment=assessment)

    @property
    def profile(self) -> Profile:
        """The thresholds."""
        return self.assessment.profile

    @cached_property
    def rank(self) -> Rank:
        """The rank of the layout."""
        return Rank(self.assessment)
