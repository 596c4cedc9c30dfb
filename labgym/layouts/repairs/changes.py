"""The differences between a layout and its repair, object by object, and the faults that remain."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

from labgym.geometry import rotate, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.rules.facility.showers import HOOD_TO_SHOWER
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.rule import FacilityIssue

STILL, STRAIGHT = 5e-4, 1e-3
"""Shifts in meters and turns in radians up to which an object counts as unmoved."""

ChangeKind = Literal["moved", "resettled", "added", "removed"]


@dataclass(frozen=True)
class Change:
    """A difference.

    Attributes:
        id: the placement.
        kind: `moved` (also turned; what is carried along is not listed), `resettled` (on another support or slot),
            `added` or `removed`.
        text: the difference in words.
        reason: what it cures or improves; empty for objects that make room for others.
    """

    id: str
    kind: ChangeKind
    text: str
    reason: str = ""


def changes(before: Layout, after: Layout, reasons: Mapping[str, str] = MappingProxyType({})) -> tuple[Change, ...]:
    """Return the differences, in the order of the later layout.

    An object that moved with its support has none, nor has one whose support was moved under it.

    Args:
        reasons: why objects were changed, by id.
    """
    listed = [_change(before, after, placement) for placement in after.placements]
    gone = [placement.id for placement in before.placements if placement.id not in after.by_id]
    listed += [Change(item, "removed", f"{item}: removed") for item in gone]
    return tuple(replace(one, reason=reasons.get(one.id, "")) for one in listed if one is not None)


def moved_ids(before: Layout, after: Layout) -> tuple[str, ...]:
    """Return the ids of the objects that were moved by themselves, not carried along, and not added."""
    return tuple(change.id for change in changes(before, after) if change.kind in ("moved", "resettled"))


def moved_furniture(before: Layout, after: Layout) -> set[str]:
    """Return the ids of the floor objects that were moved by themselves, and not added."""
    return {item for item in moved_ids(before, after) if after.placement(item).support == FLOOR}


def _change(before: Layout, after: Layout, placement: Placement) -> Change | None:
    name, there = placement.id, _where(after, placement)
    earlier = before.by_id.get(name)
    if earlier is None:
        return Change(name, "added", f"{name}: added {there}")
    here = _where(before, earlier)
    if (earlier.support, earlier.slot) != (placement.support, placement.slot):
        return Change(name, "resettled", f"{name}: put {there}, was {here}")
    shift, turn = _relative(before, earlier, after, placement)
    if shift <= STILL and abs(turn) <= STRAIGHT:
        return None
    parts = []
    if abs(turn) > STRAIGHT:
        parts.append(f"turned by {math.degrees(turn):.0f} degrees")
    if shift > STILL:
        parts.append(f"moved {shift:.2f} m: was {here}, is {there}")
    return Change(name, "moved", f"{name}: {' and '.join(parts)}")


def _relative(before: Layout, earlier: Placement, after: Layout, later: Placement) -> tuple[float, float]:
    """Return how far an object moved and turned, in the room or on its support if that is less; meters and radians."""
    local, other = _pose(before, earlier), _pose(after, later)
    on_support = math.dist(local[:3], other[:3]), wrap_angle(other[3] - local[3])
    in_room = math.dist(earlier.position, later.position), wrap_angle(later.yaw - earlier.yaw)
    return min(on_support, in_room, key=lambda move: move[0] + abs(move[1]))


def _pose(layout: Layout, placement: Placement) -> tuple[float, float, float, float]:
    """Return an object's pose (x, y, z, yaw) in the frame of what carries it."""
    x, y, z = placement.position
    if placement.support in (FLOOR, WALL):
        return x, y, z, placement.yaw
    base = layout.placement(placement.support)
    local = rotate(x - base.position[0], y - base.position[1], -base.yaw)
    return *local, z - base.position[2], placement.yaw - base.yaw


def _where(layout: Layout, placement: Placement) -> str:
    x, y, z = placement.position
    if placement.support == FLOOR:
        return f"at ({x:.2f}, {y:.2f})"
    if placement.support == WALL:
        return f"on a wall at ({x:.2f}, {y:.2f}, {z:.2f})"
    shelves = len(layout.asset(placement.support).surfaces)
    where = f"shelf {(placement.slot or 0) + 1} of {placement.support}" if shelves > 1 else placement.support
    return f"on {where} at ({x:.2f}, {y:.2f}, {z:.2f})"


def problems(state: RepairState) -> tuple[str, ...]:
    """Return what is wrong with a layout and why it stays, one sentence for each fault.

    Hard facility errors count under every rule set, also those that no moved object can change: a
    building without an exit, fixed objects in a way out, no shower that is reached from a hood.
    """
    assessment, layout = state.assessment, state.layout
    described = [violation.message for violation in assessment.violations.items]
    sentences = [
        f"{violation.message} ({_reason(layout, violation.ids)})"
        for violation in assessment.violations.items
        if violation.kind != "missing"
    ]
    sentences += [
        f"{issue.message} ({_reason(layout, issue.ids)})"
        for issue in _errors(assessment)
        if not any(map(issue.message.startswith, described))
    ]
    sentences += [f"{name} is missing (no free place was found for it)" for name in assessment.lacking]
    return tuple(sentences)


def _errors(assessment: Assessment) -> Iterator[FacilityIssue]:
    """Yield the facility errors of the layout, then those of the building and of fixed objects, and absent showers."""
    yield from assessment.errors
    if not assessment.rules.facility_in_cost:
        return
    yielded = {issue.message for issue in assessment.errors}
    advised = HOOD_TO_SHOWER in assessment.rules.facility
    for issue in assessment.issues:
        absent = advised and issue.rule == HOOD_TO_SHOWER.name and issue.value is None
        if (issue.severity == "error" or absent) and issue.message not in yielded:
            yield issue


def _reason(layout: Layout, ids: tuple[str, ...]) -> str:
    if not ids:
        return "the building itself is not changed"
    items = [layout.root(item).id for item in ids if item in layout.by_id]
    if items and not any(may_move(layout, item) for item in items):
        return "fixed objects stay"
    return "no other place or arrangement that was tried is better"
