"""Eyewashes and showers for spaces that are too far from those which a floor requires."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from labgym.layouts.brief import Unit
from labgym.layouts.interiors.filling import Names, add_pieces
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.supply import lacking
from labgym.layouts.pieces import clear_around
from labgym.layouts.request import Request
from labgym.layouts.rules.facility.showers import SHOWER_WALK
from labgym.layouts.rules.supplies import supplies_of

EYEWASH, SHOWER = "EyewashStation", "EmergencyShower"


def add_emergency_equipment(
    request: Request, rooms: Mapping[str, Interior], names: Names, generator: np.random.Generator
) -> None:
    """Add an eyewash to every laboratory space without one, and a shower where the nearest is too far.

    A door on the way counts as an obstruction, and the way takes at most 10 s, about 16.8 m (ANSI/ISEA Z358.1). Nothing
    is added where there is no place, or where the floor requires its water elsewhere.
    """
    showers = [_middle(room, unit) for room in rooms.values() for unit in _of(room, SHOWER)]
    for room in rooms.values():
        if room.ground.use != "laboratory":
            continue
        if not _of(room, EYEWASH):
            _add(request, room, EYEWASH, names, generator)
        ground = room.ground
        center = ground.to_floor((ground.width / 2.0, ground.depth / 2.0, 0.0))[:2]
        reach = math.hypot(ground.width, ground.depth) / 2.0
        if all(math.dist(center, shower) + reach > SHOWER_WALK for shower in showers):
            _add(request, room, SHOWER, names, generator)


def _of(room: Interior, role: str) -> list[str]:
    return [unit_id for unit_id, unit in room.units.items() if unit.asset.role == role]


def _middle(room: Interior, unit_id: str) -> tuple[float, float]:
    foot = room.feet[unit_id]
    x, y, _ = room.ground.to_floor((foot.x, foot.y, foot.yaw))
    return x, y


def _add(request: Request, room: Interior, name: str, names: Names, generator: np.random.Generator) -> None:
    asset, habit = request.catalog.get(name), request.habits.of(name)
    front = asset.clearance if habit.clear is None else habit.clear
    reason = "within 10 s of every place of work, without a door between (ANSI/ISEA Z358.1)"
    unit = Unit(
        names.next(asset),
        asset,
        asset.size.width,
        asset.size.depth,
        front,
        clear=clear_around(asset),
        reason=reason,
        supplies=supplies_of(asset, ()),
    )
    if lacking(unit, room.ground)[1] or add_pieces(room, [unit], {}, generator):
        names.taken.discard(unit.id)
