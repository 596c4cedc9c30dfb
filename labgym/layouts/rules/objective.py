"""The assessment of a layout: every rule of a rule set computed once, for the optimizer and the score."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

from labgym.layouts.model import Layout
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault
from labgym.layouts.rules.collisions import Collision, collisions
from labgym.layouts.rules.earlier import StateChanges
from labgym.layouts.rules.equipment import Requirement, missing_equipment, required_equipment
from labgym.layouts.rules.reach import ItemReach, item_reaches
from labgym.layouts.rules.regulations.premises import Premises
from labgym.layouts.rules.rule import FacilityIssue, FacilityRule, Instance, Term, penalised
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet, rule_set
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.violations import (
    Violations,
    bounds_violations,
    collision_violations,
    facility_violation,
    missing_violations,
    navigation_violations,
    term_violations,
)
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.layouts.rules.workflow import Workflow, walking_distance
from labgym.navigation.feasibility import FreePositions, Leg, Transition, judge_legs
from labgym.navigation.occupancy import occupancy
from labgym.navigation.plan import OBSTACLE_HEIGHT
from labgym.navigation.visibility import ShortestPaths
from labgym.protocols import Protocol

GEOMETRY_WEIGHT = 0.5
CHEMISTRY_WEIGHT = 0.5
"""Weights of F; the paper leaves them open."""

Kept = TypeVar("Kept")
Drives = Mapping[str, tuple[Transition, ...]]
"""Verdicts on drives, by the name of their rule."""


@dataclass(frozen=True)
class Assessment:
    """All rules of one layout under one rule set.

    Attributes:
        site: the layout as the rules read it, with the protocol that it is assessed for.
        measured: instances of each term by its name, the geometry penalty applied.
        driven: verdicts on the drives; None without navigation or without a protocol.
        navigation: whether ways were evaluated: the drives of the robot, ways out, walks of people.
    """

    rules: RuleSet
    site: Site
    bounds: tuple[BoundsFault, ...]
    collisions: tuple[Collision, ...]
    measured: Mapping[str, tuple[Instance, ...]]
    driven: Drives | None = None
    navigation: bool = False
    _issues: dict[str, tuple[FacilityIssue, ...]] = field(default_factory=dict, compare=False, repr=False)
    """Issues that have been computed, by rule. They do not depend on `navigation`."""
    _errors: dict[str, list[tuple[str, ...]]] = field(default_factory=dict, compare=False, repr=False)
    """Objects of the errors of rules that tell them without messages, as far as computed."""
    _instances: Mapping[str, tuple[Instance, ...]] = field(default_factory=dict, compare=False, repr=False)
    """Instances of each term without the geometry penalty."""

    @property
    def arrangement(self) -> Arrangement:
        """The layout's objects as arrays."""
        return self.site.arrangement

    @property
    def protocol(self) -> Protocol | None:
        """The protocol that the layout is assessed for."""
        return self.site.protocol

    @property
    def profile(self) -> Profile:
        """The thresholds."""
        return self.rules.profile

    @cached_property
    def out_of_bounds(self) -> frozenset[str]:
        """Ids of the objects that are out of bounds."""
        return frozenset(fault.id for fault in self.bounds)

    @cached_property
    def faulty(self) -> frozenset[str]:
        """Ids of the objects that are out of bounds or collide."""
        return self.out_of_bounds.union(*(collision.ids for collision in self.collisions))

    @cached_property
    def blocked(self) -> frozenset[str]:
        """Ids of the objects without a separate fault that cannot be used: their front is blocked."""
        terms = (term.name for term in self.rules.terms if term.lowers == "geometry")
        return frozenset(one.ids[0] for term in terms for one in self.measured[term] if one.hard)

    def of(self, term: str) -> tuple[Instance, ...]:
        """Return the instances of a term; empty if the rule set does not have it."""
        return self.measured.get(term, ())

    @cached_property
    def instances(self) -> tuple[Instance, ...]:
        """All instances of the terms whose mean satisfaction is half of F: chemistry and the protocol's constraints."""
        terms = (term.name for term in self.rules.terms if term.lowers == "satisfaction")
        return tuple(one for term in terms for one in self.measured[term])

    @cached_property
    def missing(self) -> tuple[str, ...] | None:
        """Assets that the protocol requires and that are not placed in bounds; None without a protocol."""
        if self.protocol is None:
            return None
        return missing_assets(self.arrangement, self.protocol, self.out_of_bounds)

    @cached_property
    def equipment(self) -> tuple[Requirement, ...]:
        """The safety equipment that is required."""
        return required_equipment(self.arrangement, self.protocol, self.rules.equipment)

    @cached_property
    def unequipped(self) -> tuple[str, ...]:
        """Safety equipment that is required and missing, as assets to add."""
        return missing_equipment(self.arrangement, self.equipment, self.out_of_bounds)

    @property
    def lacking(self) -> tuple[str, ...]:
        """Assets and safety equipment that are required and not placed."""
        return (*(self.missing or ()), *self.unequipped)

    @property
    def transitions(self) -> tuple[Transition, ...] | None:
        """The protocol's transitions; None without navigation or without a protocol."""
        return None if self.driven is None else self.driven["transitions"]

    @property
    def unreached(self) -> tuple[Transition, ...]:
        """The infeasible transitions of the protocol; empty without navigation or without a protocol."""
        return tuple(transition for transition in self.transitions or () if not transition.feasible)

    def drives_of(self, rule: str) -> tuple[Transition, ...]:
        """Return the verdicts on the drives of a rule; empty without navigation or without a protocol."""
        return () if self.driven is None else self.driven.get(rule, ())

    @cached_property
    def drives(self) -> tuple[Transition, ...]:
        """All drives that count in v(L); empty without navigation."""
        return () if self.driven is None else tuple(drive for own in self.driven.values() for drive in own)

    @cached_property
    def v(self) -> int:
        """Number of hard violations.

        OB + CN + hard instances of terms + infeasible drives + errors of hard facility rules + missing assets and
        safety equipment if the rule set counts them.
        """
        instances = sum(one.hard for own in self.measured.values() for one in own)
        infeasible = sum(not drive.feasible for drive in self.drives)
        missing = len(self.lacking) if self.rules.missing_is_hard else 0
        broken = sum(len(self._broken(rule)) for rule in self._hard_rules)
        return len(self.out_of_bounds) + len(self.collisions) + instances + infeasible + missing + broken

    @cached_property
    def fitness(self) -> float:
        """F in [0, 1]: half the share of objects in no violation, half the mean satisfaction."""
        count, instances = len(self.arrangement), self.instances
        geometry = 1.0 - len(self.faulty | self.blocked) / count if count else 1.0
        chemistry = sum(instance.satisfaction for instance in instances) / len(instances) if instances else 1.0
        return GEOMETRY_WEIGHT * geometry + CHEMISTRY_WEIGHT * chemistry

    @cached_property
    def violations(self) -> Violations:
        """The hard violations, described; as many as `v`."""
        return Violations(
            (
                *bounds_violations(self.arrangement, self.bounds),
                *collision_violations(self.collisions),
                *(found for term in self.rules.terms for found in term_violations(term, self.measured[term.name])),
                *missing_violations(self.lacking if self.rules.missing_is_hard else ()),
                *navigation_violations(self.arrangement, self.drives),
                *(facility_violation(issue) for issue in self.hard_issues),
            )
        )

    def issues_of(self, rule: FacilityRule) -> tuple[FacilityIssue, ...]:
        """Return the issues of a facility rule."""
        if rule.name not in self._issues:
            self._issues[rule.name] = tuple(rule.issues(self.site))
        return self._issues[rule.name]

    @cached_property
    def issues(self) -> tuple[FacilityIssue, ...]:
        """Every facility rule that the layout breaks, fixed objects included."""
        return tuple(issue for rule in self.rules.facility for issue in self.issues_of(rule))

    @cached_property
    def hard_issues(self) -> tuple[FacilityIssue, ...]:
        """Errors of hard facility rules: the building first, then ways if there is navigation."""
        issues = (issue for rule in self._hard_rules for issue in self.issues_of(rule))
        return tuple(issue for issue in issues if issue.severity == "error")

    @cached_property
    def errors(self) -> tuple[FacilityIssue, ...]:
        """Facility errors that the generator and the optimizer never leave behind; ways out only with navigation.

        Issues that concern fixed objects alone are left out: nothing can be moved. Empty if the rule set leaves
        facility errors out of the cost.
        """
        issues = (issue for rule in self._placing_rules for issue in self.issues_of(rule))
        return tuple(issue for issue in issues if issue.severity == "error" and not self._fixed.issuperset(issue.ids))

    @cached_property
    def warnings(self) -> tuple[FacilityIssue, ...]:
        """Rules on placing that are advice, as far as objects can be moved to follow them: not the number of exits."""
        rules = (rule for rule in self.rules.facility if rule.group == "placing" and not rule.ways)
        return tuple(issue for rule in rules for issue in self.issues_of(rule) if issue.severity == "warning")

    @cached_property
    def advice(self) -> tuple[FacilityIssue, ...]:
        """Every rule that is advice and that moved objects may follow; walks only with navigation."""
        rules = (rule for rule in self.rules.facility if rule.group == "safety" and (self.navigation or not rule.ways))
        safety = (issue for rule in rules for issue in self.issues_of(rule) if issue.severity == "warning")
        return (*self.warnings, *safety)

    @cached_property
    def cost(self) -> int:
        """v(L) plus the facility errors that v(L) does not contain: the quantity that the optimizer minimizes."""
        terms = {term.name for term in self.rules.terms}
        rules = (rule for rule in self._placing_rules if rule.name not in self.rules.hard and rule.term not in terms)
        return self.v + sum(not self._fixed.issuperset(ids) for rule in rules for ids in self._broken(rule))

    def _broken(self, rule: FacilityRule) -> list[tuple[str, ...]]:
        """Return the objects of each error of a rule, without its message if that is faster."""
        if rule.broken is not None and rule.name not in self._issues:
            if rule.name not in self._errors:
                self._errors[rule.name] = rule.broken(self.site)
            return self._errors[rule.name]
        return [issue.ids for issue in self.issues_of(rule) if issue.severity == "error"]

    @cached_property
    def _hard_rules(self) -> list[FacilityRule]:
        hard = [rule for rule in self.rules.facility if rule.name in self.rules.hard and rule.severity == "error"]
        building = [rule for rule in hard if rule.group == "building"]
        ways = [rule for rule in hard if rule.ways and self.navigation]
        return [*building, *ways, *(rule for rule in hard if rule.group != "building" and not rule.ways)]

    @cached_property
    def _placing_rules(self) -> list[FacilityRule]:
        """Rules whose errors the optimizer minimizes."""
        if not self.rules.facility_in_cost:
            return []
        placing = (rule for rule in self.rules.facility if rule.group == "placing" and rule.severity == "error")
        return [rule for rule in placing if self.navigation or not rule.ways]

    @cached_property
    def _fixed(self) -> frozenset[str]:
        return frozenset(placement.id for placement in self.arrangement.placements if placement.fixed)

    @cached_property
    def facility(self) -> dict[str, float]:
        """Share of the objects that keep each facility rule, in [0, 1]; only rules that apply to something."""
        shares = {rule.name: rule.share(self.site, self.issues_of(rule)) for rule in self.rules.facility}
        return {name: share for name, share in shares.items() if share is not None}

    @property
    def facility_score(self) -> float | None:
        """Mean share over the facility rules that apply, None if none does."""
        return math.fsum(self.facility.values()) / len(self.facility) if self.facility else None

    @cached_property
    def premises(self) -> Premises:
        """The walks of people, for the workflow and for regulations."""
        return Premises(self.arrangement)

    @cached_property
    def workflow(self) -> Workflow | None:
        """The walks of the protocol's workflow; None without a protocol."""
        return None if self.protocol is None else walking_distance(self.arrangement, self.protocol, self.premises)

    @cached_property
    def reaches(self) -> tuple[ItemReach, ...]:
        """Whether an arm reaches each item that a step uses; empty without a protocol."""
        return () if self.protocol is None else item_reaches(self.arrangement, self.protocol)

    @property
    def reach(self) -> float | None:
        """Share of the items that are in reach, None without any."""
        return sum(item.reached for item in self.reaches) / len(self.reaches) if self.reaches else None

    @property
    def perfect(self) -> bool:
        """Whether nothing can be improved: full fitness and no fault; with tie-breakers a shorter walk always can."""
        return not self.cost and self.fitness > 1.0 - 1e-9 and not self.errors and not self.rules.tie_breakers

    def better_than(self, other: Assessment) -> bool:
        """Whether to accept this layout over another: a lower cost, or the same cost and a higher fitness.

        With the rule set's tie-breakers, of equal ones a better reach, then a shorter walk wins.
        """
        if self.cost != other.cost:
            return self.cost < other.cost
        if abs(self.fitness - other.fitness) > 1e-12:
            return self.fitness > other.fitness
        if not self.rules.tie_breakers:
            return False
        own, others = self._tie, other._tie
        return own[0] > others[0] + 1e-12 or (own[0] > others[0] - 1e-12 and own[1] < others[1] - 1e-6)

    @property
    def _tie(self) -> tuple[float, float]:
        walk = math.inf if self.workflow is None or self.workflow.length is None else self.workflow.length
        return self.reach or 0.0, walk

    def with_navigation(self, earlier: Assessment | None = None) -> Assessment:
        """Return the assessment with navigation, as `evaluate_layout(..., navigation=True)`; the rest is kept.

        Args:
            earlier: as in `evaluate_layout`.
        """
        if self.navigation:
            return self
        return replace(self, driven=judged_drives(self.rules, self.site, earlier), navigation=True)


