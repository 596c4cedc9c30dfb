"""The furniture and items from which a language model makes a layout: closed sets of names, required or free."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.pieces import pieces
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Request
from labgym.layouts.stocking import plan_cabinets


@dataclass(frozen=True)
class Need:
    """A kind of furniture that a laboratory must have: how many pieces, and why."""

    asset: Asset
    count: int
    reason: str


@dataclass(frozen=True)
class Offer:
    """The pieces and items that a model may place.

    Attributes:
        furniture: floor furniture by asset name.
        needs: the part of it that must be placed, besides fixed pieces.
        items: instruments and reagents of the protocol by the id of their future placement; all must be placed.
        carriers: fixed pieces on the floor that have surfaces, by id.
    """

    furniture: Mapping[str, Asset]
    needs: tuple[Need, ...]
    items: Mapping[str, Asset]
    carriers: Mapping[str, Asset]


def offer_of(request: Request) -> Offer:
    """Return the furniture and items that a request requires, and the furniture that may be added."""
    needs = tuple(_needs(request))
    furniture = {need.asset.name: need.asset for need in needs}
    for name in _further(request):
        asset = request.furniture.get(name)
        if request.holdings is None or request.holdings.adds(asset.name, ()):
            furniture.setdefault(asset.name, asset)
    fixed = {each.id: request.fixed_asset(each) for each in request.fixed if each.support == FLOOR}
    carriers = {name: asset for name, asset in fixed.items() if asset.surfaces}
    return Offer(dict(sorted(furniture.items())), needs, dict(_items(request)), carriers)


def _needs(request: Request) -> Iterator[Need]:
    """Yield what protocol, storage and safety require, without the pieces that are fixed."""
    standing = [request.fixed_asset(placement).role for placement in request.fixed if placement.support == FLOOR]
    fixed = Counter(standing)
    counts: Counter[str] = Counter()
    reasons: dict[str, list[str]] = {}
    assets: dict[str, Asset] = {}
    for piece in pieces(request, plan_cabinets(request), "required"):
        asset = request.furniture.instead(piece.asset)
        if fixed[asset.role]:
            fixed[asset.role] -= 1
            continue
        assets[asset.name] = asset
        counts[asset.name] += 1
        reasons.setdefault(asset.name, []).append(piece.reason)
    for name, asset in assets.items():
        yield Need(asset, counts[name], "; ".join(dict.fromkeys(reasons[name])))


def _further(request: Request) -> Iterator[str]:
    """Yield the names of furniture that a laboratory may have, some of them several times."""
    habits = request.habits
    yield from (piece.asset for piece in habits.furniture)
    yield from habits.always
    yield from habits.filling
    yield habits.peninsula
    uses = {space.use for space in request.floor.spaces}
    for use, room in habits.rooms.items():
        if use in uses:
            yield from (*room.walls, *room.islands)


def _items(request: Request) -> Iterator[tuple[str, Asset]]:
    """Yield the instruments and reagents that stand on or in furniture, with the ids of their placements."""
    fixed = {placement.id for placement in request.fixed}
    counts: Counter[str] = Counter()
    names = (*request.protocol.instruments, *(use.name for use in request.protocol.reagents))
    for name in names:
        asset = request.catalog.find(name)
        if asset.placing == FLOOR:
            continue
        counts[asset.name] += 1
        while f"{asset.name}_{counts[asset.name]}" in fixed:
            counts[asset.name] += 1
        yield f"{asset.name}_{counts[asset.name]}", asset
