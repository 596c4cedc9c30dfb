"""A layout: a room and what stands in it, where. A document with a hash."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.assets import Asset, Catalog
from labgym.documents import Document, Record, canonical_hash
from labgym.errors import DocumentError, LabgymError, UnknownNameError
from labgym.geometry import OrientedBox, rotate, wrap_angle

Coordinate = Annotated[float, Field(ge=-100.0, le=100.0)]
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,79}$")]
FLOOR = "floor"
WALL = "wall"


class Door(Record):
    """A doorway in a wall, with a leaf that opens inwards.

    Attributes:
        wall: front (y = 0), back (y = depth), left (x = 0) or right (x = width).
        offset: metres from the wall's start (x or y = 0) to the doorway's middle.
        width, height: clear opening, metres.
    """

    wall: Literal["front", "back", "left", "right"]
    offset: Annotated[float, Field(ge=0.0, le=50.0)]
    width: Annotated[float, Field(ge=0.6, le=4.0)] = 1.0
    height: Annotated[float, Field(ge=1.8, le=4.0)] = 2.1


class Room(Record):
    """The room's interior in metres: origin at the front-left floor corner, x right, y away."""

    name: Annotated[str, Field(max_length=80)] = "custom"
    width: Annotated[float, Field(ge=2.0, le=50.0)]
    depth: Annotated[float, Field(ge=2.0, le=50.0)]
    height: Annotated[float, Field(ge=2.2, le=10.0)] = 3.0
    wall_thickness: Annotated[float, Field(ge=0.02, le=1.0)] = 0.2
    doors: Annotated[tuple[Door, ...], Field(max_length=8)] = (Door(wall="front", offset=1.5),)

    @model_validator(mode="after")
    def _doors_fit(self) -> Self:
        for door in self.doors:
            length = self.width if door.wall in ("front", "back") else self.depth
            if not (door.width / 2.0 <= door.offset <= length - door.width / 2.0) or door.height > self.height:
                raise ValueError(f"door at offset {door.offset} of the {door.wall} wall does not fit the wall")
        return self


class Placement(Record):
    """One object: the centre of its bottom face in the room frame, and its yaw.

    Attributes:
        support: "floor", "wall", or the id of the placement that it stands on or in.
        slot: index of the support's surface (a cabinet's shelf), None on floor and wall.
    """

    id: Identifier
    asset: Annotated[str, Field(max_length=64)]
    position: tuple[Coordinate, Coordinate, Coordinate]
    yaw: Annotated[float, Field(ge=-7.0, le=7.0)] = 0.0
    support: Identifier = FLOOR
    slot: Annotated[int, Field(ge=0, le=63)] | None = None


class Provenance(Record):
    """How the layout came to be: enough to make it again."""

    generator: str = "manual"
    seed: int | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    versions: dict[str, str] = Field(default_factory=dict)


