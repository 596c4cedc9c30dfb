"""Rectangular rooms and their doors, and the floors that they are."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Record
from labgym.layouts.floor.fields import DoorHeight, DoorWidth, Height, Thickness

if TYPE_CHECKING:
    from labgym.layouts.floor.model import Floor

Side = Literal["front", "back", "left", "right"]


class Door(Record):
    """A doorway in a wall of a room, with a leaf that opens inwards.

    Attributes:
        wall: front (y = 0), back (y = depth), left (x = 0) or right (x = width).
        offset: meters from the wall's start (x or y = 0) to the doorway's middle.
        width, height: clear opening, meters.
    """

    wall: Side
    offset: Annotated[float, Field(ge=0.0, le=50.0)]
    width: DoorWidth = 1.0
    height: DoorHeight = 2.1


class Room(Record):
    """The interior of a rectangular room in meters: origin at the front-left floor corner, x right, y away."""

    name: Annotated[str, Field(max_length=80)] = "custom"
    width: Annotated[float, Field(ge=2.0, le=50.0)]
    depth: Annotated[float, Field(ge=2.0, le=50.0)]
    height: Height = 3.0
    wall_thickness: Thickness = 0.2
    doors: Annotated[tuple[Door, ...], Field(max_length=8)] = (Door(wall="front", offset=1.5),)

    @model_validator(mode="after")
    def _check_doors(self) -> Self:
        for door in self.doors:
            what = f"the door at offset {door.offset:g} m of the {door.wall} wall"
            length = self.length(door.wall)
            low, high = door.width / 2.0, length - door.width / 2.0
            if not low <= door.offset <= high:
                limits = f"the offset of a {door.width:g} m door must be {low:g} to {high:g} m"
                raise ValueError(f"{what} does not fit the {length:g} m wall: {limits}")
            if door.height > self.height:
                raise ValueError(f"{what} is {door.height:g} m high, above the ceiling at {self.height:g} m")
        for first, second in combinations(self.doors, 2):
            overlap = (first.width + second.width) / 2.0 - abs(first.offset - second.offset)
            if first.wall == second.wall and overlap > 0.0:
                offsets = f"{first.offset:g} and {second.offset:g} m"
                raise ValueError(
                    f"the doors at offsets {offsets} of the {first.wall} wall overlap by {overlap:.2f} m: move one"
                )
        return self

    def length(self, wall: Side) -> float:
        """Return the length of a wall between its corners, meters."""
        return self.width if wall in ("front", "back") else self.depth

    @property
    def floor(self) -> Floor:
        """The floor that has this room as its only space."""
        from labgym.layouts.floor.model import Floor  # a floor is made of the records here

        return Floor.rectangle(self.width, self.depth, self.height, self.wall_thickness, self.doors, self.name)
