"""Says why a room cannot hold a protocol: which constraints clash, and the smallest preset that fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labgym.errors import InfeasibleError
from labgym.layouts.brief import Brief
from labgym.layouts.briefing import write_brief
from labgym.layouts.floor_plan import GROUPS, solve
from labgym.layouts.model import Room
from labgym.layouts.request import Request
from labgym.layouts.rooms import room_presets
from labgym.layouts.rules.zones import door_span
from labgym.layouts.walls import choose_walls

EFFORT = 0.4


def explain(request: Request, brief: Brief) -> InfeasibleError:
    """Return the error for a brief that has no floor plan.

    A group of constraints clashes where lifting it alone leaves a solution; where no single one does, the
    furniture itself is too much for the walls.
    """
    protocol, room, profile = request.protocol, request.room, request.profile
    conflicts = [clash for group in GROUPS if (clash := _clash(brief, room, group)) is not None]
    if not conflicts:
        conflicts = [_demand(brief, room)]
    what = (
        f"a {room.width:g} x {room.depth:g} m room cannot hold protocol {protocol.id!r} under profile {profile.name!r}"
    )
    return InfeasibleError(what, conflicts, smallest_preset(request))


def smallest_preset(request: Request) -> str | None:
    """Return the name of the smallest room preset that holds a protocol's required furniture, or None."""
    for name, room in room_presets().items():
        for attempt in range(3):
            generator = np.random.default_rng([attempt])
            try:
                brief = write_brief(replace(request, room=room), "required", generator)
            except InfeasibleError:
                return None
            if solve(choose_walls(brief, room, generator), room, 0, effort=0.1) is not None:
                return name
        if solve(brief, room, 0, effort=EFFORT) is not None:
            return name
    return None


def _clash(brief: Brief, room: Room, group: str) -> str | None:
    if solve(brief, room, 0, lifted=(group,), effort=EFFORT) is None:
        return None
    if group == "separations":
        named = [f"{rule.first} {rule.distance:.2f} m from {rule.second} ({rule.reason})" for rule in brief.separations]
        return "separations: " + ", ".join(named[:6]) + (f" and {len(named) - 6} more" if len(named) > 6 else "")
    if group == "service zones":
        widest = sorted(brief.units, key=lambda unit: -unit.front)[:4]
        return "service zones: " + ", ".join(f"{unit.front:g} m free before {unit.id}" for unit in widest)
    if group == "doors":
        return (
            f"doors: {brief.door_zone:g} m free inside each of {len(room.doors)}, hoods {brief.hood_door:g} m from them"
        )
    return f"aisles: {brief.aisle:g} m around islands"


def _demand(brief: Brief, room: Room) -> str:
    needed = sum(unit.width for unit in brief.units if unit.stance == "wall")
    offered = 2.0 * (room.width + room.depth) - sum(door_span(door) for door in room.doors)
    deepest = max(brief.units, key=lambda unit: unit.depth + unit.front)
    return (
        f"furniture: {len(brief.units)} pieces need {needed:.1f} m of wall of {offered:.1f} m between doors, "
        f"{deepest.id} needs {deepest.depth + deepest.front:.2f} m of depth"
    )
