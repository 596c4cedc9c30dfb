"""Units of a brief from the pieces that a request asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from labgym.layouts.brief import Content, Unit
from labgym.layouts.fitting import PERSON
from labgym.layouts.pieces import WallPiece, clear_around, front_of
from labgym.layouts.request import Request
from labgym.layouts.rules.supplies import supplies_of


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