class Layout(Document):
    """A room with placements. Immutable; its hash is over canonical JSON with lengths rounded to 0.1 mm.

    `Layout.parse` and `Layout.load` also check that every name in it exists.
    """

    SCHEMA: ClassVar[str] = "labgym.layout/1"

    id: Identifier
    protocol: Annotated[str, Field(max_length=64)] | None = None
    room: Room
    placements: Annotated[tuple[Placement, ...], Field(max_length=2000)]
    provenance: Provenance = Provenance()

    @classmethod
    def parse(cls, data: Any, source: object = "document") -> Self:
        """Validate plain data, names included: each asset exists, each support is there, ids are unique.

        Raises:
            DocumentError: names the source and the field.
        """
        layout = super().parse(data, source)
        layout.check_references(source)
        return layout

    def check_references(self, source: object = "layout") -> None:
        """Check that ids are unique, assets exist, and every support holds what it is said to.

        Raises:
            DocumentError: names the source and the first placement at fault.
        """
        seen: set[str] = set()
        for index, placement in enumerate(self.placements):
            field = f"placements.{index}"
            if placement.id in seen:
                raise DocumentError(source, f"{field}.id", f"{placement.id!r} occurs twice; ids must be unique")
            seen.add(placement.id)
            try:
                Catalog.load().get(placement.asset)
            except UnknownNameError as error:
                raise DocumentError(source, f"{field}.asset", str(error)) from None
        for index, placement in enumerate(self.placements):
            try:
                self._check_support(placement)
            except LabgymError as error:
                raise DocumentError(source, f"placements.{index}.support", str(error)) from None

    def _check_support(self, placement: Placement) -> None:
        """Follow the supports of a placement down to the floor or a wall."""
        seen = {placement.id}
        while placement.support not in (FLOOR, WALL):
            parent = self.placement(placement.support)
            slots = len(self.asset(parent.id).surfaces)
            if placement.slot is None or placement.slot >= slots:
                raise LabgymError(f"{placement.id!r} names slot {placement.slot} of {parent.id!r}, which has {slots}")
            if parent.id in seen:
                raise LabgymError(f"supports of {placement.id!r} form a cycle")
            seen.add(parent.id)
            placement = parent

    @cached_property
    def by_id(self) -> dict[str, Placement]:
        """Placements by id."""
        return {placement.id: placement for placement in self.placements}

    @cached_property
    def hash(self) -> str:
        """SHA-256 of room and placements, lengths rounded to 0.1 mm; provenance and id do not count."""
        body = {"schema": self.SCHEMA, "protocol": self.protocol, "room": self.room, "placements": self.placements}
        return canonical_hash(_rounded(body))

    def placement(self, placement_id: str) -> Placement:
        """Return a placement by id.

        Raises:
            UnknownNameError: there is none of that id.
        """
        if placement_id not in self.by_id:
            raise UnknownNameError("placement", placement_id, self.by_id)
        return self.by_id[placement_id]

    def asset(self, placement_id: str) -> Asset:
        """Return the catalogue entry of a placement."""
        return Catalog.load().get(self.placement(placement_id).asset)

    def box(self, placement_id: str) -> OrientedBox:
        """Return a placement's bounding box in the room frame."""
        return placed_box(self.placement(placement_id), self.asset(placement_id))

    def solids(self, placement_id: str) -> tuple[OrientedBox, ...]:
        """Return a placement's solid boxes in the room frame: its bounding box, or a hollow one's shell."""
        placement = self.placement(placement_id)
        return tuple(_moved(part, placement) for part in self.asset(placement_id).solids())

    def surface(self, placement_id: str, slot: int) -> OrientedBox:
        """Return a surface of a placement as a box from its height up to its headroom (1000 m where open)."""
        placement, surface = self.placement(placement_id), self.asset(placement_id).surfaces[slot]
        top = surface.z + (surface.headroom if surface.headroom is not None else 1000.0)
        return _moved(OrientedBox(surface.x, surface.y, surface.width, surface.depth, 0.0, surface.z, top), placement)

    def children(self, placement_id: str) -> tuple[Placement, ...]:
        """Return what stands directly on or in a placement."""
        return tuple(placement for placement in self.placements if placement.support == placement_id)

    def root(self, placement_id: str) -> Placement:
        """Return the floor or wall object that finally carries a placement; itself where it stands on the floor."""
        placement = self.placement(placement_id)
        while placement.support not in (FLOOR, WALL):
            placement = self.placement(placement.support)
        return placement

    def find(self, asset: str) -> Placement | None:
        """Return the first placement of an asset, or None."""
        return next((placement for placement in self.placements if placement.asset == asset), None)

    def obstacles(self, below: float) -> Iterator[OrientedBox]:
        """Yield bounding boxes of floor and wall objects that reach below a height in metres."""
        for placement in self.placements:
            if placement.support in (FLOOR, WALL):
                box = self.box(placement.id)
                if box.z0 < below:
                    yield box

    def replace(self, **changes: Any) -> Layout:
        """Return a copy with fields changed and caches fresh."""
        fields = {name: getattr(self, name) for name in type(self).model_fields}
        return Layout(**{**fields, **changes})


def placed_box(placement: Placement, asset: Asset) -> OrientedBox:
    """Return the bounding box of an asset where a placement puts it."""
    x, y, z = placement.position
    size = asset.size
    return OrientedBox(x, y, size.width, size.depth, placement.yaw, z, z + size.height)


def _moved(part: OrientedBox, placement: Placement) -> OrientedBox:
    dx, dy = rotate(part.x, part.y, placement.yaw)
    x, y, z = placement.position
    return OrientedBox(x + dx, y + dy, part.width, part.depth, placement.yaw + part.yaw, z + part.z0, z + part.z1)


def _rounded(value: Any) -> Any:
    if isinstance(value, Record):
        rounded = {name: _rounded(getattr(value, name)) for name in type(value).model_fields}
        if isinstance(value, Placement):
            rounded["yaw"] = round(wrap_angle(value.yaw) * 1e4) % round(2e4 * math.pi)
        return rounded
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_rounded(item) for item in value]
    return round(value * 1e4) if isinstance(value, float) else value
