"""Which pieces of furniture a protocol, safety and habit require, and why; not where they stand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from labgym.assets import Asset
from labgym.layouts.brief import LEVELS, Content, Furnishing, Unit
from labgym.layouts.fitting import PERSON
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Request
from labgym.layouts.roles import takes_role, with_role
from labgym.layouts.rules.supplies import supplies_of
from labgym.layouts.rules.thresholds import SHOWER_RADIUS
from labgym.layouts.stocking import Cabinet

GOAL_FRONT = 1.0
"""Free depth in front of a location: the stand-off of 0.60 m, the robot's 0.30 m, and two cells of the grid."""


@dataclass(frozen=True)
class WallPiece:
    """A piece of furniture that stands against a wall.

    Attributes:
        id: id of the future placement.
        reason: why the room has it.
        least_front: free depth that it needs in front whatever its habit says, meters.
    """

    id: str
    asset: Asset
    reason: str
    least_front: float = 0.0


def pieces(request: Request, cabinets: Sequence[Cabinet], furnishing: Furnishing) -> Iterator[WallPiece]:
    """Yield locations, the furniture of a level and of those below it, cabinets and floor instruments."""
    yield from _locations(request)
    for level in reversed(LEVELS[LEVELS.index(furnishing) :]):
        yield from further_pieces(request, level)
    for cabinet in cabinets:
        names = ", ".join(asset.name for asset in cabinet.reagents)
        yield WallPiece(cabinet.id, cabinet.asset, f"stores {names} (storage class {cabinet.asset.storage_class})")
    yield from _floor_instruments(request)


def further_pieces(request: Request, level: Furnishing) -> Iterator[WallPiece]:
    """Yield the furniture that a room gets from one level of furnishing on."""
    for piece in request.habits.furniture:
        if piece.level == level:
            yield WallPiece(f"{piece.asset}_1", request.catalog.get(piece.asset), piece.reason)


def front_of(request: Request, piece: WallPiece) -> float:
    """Return the free depth that a piece needs in front, meters: habit, or the catalog's clearance."""
    clear = request.habits.of(piece.asset.name).clear
    return max(piece.least_front, piece.asset.clearance if clear is None else clear)


def clear_around(asset: Asset) -> float:
    """Return the distance that other furniture keeps on all sides of an asset, meters."""
    return max(0.0, SHOWER_RADIUS - asset.size.short / 2.0) if asset.subtype == "shower" else 0.0


def with_fixed(request: Request, units: Sequence[Unit]) -> list[Unit]:
    """Let fixed floor objects take the place of units whose role they have or can take.

    Each of the others becomes a separate unit.
    """
    merged, ids = list(units), {placement.id for placement in request.fixed}
    standing = [
        (placement, request.fixed_asset(placement)) for placement in request.fixed if placement.support == FLOOR
    ]
    roles = {unit.asset.role for unit in units}
    for placement, asset in sorted(standing, key=lambda pair: pair[1].role not in roles):
        places = [k for k, unit in enumerate(merged) if unit.id == placement.id]
        free = [k for k, unit in enumerate(merged) if unit.id not in ids]
        places += [k for k in free if merged[k].asset.role == asset.role]
        places += [k for k in free if takes_role(asset, merged[k].asset)]
        if places:
            unit = merged[places[0]]
            size, reason = asset.size, f"{unit.reason}; fixed by the request"
            own = with_role(asset, unit.asset.role)
            merged[places[0]] = replace(
                unit, id=placement.id, asset=own, width=size.width, depth=size.depth, reason=reason
            )
        else:
            size = asset.size
            unit = Unit(placement.id, asset, size.width, size.depth, asset.clearance, reason="fixed by the request")
            merged.append(unit)
    return merged


def _locations(request: Request) -> Iterator[WallPiece]:
    """A piece for every location of the protocol and every location that a laboratory always has."""
    protocol, always = request.protocol, request.habits.always
    for name in dict.fromkeys((*always, *protocol.locations)):
        steps = [number for number, step in enumerate(protocol.steps, 1) if step.location == name]
        reasons = [f"location of step {', '.join(map(str, steps))}"] if steps else []
        reasons += [f"every laboratory has one ({always[name]})"] if name in always else []
        reason = "; ".join(reasons) or "location of the protocol"
        yield WallPiece(f"{name}_1", request.catalog.get(name), reason, GOAL_FRONT)


def _floor_instruments(request: Request) -> Iterator[WallPiece]:
    counts: dict[str, int] = {}
    for name in request.protocol.instruments:
        asset = request.catalog.find(name)
        if asset.placing == "floor":
            counts[asset.name] = counts.get(asset.name, 1) + 1
            yield WallPiece(f"{asset.name}_{counts[asset.name]}", asset, "instrument of the protocol")


def unit_of(request: Request, piece: WallPiece) -> Unit:
    """Return the unit of a piece, as the variant of the floor, with the services that it needs."""
    asset = request.furniture.instead(piece.asset)
    width = max(asset.size.width, PERSON if asset.subtype in ("eyewash", "fire") else 0.0)
    front, clear = front_of(request, piece), clear_around(asset)
    unit = Unit(piece.id, asset, width, asset.size.depth, front, clear=clear, reason=piece.reason)
    return supplied_with(unit, ())


def supplied_with(unit: Unit, contents: Sequence[Content]) -> Unit:
    """Return a unit with the services that it and its contents need."""
    return replace(unit, supplies=supplies_of(unit.asset, [content.asset for content in contents]))
