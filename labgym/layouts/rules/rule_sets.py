"""Rule sets: which rules a layout is judged by, with which thresholds, and which of them are hard."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from labgym.errors import UnknownNameError
from labgym.layouts.placement import WALL
from labgym.layouts.rules import facility, thresholds
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault, bounds_faults, support_faults
from labgym.layouts.rules.drives import ENTRIES, TRANSITIONS
from labgym.layouts.rules.equipment import REQUIREMENTS, Requirement, equipment_figures
from labgym.layouts.rules.facility.fronts import FRONTS
from labgym.layouts.rules.glass import GLASS, GLASS_ON_SURFACES
from labgym.layouts.rules.handling import FLAMMABLES, INCOMPATIBLES
from labgym.layouts.rules.nearness import NEAR, VENTILATED
from labgym.layouts.rules.reach import reach_figures
from labgym.layouts.rules.regulations.profiles import regulation_figures
from labgym.layouts.rules.rule import DriveRule, FacilityRule, Term, facility_figures
from labgym.layouts.rules.safety.rules import RULES as SAFETY
from labgym.layouts.rules.safety.signs import EXIT_SIGNS
from labgym.layouts.rules.separation import STORED_FLAMMABLES, STORED_INCOMPATIBLES
from labgym.layouts.rules.storage import STORED, STORED_BY_CLASS
from labgym.layouts.rules.thresholds import PROFILES, Profile
from labgym.layouts.rules.workflow import workflow_figures

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment


@dataclass(frozen=True)
class RuleSet:
    """Rules with their thresholds; everything that tells one assessment of a layout from another.

    Attributes:
        name: as in options and reports.
        summary: its purpose, in one sentence.
        bounds: each returns the objects of a layout that are out of bounds.
        terms: rules that are measured on instances.
        drives: drives of the robot that must be possible.
        paths: where the robot fits: `exact`, by the exact clearance, or `grid`, on a 5 cm grid.
        facility: facility rules in the order of reports.
        hard: names of the facility rules whose errors count in v(L).
        missing_is_hard: whether required assets and equipment that are missing count in v(L).
        equipment: safety equipment that a laboratory needs for what it holds.
        figures: each returns further fields of the report, which count neither in v(L) nor in F.
        proxy: version of the rules of the consistency proxy.
        profile: the thresholds.
        facility_in_cost: whether the optimizer also minimizes facility errors that do not count in v(L).
        tie_breakers: whether, of two layouts with equal v and F, the one with the better reach and the shorter walk is
            preferred. Off for benchmark splits.
    """

    name: str
    summary: str
    bounds: tuple[Callable[[Arrangement], Iterable[BoundsFault]], ...]
    terms: tuple[Term, ...]
    drives: tuple[DriveRule, ...]
    paths: Literal["exact", "grid"]
    facility: tuple[FacilityRule, ...]
    hard: frozenset[str] = frozenset()
    missing_is_hard: bool = False
    equipment: tuple[Requirement, ...] = ()
    figures: tuple[Callable[[Assessment], Mapping[str, Any]], ...] = ()
    proxy: Literal[1, 2] = 1
    profile: Profile = PROFILES["default"]
    facility_in_cost: bool = True
    tie_breakers: bool = False

    def without(self, term: str) -> RuleSet:
        """Return the rule set without a term."""
        return replace(self, terms=tuple(one for one in self.terms if one.name != term))

    @property
    def furnishing(self) -> RuleSet:
        """The rule set while furniture is arranged, without what hangs on walls and marks exits in the end.

        The furniture that will carry required equipment stands for it.
        """
        carried = (one for one in self.equipment if one.carrier != WALL)
        equipment = tuple(replace(one, accepted=one.accepted | {one.carrier}) for one in carried)
        return replace(self, equipment=equipment, facility=tuple(rule for rule in self.facility if rule != EXIT_SIGNS))

    def __reduce__(self) -> str | tuple[Any, ...]:
        """Return what pickle stores: the name of a rule set of the table, its thresholds and paths; workers get it."""
        if self.name in RULE_SETS and replace(RULE_SETS[self.name], profile=self.profile, paths=self.paths) == self:
            return _restored, (self.name, self.profile, self.paths)
        return super().__reduce__()


PAPER = RuleSet(
    name="paper",
    summary="the definitions of the LabBuilder paper's columns, as this project read them",
    bounds=(bounds_faults,),
    terms=(STORED_FLAMMABLES, STORED_INCOMPATIBLES, STORED, GLASS_ON_SURFACES),
    drives=(TRANSITIONS,),
    paths="grid",
    facility=(*facility.EXITS, *facility.PLACING, *facility.WAYS, *facility.HOODS, *facility.EMERGENCY),
)
TOUCHSTONE = RuleSet(
    name="touchstone",
    summary="everything that makes a laboratory safe and usable; a spoilt layout cannot pass",
    bounds=(bounds_faults, support_faults),
    terms=(FLAMMABLES, INCOMPATIBLES, STORED_BY_CLASS, GLASS, NEAR, VENTILATED, FRONTS),
    drives=(TRANSITIONS, ENTRIES),
    paths="exact",
    facility=(
        *facility.EXITS,
        *facility.PLACING,
        *facility.WAYS,
        *facility.HOODS,
        *(rule for rule in SAFETY if not rule.ways),
        *(rule for rule in SAFETY if rule.ways),
    ),
    hard=frozenset(
        {"egress", "door_area", "shower_clear", "exit_width", "no_exit", "second_exit", *(rule.name for rule in SAFETY)}
    ),
    missing_is_hard=True,
    equipment=REQUIREMENTS,
    figures=(equipment_figures, facility_figures, workflow_figures, reach_figures, regulation_figures),
    proxy=2,
)
RULE_SETS: dict[str, RuleSet] = {rules.name: rules for rules in (TOUCHSTONE, PAPER)}
"""The rule sets by name; the first is the default everywhere."""


def rule_set(rules: str | RuleSet = TOUCHSTONE, profile: str | Profile | None = None) -> RuleSet:
    """Return a rule set.

    Args:
        rules: its name, or the rule set itself.
        profile: thresholds to apply it with, or their name; by default its own.

    Raises:
        UnknownNameError: no rule set, or no profile, has that name.
    """
    if isinstance(rules, str) and rules not in RULE_SETS:
        raise UnknownNameError("rule set", rules, RULE_SETS)
    chosen = RULE_SETS[rules] if isinstance(rules, str) else rules
    limits = chosen.profile if profile is None else thresholds.profile(profile)
    return chosen if limits is chosen.profile else replace(chosen, profile=limits)


def _restored(name: str, profile: Profile, paths: Literal["exact", "grid"]) -> RuleSet:
    return replace(RULE_SETS[name], profile=profile, paths=paths)
