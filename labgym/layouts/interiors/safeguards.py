"""The hazards of furniture, and the safety equipment that each space with hazards has."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.brief import Content, Hazard, Unit
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.distances import first_of_role
from labgym.layouts.interiors.filling import Names
from labgym.layouts.interiors.supply import lacking
from labgym.layouts.pieces import WallPiece, unit_of
from labgym.layouts.request import Request
from labgym.layouts.rules.safety.hazards import burning, fire_classes, hazardous, water_reactive

EQUIPMENT = {
    "EyewashStation": "eyewash where hazardous work is done, without a door between (ANSI/ISEA Z358.1)",
    "EmergencyShower": "emergency shower where hazardous work is done, without a door between (ANSI/ISEA Z358.1)",
    "HandWashSink": "washing hands where hazardous work is done (OSHA 1910.141(d))",
}
"""What a space with hazardous work has, and why."""
CLASS_D, CLASS_D_REASON = "ClassDExtinguisher", "extinguisher for burning metals and hydrides (NFPA 10)"


def marked(request: Request, units: Sequence[Unit], contents: Mapping[str, tuple[Content, ...]]) -> tuple[Unit, ...]:
    """Return units with the hazards of what they store, and of what protocols handle at them."""
    stored: dict[str, list[Asset]] = defaultdict(list)
    handled: dict[str, list[Asset]] = defaultdict(list)
    for unit_id, items in contents.items():
        stored[unit_id] += [item.asset for item in items if item.asset.kind == "reagent"]
    first = first_of_role(units)
    for protocol in request.protocols:
        names = {use.name for use in protocol.reagents}
        for step in protocol.steps:
            if step.location in first:
                place = first[step.location].id
                handled[place] += [request.catalog.find(name) for name in step.uses if name in names]
    return tuple(replace(unit, hazards=_hazards(unit, stored[unit.id], handled[unit.id])) for unit in units)


def _hazards(unit: Unit, stored: Sequence[Asset], handled: Sequence[Asset]) -> frozenset[Hazard]:
    held, hazards = [unit.asset, *stored, *handled], set[Hazard]()
    if any(map(water_reactive, held)):
        hazards.add("reactive")
    if any(map(water_reactive, stored)):
        hazards.add("dry")
    if any(map(burning, held)) or unit.asset.category == "waste":
        hazards.add("burning")
    if any("D" in fire_classes(asset) for asset in held):
        hazards.add("metal")
    if unit.asset.fume_hood or any(map(hazardous, handled)):
        hazards.add("work")
    return frozenset(hazards)


def with_safeguards(
    request: Request,
    grounds: Sequence[Ground],
    shares: Mapping[str, Sequence[Unit]],
    standing: Mapping[str, Sequence[tuple[Unit, OrientedBox]]],
    names: Names,
) -> dict[str, list[Unit]]:
    """Return the units of each space with the safety equipment that its hazards ask for and that it lacks.

    Nothing is added if the water points of the floor are elsewhere.
    """
    result = {}
    for ground in grounds:
        units = [*shares[ground.space], *(unit for unit, _ in standing[ground.space])]
        pieces = [WallPiece(names.next(asset), asset, reason) for asset, reason in _lacking(request, units)]
        added = [unit_of(request, piece) for piece in pieces]
        able = [unit for unit in added if not lacking(unit, ground)[1]]
        result[ground.space] = [*shares[ground.space], *able]
    return result


def _lacking(request: Request, units: Sequence[Unit]) -> list[tuple[Asset, str]]:
    roles = {unit.asset.role for unit in units}
    lacking: list[tuple[str, str]] = []
    if any("work" in unit.hazards or unit.asset.fume_hood for unit in units):
        lacking += [(name, reason) for name, reason in EQUIPMENT.items() if name not in roles]
    if any("metal" in unit.hazards for unit in units) and CLASS_D not in roles:
        lacking.append((CLASS_D, CLASS_D_REASON))
    return [(request.catalog.get(name), reason) for name, reason in lacking]
