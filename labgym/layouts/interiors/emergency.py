"""Eyewashes, showers and sinks for laboratories that have none, and for hoods that are too far from them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labgym.layouts.interiors.filling import Names, add_pieces, is_near
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.safeguards import EQUIPMENT
from labgym.layouts.interiors.supply import lacking
from labgym.layouts.interiors.units import unit_of
from labgym.layouts.pieces import WallPiece
from labgym.layouts.request import Request


def add_emergency_equipment(
    request: Request, rooms: Mapping[str, Interior], names: Names, generator: np.random.Generator
) -> None:
    """Add eyewashes, showers and a sink to every laboratory, so that any may get hoods.

    The way from a hood takes at most 10 s, about 16.8 m, without a door between (ANSI/ISEA Z358.1). Nothing is added
    where there is no place, or where the floor requires its water elsewhere.
    """
    for room in rooms.values():
        if room.ground.use != "laboratory":
            continue
        for role, reason in EQUIPMENT.items():
            if _is_far(room, role):
                _add(request, room, role, reason, names, generator)


def _is_far(room: Interior, role: str) -> bool:
    """Whether a space lacks a piece, or some hazardous work is too far from it."""
    work = [room.feet[unit_id] for unit_id, unit in room.units.items() if "work" in unit.hazards]
    lacks = all(unit.asset.role != role for unit in room.units.values())
    return lacks or not all(is_near(room, foot, role) for foot in work)


def _add(
    request: Request, room: Interior, name: str, reason: str, names: Names, generator: np.random.Generator
) -> None:
    asset = request.catalog.get(name)
    unit = unit_of(request, WallPiece(names.next(asset), asset, reason))
    far = [unit_id for unit_id, one in room.units.items() if "work" in one.hazards and one.asset.fume_hood]
    if lacking(unit, room.ground)[1] or add_pieces(room, [unit], {unit.id: far[-1:]}, generator):
        names.taken.discard(unit.id)
