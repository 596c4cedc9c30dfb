"""Faults of a written layout, by polygons; independent of the rules of `labgym.layouts.rules`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import shapely
from shapely.geometry import Point

from labgym.eval.outside.written_plan import WrittenItem, WrittenPlan

DEEP = 1e-3
"""Two solids overlap if they interpenetrate by more than this on every axis, meters."""
BEYOND = 0.01
"""Footprints may reach this far beyond the floor: skirting and plaster, meters."""
LOOSE_FIT = 0.005
"""Largest gap between an object and its support, and largest overhang over a surface, meters."""
BRACKET = 0.02
"""Largest gap between an object on a wall and the wall, meters."""
DISC, WAY = 0.30, 0.45
"""Radius of the robot's planning disc, and half the width of a way out, meters."""
NICHE = 0.30
"""Furniture narrower than a way out may stand in a niche: the way passes its place of work within this, meters."""
ROBOT_TOP, HEAD, PROTRUDES = 1.40, 2.0, 0.10
"""Height of the robot; height of a way out; depth from which an object on a wall is in a way out; meters."""
MOVABLE = {"seat", "trolley", "carton", "drum", "floor_sign", "container", "spill", "fire"}
"""Subtypes of what people push aside or carry away."""
SLACK = 2e-3
"""Rounding of coordinates and of round corners, meters."""


@dataclass(frozen=True)
class OutsideFinding:
    """A violation: its kind, the objects concerned, and its size in meters."""

    kind: str
    who: tuple[str, ...]
    value: float = 0.0


def findings(plan: WrittenPlan) -> list[OutsideFinding]:
    """Return what is wrong with a layout by its polygons."""
    return [
        *_overlaps(plan),
        *_outside(plan),
        *_unsupported(plan),
        *unreached(plan, "goal", DISC, _in_the_robots_way(plan), plan.goals(), {}),
        *unreached(plan, "way out", WAY, _in_a_way_out(plan), *_places(plan)),
    ]


def _overlaps(plan: WrittenPlan) -> Iterator[OutsideFinding]:
    blocks = [*plan.building, *(block for item in plan.items for block in item.blocks())]
    thin = [block.polygon.buffer(-DEEP / 2, join_style="mitre") for block in blocks]
    first, second = shapely.STRtree(thin).query(thin, predicate="intersects")
    seen = set()
    for one, other in zip(first.tolist(), second.tolist(), strict=True):
        a, b = blocks[one], blocks[other]
        fixed = one < len(plan.building) and other < len(plan.building)
        depth = min(a.z1, b.z1) - max(a.z0, b.z0)
        if plan.assembled(a.owner, b.owner):
            continue
        if one < other and not fixed and a.owner != b.owner and depth > DEEP and (a.owner, b.owner) not in seen:
            seen.add((a.owner, b.owner))
            yield OutsideFinding("overlap", (a.owner, b.owner), depth)


def _outside(plan: WrittenPlan) -> Iterator[OutsideFinding]:
    allowed = plan.domain.buffer(BEYOND, join_style="mitre")
    for item in plan.items:
        if not allowed.covers(item.footprint):
            yield OutsideFinding("outside", (item.id,), item.footprint.difference(allowed).area)


def _unsupported(plan: WrittenPlan) -> Iterator[OutsideFinding]:
    for item in plan.items:
        if item.support == "floor":
            if abs(item.z) > LOOSE_FIT:
                yield OutsideFinding("support", (item.id, "floor"), abs(item.z))
        elif item.support == "wall":
            gap = _wall_gap(plan, item)
            if gap > BRACKET:
                yield OutsideFinding("support", (item.id, "wall"), gap)
        else:
            yield from _on_surface(plan, item)


def _on_surface(plan: WrittenPlan, item: WrittenItem) -> Iterator[OutsideFinding]:
    carrier = plan.by_id.get(item.support)
    surfaces = carrier.surfaces() if carrier is not None else []
    if item.slot is None or item.slot >= len(surfaces):
        yield OutsideFinding("support", (item.id, item.support))
        return
    polygon, z = surfaces[item.slot]
    if abs(item.z - z) > LOOSE_FIT:
        yield OutsideFinding("support", (item.id, item.support), abs(item.z - z))
    if not polygon.buffer(LOOSE_FIT, join_style="mitre").covers(item.footprint):
        yield OutsideFinding("overhang", (item.id, item.support), item.footprint.difference(polygon).area)


def _wall_gap(plan: WrittenPlan, item: WrittenItem) -> float:
    """Distance of the back of an object to the wall or column behind it, at the middle of its height."""
    middle = item.z + item.height / 2
    back = item.rectangle(-item.width / 4, item.width / 4, -item.depth / 2, -item.depth / 2 + 1e-4)
    behind = [block.polygon.distance(back) for block in plan.building if block.z0 < middle < block.z1]
    return min(behind, default=math.inf)


def _in_the_robots_way(plan: WrittenPlan) -> list[shapely.Polygon]:
    standing = [item.footprint for item in plan.items if item.support in ("floor", "wall") and item.z < ROBOT_TOP]
    return [*standing, *(block.polygon for block in plan.building if block.z0 < ROBOT_TOP)]


def _in_a_way_out(plan: WrittenPlan) -> list[shapely.Polygon]:
    obstacles = [block.polygon for block in plan.building if block.z0 < HEAD]
    for item in plan.items:
        stands = item.support == "floor" and item.entry["subtype"] not in MOVABLE
        protrudes = item.support == "wall" and item.depth > PROTRUDES and item.z < HEAD
        if stands or protrudes:
            obstacles.append(item.footprint)
    return obstacles


def _places(plan: WrittenPlan) -> tuple[dict[str, Point], dict[str, float]]:
    """The places of work, and how far from each a way out may pass."""
    places, reach = {}, {}
    for item in plan.items:
        used = item.entry.get("clearance", 0.0) > 0.0 and item.entry["subtype"] not in MOVABLE
        if item.support == "floor" and used:
            places[item.id] = item.in_front(0.60)
            reach[item.id] = WAY + (NICHE if item.width < 2 * WAY else 0.0)
    return places, reach


def unreached(
    plan: WrittenPlan,
    kind: str,
    radius: float,
    obstacles: list[shapely.Polygon],
    places: dict[str, Point],
    reach: dict[str, float],
) -> Iterator[OutsideFinding]:
    """Yield what a disc does not reach from an exit; its center moves where it is a radius away from every obstacle."""
    grown = shapely.union_all([polygon.buffer(radius - SLACK, quad_segs=32) for polygon in obstacles])
    free = plan.domain.difference(grown)
    parts = [part for part in getattr(free, "geoms", [free]) if part.area > 0.0]
    if not plan.exits:
        yield OutsideFinding("no exit", ())
    for number, exit_ in enumerate(plan.exits):
        start = exit_.inside(radius)
        part = min(parts, key=lambda part: part.distance(start), default=None)
        if part is None or part.distance(start) > 2 * SLACK:
            yield OutsideFinding(kind, (f"exit {number}",), 0.0 if part is None else part.distance(start))
            continue
        for name, place in places.items():
            gap = part.distance(place) - reach.get(name, 0.0)
            if gap > 2 * SLACK:
                yield OutsideFinding(kind, (f"exit {number}", name), gap)
