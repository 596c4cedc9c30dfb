"""Which furniture the sampler lists for a protocol, and what it forgets."""

from __future__ import annotations

from dataclasses import dataclass, replace

from labgym.layouts.brief import Unit
from labgym.layouts.pieces import WallPiece, clear_around, front_of, further_pieces, pieces, with_fixed
from labgym.layouts.request import Request
from labgym.layouts.stocking import Cabinet, plan_cabinets
from labgym.paper.sampler.rates import Slips


@dataclass(frozen=True)
class SampledInventory:
    """The floor furniture of a proposal, and the cabinets in it with the reagents that belong there."""

    units: tuple[Unit, ...]
    cabinets: tuple[Cabinet, ...]


def list_furniture(request: Request, slips: Slips) -> SampledInventory:
    """Return what the protocol and safety require: places of work, cabinets, floor instruments, safety equipment.

    No further benches are listed: the prompt of a language model names what the experiment needs.
    """
    cabinets = _cabinets(request, slips)
    safety = {piece.id for piece in further_pieces(request, "required")}
    visited = set(request.protocol.locations)
    listed = pieces(request, cabinets, "required")
    units = [_unit(request, piece) for piece in listed if not _forgotten(piece, safety, visited, slips)]
    return SampledInventory(tuple(with_fixed(request, units)), cabinets)


def _forgotten(piece: WallPiece, safety: set[str], visited: set[str], slips: Slips) -> bool:
    if piece.id in safety:
        return slips.happens("safety_forgotten", piece.id)
    if piece.asset.name in visited:
        return slips.happens("place_forgotten", piece.id)
    return piece.asset.kind == "instrument" and slips.happens("thing_forgotten", piece.id)


def _cabinets(request: Request, slips: Slips) -> tuple[Cabinet, ...]:
    """One cabinet per storage class, or several so that incompatible reagents are apart, if that is thought of."""
    fixed = {placement.id for placement in request.fixed}
    cabinets: list[Cabinet] = []
    for cabinet in plan_cabinets(request):
        if cabinets and slips.happens("classes_mixed", cabinet.id):
            cabinets[0] = replace(cabinets[0], reagents=(*cabinets[0].reagents, *cabinet.reagents))
        elif cabinet.id in fixed:
            cabinets.append(cabinet)
        else:
            cabinets.append(replace(cabinet, asset=request.furniture.instead(cabinet.asset)))
    return tuple(cabinets)


def _unit(request: Request, piece: WallPiece) -> Unit:
    asset = request.furniture.instead(piece.asset)
    size, front, clear = asset.size, front_of(request, piece), clear_around(asset)
    return Unit(piece.id, asset, size.width, size.depth, front, clear=clear, reason=piece.reason)
