"""Rectangular rooms and their doors, and the floors that they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Record
from labgym.errors import LabgymError
from labgym.layouts.floor.fields import DoorHeight, DoorWidth, Height, Thickness
from labgym.layouts.floor.spaces import Rectangle, Space
from labgym.layouts.floor.walls import Opening, Wall

if TYPE_CHECKING:
    from labgym.layouts.floor.model import Floor

Side = Literal["front", "back", "left", "right"]


class Door(Record):
    """A doorway in a wall of a room, with a leaf.

    Attributes:
        wall: front (y = 0), back (y = depth), left (x = 0) or right (x = width).
        offset: meters from the wall's start (x or y = 0) to the doorway's middle.
        width, height: clear opening, meters.
        outward: whether the leaf opens out of the room.
    """

    wall: Side
    offset: Annotated[float, Field(ge=0.0, le=50.0)]
    width: DoorWidth = 1.0
    height: DoorHeight = 2.1
    outward: bool = False


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


SAME_POINT = 1e-3
"""Ends of walls that are nearer to a corner than this meet it, meters."""
INWARD: dict[Side, Literal["left", "right"]] = {"front": "left", "back": "right", "left": "right", "right": "left"}
"""Side of each wall of a rectangle on which the room lies, seen from the wall's start."""
OPPOSITE: dict[str, Literal["left", "right"]] = {"left": "right", "right": "left"}
READS = "this function reads floors of one rectangular space"
Line = tuple[tuple[float, float], tuple[float, float]]


def rectangle_parts(room: Room) -> tuple[tuple[Wall, ...], Space]:
    """Return the walls around a rectangular room, in the order front, back, left, right, and the space in it."""
    walls = tuple(
        Wall(
            start=start,
            end=end,
            thickness=room.wall_thickness,
            height=room.height,
            openings=tuple(
                Opening(
                    position=door.offset,
                    width=door.width,
                    height=door.height,
                    swing=OPPOSITE[INWARD[side]] if door.outward else INWARD[side],
                )
                for door in room.doors
                if door.wall == side
            ),
        )
        for side, (start, end) in _middle_lines(room.width, room.depth, room.wall_thickness).items()
    )
    return walls, Space(region=(Rectangle(x1=room.width, y1=room.depth),), ceiling=room.height)


def room_of(name: str, walls: Sequence[Wall], spaces: Sequence[Space]) -> Room:
    """Return the room that walls and spaces form, if it is the only space, and a rectangle at the origin.

    Raises:
        LabgymError: the walls and spaces are no such room; names the first difference.
        ValueError: a size is out of the range of `Room`.
    """
    space = _only_space(spaces)
    width, depth = space.region[0].x1, space.region[0].y1
    doors: list[Door] = []
    sides: dict[Side, Wall] = {}
    for index, wall in enumerate(walls):
        side, reverse = _side_of(wall, width, depth)
        if side is None:
            raise LabgymError(f"{READS}; wall {index} lies along none of the four sides of the space")
        if side in sides:
            raise LabgymError(f"{READS}; two walls lie along the {side} side")
        if wall.height != space.ceiling or wall.thickness != walls[0].thickness:
            raise LabgymError(f"{READS} with walls of one thickness, as high as the ceiling; wall {index} differs")
        sides[side] = wall
        doors += [_door(side, opening, width, depth, reverse) for opening in wall.openings]
    if len(sides) != 4:
        raise LabgymError(f"{READS} with a wall along each side; got {len(sides)} walls")
    return Room(
        name=name,
        width=width,
        depth=depth,
        height=space.ceiling,
        wall_thickness=walls[0].thickness,
        doors=tuple(doors),
    )


def sides_of(room: Room, walls: Sequence[Wall]) -> dict[Side, int]:
    """Return the index of the wall along each side of a room, in the order front, back, left, right."""
    sides = {_side_of(wall, room.width, room.depth)[0]: index for index, wall in enumerate(walls)}
    return {side: sides[side] for side in INWARD}


def _only_space(spaces: Sequence[Space]) -> Space:
    if len(spaces) != 1:
        raise LabgymError(f"{READS}; got {len(spaces)} spaces")
    space = spaces[0]
    if len(space.region) != 1:
        raise LabgymError(f"{READS}; space {space.id!r} consists of {len(space.region)} rectangles")
    corner = space.region[0]
    if (space.x, space.y, space.yaw, corner.x0, corner.y0) != (0.0, 0.0, 0.0, 0.0, 0.0):
        raise LabgymError(f"{READS} whose frame and front-left corner are the origin; space {space.id!r} is moved")
    return space


def _middle_lines(width: float, depth: float, thickness: float) -> dict[Side, Line]:
    """Return the middle lines of the walls around a rectangle, each from the corner where x or y is least."""
    half = thickness / 2.0
    return {
        "front": ((0.0, -half), (width, -half)),
        "back": ((0.0, depth + half), (width, depth + half)),
        "left": ((-half, 0.0), (-half, depth)),
        "right": ((width + half, 0.0), (width + half, depth)),
    }


def _side_of(wall: Wall, width: float, depth: float) -> tuple[Side | None, bool]:
    """Return the side of a rectangle that a wall lies along, and whether it runs against the side's direction."""
    for side, (start, end) in _middle_lines(width, depth, wall.thickness).items():
        for reverse, line in ((False, (start, end)), (True, (end, start))):
            if max(math.dist(wall.start, line[0]), math.dist(wall.end, line[1])) <= SAME_POINT:
                return side, reverse
    return None, False


def _door(side: Side, opening: Opening, width: float, depth: float, reverse: bool) -> Door:
    if opening.kind != "door" or opening.state != "closed":
        what = f"an open {opening.kind}" if opening.kind == "door" else f"a {opening.kind}"
        raise LabgymError(f"{READS} with closed doors as its only openings; the {side} wall has {what}")
    length = width if side in ("front", "back") else depth
    offset = length - opening.position if reverse else opening.position
    outward = (opening.swing == INWARD[side]) == reverse
    return Door(wall=side, offset=offset, width=opening.width, height=opening.height, outward=outward)
