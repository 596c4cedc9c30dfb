"""Floors: walls with openings and the spaces between them, and the view of a one-room floor as a `Room`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import combinations
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Record

Coordinate = Annotated[float, Field(ge=-100.0, le=100.0)]
IDENTIFIER = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,79}$"
Identifier = Annotated[str, Field(pattern=IDENTIFIER)]
Thickness = Annotated[float, Field(ge=0.02, le=1.0)]
Height = Annotated[float, Field(ge=2.2, le=10.0)]
DoorWidth = Annotated[float, Field(ge=0.6, le=4.0)]
DoorHeight = Annotated[float, Field(ge=1.8, le=4.0)]
Side = Literal["front", "back", "left", "right"]

SAME_POINT = 1e-3
"""Ends of walls that are nearer to a corner than this meet it, meters."""
INWARD: dict[Side, Literal["left", "right"]] = {"front": "left", "back": "right", "left": "right", "right": "left"}
"""Side of each wall of a rectangle on which the room lies, seen from the wall's start."""


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
    """The interior of a rectangular room in metres: origin at the front-left floor corner, x right, y away."""

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
        return Floor.rectangle(self.width, self.depth, self.height, self.wall_thickness, self.doors, self.name)


class Opening(Record):
    """A door in a wall.

    Attributes:
        position: meters from the wall's start to the middle of the opening.
        width, height: clear opening, meters.
        hinge: the end of the wall that is nearer to the hinge.
        swing: the side of the wall, seen from its start, to which the leaf opens.
    """

    kind: Literal["door"] = "door"
    position: Annotated[float, Field(ge=0.0, le=50.0)]
    width: DoorWidth = 1.0
    height: DoorHeight = 2.1
    hinge: Literal["start", "end"] = "start"
    swing: Literal["left", "right"] = "left"


class Wall(Record):
    """A straight wall: `start` and `end` are the ends (x, y) of its middle line; lengths in meters."""

    start: tuple[Coordinate, Coordinate]
    end: tuple[Coordinate, Coordinate]
    thickness: Thickness = 0.2
    height: Height = 3.0
    openings: Annotated[tuple[Opening, ...], Field(max_length=8)] = ()


class Rectangle(Record):
    """An axis-aligned rectangle in the frame of a space: two opposite corners, meters."""

    x0: Coordinate = 0.0
    y0: Coordinate = 0.0
    x1: Coordinate
    y1: Coordinate


class Space(Record):
    """A room of a floor.

    Attributes:
        use: purpose of the space.
        x, y, yaw: the space's frame in the floor's; meters, radians.
        region: rectangles whose union is the free floor between the walls, in the space's frame.
        ceiling: height of the ceiling, meters.
    """

    id: Identifier = "laboratory"
    use: Literal["laboratory", "instrument", "store", "write-up", "corridor"] = "laboratory"
    x: Coordinate = 0.0
    y: Coordinate = 0.0
    yaw: Annotated[float, Field(ge=-7.0, le=7.0)] = 0.0
    region: Annotated[tuple[Rectangle, ...], Field(min_length=1, max_length=64)]
    ceiling: Height = 3.0


class Floor(Record):
    """Walls and the spaces that they enclose.

    This version of labgym reads floors of one rectangular space with its corner at the origin and a wall along each
    side; anything else is refused. `room` is the view of that space which the rest of labgym uses.

    Attributes:
        name: a label, such as the name of a room preset. It does not count in a layout's hash.
    """

    name: Annotated[str, Field(max_length=80)] = "custom"
    walls: Annotated[tuple[Wall, ...], Field(max_length=1000)]
    spaces: Annotated[tuple[Space, ...], Field(min_length=1, max_length=64)]

    @model_validator(mode="after")
    def _check_supported(self) -> Self:
        _ = self.room
        return self

    @classmethod
    def rectangle(
        cls,
        width: float,
        depth: float,
        height: float = 3.0,
        wall_thickness: float = 0.2,
        doors: Sequence[Door] = (Door(wall="front", offset=1.5),),
        name: str = "custom",
    ) -> Floor:
        """Return the floor of one rectangular room; arguments in meters, as in `Room`.

        Raises:
            ValueError: a value out of range, a door that does not fit its wall, or doors that overlap.
        """
        room = Room(
            name=name, width=width, depth=depth, height=height, wall_thickness=wall_thickness, doors=tuple(doors)
        )
        walls = tuple(
            Wall(
                start=start,
                end=end,
                thickness=wall_thickness,
                height=height,
                openings=tuple(
                    Opening(position=door.offset, width=door.width, height=door.height, swing=INWARD[side])
                    for door in room.doors
                    if door.wall == side
                ),
            )
            for side, (start, end) in _middle_lines(width, depth, wall_thickness).items()
        )
        space = Space(region=(Rectangle(x1=width, y1=depth),), ceiling=height)
        return cls(name=name, walls=walls, spaces=(space,))

    @cached_property
    def room(self) -> Room:
        """The only space as a rectangular room."""
        space = self._only_space()
        width, depth = space.region[0].x1, space.region[0].y1
        doors: list[Door] = []
        sides: dict[Side, Wall] = {}
        for index, wall in enumerate(self.walls):
            side, reverse = _side_of(wall, width, depth)
            if side is None:
                raise ValueError(f"{_READS}; wall {index} lies along none of the four sides of the space")
            if side in sides:
                raise ValueError(f"{_READS}; two walls lie along the {side} side")
            if wall.height != space.ceiling or wall.thickness != self.walls[0].thickness:
                raise ValueError(f"{_READS} with walls of one thickness, as high as the ceiling; wall {index} differs")
            sides[side] = wall
            doors += [_door(side, opening, width, depth, reverse) for opening in wall.openings]
        if len(sides) != 4:
            raise ValueError(f"{_READS} with a wall along each side; got {len(sides)} walls")
        return Room(
            name=self.name,
            width=width,
            depth=depth,
            height=space.ceiling,
            wall_thickness=self.walls[0].thickness,
            doors=tuple(doors),
        )

    def _only_space(self) -> Space:
        if len(self.spaces) != 1:
            raise ValueError(f"{_READS}; got {len(self.spaces)} spaces")
        space = self.spaces[0]
        if len(space.region) != 1:
            raise ValueError(f"{_READS}; space {space.id!r} consists of {len(space.region)} rectangles")
        corner = space.region[0]
        if (space.x, space.y, space.yaw, corner.x0, corner.y0) != (0.0, 0.0, 0.0, 0.0, 0.0):
            raise ValueError(f"{_READS} whose frame and front-left corner are the origin; space {space.id!r} is moved")
        return space


_READS = "this version reads floors of one rectangular space"
Line = tuple[tuple[float, float], tuple[float, float]]


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
    if (opening.swing == INWARD[side]) == reverse:
        raise ValueError(f"{_READS} with doors that open into it; the door in the {side} wall opens outwards")
    length = width if side in ("front", "back") else depth
    offset = length - opening.position if reverse else opening.position
    return Door(wall=side, offset=offset, width=opening.width, height=opening.height)
