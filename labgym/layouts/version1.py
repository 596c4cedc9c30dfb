"""Version 1 of the layout document. It is frozen: its fields, its JSON and its hash never change.

The records below repeat the fields that version 1 has, so that a field added to `Room` or `Placement` neither enters
a version 1 file nor changes the hash of a published layout.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record, canonical_hash
from labgym.geometry import wrap_angle
from labgym.layouts.floor import Coordinate, Door, Identifier, Room
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.provenance import Provenance
from labgym.protocols import Protocol

SCHEMA = "labgym.layout/1"


class Door1(Record):
    """A doorway of a version 1 room."""

    wall: Literal["front", "back", "left", "right"]
    offset: Annotated[float, Field(ge=0.0, le=50.0)]
    width: Annotated[float, Field(ge=0.6, le=4.0)] = 1.0
    height: Annotated[float, Field(ge=1.8, le=4.0)] = 2.1


class Room1(Record):
    """The room of a version 1 layout, in meters."""

    name: Annotated[str, Field(max_length=80)] = "custom"
    width: Annotated[float, Field(ge=2.0, le=50.0)]
    depth: Annotated[float, Field(ge=2.0, le=50.0)]
    height: Annotated[float, Field(ge=2.2, le=10.0)] = 3.0
    wall_thickness: Annotated[float, Field(ge=0.02, le=1.0)] = 0.2
    doors: Annotated[tuple[Door1, ...], Field(max_length=8)] = (Door1(wall="front", offset=1.5),)


class Placement1(Record):
    """A placement of a version 1 layout: position in meters, yaw in radians."""

    id: Identifier
    asset: Annotated[str, Field(max_length=64)]
    position: tuple[Coordinate, Coordinate, Coordinate]
    yaw: Annotated[float, Field(ge=-7.0, le=7.0)] = 0.0
    support: Identifier = FLOOR
    slot: Annotated[int, Field(ge=0, le=63)] | None = None


class Layout1(Document):
    """A layout document of version 1: a room with placements, and the id of the protocol that it was made for."""

    SCHEMA: ClassVar[str] = SCHEMA

    id: Identifier
    protocol: Annotated[str, Field(max_length=64)] | None = None
    room: Room1
    placements: Annotated[tuple[Placement1, ...], Field(max_length=2000)]
    provenance: Provenance = Provenance()


@dataclass(frozen=True)
class Version1Fields:
    """Fields that only version 1 has: the id of a protocol in place of the protocol, and the room as it was written."""

    protocol: str | None
    room: Room


@lru_cache(maxsize=1)
def published_protocols() -> MappingProxyType[str, Protocol]:
    """Return the library's protocols by id, as they were when the published layouts were made.

    A version 1 document names its protocol by the id only, so that a correction of the library would change a published
    room. They are stored with the rooms, in `layouts/protocols`, and read once per process.

    Raises:
        DocumentError: a file is not a protocol.
    """
    files = sorted((artefacts("layouts") / "protocols").glob("*.json"))
    return MappingProxyType({protocol.id: protocol for protocol in map(Protocol.load, files)})


def to_room(room: Room1) -> Room:
    """Return the room of a version 1 file.

    Raises:
        ValueError: a door does not fit its wall, or two overlap.
    """
    doors = tuple(Door(wall=d.wall, offset=d.offset, width=d.width, height=d.height) for d in room.doors)
    return Room(
        name=room.name,
        width=room.width,
        depth=room.depth,
        height=room.height,
        wall_thickness=room.wall_thickness,
        doors=doors,
    )


def to_placement(placement: Placement1) -> Placement:
    """Return a placement of a version 1 file."""
    return Placement(
        id=placement.id,
        asset=placement.asset,
        position=placement.position,
        yaw=placement.yaw,
        support=placement.support,
        slot=placement.slot,
    )


def to_version_1(
    layout_id: str, fields: Version1Fields, placements: tuple[Placement, ...], provenance: Provenance
) -> Layout1:
    """Return the version 1 document of a layout."""
    room = fields.room
    doors = tuple(Door1(wall=d.wall, offset=d.offset, width=d.width, height=d.height) for d in room.doors)
    return Layout1(
        id=layout_id,
        protocol=fields.protocol,
        room=Room1(
            name=room.name,
            width=room.width,
            depth=room.depth,
            height=room.height,
            wall_thickness=room.wall_thickness,
            doors=doors,
        ),
        placements=tuple(
            Placement1(id=p.id, asset=p.asset, position=p.position, yaw=p.yaw, support=p.support, slot=p.slot)
            for p in placements
        ),
        provenance=provenance,
    )


def hash_of(fields: Version1Fields, placements: tuple[Placement, ...]) -> str:
    """Return the version 1 hash: SHA-256 over protocol id, room and placements, lengths rounded to 0.1 mm."""
    room = fields.room
    body: dict[str, Any] = {
        "schema": SCHEMA,
        "protocol": fields.protocol,
        "room": {
            "name": room.name,
            "width": _tenths(room.width),
            "depth": _tenths(room.depth),
            "height": _tenths(room.height),
            "wall_thickness": _tenths(room.wall_thickness),
            "doors": [
                {
                    "wall": door.wall,
                    "offset": _tenths(door.offset),
                    "width": _tenths(door.width),
                    "height": _tenths(door.height),
                }
                for door in room.doors
            ],
        },
        "placements": [
            {
                "id": placement.id,
                "asset": placement.asset,
                "position": [_tenths(coordinate) for coordinate in placement.position],
                "yaw": round(wrap_angle(placement.yaw) * 1e4) % round(2e4 * math.pi),
                "support": placement.support,
                "slot": placement.slot,
            }
            for placement in placements
        ],
    }
    return canonical_hash(body)


def _tenths(length: float) -> int:
    """Return a length in tenths of a millimeter."""
    return round(length * 1e4)
