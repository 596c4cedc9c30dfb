"""Which furniture a room gets for a protocol and which walls it prefers.

Walls have roles: `store` and `work` are the two side walls. The hood line is on the back wall with rotary evaporators
and waste next to it, storage on one side, wet work and cleaning on the other, weighing and analysis near the entrance.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from labgym.assets import Asset
from labgym.layouts.brief import LEVELS, Furnishing, Stance, Unit, Wall
from labgym.layouts.cabinets import Cabinet
from labgym.layouts.habits import Side
from labgym.layouts.model import FLOOR, Room
from labgym.layouts.request import Request
from labgym.layouts.rules.thresholds import SHOWER_RADIUS
from labgym.layouts.rules.zones import door_span

Sides = dict[Side, Wall]

GOAL_FRONT = 1.0
"""Free depth in front of a location: the stand-off of 0.60 m, the robot's 0.30 m, and two cells of the grid."""
FILLED = 0.7
"""Share of the wall length up to which a room is filled; the rest is left for doors, passages and wall equipment."""
HEAVY_AISLE = 1.5
AISLE = 1.2
"""Clear width around islands, metres: 1.5 between occupied benches, 1.2 at least (design.md, section 6)."""
BENCH_DEPTH, HOOD_DEPTH, SIDE_DEPTH, ISLAND_DEPTH, HOOD_FRONT = 0.8, 0.85, 0.85, 1.5, 1.5
"""Depths of a row at the front wall, at the back wall and at a side wall, of an island, and in front of hoods, meters;
they only estimate how many islands fit."""
MOST_ISLANDS = 3
PENINSULA_SHARE = 0.25
"""Share of rooms with a single row in which a peninsula is tried instead of an island."""


def draw_sides(generator: np.random.Generator) -> Sides:
    """Return which wall plays which role; the seed decides whether storage is on the left or on the right."""
    sides: Sides = {"front": "front", "back": "back", "store": "left", "work": "right"}
    if generator.random() < 0.5:
        sides |= {"store": "right", "work": "left"}
    return sides


def furniture(
    request: Request,
    cabinets: Sequence[Cabinet],
    sides: Sides,
    furnishing: Furnishing,
    generator: np.random.Generator,
) -> tuple[Unit, ...]:
    """Return every unit of a room: locations, safety and storage, floor instruments, islands, and filling."""
    units = [
        *_location_units(request, sides, generator),
        *_further_units(request, sides, furnishing, generator),
        *_cabinet_units(request, cabinets, sides, generator),
        *_floor_instruments(request, sides, generator),
        *_island_units(request, furnishing, generator),
    ]
    units = _with_fixed(request, units)
    if furnishing == "full":
        units += _filling_units(request, units, sides, generator)
    return tuple(units)


def _with_fixed(request: Request, units: Sequence[Unit]) -> list[Unit]:
    """Let fixed floor objects take the place of units of the same asset; each of the others becomes a separate unit."""
    merged, fixed = list(units), {placement.id for placement in request.fixed}
    for placement in request.fixed:
        if placement.support != FLOOR:
            continue
        asset = request.fixed_asset(placement)
        places = [k for k, unit in enumerate(merged) if unit.id == placement.id]
        places += [k for k, unit in enumerate(merged) if unit.asset.name == asset.name and unit.id not in fixed]
        if places:
            unit = merged[places[0]]
            size, reason = asset.size, f"{unit.reason}; fixed by the request"
            merged[places[0]] = replace(
                unit, id=placement.id, asset=asset, width=size.width, depth=size.depth, reason=reason
            )
        else:
            size = asset.size
            unit = Unit(placement.id, asset, size.width, size.depth, asset.clearance, reason="fixed by the request")
            merged.append(unit)
    return merged


def _location_units(request: Request, sides: Sides, generator: np.random.Generator) -> list[Unit]:
    """A unit for every location of the protocol and every location that a laboratory always has."""
    protocol, always = request.protocol, request.habits.always
    units = []
    for name in dict.fromkeys((*always, *protocol.locations)):
        steps = [number for number, step in enumerate(protocol.steps, 1) if step.location == name]
        reasons = [f"location of step {', '.join(map(str, steps))}"] if steps else []
        reasons += [f"every laboratory has one ({always[name]})"] if name in always else []
        reason = "; ".join(reasons) or "location of the protocol"
        units.append(_wall_unit(request, name, f"{name}_1", sides, generator, reason, GOAL_FRONT))
    return units


def _further_units(
    request: Request, sides: Sides, furnishing: Furnishing, generator: np.random.Generator
) -> Iterable[Unit]:
    """The furniture of this level of furnishing and of the levels below it, required pieces first."""
    for level in reversed(LEVELS[LEVELS.index(furnishing) :]):
        for piece in request.habits.furniture:
            if piece.level == level:
                yield _wall_unit(request, piece.asset, f"{piece.asset}_1", sides, generator, piece.reason)


