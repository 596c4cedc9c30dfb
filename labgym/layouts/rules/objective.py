"""The assessment of a layout: every rule computed once, for the optimizer and the score."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from labgym.layouts.model import Layout
from labgym.layouts.rules import thresholds
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault, bounds_faults
from labgym.layouts.rules.collisions import Collision, collisions
from labgym.layouts.rules.egress import narrow_exits
from labgym.layouts.rules.facility import FacilityIssue
from labgym.layouts.rules.facility.exits import egress_issues
from labgym.layouts.rules.facility.issues import equipment_issues, placing_issues
from labgym.layouts.rules.glass import glass_instances
from labgym.layouts.rules.presence import missing_assets
from labgym.layouts.rules.satisfaction import Instance, penalised
from labgym.layouts.rules.separation import flammable_instances, incompatible_instances
from labgym.layouts.rules.storage import storage_instances
from labgym.layouts.rules.thresholds import VERSION_2, Profile
from labgym.layouts.rules.violations import (
    Violations,
    bounds_violations,
    chemical_violations,
    collision_violations,
    navigation_violations,
)
from labgym.navigation.feasibility import Transition, legs, transitions
from labgym.navigation.plan import OBSTACLE_HEIGHT
from labgym.protocols import Protocol

GEOMETRY_WEIGHT = 0.5
CHEMISTRY_WEIGHT = 0.5
"""Weights of F; the paper leaves them open."""


@dataclass(frozen=True)
class Assessment:
    """All rules of one layout under one profile.

    Attributes:
        flammable, incompatible, storage, glass: instances, the geometry penalty applied.
        missing: required assets that are not placed, None without a protocol.
        transitions: None without navigation or without a protocol.
        navigation: whether ways were evaluated: the protocol's transitions and egress.
    """

    profile: Profile
    arrangement: Arrangement
    bounds: tuple[BoundsFault, ...]
    collisions: tuple[Collision, ...]
    flammable: tuple[Instance, ...]
    incompatible: tuple[Instance, ...]
    storage: tuple[Instance, ...]
    glass: tuple[Instance, ...]
    missing: tuple[str, ...] | None
    transitions: tuple[Transition, ...] | None
    navigation: bool = False

    @cached_property
    def out_of_bounds(self) -> frozenset[str]:
        """Ids of the objects that are out of bounds."""
        return frozenset(fault.id for fault in self.bounds)

    @cached_property
    def faulty(self) -> frozenset[str]:
        """Ids of the objects that are out of bounds or collide."""
        return self.out_of_bounds.union(*(collision.ids for collision in self.collisions))

    @property
    def instances(self) -> tuple[Instance, ...]:
        """All chemical instances."""
        return self.flammable + self.incompatible + self.storage + self.glass

    @cached_property
    def v(self) -> int:
        """Number of hard violations: OB + CN + pairs under d_low + reagents not stored + infeasible transitions."""
        chemical = sum(instance.hard for instance in self.instances)
        unreachable = sum(not transition.feasible for transition in self.transitions or ())
        return len(self.out_of_bounds) + len(self.collisions) + chemical + unreachable

    @cached_property
    def fitness(self) -> float:
        """F in [0, 1]: half the share of objects in no violation, half the mean satisfaction."""
        count, instances = len(self.arrangement), self.instances
        geometry = 1.0 - len(self.faulty) / count if count else 1.0
        chemistry = sum(instance.satisfaction for instance in instances) / len(instances) if instances else 1.0
        return GEOMETRY_WEIGHT * geometry + CHEMISTRY_WEIGHT * chemistry

    @cached_property
    def violations(self) -> Violations:
        """The hard violations, described; as many as `v`."""
        return Violations(
            (
                *bounds_violations(self.arrangement, self.bounds),
                *collision_violations(self.collisions),
                *chemical_violations(self.instances),
                *navigation_violations(self.arrangement, self.transitions or ()),
            )
        )

    @cached_property
    def errors(self) -> tuple[FacilityIssue, ...]:
        """Facility rules that the generator and the optimizer never leave broken; egress only with navigation.

        They do not count in v(L). Issues that concern fixed objects alone are left out: nothing can be moved. Empty if
        the profile leaves facility rules out.
        """
        if "facility" in self.profile.left_out:
            return ()
        issues = (*self._placing, *(self._egress if self.navigation else ()))
        fixed = {placement.id for placement in self.arrangement.placements if placement.fixed}
        return tuple(issue for issue in issues if issue.severity == "error" and not fixed.issuperset(issue.ids))

    @cached_property
    def warnings(self) -> tuple[FacilityIssue, ...]:
        """Facility rules that are advice, as far as objects can be moved to follow them: not the number of exits."""
        issues = (*self._placing, *equipment_issues(self.arrangement))
        return tuple(issue for issue in issues if issue.severity == "warning")

    @property
    def advice(self) -> tuple[FacilityIssue, ...]:
        """Every rule that is advice and that moved objects may follow: the facility warnings."""
        return self.warnings

    @cached_property
    def _placing(self) -> tuple[FacilityIssue, ...]:
        return tuple(placing_issues(self.arrangement))

    @cached_property
    def _egress(self) -> tuple[FacilityIssue, ...]:
        return tuple(egress_issues(self.arrangement))

    def with_navigation(self, protocol: Protocol | None) -> Assessment:
        """Return the assessment with navigation, as `evaluate_layout(..., navigation=True)`; the rest is kept."""
        if self.navigation:
            return self
        moves = None if protocol is None else judged_transitions(self.arrangement.layout, protocol)
        assessment = replace(self, transitions=moves, navigation=True)
        if "_placing" in self.__dict__:
            assessment.__dict__["_placing"] = self._placing
        return assessment

    @cached_property
    def cost(self) -> int:
        """v(L) plus the number of facility errors: the quantity that the optimizer minimizes."""
        if "errors" in self.__dict__ or "facility" in self.profile.left_out:
            return self.v + len(self.errors)
        concerned = [issue.ids for issue in self._placing if issue.severity == "error"]
        concerned += narrow_exits(self.arrangement) if self.navigation else []  # The messages' widths take longer.
        fixed = {placement.id for placement in self.arrangement.placements if placement.fixed}
        return self.v + sum(not fixed.issuperset(ids) for ids in concerned)

    @property
    def drives(self) -> tuple[Transition, ...]:
        """The drives that count in v(L); empty without navigation."""
        return self.transitions or ()

    @property
    def lacking(self) -> tuple[str, ...]:
        """Assets that are required and not placed, without those that are out of bounds; empty without a protocol."""
        return self.missing or ()

    @property
    def perfect(self) -> bool:
        """Whether nothing can be improved: no violation, no facility error, full fitness."""
        return self.v == 0 and self.fitness > 1.0 - 1e-9 and not self.errors

    def better_than(self, other: Assessment) -> bool:
        """Whether to accept this layout over another: a lower cost, or the same cost and a higher fitness."""
        return self.cost < other.cost or (self.cost == other.cost and self.fitness > other.fitness + 1e-12)


def evaluate_layout(
    layout: Layout,
    protocol: Protocol | None = None,
    profile: str | Profile = "default",
    navigation: bool = False,
    earlier: Assessment | None = None,
    metrics: str | None = None,
) -> Assessment:
    """Apply every rule to a layout.

    Args:
        layout: the layout.
        protocol: required assets and transitions; None leaves both out.
        profile: name of the thresholds, or a profile; its `metrics` choose the version of the definitions.
        navigation: whether to plan the protocol's transitions and check egress, which takes as long as all the rest.
        earlier: assessment of another state of the layout, whose transitions are taken over if neither floor nor
            obstacles nor goal poses have changed. It changes no result.
        metrics: version of the definitions, `touchstone-v1` or `touchstone-v2`; by default the profile's.

    Raises:
        UnknownNameError: the profile, the version, an asset or a support does not exist.
    """
    limits, arrangement = thresholds.profile(profile, metrics), Arrangement.of(layout)
    bounds, overlaps = bounds_faults(arrangement), collisions(arrangement)
    out_of_bounds = frozenset(fault.id for fault in bounds)
    faulty = out_of_bounds.union(*(collision.ids for collision in overlaps))
    version_2 = limits.metrics == VERSION_2
    drives = navigation and protocol is not None and not version_2
    basis = Assessment(
        profile=limits,
        arrangement=arrangement,
        bounds=bounds,
        collisions=overlaps,
        flammable=penalised(flammable_instances(arrangement, limits), faulty),
        incompatible=penalised(incompatible_instances(arrangement, limits), faulty),
        storage=() if "storage" in limits.left_out else penalised(storage_instances(arrangement), faulty),
        glass=penalised(glass_instances(arrangement, limits), faulty),
        missing=None if protocol is None else missing_assets(arrangement, protocol, out_of_bounds),
        transitions=judged_transitions(layout, protocol, earlier) if drives and protocol is not None else None,
        navigation=navigation,
    )
    if not version_2:
        return basis
    from labgym.layouts.rules.touchstone2.assessment import assess  # it extends the assessment of this module

    return assess(basis, protocol, earlier)


def judged_transitions(layout: Layout, protocol: Protocol, earlier: Assessment | None = None) -> tuple[Transition, ...]:
    """Judge a protocol's transitions: in a rectangular room on touchstone-v1's grid, elsewhere by exact clearance.

    Args:
        earlier: as in `evaluate_layout`.
    """
    if earlier is not None and earlier.transitions is not None:
        other = earlier.arrangement.layout
        unmoved = other.floor is layout.floor and list(other.obstacles(OBSTACLE_HEIGHT)) == list(
            layout.obstacles(OBSTACLE_HEIGHT)
        )
        if unmoved and legs(layout, protocol) == [move.leg for move in earlier.transitions]:
            return earlier.transitions
    return transitions(layout, protocol, method="grid" if layout.floor.is_rectangle else "exact")
