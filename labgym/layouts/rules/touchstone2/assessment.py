"""The assessment of a layout under touchstone-v2: v, F and everything behind them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

from labgym.layouts.rules.bounds import BoundsFault
from labgym.layouts.rules.facility import FacilityIssue
from labgym.layouts.rules.facility.exits import building_exit_issues
from labgym.layouts.rules.facility.hoods import hood_issues
from labgym.layouts.rules.objective import CHEMISTRY_WEIGHT, GEOMETRY_WEIGHT, Assessment
from labgym.layouts.rules.presence import missing_assets
from labgym.layouts.rules.regulations.premises import Premises
from labgym.layouts.rules.safety.rules import safety_issues
from labgym.layouts.rules.safety.site import Site
from labgym.layouts.rules.satisfaction import Instance, penalised
from labgym.layouts.rules.touchstone2.entries import entry_legs
from labgym.layouts.rules.touchstone2.equipment import Requirement, missing_equipment, required_equipment
from labgym.layouts.rules.touchstone2.facility_score import FacilityScore, facility_score, is_hard
from labgym.layouts.rules.touchstone2.fronts import front_instances
from labgym.layouts.rules.touchstone2.glassware import all_glass_instances
from labgym.layouts.rules.touchstone2.handling import flammable_handling, incompatible_handling
from labgym.layouts.rules.touchstone2.nearness import near_instances
from labgym.layouts.rules.touchstone2.reach import ItemReach, item_reaches
from labgym.layouts.rules.touchstone2.storage import class_instances
from labgym.layouts.rules.touchstone2.supports import support_faults
from labgym.layouts.rules.touchstone2.ventilation import ventilation_instances
from labgym.layouts.rules.touchstone2.workflow import Workflow, walking_distance
from labgym.layouts.rules.violations import (
    Violation,
    Violations,
    bounds_violations,
    chemical_violations,
    collision_violations,
    navigation_violations,
)
from labgym.navigation.feasibility import Leg, Transition, judge_legs, legs
from labgym.navigation.plan import OBSTACLE_HEIGHT
from labgym.navigation.visibility import ShortestPaths
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Assessment2(Assessment):
    """All rules of one layout under touchstone-v2.

    Attributes:
        site: the layout as the safety rules read it.
        protocol: the protocol that the layout is assessed for.
        near, ventilation: instances of the protocol's constraints; empty without a protocol.
        fronts: instances of the rule on free fronts; they count in v and in the geometric half of F.
        equipment: the safety equipment that is required. unequipped: what of it is missing, as assets to add.
        entries: drives from doors to the first location of their room; None without navigation or a protocol.
    """

    site: Site = field(kw_only=True)
    protocol: Protocol | None = None
    near: tuple[Instance, ...] = ()
    ventilation: tuple[Instance, ...] = ()
    fronts: tuple[Instance, ...] = ()
    equipment: tuple[Requirement, ...] = ()
    unequipped: tuple[str, ...] = ()
    entries: tuple[Transition, ...] | None = None

    @property
    def instances(self) -> tuple[Instance, ...]:
        """All instances of chemistry and of the protocol's constraints."""
        return (*super().instances, *self.near, *self.ventilation)

    @cached_property
    def v(self) -> int:
        """Number of hard violations.

        OB + CN + chemical pairs under d_low + reagents not in their class + vessels of harmful vapors outside their
        hood + pieces of an apparatus apart + blocked fronts + infeasible transitions and entries + missing assets and
        safety equipment + broken hard facility rules.
        """
        hard = sum(instance.hard for instance in (*self.instances, *self.fronts))
        blocked = sum(not drive.feasible for drive in self.drives)
        objects = len(self.out_of_bounds) + len(self.collisions) + len(self.lacking)
        return objects + hard + blocked + len(self.hard_issues)

    @cached_property
    def fitness(self) -> float:
        """F in [0, 1]: half the share of objects without a fault and with a free front, half the mean satisfaction."""
        count, instances = len(self.arrangement), self.instances
        blocked = {front.ids[0] for front in self.fronts if front.hard}
        geometry = 1.0 - len(self.faulty | blocked) / count if count else 1.0
        chemistry = sum(instance.satisfaction for instance in instances) / len(instances) if instances else 1.0
        return GEOMETRY_WEIGHT * geometry + CHEMISTRY_WEIGHT * chemistry

    @cached_property
    def violations(self) -> Violations:
        """The hard violations, described; as many as `v`."""
        return Violations(
            (
                *bounds_violations(self.arrangement, self.bounds),
                *collision_violations(self.collisions),
                *chemical_violations((*self.flammable, *self.incompatible, *self.storage, *self.glass)),
                *_protocol_violations((*self.near, *self.ventilation)),
                *_front_violations(self.fronts),
                *_missing_violations(self.lacking),
                *navigation_violations(self.arrangement, self.drives),
                *(_facility_violation(issue) for issue in self.hard_issues),
            )
        )

    @cached_property
    def issues(self) -> tuple[FacilityIssue, ...]:
        """Every facility rule and safety rule that the layout breaks, fixed objects included.

        Stricter safety rules replace two facility rules of touchstone-v1: `corrosive_height` and `shower_walk`.
        """
        exits = building_exit_issues(self.arrangement.building, self.profile)
        general = (*exits, *self._placing, *self._egress, *self._hoods)
        return (*general, *self._standing_issues, *self._walking_issues)

    @cached_property
    def warnings(self) -> tuple[FacilityIssue, ...]:
        """Facility rules that are advice, as far as objects can be moved to follow them; safety rules are `advice`."""
        return tuple(issue for issue in (*self._placing, *self._hoods) if issue.severity == "warning")

    @cached_property
    def advice(self) -> tuple[FacilityIssue, ...]:
        """Every rule that is advice and that moved objects may follow; walks only with navigation."""
        walking = self._walking_issues if self.navigation else ()
        safety = (issue for issue in (*self._standing_issues, *walking) if issue.severity == "warning")
        return (*self.warnings, *safety)

    @cached_property
    def facility(self) -> FacilityScore:
        """The score of the facility rules."""
        return facility_score(self.site, self.issues)

    @cached_property
    def _standing_issues(self) -> tuple[FacilityIssue, ...]:
        """Issues under the safety rules that plan no walks."""
        return safety_issues(self.site, ways=False)

    @cached_property
    def _hoods(self) -> tuple[FacilityIssue, ...]:
        return tuple(hood_issues(self.arrangement))

    @cached_property
    def _walking_issues(self) -> tuple[FacilityIssue, ...]:
        """Issues under the safety rules that plan walks."""
        return safety_issues(self.site, ways=True)

    @cached_property
    def hard_issues(self) -> tuple[FacilityIssue, ...]:
        """Facility and safety rules that the layout breaks and that count in v(L); walks only with navigation."""
        ways = (*self._egress, *self._walking_issues) if self.navigation else ()
        exits = building_exit_issues(self.arrangement.building, self.profile)
        return tuple(issue for issue in (*exits, *ways, *self._placing, *self._standing_issues) if is_hard(issue))

    @property
    def drives(self) -> tuple[Transition, ...]:
        """The protocol's transitions and the drives from doors; empty without navigation."""
        return (*(self.transitions or ()), *(self.entries or ()))

    @property
    def lacking(self) -> tuple[str, ...]:
        """Assets and safety equipment that are required and not placed."""
        return (*(self.missing or ()), *self.unequipped)

    @cached_property
    def cost(self) -> int:
        """v(L) plus the number of facility errors that v(L) does not contain."""
        counted = ("front_clearance", "second_exit")
        return self.v + sum(not is_hard(issue) and issue.rule not in counted for issue in self.errors)

    @cached_property
    def workflow(self) -> Workflow | None:
        """The walks of the protocol's workflow; None without a protocol."""
        return None if self.protocol is None else walking_distance(self.arrangement, self.protocol, self.premises)

    @cached_property
    def premises(self) -> Premises:
        """The walks of people, for the workflow and for regulations."""
        return Premises(self.arrangement)

    @cached_property
    def reaches(self) -> tuple[ItemReach, ...]:
        """Whether an arm reaches each item that a step uses; empty without a protocol."""
        return () if self.protocol is None else item_reaches(self.arrangement, self.protocol)

    @property
    def perfect(self) -> bool:
        """Whether nothing can be improved; with tie-breakers a shorter walk always can."""
        return super().perfect and not self.cost and not self.profile.tie_breakers

    @property
    def reach(self) -> float | None:
        """Share of the items that are in reach, None without any."""
        return sum(item.reached for item in self.reaches) / len(self.reaches) if self.reaches else None

    def better_than(self, other: Assessment) -> bool:
        """Whether to accept this layout over another: a lower cost, or the same cost and a higher fitness.

        With the profile's tie-breakers, of equal ones a better reach, then a shorter walk wins.
        """
        if self.cost != other.cost:
            return self.cost < other.cost
        if abs(self.fitness - other.fitness) > 1e-12:
            return self.fitness > other.fitness
        if not self.profile.tie_breakers or not isinstance(other, Assessment2):
            return False
        own, others = self._tie, other._tie
        return own[0] > others[0] + 1e-12 or (own[0] > others[0] - 1e-12 and own[1] < others[1] - 1e-6)

    @property
    def _tie(self) -> tuple[float, float]:
        walk = float("inf") if self.workflow is None or self.workflow.length is None else self.workflow.length
        return self.reach or 0.0, walk

    def with_navigation(self, protocol: Protocol | None) -> Assessment2:
        """Return the assessment with navigation, as `evaluate_layout(..., navigation=True)`; the rest is kept."""
        if self.navigation:
            return self
        drives = _drives(self, protocol, None)
        assessment = replace(self, navigation=True, transitions=drives[0], entries=drives[1])
        for name in ("_placing", "_hoods", "_standing_issues", "faulty", "out_of_bounds"):
            if name in self.__dict__:
                assessment.__dict__[name] = self.__dict__[name]
        return assessment


