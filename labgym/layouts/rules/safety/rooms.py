"""Equipment that each room needs for what it holds and for the work in it, reached without passing a door."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from labgym.layouts.rules.earlier import chemicals
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import CLASS_B, CLASS_D, calls_for_detector, fire_classes
from labgym.layouts.rules.site import Site

NAMED = 3
"""Placements that a finding about a room names at most."""


@dataclass(frozen=True)
class RoomRequirement:
    """A kind of equipment that a room needs.

    Attributes:
        name: of the rule.
        asset: the asset to add where it is missing.
        accepted: roles that meet the requirement.
        causes: returns the placements of a room that call for it.
    """

    name: str
    asset: str
    accepted: frozenset[str]
    causes: Callable[[Site, int], tuple[str, ...]]
    requires: str
    source: str


def _work(site: Site, room: int) -> tuple[str, ...]:
    return tuple(site.arrangement.placements[row].id for row in site.work.get(room, ()))


def _burning(site: Site, room: int) -> tuple[str, ...]:
    return _holders(site, room, lambda asset: "B" in fire_classes(asset)) or _work(site, room)


def _metals(site: Site, room: int) -> tuple[str, ...]:
    return _holders(site, room, lambda asset: "D" in fire_classes(asset))


def _gases(site: Site, room: int) -> tuple[str, ...]:
    return _holders(site, room, calls_for_detector)


def _holders(site: Site, room: int, calls: Callable[..., bool]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(holder for holder, asset in site.contents.get(room, ()) if calls(asset)))


REQUIREMENTS = (
    RoomRequirement(
        "room_shower",
        "EmergencyShower",
        frozenset({"EmergencyShower"}),
        _work,
        "Each room with hazardous work has an emergency shower",
        "ANSI/ISEA Z358.1-2014, 4.5.2: no door on the way; OSHA 29 CFR 1910.151(c)",
    ),
    RoomRequirement(
        "room_eyewash",
        "EyewashStation",
        frozenset({"EyewashStation"}),
        _work,
        "Each room with hazardous work has an eyewash",
        "ANSI/ISEA Z358.1-2014, 5.4.2: no door on the way; OSHA 29 CFR 1910.151(c)",
    ),
    RoomRequirement(
        "room_hand_wash",
        "HandWashSink",
        frozenset({"HandWashSink"}),
        _work,
        "Each room with hazardous work has a sink for washing hands; a wash-up bench is not one",
        "OSHA 29 CFR 1910.141(d)(2); Prudent Practices, 6.C.2; BMBL, BSL-1",
    ),
    RoomRequirement(
        "room_extinguisher_b",
        "FireExtinguisher",
        CLASS_B,
        _burning,
        "Each room with flammables or hazardous work has an extinguisher of class B (ABC powder or CO2)",
        "NFPA 10, 5.2 and 6.3; OSHA 29 CFR 1910.157(d)(2) and (d)(4)",
    ),
    RoomRequirement(
        "room_extinguisher_d",
        "ClassDExtinguisher",
        CLASS_D,
        _metals,
        "Each room with active metals, metal hydrides, organometallics or pyrophorics has an extinguisher of class D",
        "NFPA 10, 5.2.4 and 6.5; OSHA 29 CFR 1910.157(d)(6)",
    ),
    RoomRequirement(
        "room_gas_detector",
        "GasDetector",
        frozenset({"GasDetector"}),
        _gases,
        "Each room with burning or toxic gases, or flammable liquids of GHS categories 1 and 2, has a gas detector",
        "NFPA 45; IEC 60079-29-2; TRGS 722, 2.4",
    ),
)
"""What rooms need, and what calls for it."""


def held_in_rooms(site: Site, row: int) -> object:
    """Look at what calls for equipment, and at equipment; of others only at what they are and stand on."""
    asset = site.arrangement.assets[row]
    equipment = any(asset.role in one.accepted for one in REQUIREMENTS)
    if equipment or asset.fume_hood or asset.subtype == "gas_cylinder":
        return site.arrangement.placements[row]
    return chemicals(site, row)


@dataclass(frozen=True)
class Lacking:
    """Equipment that a room lacks: the asset to add, the indices of the room's spaces, and what calls for it."""

    asset: str
    spaces: tuple[int, ...]
    causes: tuple[str, ...]


def lacking_equipment(site: Site) -> tuple[Lacking, ...]:
    """Return what each room lacks, the requirements in their order."""
    return tuple(
        Lacking(one.asset, tuple(space for space, own in enumerate(site.rooms) if own == room), causes)
        for one in REQUIREMENTS
        for room, causes in _missing(site, one).items()
    )


def _needing(site: Site, one: RoomRequirement) -> Mapping[int, tuple[str, ...]]:
    """Return the rooms that need a kind of equipment, and what calls for it."""
    rooms = sorted(set(site.rooms.tolist()))
    causes = {room: one.causes(site, room) for room in rooms}
    return {room: own for room, own in causes.items() if own}


def _missing(site: Site, one: RoomRequirement) -> Mapping[int, tuple[str, ...]]:
    return {room: own for room, own in _needing(site, one).items() if not site.rows_in(room, one.accepted)}


def _rule(one: RoomRequirement) -> FacilityRule:
    def check(site: Site) -> Iterator[Breach]:
        for room, causes in _missing(site, one).items():
            named = ", ".join(causes[:NAMED]) + (f" and {len(causes) - NAMED} more" if len(causes) > NAMED else "")
            kinds = " or ".join(sorted(one.accepted))
            message = f"room {site.name(room)} with {named} has 0 {kinds}, 1 is required"
            yield Breach(causes, 0.0, 1.0, message, f"add {one.asset} to the room")

    return FacilityRule(
        name=one.name,
        requires=one.requires,
        limit="1 per room",
        source=one.source,
        count=lambda site: len(_needing(site, one)),
        check=check,
        looks_at=held_in_rooms,
    )


RULES = tuple(_rule(one) for one in REQUIREMENTS)
