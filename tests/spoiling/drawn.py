"""Ways to spoil a layout at random, by kind: each draw breaks a safety rule that the layout kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from labgym.layouts.floor.walls import Opening, Wall
from labgym.layouts.model import Layout
from labgym.layouts.moves import Rotate, Settle, apply, lifted, replaced, without
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.safety.heights import REAGENT_HEIGHT_M, mounting
from labgym.layouts.rules.safety.rooms import REQUIREMENTS
from labgym.layouts.rules.safety.square import furniture_rows
from labgym.layouts.rules.safety.standing import forbidden
from labgym.layouts.rules.site import Site
from labgym.protocols import Protocol
from spoiling.objects import ids_where

Item = TypeVar("Item")
Draw = Callable[[Layout, Protocol, np.random.Generator], Layout]

LEAST_COVER_M = 0.05
"""A wall item is drawn at least this far over an opening, meters."""
BEYOND_M = (0.05, 0.9)
"""How far an object is drawn beyond a limit of its height, meters."""
SKEW_RAD = (math.radians(3.0), math.radians(45.0))
"""Angles by which furniture is turned."""


@dataclass(frozen=True)
class DrawnSpoiling:
    """A kind of fault.

    Attributes:
        title: what is done, in words.
        rules: safety rules, one of which each draw breaks; the rule of missing equipment is a violation of kind
            `missing`, too.
        draw: returns a spoilt layout, or the same object if there is nothing of the kind to spoil.
    """

    title: str
    rules: frozenset[str]
    draw: Draw


def over_opening(layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Hang a wall item across a door, a passage or a window, from either side, by any part of its width."""
    items = ids_where(layout, lambda p, _: p.support == WALL)
    openings = [(wall, opening) for wall in layout.floor.walls for opening in wall.openings]
    for item in _shuffled(items, generator):
        for wall, opening in _shuffled(openings, generator):
            for side in _shuffled((1.0, -1.0), generator):
                moved = _across(layout, item, wall, opening, side, generator)
                if moved is not None:
                    return moved
    return layout


def _across(
    layout: Layout, item: str, wall: Wall, opening: Opening, side: float, generator: np.random.Generator
) -> Layout | None:
    """Return the layout with an item over a part of an opening; None if that side of the wall is no room."""
    size, placement = layout.asset(item).size, layout.placement(item)
    reach = (opening.width + size.width) / 2.0 - LEAST_COVER_M
    low, high = size.width / 2.0, wall.length - size.width / 2.0
    along = float(np.clip(opening.position + generator.uniform(-reach, reach), low, high)) if low < high else -1.0
    if abs(along - opening.position) > reach:
        return None
    x, y = wall.point(along, side * (wall.thickness / 2.0 + size.depth / 2.0 + 0.005))
    if layout.floor.space_at(*wall.point(along, side * (wall.thickness / 2.0 + 0.3))) is None:
        return None
    z = placement.position[2]
    if z > opening.top - LEAST_COVER_M or z + size.height < opening.sill + LEAST_COVER_M:
        z = (opening.sill + opening.top - size.height) / 2.0
    yaw = wall.yaw if side > 0.0 else wall.yaw + math.pi
    position = (round(x, 6), round(y, 6), round(max(z, 0.0), 6))
    hung = placement.model_copy(update={"position": position, "yaw": math.remainder(yaw, math.tau)})
    return replaced(layout, {item: hung})


