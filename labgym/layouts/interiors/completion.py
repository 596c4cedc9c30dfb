"""Completes furnished spaces: further pieces, furniture that exists, emergency equipment, and the style's benches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from labgym.layouts.brief import Unit
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.distances import nearness_of
from labgym.layouts.interiors.filling import Filler, Names, add_pieces, is_equipped, is_near
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.needs import Needs
from labgym.layouts.interiors.safeguards import EQUIPMENT
from labgym.layouts.interiors.supply import lacking
from labgym.layouts.pieces import WallPiece, unit_of
from labgym.layouts.request import Request
from labgym.layouts.rules.safety.pieces import OPTIONAL_PIECES
from labgym.layouts.rules.thresholds import MOVABLE


def add_emergency_equipment(
    request: Request, rooms: Mapping[str, Interior], names: Names, generator: np.random.Generator
) -> None:
    """Add eyewashes, showers and a sink to every laboratory, so that any may get hoods.

    The way from a hood takes at most 10 s, about 16.8 m, without a door between (ANSI/ISEA Z358.1). Nothing is added
    where there is no place, or if the water points of the floor are elsewhere.
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


def complete(
    request: Request, needs: Needs, rooms: Mapping[str, Interior], generator: np.random.Generator
) -> list[Unit]:
    """Add further pieces and fill all spaces; return the further pieces that found no place."""
    habits = request.habits
    partners: dict[str, list[str]] = {}
    for near in nearness_of((*needs.required, *needs.further), habits):
        partners.setdefault(near.first, []).append(near.second)
        partners.setdefault(near.second, []).append(near.first)
    names = Names(
        {unit.id for unit in (*needs.required, *needs.further)}.union(*(room.units for room in rooms.values()))
    )
    _tell_apart(rooms)
    if request.holdings is None or request.holdings.purchases == "any":
        add_emergency_equipment(request, rooms, names, generator)
    left, kinds = [], {service.kind for service in request.floor.services}
    for unit in sorted(needs.further, key=lambda unit: kinds.isdisjoint(unit.supplies)):
        able = [room for room in _able(habits, rooms, unit.asset.role) if not unit.asset.fume_hood or is_equipped(room)]
        able.sort(key=lambda room: not any(other in room.feet for other in partners.get(unit.id, ())))
        # A hood that nobody requires is not worth a long duct: it stands within reach of an exhaust or not at all.
        beyond = (False,) if unit.asset.fume_hood or not unit.supplies else (False, True)
        if all(add_pieces(room, [unit], partners, generator, farther) for farther in beyond for room in able):
            left.append(unit)
    filler = Filler(request, names, generator)
    if request.holdings is not None:
        _add_existing(filler, needs, rooms)
        if request.holdings.purchases != "any":
            return left
    for room in rooms.values():
        counts = Counter(unit.asset.role for other in rooms.values() for unit in other.units.values())
        filler.fill(room, {name: most - counts[name] for name, most in OPTIONAL_PIECES.items()})
    return left


def _tell_apart(rooms: Mapping[str, Interior]) -> None:
    """Let each space know the units of others from which its water stays away."""
    for room in rooms.values():
        for other in rooms.values():
            for unit_id, unit in other.units.items() if other is not room else ():
                if "reactive" in unit.hazards:
                    box = other.ground.box_on_floor(other.feet[unit_id])
                    room.beyond.append((unit, room.ground.to_ground(box)))


def _able(habits: Habits, rooms: Mapping[str, Interior], name: str) -> list[Interior]:
    """The spaces in which an asset may stand, those of its uses first."""
    uses = habits.uses_of(name)
    able = [room for use in uses for room in rooms.values() if room.ground.use == use]
    return able + [room for room in rooms.values() if room.ground.use not in (*uses, "corridor")]


def _add_existing(filler: Filler, needs: Needs, rooms: Mapping[str, Interior]) -> None:
    """Place the furniture that exists beyond what is required, the largest pieces first, as far as it finds a place."""
    request = filler.request
    if request.holdings is None:
        return
    placed = [unit.asset.name for room in rooms.values() for unit in room.units.values()]
    placed += [content.asset.name for contents in needs.contents.values() for content in contents]
    left = [(request.catalog.get(name), count) for name, count in request.holdings.left(placed).items()]
    assets = [a for a, count in left if a.placing == "floor" and a.subtype not in MOVABLE for _ in range(count)]
    full: set[str] = set()
    for asset in sorted(assets, key=lambda asset: (-asset.size.width * asset.size.depth, asset.name)):
        able = _able(request.habits, rooms, asset.name)
        free = request.habits.of(asset.name).stance != "wall"
        if asset.name not in full and not any(filler.add_piece(room, asset, free) for room in able):
            full.add(asset.name)
