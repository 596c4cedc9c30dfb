"""Floors that cannot hold what protocols require, and searches that end without a plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from labgym.errors import InfeasibleError, SearchLimitError
from labgym.geometry import OrientedBox
from labgym.layouts.brief import Content, Unit
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.distribution import wall_length
from labgym.layouts.interiors.furnisher import FurnishedSpace
from labgym.layouts.interiors.interior import Interior, fixed_pieces
from labgym.layouts.interiors.standing import Standing
from labgym.layouts.interiors.supply import required
from labgym.layouts.model import Layout
from labgym.layouts.pieces import pieces, unit_of
from labgym.layouts.request import Request
from labgym.layouts.rules import facility
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import cut_off
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import EGRESS_WIDTH
from labgym.layouts.stocking import plan_cabinets

Pieces = Mapping[str, Sequence[tuple[Unit, OrientedBox]]]


def obstructions(units: Sequence[Unit], grounds: Sequence[Ground], fixed: Pieces) -> list[str]:
    """Return a sentence for each unit that would stand at no wall even if it were the only one.

    Args:
        grounds: the spaces that may be furnished.
        fixed: the fixed pieces of each space, by its id.
    """
    return [
        f"{unit.id} ({unit.width:.2f} m wide, {unit.depth:.2f} m deep) has no place along a wall: "
        f"{_reason(unit, grounds, fixed)}"
        for unit in units
        if not any(_has_place(unit, ground, fixed.get(ground.space, ())) for ground in grounds)
    ]


def _reason(unit: Unit, grounds: Sequence[Ground], fixed: Pieces) -> str:
    """The first thing without which the unit would have a place."""
    kinds = sorted({kind for ground in grounds for kind in unit.supplies if kind in ground.supplies.required})
    reliefs: list[tuple[str, Callable[[Ground], bool]]] = [
        (
            f"within reach of {' and '.join(kinds)} nothing is free",
            lambda ground: _has_place(replace(unit, supplies=()), ground, fixed.get(ground.space, ())),
        ),
        (
            f"fixed pieces take it ({', '.join(piece.id for pieces in fixed.values() for piece, _ in pieces)})",
            lambda ground: _has_place(unit, ground, ()),
        ),
        (
            "keep-outs take it",
            lambda ground: _has_place(unit, replace(ground, clear=()), fixed.get(ground.space, ())),
        ),
        (
            f"doors take it, with the {HOOD_DOOR_LEAST:g} m that hoods keep from them"
            if unit.asset.fume_hood
            else "the areas inside doors take it",
            lambda ground: _has_place(unit, replace(ground, gates=()), fixed.get(ground.space, ())),
        ),
        (
            f"{unit.front:.2f} m in front of it must be free",
            lambda ground: _has_place(replace(unit, front=0.0), ground, fixed.get(ground.space, ())),
        ),
    ]
    for text, relief in reliefs:
        if any(relief(ground) for ground in grounds):
            return text
    segments = [segment for ground in grounds for segment in ground.segments]
    stretches = [stretch for segment in segments for stretch in segment.free(unit.asset.size.height)]
    longest = max((high - low for low, high in stretches), default=0.0)
    return f"the longest free stretch is {longest:.2f} m"


def _has_place(unit: Unit, ground: Ground, fixed: Sequence[tuple[Unit, OrientedBox]]) -> bool:
    """Whether a unit could stand at a wall of a space among its fixed pieces alone."""
    if unit.asset.size.height > ground.ceiling:
        return False
    standing = Standing(ground)
    for piece, foot in fixed:
        standing.add(foot, piece.front, piece.clear)
    options = [(segment, standing.places(segment, unit)) for segment in ground.segments]
    return bool(required([option for option in options if option[1]], unit, ground.supplies))


def check_floor(request: Request, grounds: Sequence[Ground]) -> None:
    """Refuse a floor that is unsuitable for any furniture.

    Raises:
        InfeasibleError: too few exits, no space for laboratory work, none that is high enough for a hood, or fixed
            objects that break a rule.
    """
    layout = Layout(id="empty", floor=request.floor, placements=(), catalog=request.catalog)
    exits = facility.issues(facility.EXITS, Site(Arrangement.of(layout), None, request.profile))
    conflicts = [issue.message for issue in exits if issue.severity == "error"]
    if all(ground.use == "corridor" for ground in grounds):
        conflicts.append("all spaces are corridors: give one the use 'laboratory'")
    highest = max(ground.ceiling for ground in grounds)
    units = [unit_of(request, piece) for piece in pieces(request, plan_cabinets(request), "required")]
    tall = {unit.asset.name: unit.asset.size.height for unit in units if unit.asset.size.height > highest}
    conflicts += [
        f"{name} is {height:.2f} m high, but the ceiling is {highest:.2f} m: at least {height:.2f} m is required"
        for name, height in sorted(tall.items())
    ]
    conflicts += _fixed_conflicts(request)
    standing = fixed_pieces(request, (), grounds)
    for ground in grounds if request.fixed else ():
        room = Interior(ground)
        for unit, foot in standing[ground.space]:
            if not room.add_anyway(unit, foot):
                way = f"no way {2.0 * room.ways.radius:.2f} m wide between the doors of {ground.space!r}"
                conflicts.append(f"fixed: {unit.id} leaves {way}")
                break
    if conflicts:
        raise InfeasibleError(_sentence(request, "cannot hold"), conflicts, None, remedy="change the floor")


SMALLEST_LABORATORY_M2 = 5.0
"""Area of the smallest laboratory next to others; smaller ones, such as closets of read floors, stay empty."""


def usable(request: Request, grounds: Sequence[Ground]) -> list[Ground]:
    """Return the spaces to which ways of the required width lead from all exits, without closets.

    Raises:
        InfeasibleError: no space for laboratory work is reached.
    """
    missed = cut_off(request.floor) if len(grounds) > 1 else {}
    able = [ground for ground in grounds if not any(ground.space in spaces for spaces in missed.values())]
    if all(ground.use == "corridor" for ground in able):
        conflicts = [
            f"no way {EGRESS_WIDTH:.2f} m wide leads from {entrance} to {len(spaces)} of {len(grounds)} spaces"
            for entrance, spaces in missed.items()
            if spaces
        ]
        remedy = "widen the doors on these ways, or remove exits, so that a way leads from each exit to one laboratory"
        raise InfeasibleError(_sentence(request, "cannot hold"), conflicts, None, remedy=remedy)
    large = [ground for ground in able if ground.use != "laboratory" or ground.area >= SMALLEST_LABORATORY_M2]
    return able if all(ground.use == "corridor" for ground in large) else large


def _fixed_conflicts(request: Request) -> list[str]:
    """Return what is wrong with the fixed objects alone: outside, overlapping, in doors, keep-outs or off services."""
    if not request.fixed:
        return []
    fixed = Layout(id="fixed", floor=request.floor, placements=request.fixed, catalog=request.catalog)
    assessment = evaluate_layout(fixed, None, request.rules)
    placing = (violation for violation in assessment.violations.items if violation.kind in ("bounds", "collision"))
    conflicts = [f"fixed: {violation.message}" for violation in placing]
    issues = [issue for issue in facility.issues(facility.PLACING, assessment.site) if issue.severity == "error"]
    return conflicts + [f"fixed: {i.message}" for i in issues if i.rule in ("door_area", "keep_out", "supply")]


def check_holdings(request: Request, units: Sequence[Unit], contents: Mapping[str, tuple[Content, ...]]) -> None:
    """Check that everything required exists if nothing may be bought.

    Raises:
        InfeasibleError: names what must be bought.
    """
    if request.holdings is None or request.holdings.purchases != "none":
        return
    things = [unit.asset for unit in units] + [content.asset for each in contents.values() for content in each]
    listed = any(request.catalog.get(name).kind == "reagent" for name in request.holdings.counts)
    missing = request.holdings.missing(thing.name for thing in things if thing.kind != "reagent" or listed)
    if missing:
        names = ", ".join(f"{count} {name}" for name, count in missing.items())
        what = _sentence(request, "cannot be furnished from what exists for")
        raise InfeasibleError(what, [f"missing: {names}"], None, remedy="buy them, or allow purchases")


def check_places(request: Request, required: Sequence[Unit], grounds: Sequence[Ground]) -> None:
    """Refuse a floor on which some required piece would stand at no wall even if it were the only one.

    Raises:
        InfeasibleError: names the pieces; of floors with oblique walls, along which not all places are tried, no error.
    """
    able = [ground for ground in grounds if ground.use != "corridor"] or list(grounds)
    if not all(segment.straight for ground in able for segment in ground.segments):
        return
    fixed = {placement.id for placement in request.fixed}
    free = [unit for unit in required if unit.id not in fixed]
    obstructed = obstructions(free, able, fixed_pieces(request, required, grounds))
    if obstructed:
        raise InfeasibleError(_sentence(request, "cannot hold"), obstructed, None, remedy="change the floor")


def check_walls(request: Request, required: Sequence[Unit], grounds: Sequence[Ground]) -> None:
    """Refuse a floor whose walls are shorter than its required pieces are wide together: each stands along a wall.

    Raises:
        InfeasibleError: names both lengths.
    """
    fixed = {placement.id for placement in request.fixed}
    free = [unit for unit in required if unit.id not in fixed]
    able = [ground for ground in grounds if ground.use != "corridor"] or grounds
    needed, offered = sum(unit.width for unit in free), sum(_usable_length(free, ground) for ground in able)
    if needed > offered:
        conflict = (
            f"{len(free)} pieces are {needed:.1f} m wide together; the walls at which they can stand are "
            f"{offered:.1f} m long"
        )
        raise InfeasibleError(_sentence(request, "cannot hold"), [conflict], None, remedy="enlarge the floor")


def _usable_length(units: Sequence[Unit], ground: Ground) -> float:
    """Return the length of wall that one or another unit can take while the others are elsewhere, meters."""
    standing, total = Standing(ground), 0.0
    for segment in ground.segments:
        end = 0.0
        for low, high in sorted((a, b + unit.width) for unit in units for a, b in standing.places(segment, unit)):
            total += max(high - max(low, end), 0.0)
            end = max(end, high)
    return total


def failure(
    request: Request,
    required: Sequence[Unit],
    grounds: Sequence[Ground],
    outcome: FurnishedSpace,
    attempts: Counter[str],
) -> InfeasibleError:
    """Return the error for a floor without a plan: infeasible if that is proved, else a search that ended."""
    needed = sum(unit.width for unit in required)
    offered = sum(wall_length(ground) for ground in grounds if ground.use != "corridor")
    demand = (
        f"{len(required)} pieces are {needed:.1f} m wide together; the walls between doors, without corners, are "
        f"{offered:.1f} m long"
    )
    if outcome.proven:
        return InfeasibleError(_sentence(request, "cannot hold"), [demand], None, remedy="enlarge the floor")
    words = {
        "infeasible": "had no plan on the walls that they chose",
        "stopped": "reached the solver's effort limit",
        "closed": "cut a door or a place of work off",
    }
    tried = [f"{attempts[word]} attempts {text}" for word, text in words.items() if attempts[word]]
    what = f"no plan was found for {_sentence(request, 'with')}; a layout may exist"
    remedy = "try another seed or a larger floor"
    where = [f"the furniture of {outcome.space!r} found no places"] if len(grounds) > 1 else []
    return SearchLimitError(what, [*where, *tried, demand], None, remedy=remedy)


def _sentence(request: Request, verb: str) -> str:
    """Return the floor, a verb and the protocols as the start of a message."""
    names = ", ".join(repr(protocol.id) for protocol in request.protocols)
    noun = "protocol" if len(request.protocols) == 1 else "protocols"
    return f"floor {request.floor.name!r} {verb} {noun} {names}"