def wrong_height(layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Hang a wall item too high or too low, or put a reagent on a shelf above eye level."""
    ways = [_hung_wrong, _shelved_high]
    for way in _shuffled(ways, generator):
        spoilt = way(layout, generator)
        if spoilt is not layout:
            return spoilt
    return layout


def _hung_wrong(layout: Layout, generator: np.random.Generator) -> Layout:
    items = ids_where(layout, lambda p, a: p.support == WALL and mounting(a) is not None)
    for item in _shuffled(items, generator):
        limits, height = mounting(layout.asset(item)), layout.asset(item).size.height
        ceiling = min(space.ceiling for space in layout.floor.spaces)
        beyond = generator.uniform(*BEYOND_M)
        assert limits is not None
        heights = (min(limits.top + beyond, ceiling) - height, max(limits.bottom - beyond, 0.0))
        for bottom in _shuffled(heights, generator):
            if bottom + height > limits.top + 0.01 or bottom < limits.bottom - 0.01:
                return lifted(layout, item, round(float(bottom), 6))
    return layout


def _shelved_high(layout: Layout, generator: np.random.Generator) -> Layout:
    reagents = ids_where(layout, lambda p, a: a.kind == "reagent" and p.support not in (FLOOR, WALL))
    places = [
        (placement.id, slot)
        for placement in layout.placements
        for slot in range(len(layout.asset(placement.id).surfaces))
        if layout.surface(placement.id, slot).z0 > REAGENT_HEIGHT_M + 0.01
    ]
    if not reagents or not places:
        return layout
    chosen = _shuffled(reagents, generator)[: int(generator.integers(1, len(reagents) + 1))]
    for reagent in chosen:
        own = [place for place in places if place[0] == layout.placement(reagent).support] or places
        layout = _settled(layout, reagent, own[int(generator.integers(len(own)))], generator)
    return layout


def misplaced(layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Put an object on or in furniture where its kind does not belong."""
    items = [p.id for p in layout.placements if p.support != WALL and not layout.children(p.id)]
    carriers = [p.id for p in layout.placements if layout.asset(p.id).surfaces]
    for item in _kinds_first(layout, items, generator):
        excluded = [one for one in carriers if forbidden(layout.asset(item), layout.asset(one)) is not None]
        for carrier in _shuffled(excluded, generator):
            slot = int(generator.integers(len(layout.asset(carrier).surfaces)))
            return _settled(layout, item, (carrier, slot), generator)
    return layout


def skewed(layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Turn a piece of furniture by 3 to 45 degrees, with what stands on it."""
    rows = furniture_rows(Arrangement.of(layout))
    pieces = [p.id for p in (Arrangement.of(layout).placements[row] for row in rows) if p.support == FLOOR]
    if not pieces:
        return layout
    piece = _kinds_first(layout, pieces, generator)[0]
    turn = float(generator.uniform(*SKEW_RAD)) * (1.0 if generator.random() < 0.5 else -1.0)
    return apply(layout, Rotate(piece, layout.placement(piece).yaw + turn))


def equipment_missing(layout: Layout, protocol: Protocol, generator: np.random.Generator) -> Layout:
    """Remove a kind of required equipment from one room that needs it, or carry it to a room that does not."""
    site = Site(Arrangement.of(layout), protocol)
    rooms = sorted(set(site.rooms.tolist()))
    needed = [
        (site.rows_in(room, one.accepted), room)
        for one in REQUIREMENTS
        for room in rooms
        if one.causes(site, room) and site.rows_in(room, one.accepted)
    ]
    if not needed:
        return layout
    rows, room = needed[int(generator.integers(len(needed)))]
    ids = [site.arrangement.placements[row].id for row in rows]
    spare = [other for other in rooms if other != room and not site.work.get(other)]
    if spare and generator.random() < 0.5:
        space = layout.floor.spaces[spare[int(generator.integers(len(spare)))]]
        region = space.region[0]
        x, y = space.boxes[0].x, space.boxes[0].y
        for k, each in enumerate(ids):
            placement, across = layout.placement(each), (k + 0.5) / len(ids) - 0.5
            shift = across * (region.x1 - region.x0) * 0.8
            position = (round(x + shift * math.cos(space.yaw), 6), round(y + shift * math.sin(space.yaw), 6))
            moved = placement.model_copy(update={"position": (*position, placement.position[2])})
            layout = replaced(layout, {each: moved})
        return layout
    return without(layout, ids)


def _settled(layout: Layout, item: str, place: tuple[str, int], generator: np.random.Generator) -> Layout:
    """Return the layout with an item on a surface, at a random place that keeps it on it if it fits."""
    surface, size = layout.surface(*place), layout.asset(item).size
    x, y = (
        float(generator.uniform(-1.0, 1.0)) * max(whole - own, 0.0) / 2.0
        for whole, own in ((surface.width, size.width), (surface.depth, size.depth))
    )
    return apply(layout, Settle(item, place[0], place[1], round(x, 6), round(y, 6)))


def _kinds_first(layout: Layout, ids: Sequence[str], generator: np.random.Generator) -> list[str]:
    """Return ids in a random order of their subtypes, so that rare kinds are drawn as often as frequent ones."""
    by_kind: dict[str, list[str]] = {}
    for each in ids:
        by_kind.setdefault(layout.asset(each).subtype, []).append(each)
    kinds = _shuffled(sorted(by_kind), generator)
    return [each for kind in kinds for each in _shuffled(by_kind[kind], generator)]


def _shuffled(items: Sequence[Item], generator: np.random.Generator) -> list[Item]:
    return [items[k] for k in generator.permutation(len(items))]


DRAWN: Mapping[str, DrawnSpoiling] = {
    "wall_item_over_opening": DrawnSpoiling(
        "a wall item over a door or a window", frozenset({"wall_opening"}), over_opening
    ),
    "wrong_height": DrawnSpoiling(
        "something too high or too low",
        frozenset({"wall_height", "reagent_height", "heavy_height", "detector_height"}),
        wrong_height,
    ),
    "misplaced": DrawnSpoiling("an object where it does not belong", frozenset({"misplaced"}), misplaced),
    "skewed_furniture": DrawnSpoiling("skewed furniture", frozenset({"square"}), skewed),
    "equipment_missing": DrawnSpoiling(
        "a room without equipment that it needs", frozenset(one.name for one in REQUIREMENTS), equipment_missing
    ),
}
"""Kinds of faults that `touchstone` missed before it had safety rules, drawn with a random generator."""
