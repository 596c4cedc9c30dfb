"""The hard violations of a layout: objects, amount, message and remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault
from labgym.layouts.rules.collisions import Collision
from labgym.layouts.rules.rule import FacilityIssue, Instance, Term
from labgym.navigation.feasibility import Transition


@dataclass(frozen=True)
class Violation:
    """One hard violation.

    Attributes:
        kind: `bounds`, `collision`, `missing`, `navigation`, `facility`, or the name of a term.
        ids: placements that take part; for navigation, the placements of the two locations that exist.
        amount: meters out of bounds, of penetration or short of the least distance; 1 for counts.
        message: the violation in one line.
        suggestion: the remedy in one line.
    """

    kind: str
    ids: tuple[str, ...]
    amount: float
    message: str
    suggestion: str


@dataclass(frozen=True)
class Violations:
    """The hard violations of a layout; `count` is v(L)."""

    items: tuple[Violation, ...]

    @property
    def count(self) -> int:
        """v(L)."""
        return len(self.items)

    def of(self, *kinds: str) -> tuple[Violation, ...]:
        """Return the violations of some kinds."""
        return tuple(item for item in self.items if item.kind in kinds)


def bounds_violations(arrangement: Arrangement, faults: Iterable[BoundsFault]) -> list[Violation]:
    """Return one violation for each object out of bounds; its message lists all its faults."""
    by_object: dict[str, list[BoundsFault]] = {}
    for fault in faults:
        by_object.setdefault(fault.id, []).append(fault)
    return [_bounds_violation(arrangement, placement, own) for placement, own in by_object.items()]


def collision_violations(collisions: Iterable[Collision]) -> list[Violation]:
    """Return one violation for each colliding pair."""
    violations = []
    for collision in collisions:
        (first, second), depth = collision.ids, collision.depth
        message = f"{first} and {second} interpenetrate by {depth:.3f} m ({collision.volume:.2g} m3)"
        violations.append(Violation("collision", collision.ids, depth, message, f"move one of them by {depth:.3f} m"))
    return violations


def term_violations(term: Term, instances: Iterable[Instance]) -> list[Violation]:
    """Return one violation for each hard instance of a term."""
    if term.remedy is None:
        return []
    return [Violation(term.name, one.ids, *term.remedy(one)) for one in instances if one.hard]


def missing_violations(names: Iterable[str]) -> list[Violation]:
    """Return one violation for each asset that is required and not placed."""
    return [Violation("missing", (), 1.0, f"{name} is required but missing", f"add {name}") for name in names]


def facility_violation(issue: FacilityIssue) -> Violation:
    """Return the violation for a facility rule that is hard."""
    amount = 1.0 if issue.value is None else abs(issue.limit - issue.value)
    problem, _, remedy = issue.message.rpartition(": ")
    return Violation("facility", issue.ids, amount, problem or issue.message, remedy if problem else "see the rule")


def navigation_violations(arrangement: Arrangement, transitions: Iterable[Transition]) -> list[Violation]:
    """Return one violation for each transition without a collision-free path."""
    return [
        _navigation_violation(arrangement, transition) for transition in transitions if transition.failure is not None
    ]


def _bounds_violation(arrangement: Arrangement, placement_id: str, faults: list[BoundsFault]) -> Violation:
    x, y, z = arrangement.placements[arrangement.row(placement_id)].position
    support = arrangement.placements[arrangement.row(placement_id)].support
    problems = {
        "room": "outside the room",
        "surface": f"off its support {support}",
        "height": f"above or below {support}",
    }
    remedies = {"room": "move it inward", "surface": "move it back onto its support", "height": "set it on its support"}
    worst = max(faults, key=lambda fault: fault.amount)
    where = f"{placement_id} at ({x:.2f}, {y:.2f}, {z:.2f}) is"
    if worst.cause == "support":
        asset = arrangement.assets[arrangement.row(placement_id)]
        place = {"floor": "on the floor", "wall": "on a wall"}.get(asset.placing, "on furniture")
        message = f"{where} on {support}; a {asset.subtype} belongs {place}"
        return Violation("bounds", (placement_id,), 1.0, message, f"place it {place}")
    reasons = ", ".join(
        f"{fault.amount:.3f} m {problems[fault.cause]}" if fault.cause != "support" else f"on {support}"
        for fault in faults
    )
    return Violation(
        "bounds",
        (placement_id,),
        worst.amount,
        f"{where} {reasons}",
        f"{remedies[worst.cause]} by {worst.amount:.3f} m",
    )


def _navigation_violation(arrangement: Arrangement, transition: Transition) -> Violation:
    here, there = transition.start_location, transition.goal_location
    remedies = {
        "missing": ("a location is not placed", "place it"),
        "outside_room": ("the robot would stand outside the room", "turn the furniture so that its front looks inward"),
        "endpoint_invalid": ("the robot does not fit in front of it", "free 0.90 m in front of the furniture"),
        "unreachable": ("no free path connects them", "widen the passages between them to 0.70 m or more"),
    }
    problem, remedy = remedies[transition.failure or "unreachable"]
    named = {"start": here, "goal": there}
    where = " and ".join(named[end] for end in transition.ends)
    placements = (arrangement.layout.find(name) for name in (here, there))
    ids = tuple(dict.fromkeys(placement.id for placement in placements if placement is not None))
    message = f"{here} -> {there}: {problem}" + (f" ({where})" if where else "")
    return Violation("navigation", ids, 1.0, message, remedy)