def evaluate_layout(
    layout: Layout,
    protocol: Protocol | None = None,
    rules: str | RuleSet = TOUCHSTONE,
    navigation: bool = False,
    earlier: Assessment | None = None,
) -> Assessment:
    """Apply every rule of a rule set to a layout.

    Args:
        layout: the layout.
        protocol: required assets and drives; None leaves both out.
        rules: a rule set or its name: `touchstone` or `paper`; other thresholds as in `rule_set("touchstone", "code")`.
        navigation: whether to plan the protocol's drives and check ways out, which takes as long as all the rest.
        earlier: assessment of another state of the layout, from which everything is taken over that depends on nothing
            that has changed. It changes no result.

    Raises:
        UnknownNameError: the rule set, an asset or a support does not exist.
    """
    rules = rule_set(rules)
    arrangement = Arrangement.of(layout, None if earlier is None else earlier.arrangement)
    site = Site(arrangement, protocol, rules.profile)
    changes = None if earlier is None or earlier.rules != rules else StateChanges.between(earlier.site, site)

    def unchanged(results: Mapping[str, Kept], judged: Sequence[Term | FacilityRule]) -> dict[str, Kept]:
        """Return the earlier results of rules that look at nothing that has changed."""
        if changes is None:
            return {}
        rules = [rule for rule in judged if rule.name in results and not changes.concern(rule.looks_at)]
        return {rule.name: results[rule.name] for rule in rules}

    bounds = tuple(fault for check in rules.bounds for fault in check(arrangement))
    same = {} if earlier is None else unchanged(earlier._instances, rules.terms)
    instances = {
        term.name: same[term.name] if term.name in same else tuple(term.instances(site)) for term in rules.terms
    }
    basis = Assessment(
        rules,
        site,
        bounds,
        collisions(arrangement),
        instances,
        navigation=navigation,
        _issues={} if earlier is None else unchanged(earlier._issues, rules.facility),
        _errors={} if earlier is None else unchanged(earlier._errors, rules.facility),
        _instances=instances,
    )
    voided = {"faulty": basis.faulty, "unusable": basis.faulty | basis.blocked}
    measured = {
        term.name: penalised(own, voided[term.void]) if term.lowers == "satisfaction" else own
        for term, own in zip(rules.terms, instances.values(), strict=True)
    }
    driven = judged_drives(rules, site, earlier) if navigation else None
    return replace(basis, measured=measured, driven=driven)