def assess(basis: Assessment, protocol: Protocol | None, earlier: Assessment | None = None) -> Assessment2:
    """Return the assessment under touchstone-v2 of a layout that has been assessed under version 1.

    Args:
        basis: the assessment under version 1, without its transitions: bounds, collisions and pairs are taken over.
        protocol: the protocol.
        earlier: assessment of another state of the layout, whose drives are taken over if nothing that they depend on
            has changed. It changes no result.
    """
    arrangement, profile = basis.arrangement, basis.profile
    bounds: tuple[BoundsFault, ...] = (*basis.bounds, *support_faults(arrangement))
    out_of_bounds = frozenset(fault.id for fault in bounds)
    faulty = out_of_bounds | basis.faulty
    fronts = front_instances(arrangement)
    unusable = faulty | {front.ids[0] for front in fronts if front.hard}
    equipment = required_equipment(arrangement, protocol)
    flammable, incompatible = basis.flammable, basis.incompatible
    near: tuple[Instance, ...] = ()
    ventilation: tuple[Instance, ...] = ()
    site = Site.of(arrangement, protocol)
    if protocol is not None:
        flammable += flammable_handling(arrangement, site.handled_by[0], profile)
        incompatible += incompatible_handling(arrangement, site.handled_by[0], profile)
        near = penalised(near_instances(arrangement, protocol), faulty)
        ventilation = penalised(ventilation_instances(arrangement, protocol, unusable), faulty)
    assessment = Assessment2(
        profile=profile,
        arrangement=arrangement,
        bounds=bounds,
        collisions=basis.collisions,
        flammable=penalised(flammable, faulty),
        incompatible=penalised(incompatible, faulty),
        storage=() if "storage" in profile.left_out else penalised(class_instances(arrangement), faulty),
        glass=penalised(all_glass_instances(arrangement, profile), faulty),
        missing=None if protocol is None else missing_assets(arrangement, protocol, out_of_bounds),
        transitions=None,
        navigation=basis.navigation,
        site=site,
        protocol=protocol,
        near=near,
        ventilation=ventilation,
        fronts=fronts,
        equipment=equipment,
        unequipped=missing_equipment(arrangement, equipment, out_of_bounds),
    )
    if not basis.navigation:
        return assessment
    moves, entries = _drives(assessment, protocol, earlier)
    return replace(assessment, transitions=moves, entries=entries)


