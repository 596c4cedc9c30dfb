"""Why a room cannot hold a protocol: which constraints clash, and the smallest preset that fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from labgym.errors import InfeasibleError, SearchLimitError
from labgym.layouts.brief import Brief, Unit
from labgym.layouts.briefing import write_brief
from labgym.layouts.floor_plan import GROUPS, solve
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.layouts.rooms import room_presets
from labgym.layouts.rules import facility
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.zones import door_span
from labgym.layouts.walls import choose_walls

EFFORT = 0.05
"""Deterministic search time of each trial with lifted constraints."""
PRESET_EFFORT = 0.05
PRESET_TRIES = 3
SHOWN = 6
"""Maximum number of separations that a message names."""


def room_conflicts(request: Request) -> list[str]:
    """Return why a room is unsuitable for any furniture: no door, too few exits, fixed objects that break a rule."""
    empty = Layout(id="empty", floor=request.floor, placements=(), catalog=request.catalog)
    exits = facility.issues(facility.EXITS, Site(Arrangement.of(empty), None, request.profile))
    conflicts = [issue.message for issue in exits if issue.severity == "error"]
    if not request.room.doors:
        conflicts.append("the room has no door: add one")
    return conflicts + fixed_conflicts(request)


def fixed_conflicts(request: Request) -> list[str]:
    """Return what is wrong with the fixed objects alone: outside, overlapping, in doors, keep-outs or off services."""
    if not request.fixed:
        return []
    fixed = Layout(id="fixed", floor=request.floor, placements=request.fixed, catalog=request.catalog)
    assessment = evaluate_layout(fixed, None, request.rules)
    conflicts = [f"fixed: {violation.message}" for violation in assessment.violations.items]
    issues = [issue for issue in facility.issues(facility.PLACING, assessment.site) if issue.severity == "error"]
    return conflicts + [f"fixed: {i.message}" for i in issues if i.rule in ("door_area", "keep_out", "supply")]


def height_conflicts(request: Request, brief: Brief) -> list[str]:
    """Return the furniture that is higher than the ceiling, one sentence for each asset."""
    height = request.room.height
    tall = {unit.asset.name: unit.asset.size.height for unit in brief.units if unit.asset.size.height > height}
    return [
        f"{name} is {needed:.2f} m high, but the ceiling is {height:.2f} m: at least {needed:.2f} m is required"
        for name, needed in sorted(tall.items(), key=lambda entry: -entry[1])
    ]


def infeasible(request: Request, conflicts: Sequence[str]) -> InfeasibleError:
    """Return the error for a room that cannot hold a protocol."""
    room = request.room
    what = (
        f"a {room.width:g} x {room.depth:g} m room cannot hold protocol {request.protocol.id!r} under profile "
        f"{request.profile.name!r}"
    )
    return InfeasibleError(what, conflicts, smallest_preset(request))


def search_stopped(request: Request, effort: float, reasons: Sequence[str] = ()) -> SearchLimitError:
    """Return the error for a solver that stopped without a floor plan and without a proof of infeasibility."""
    what = f"the solver stopped at its effort limit ({effort:g}) before finding a layout for {_where(request)}"
    return _search_error(request, what, reasons)


def attempts_used_up(request: Request, attempts: int, errors: Sequence[str]) -> SearchLimitError:
    """Return the error for floor plans that all break a facility rule; `errors` are those of the last one."""
    what = f"each of the {attempts} floor plans found for {_where(request)} breaks a facility rule"
    return _search_error(request, what, errors)


def _where(request: Request) -> str:
    return f"protocol {request.protocol.id!r} in a {request.room.width:g} x {request.room.depth:g} m room"


def _search_error(request: Request, what: str, reasons: Sequence[str]) -> SearchLimitError:
    what += "; a layout may exist"
    remedy = "try another seed or a larger room"
    return SearchLimitError(what, reasons, smallest_preset(request), remedy=remedy)


def explain(request: Request, brief: Brief) -> InfeasibleError:
    """Return the error for a brief that has no floor plan.

    Groups of constraints clash if lifting them, and no fewer, leaves a solution. If lifting all of them leaves none,
    the furniture does not fit along the walls.
    """
    return infeasible(request, clashes(request, brief) or [_demand(request, brief)])


def clashes(request: Request, brief: Brief) -> list[str]:
    """Return the smallest sets of constraint groups (one or two) without which there is a floor plan."""
    conflicts = [_named(brief, request, group) for group in GROUPS if _solvable(brief, request, (group,))]
    if not conflicts:
        pairs = [pair for pair in combinations(GROUPS, 2) if _solvable(brief, request, pair)]
        conflicts = [f"{first} together with {second}" for first, second in pairs]
    return conflicts


def smallest_preset(request: Request) -> str | None:
    """Return the name of the smallest room preset that holds a protocol's required furniture, or None."""
    for name, room in room_presets().items():
        trial = replace(request, floor=room.floor, fixed=())
        if room_conflicts(trial):
            continue
        for attempt in range(PRESET_TRIES):
            generator = np.random.default_rng([attempt])
            try:
                brief = write_brief(trial, "required", generator)
            except InfeasibleError:
                return None
            if solve(choose_walls(brief, room, generator), room, 0, effort=PRESET_EFFORT).status == "solved":
                return name
        if solve(brief, room, 0, effort=EFFORT).status == "solved":
            return name
    return None


def _solvable(brief: Brief, request: Request, lifted: Sequence[str]) -> bool:
    return solve(brief, request.room, 0, lifted=lifted, effort=EFFORT).status == "solved"


def _named(brief: Brief, request: Request, group: str) -> str:
    """A group of constraints with its figures."""
    if group == "separations":
        named = [f"{rule.first} {rule.distance:.2f} m from {rule.second} ({rule.reason})" for rule in brief.separations]
        more = f" and {len(named) - SHOWN} more" if len(named) > SHOWN else ""
        return "separations: " + ", ".join(named[:SHOWN]) + more
    if group in ("hood clearance", "front clearance"):
        owners = [unit for unit in brief.units if unit.asset.fume_hood == (group == "hood clearance")]
        widest = sorted(owners, key=lambda unit: -unit.front)[:3]
        return f"{group}: " + ", ".join(f"{unit.front:g} m clear in front of {unit.id}" for unit in widest)
    if group == "doors":
        doors = len(request.room.doors)
        noun = "the door" if doors == 1 else f"each of {doors} doors"
        return f"doors: {brief.door_zone:g} m clear inside {noun}, hoods {brief.hood_door:g} m away"
    if group == "emergency shower":
        clear = max((unit.clear for unit in brief.units), default=0.0)
        return f"emergency shower: {clear:.2f} m clear on all sides"
    return f"aisles: {brief.aisle:g} m around islands"


def _demand(request: Request, brief: Brief) -> str:
    """Length of wall that the furniture needs and that the room has, corners counted once."""
    room = request.room
    units = [unit for unit in brief.units if unit.stance == "wall"]
    needed = sum(unit.width for unit in units)
    between = 2.0 * (room.width + room.depth) - sum(door_span(door) for door in room.doors)
    corners = 4.0 * min((unit.depth for unit in units), default=0.0)
    longest: Unit = max(units, key=lambda unit: unit.width)
    message = (
        f"furniture: {len(units)} pieces are {needed:.1f} m wide together; of {between:.1f} m of wall between doors at "
        f"most {between - corners:.1f} m can be used, because neighboring walls share the corners"
    )
    if longest.width > max(room.width, room.depth) - 0.02:
        message += f", and {longest.id} is {longest.width:.2f} m wide"
    return message
