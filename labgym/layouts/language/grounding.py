"""A model's answers turned into placements. What cannot be placed is left out and noted, never replaced."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from labgym.assets import Asset
from labgym.geometry import wrap_angle
from labgym.layouts.language.offer import Offer
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.request import Request

FILLED = 0.25
"""Greatest share of the floor's area that furniture beyond what is required may cover."""
SPACING = 4.0
"""Floor area per optional piece of furniture, square meters: a floor crowded with small pieces takes hours."""
LISTED = 8
"""Greatest number of names in a note."""


@dataclass(frozen=True)
class GroundedPiece:
    """A piece of furniture, placed or fixed, its catalog entry, and the ids of the items that it is to hold."""

    placement: Placement
    asset: Asset
    holds: tuple[str, ...]


@dataclass(frozen=True)
class Furnished:
    """An answer at room level as placements.

    Attributes:
        pieces: the furniture. carriers: fixed and placed furniture that holds items, each item once.
        zones: the functional zones, by name. steps: the zone of each step, by its number.
        notes: what was left out, and what contradicts the protocol; one sentence each.
    """

    pieces: tuple[GroundedPiece, ...]
    carriers: tuple[GroundedPiece, ...] = ()
    zones: dict[str, dict[str, Any]] = field(default_factory=dict)
    steps: dict[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def furnished(answer: Any, offer: Offer, request: Request) -> Furnished:
    """Return the furniture, zones and steps of an answer to the form of `answers.room_form`."""
    notes: list[str] = []
    zones = _zones(answer.zones, notes)
    chosen = _affordable(answer.furniture, offer, request, notes)
    fixed = {placement.id: placement for placement in request.fixed}
    counts: Counter[str] = Counter()
    pieces = []
    for proposed in chosen:
        asset = offer.furniture[proposed.asset]
        name = _free_id(asset.name, counts, fixed)
        position = (round(proposed.x, 6), round(proposed.y, 6), 0.0)
        placement = Placement(id=name, asset=asset.name, position=position, yaw=radians(proposed.yaw), support=FLOOR)
        pieces.append(GroundedPiece(placement, asset, tuple(proposed.holds)))
    standing = [GroundedPiece(fixed[each.id], offer.carriers[each.id], tuple(each.holds)) for each in _standing(answer)]
    placed = Counter(piece.asset.name for piece in pieces)
    lacking = [need.asset.name for need in offer.needs for _ in range(need.count - placed[need.asset.name])]
    notes += _note("left out required furniture", lacking)
    carrying = _held_once([*standing, *pieces], offer, notes)
    steps = _steps(answer.steps, zones, len(request.protocol.steps), notes)
    notes += _ungrounded(chosen, offer, request, steps)
    return Furnished(tuple(pieces), carrying, zones, steps, tuple(notes))


def arranged(answer: Any, piece: GroundedPiece, offer: Offer) -> tuple[tuple[Placement, ...], tuple[str, ...]]:
    """Return the placements of a piece's items from an answer to `answers.surface_form`, and notes."""
    placements: dict[str, Placement] = {}
    twice = []
    for proposed in answer.items:
        if proposed.id in placements:
            twice.append(proposed.id)
            continue
        surface, yaw = piece.asset.surfaces[proposed.surface], radians(proposed.yaw)
        # The frame of a surface is that of a person in front of it, who looks against the front of the furniture.
        local = (surface.x + surface.width / 2.0 - proposed.x, surface.y + surface.depth / 2.0 - proposed.y)
        asset = offer.items[proposed.id]
        spot = Placement(id=proposed.id, asset=asset.name, position=(*_on(piece.placement, *local), surface.z))
        placements[proposed.id] = spot.model_copy(
            update={
                "yaw": round(wrap_angle(piece.placement.yaw + yaw), 9),
                "support": piece.placement.id,
                "slot": proposed.surface,
            }
        )
    where = piece.placement.id
    left = [item for item in piece.holds if item not in placements]
    notes = [
        *_note(f"placed items of {where} twice; the first pose counts", twice),
        *_note(f"left out of {where}", left),
    ]
    return tuple(placements.values()), tuple(notes)


def radians(degrees: float) -> float:
    """Return a yaw in degrees as radians within half a turn."""
    return round(wrap_angle(math.radians(degrees)), 9)


def _on(placement: Placement, x: float, y: float) -> tuple[float, float]:
    sin, cos = math.sin(placement.yaw), math.cos(placement.yaw)
    px, py, _ = placement.position
    return round(px + cos * x - sin * y, 6), round(py + sin * x + cos * y, 6)


def _standing(answer: Any) -> list[Any]:
    """Return what an answer says about fixed pieces; the form asks only if there are some."""
    return list(getattr(answer, "standing", ()))


def _held_once(pieces: Iterable[GroundedPiece], offer: Offer, notes: list[str]) -> tuple[GroundedPiece, ...]:
    """Return the pieces that hold items; of several pieces that claim an item, the first holds it."""
    held: set[str] = set()
    twice: list[str] = []
    bare: list[str] = []
    carriers = []
    for piece in pieces:
        claimed = tuple(dict.fromkeys(piece.holds))
        if not piece.asset.surfaces:
            bare += claimed
            continue
        twice += [item for item in claimed if item in held]
        holds = tuple(item for item in claimed if item not in held)
        held.update(holds)
        if holds:
            carriers.append(GroundedPiece(piece.placement, piece.asset, holds))
    bare = [item for item in dict.fromkeys(bare) if item not in held]
    notes += _note("put items into several pieces, of which the first counts", twice)
    notes += _note("put items onto furniture without a surface; they are left out", bare)
    notes += _note("left out items", [item for item in offer.items if item not in held and item not in bare])
    return tuple(carriers)


def _free_id(asset: str, counts: Counter[str], taken: Container[str]) -> str:
    """Return the next id of an asset that no fixed piece has."""
    counts[asset] += 1
    while f"{asset}_{counts[asset]}" in taken:
        counts[asset] += 1
    return f"{asset}_{counts[asset]}"


def _zones(proposed: Iterable[Any], notes: list[str]) -> dict[str, dict[str, Any]]:
    zones: dict[str, dict[str, Any]] = {}
    twice = []
    for zone in proposed:
        if zone.name in zones:
            twice.append(zone.name)
            continue
        x, y = sorted((zone.x0, zone.x1)), sorted((zone.y0, zone.y1))
        zones[zone.name] = {"space": zone.space, "rectangle": [round(v, 3) for v in (x[0], y[0], x[1], y[1])]}
    notes += _note("described zones several times, of which the first counts", twice)
    return zones


def _affordable(proposed: Sequence[Any], offer: Offer, request: Request, notes: list[str]) -> list[Any]:
    """Return the pieces without those, beyond the required ones, that repeat one, do not exist or cover too much."""
    needed = Counter({need.asset.name: need.count for need in offer.needs})
    area = sum(space.area for space in request.floor.spaces)
    free, most = FILLED * area, int(area / SPACING)
    chosen: list[Any] = []
    surplus: list[str] = []
    absent: list[str] = []
    repeated: list[str] = []
    poses: set[tuple[str, float, float]] = set()
    for piece in proposed:
        size, holdings = offer.furniture[piece.asset].size, request.holdings
        pose = (piece.asset, round(piece.x, 2), round(piece.y, 2))
        if needed[piece.asset] > 0:
            needed[piece.asset] -= 1
        elif pose in poses:
            repeated.append(piece.asset)
            continue
        elif holdings is not None and not holdings.adds(piece.asset, (each.asset for each in chosen)):
            absent.append(piece.asset)
            continue
        elif size.width * size.depth > free or most <= 0:
            surplus.append(piece.asset)
            continue
        else:
            free -= size.width * size.depth
            most -= 1
        poses.add(pose)
        chosen.append(piece)
    notes += _note("placed furniture again where the same stands; it is left out", repeated)
    limits = f"{FILLED:.0%} of the floor's area or one piece for {SPACING:g} m²"
    notes += _note(f"placed furniture beyond {limits}; it is left out", surplus)
    notes += _note("placed furniture that does not exist; it is left out", absent)
    return chosen


def _steps(proposed: Iterable[Any], zones: dict[str, Any], count: int, notes: list[str]) -> dict[int, str]:
    steps: dict[int, str] = {}
    for each in proposed:
        steps.setdefault(each.step, each.zone)
    notes += _note("assigned no zone to steps", [str(n) for n in range(1, count + 1) if n not in steps])
    notes += _note("assigned steps to zones that it does not describe", [z for z in steps.values() if z not in zones])
    return dict(sorted(steps.items()))


def _ungrounded(chosen: Iterable[Any], offer: Offer, request: Request, steps: dict[int, str]) -> list[str]:
    """Return a note on the steps whose location stands in another zone than the one that they are assigned to."""
    where: dict[str, set[str]] = {}
    for piece in chosen:
        where.setdefault(offer.furniture[piece.asset].role, set()).add(piece.zone)
    apart = []
    for number, zone in steps.items():
        location = request.protocol.steps[number - 1].location
        if location in where and zone not in where[location]:
            apart.append(f"{number} ({location} is in {', '.join(sorted(where[location]))}, not {zone})")
    return _note("assigned steps to zones in which their location does not stand", apart)


def _note(what: str, names: Sequence[str]) -> list[str]:
    """Return one sentence with names, as a list; empty without names."""
    counts = Counter(names)
    words = [name if count == 1 else f"{count} {name}" for name, count in counts.items()]
    more = f" and {len(words) - LISTED} more" if len(words) > LISTED else ""
    return [f"the model {what}: {', '.join(words[:LISTED])}{more}"] if words else []