def _cabinet_units(
    request: Request, cabinets: Sequence[Cabinet], sides: Sides, generator: np.random.Generator
) -> Iterable[Unit]:
    for cabinet in cabinets:
        names = ", ".join(asset.name for asset in cabinet.reagents)
        reason = f"stores {names} (storage class {cabinet.asset.storage_class})"
        yield _wall_unit(request, cabinet.asset.name, cabinet.id, sides, generator, reason)


def _floor_instruments(request: Request, sides: Sides, generator: np.random.Generator) -> list[Unit]:
    units: list[Unit] = []
    for name in request.protocol.instruments:
        asset = request.catalog.find(name)
        if asset.placing == "floor":
            number = 2 + sum(unit.asset.name == asset.name for unit in units)
            unit_id = f"{asset.name}_{number}"
            units.append(_wall_unit(request, asset.name, unit_id, sides, generator, "instrument of the protocol"))
    return units


def _filling_units(
    request: Request, units: Sequence[Unit], sides: Sides, generator: np.random.Generator
) -> Iterable[Unit]:
    """Benches, cold storage and racks for the wall that the other units leave free."""
    room = request.room
    offered = 2.0 * (room.width + room.depth) - sum(door_span(door) for door in room.doors)
    used = sum(unit.width for unit in units if unit.stance == "wall")
    filling: list[Unit] = []
    for name in request.habits.filling:
        ids = {unit.id for unit in (*units, *filling)}
        number = 1 + sum(unit.asset.name == name for unit in filling)
        while f"{name}_{number}" in ids:
            number += 1
        unit = _wall_unit(request, name, f"{name}_{number}", sides, generator, "fills free wall")
        if used + unit.width <= FILLED * offered:
            filling.append(unit)
            used += unit.width
    return filling


def _wall_unit(
    request: Request,
    name: str,
    unit_id: str,
    sides: Sides,
    generator: np.random.Generator,
    reason: str,
    least_front: float = 0.0,
) -> Unit:
    """Return a wall unit of that catalog name with the habits of its kind."""
    asset, habit = request.catalog.get(name), request.habits.of(name)
    place = generator.random()
    anchors: dict[str, float] = {}
    for span, kinds in ((habit.side, ("left", "right")), (habit.front, ("front",)), (habit.back, ("back",))):
        if span is not None:
            along = span[0] + place * (span[1] - span[0])
            anchors |= {wall: 1.0 - along if _reversed(wall, sides, request.room) else along for wall in kinds}
    walls = tuple(dict.fromkeys(sides[side] for side in habit.walls))
    front = max(least_front, asset.clearance if habit.clear is None else habit.clear)
    size = asset.size
    clear = max(0.0, SHOWER_RADIUS - size.short / 2.0) if asset.subtype == "shower" else 0.0
    return Unit(unit_id, asset, size.width, size.depth, front, walls=walls, anchors=anchors, clear=clear, reason=reason)


def _reversed(wall: str, sides: Sides, room: Room) -> bool:
    """Whether a span of the wall counts from its end instead of its start."""
    if wall == "back":
        return sides["store"] == "right"
    return wall == "front" and any(door.wall == "front" and door.offset > room.width / 2.0 for door in room.doors)


def _island_units(request: Request, furnishing: Furnishing, generator: np.random.Generator) -> list[Unit]:
    """Islands or a peninsula, as many and as large as the room takes besides a full row on every wall."""
    if furnishing == "required":
        return []
    room, catalog, habits = request.room, request.catalog, request.habits
    wide = room.width - 2 * SIDE_DEPTH - 2 * AISLE
    deep = room.depth - HOOD_DEPTH - BENCH_DEPTH - HOOD_FRONT - AISLE
    rows = max(1, min(MOST_ISLANDS, int((deep + AISLE) / (ISLAND_DEPTH + AISLE))))
    if furnishing == "reduced":
        rows = 1
    islands = [catalog.get(name) for name in habits.islands]
    fitting = [asset for asset in islands if asset.size.width <= wide] or [islands[-1]]
    stance: Stance = "peninsula" if generator.random() < PENINSULA_SHARE and rows == 1 else "island"
    asset: Asset = fitting[0] if furnishing == "full" else fitting[-1]
    if stance == "peninsula":
        asset = catalog.get(habits.peninsula)
    units = []
    for row in range(rows):
        middle = BENCH_DEPTH + AISLE + ISLAND_DEPTH / 2.0 + row * (deep / rows)
        anchor = float(np.clip(middle / room.depth + generator.uniform(-0.03, 0.03), 0, 1))
        units.append(
            Unit(
                f"{asset.name}_{row + 1}",
                asset,
                asset.size.width,
                asset.size.depth,
                0.0,
                stance=stance,
                walls=("left", "right") if stance == "peninsula" else (),
                anchors={"island": anchor} if stance == "island" else {},
                reason=f"{stance} bench in the middle of the room",
            )
        )
    return units
