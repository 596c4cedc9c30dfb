"""The hard violations of a layout: objects, amount, message and remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import BoundsFault
from labgym.layouts.rules.collisions import Collision
from labgym.layouts.rules.satisfaction import Instance
from labgym.navigation.feasibility import Transition

Kind = Literal[
    "bounds", "collision", "flammable", "incompatible", "storage", "navigation",
    "front", "near", "ventilation", "missing", "facility",
]  # fmt: skip
"""Kinds of hard violations; those of the last line exist in touchstone-v2 only."""


@dataclass(frozen=True)
class Violation:
    """One hard violation.

    Attributes:
        ids: placements that take part; for navigation, the placements of the two locations that exist.
        amount: meters out of bounds, of penetration or short of the least distance; 1 for counts.
        message: the violation in one line.
        suggestion: the remedy in one line.
    """

    kind: Kind
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

    def of(self, *kinds: Kind) -> tuple[Violation, ...]:
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


def chemical_violations(instances: Iterable[Instance]) -> list[Violation]:
    """Return one violation for each pair below its least distance and for each reagent that is not stored."""
    violations = []
    for instance in instances:
        if not instance.hard:
            continue
        if instance.distance is None:
            reagent = instance.ids[0]
            message, remedy = f"{reagent} is {instance.note}", f"put {reagent} on a shelf of a reagent cabinet"
            violations.append(Violation("storage", instance.ids, 1.0, message, remedy))
            continue
        kind: Kind = "flammable" if instance.rule == "flammable" else "incompatible"
        short = instance.limit - instance.distance
        first, second = instance.ids
        message = f"{first} is {instance.distance:.2f} m from {second}, under {instance.limit:g} m: {instance.note}"
        remedy = f"move {first} and {second} {short:.2f} m further apart"
        violations.append(Violation(kind, instance.ids, short, message, remedy))
    return violations


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
