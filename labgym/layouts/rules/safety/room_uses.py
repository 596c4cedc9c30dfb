"""Rooms in which kinds of objects do not belong: hazards in ways out and where people write, kits far from spills."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.rules.earlier import chemicals
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import hazardous
from labgym.layouts.rules.safety.standing import HOT
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.storage import STORAGE_CLASSES


@dataclass(frozen=True)
class WrongRoom:
    """A kind of object and the rooms in which it does not belong.

    Attributes:
        what: the objects, in words. is_kind: whether an asset is one.
        where: the rooms, in words. excludes: whether the space of an object, by index, is one.
        belongs: where it belongs instead, for the remedy.
    """

    what: str
    is_kind: Callable[[Asset], bool]
    where: str
    excludes: Callable[[Site, int], bool]
    reason: str
    belongs: str
    source: str


def _chemical_waste(asset: Asset) -> bool:
    return asset.category == "waste" and (asset.subtype == "station" or asset.hazards.flammable)


def _used_as(*uses: str) -> Callable[[Site, int], bool]:
    return lambda site, space: site.arrangement.layout.floor.spaces[space].use in uses


def _hazardous_work(asset: Asset) -> bool:
    contained = asset.fume_hood or asset.category == "containment"
    return contained or asset.subtype == "gas_cylinder" or asset.heat_class in HOT or _chemical_waste(asset)


def _hazard(asset: Asset) -> bool:
    return _hazardous_work(asset) or asset.kind == "reagent" or asset.storage_class in STORAGE_CLASSES


def _holds_no_hazard(site: Site, space: int) -> bool:
    room = int(site.rooms[space])
    return not site.work.get(room) and not any(hazardous(asset) for _, asset in site.contents.get(room, ()))


WRONG_ROOMS = (
    WrongRoom(
        "reagents, cylinders, waste, hoods and hot devices", _hazard, "a corridor", _used_as("corridor"),
        "ways out hold nothing that burns or leaks", "a laboratory", "OSHA 29 CFR 1910.37(a)(1) and (a)(2)",
    ),
    WrongRoom(
        "cylinders, waste, hoods and hot devices", _hazardous_work, "a write-up room", _used_as("write-up"),
        "people write, eat and drink there", "a laboratory", "Prudent Practices, 6.C.2; OSHA 29 CFR 1910.141(g)(2)",
    ),
    WrongRoom(
        "spill kits", lambda asset: asset.subtype == "spill", "a room without hazardous reagents", _holds_no_hazard,
        "nobody fetches them through a door while a spill spreads", "the laboratory", "Prudent Practices, 6.C.3",
    ),
)  # fmt: skip
"""What does not belong in which rooms."""


def _judged(site: Site) -> list[int]:
    return [row for row, asset in enumerate(site.arrangement.assets) if any(one.is_kind(asset) for one in WRONG_ROOMS)]


def _check(site: Site) -> Iterator[Breach]:
    arrangement = site.arrangement
    for row in _judged(site):
        own, asset, space = arrangement.placements[row].id, arrangement.assets[row], int(arrangement.spaces[row])
        wrong = next((one for one in WRONG_ROOMS if one.is_kind(asset) and one.excludes(site, space)), None)
        if wrong is not None:
            where = arrangement.layout.floor.spaces[space].id
            message = f"{own} is in {where!r}; {wrong.what} do not belong in {wrong.where}"
            yield Breach(
                (own,), None, 0.0, f"{message} ({wrong.reason}; {wrong.source})", f"move it to {wrong.belongs}"
            )


def _looked_at(site: Site, row: int) -> object:
    is_judged = any(one.is_kind(site.arrangement.assets[row]) for one in WRONG_ROOMS)
    return site.arrangement.placements[row] if is_judged else chemicals(site, row)


RULES = (
    FacilityRule(
        name="wrong_room",
        requires="Objects are in the rooms where they belong: no hazards in corridors, no hazardous work in write-up "
        "rooms, spill kits where spills happen",
        limit="by kind (`WRONG_ROOMS`)",
        source="OSHA 29 CFR 1910.37(a) and 1910.141(g)(2); Prudent Practices, 6.C",
        count=lambda site: len(_judged(site)),
        check=_check,
        looks_at=_looked_at,
    ),
)