def judged_drives(rules: RuleSet, site: Site, earlier: Assessment | None = None) -> Drives | None:
    """Judge the drives of a rule set; None without a protocol.

    Args:
        earlier: as in `evaluate_layout`.
    """
    if site.protocol is None:
        return None
    layout = site.arrangement.layout
    legs: dict[str, list[Leg]] = {rule.name: rule.legs(site) for rule in rules.drives}
    if earlier is not None and earlier.driven is not None and _unmoved(layout, earlier.arrangement.layout):
        if legs == {name: [drive.leg for drive in own] for name, own in earlier.driven.items()}:
            return earlier.driven
    spaces = {radius: _free_positions(rules, layout, radius) for radius in {rule.radius for rule in rules.drives}}
    return {rule.name: judge_legs(layout, legs[rule.name], spaces[rule.radius]) for rule in rules.drives}


def _free_positions(rules: RuleSet, layout: Layout, radius: float) -> FreePositions:
    return occupancy(layout).dilated(radius) if rules.paths == "grid" else ShortestPaths(layout, radius)


def _unmoved(layout: Layout, other: Layout) -> bool:
    """Whether the robot meets the same floor and the same obstacles in two layouts."""
    if other.floor is not layout.floor:
        return False
    return list(other.obstacles(OBSTACLE_HEIGHT)) == list(layout.obstacles(OBSTACLE_HEIGHT))