def _drives(
    assessment: Assessment2, protocol: Protocol | None, earlier: Assessment | None
) -> tuple[tuple[Transition, ...] | None, tuple[Transition, ...] | None]:
    """Judge the protocol's transitions and the drives from the doors, both by exact clearance."""
    if protocol is None:
        return None, None
    layout = assessment.arrangement.layout
    between, entering = legs(layout, protocol), entry_legs(assessment.arrangement, protocol)
    if isinstance(earlier, Assessment2) and earlier.transitions is not None and earlier.entries is not None:
        other = earlier.arrangement.layout
        unmoved = other.floor is layout.floor and list(other.obstacles(OBSTACLE_HEIGHT)) == list(
            layout.obstacles(OBSTACLE_HEIGHT)
        )
        same = _legs(earlier.transitions) == between and _legs(earlier.entries) == entering
        if unmoved and same:
            return earlier.transitions, earlier.entries
    space = ShortestPaths(layout)
    verdicts = judge_legs(layout, [*between, *entering], space)
    return verdicts[: len(between)], verdicts[len(between) :]


def _legs(drives: tuple[Transition, ...]) -> list[Leg]:
    return [drive.leg for drive in drives]


def _protocol_violations(instances: Iterable[Instance]) -> list[Violation]:
    violations = []
    for instance in instances:
        if not instance.hard:
            continue
        if instance.rule == "near":
            short = (instance.distance or 0.0) - instance.limit
            message = f"{instance.ids[0]} is {instance.distance:.2f} m from {instance.ids[1]}: {instance.note}"
            remedy = f"place them on one surface, at most {instance.limit:g} m apart"
            violations.append(Violation("near", instance.ids, short, message, remedy))
        else:
            remedy = f"place {', '.join(instance.ids[1:])} in {instance.ids[0]}" if instance.ids[1:] else "place it"
            violations.append(Violation("ventilation", instance.ids, 1.0, instance.note, remedy))
    return violations


def _front_violations(fronts: Iterable[Instance]) -> list[Violation]:
    violations = []
    for front in fronts:
        if front.hard:
            free, own = front.distance or 0.0, front.ids[0]
            message = f"{own} needs {front.limit:g} m clear in front but has {free:.2f} m: {front.note}"
            remedy = f"move {', '.join(front.ids[1:])} away" if front.ids[1:] else f"turn {own} away from the wall"
            violations.append(Violation("front", front.ids, max(front.limit - free, 0.0), message, remedy))
    return violations


def _missing_violations(names: Iterable[str]) -> list[Violation]:
    return [Violation("missing", (), 1.0, f"{name} is required but missing", f"add {name}") for name in names]


def _facility_violation(issue: FacilityIssue) -> Violation:
    amount = 1.0 if issue.value is None else abs(issue.limit - issue.value)
    problem, _, remedy = issue.message.rpartition(": ")
    return Violation("facility", issue.ids, amount, problem or issue.message, remedy if problem else "see the rule")
