"""Which furniture a room gets for a protocol and which walls it prefers.

Walls have roles: `store` and `work` are the two side walls. The hood line is on the back wall with rotary evaporators
and waste next to it, storage on one side, wet work and cleaning on the other, weighing and analysis near the entrance.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from labgym.assets import Asset
from labgym.layouts.brief import Furnishing, Stance, Unit, Wall
from labgym.layouts.cabinets import Cabinet
from labgym.layouts.floor import Room
from labgym.layouts.habits import Side
from labgym.layouts.pieces import WallPiece, clear_around, front_of, pieces, with_fixed
from labgym.layouts.request import Request
from labgym.layouts.rules.zones import door_span

Sides = dict[Side, Wall]

FILLED = 0.7
"""Share of the wall length up to which a room is filled; the rest is left for doors, passages and wall equipment."""
HEAVY_AISLE = 1.5
AISLE = 1.2
"""Clear width around islands, meters: 1.5 between occupied benches, 1.2 at least (assumption)."""
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
    units = [_wall_unit(request, piece, sides, generator) for piece in pieces(request, cabinets, furnishing)]
    units += _island_units(request, furnishing, generator)
    units = with_fixed(request, units)
    if furnishing == "full":
        units += _filling_units(request, units, sides, generator)
    return tuple(units)


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
        piece = WallPiece(f"{name}_{number}", request.catalog.get(name), "fills free wall")
        unit = _wall_unit(request, piece, sides, generator)
        if used + unit.width <= FILLED * offered:
            filling.append(unit)
            used += unit.width
    return filling


def _wall_unit(request: Request, piece: WallPiece, sides: Sides, generator: np.random.Generator) -> Unit:
    """Return the unit of a piece with the habits of its kind."""
    asset, habit = piece.asset, request.habits.of(piece.asset.name)
    place = generator.random()
    anchors: dict[str, float] = {}
    for span, kinds in ((habit.side, ("left", "right")), (habit.front, ("front",)), (habit.back, ("back",))):
        if span is not None:
            along = span[0] + place * (span[1] - span[0])
            anchors |= {wall: 1.0 - along if _reversed(wall, sides, request.room) else along for wall in kinds}
    walls = tuple(dict.fromkeys(sides[side] for side in habit.walls))
    return Unit(
        piece.id,
        asset,
        asset.size.width,
        asset.size.depth,
        front_of(request, piece),
        walls=walls,
        anchors=anchors,
        clear=clear_around(asset),
        reason=piece.reason,
    )


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
