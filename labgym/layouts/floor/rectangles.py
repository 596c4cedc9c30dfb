"""One-room floors: the walls of a rectangular room, and the room that a floor is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from labgym.errors import LabgymError
from labgym.layouts.floor.rooms import Door, Room, Side
from labgym.layouts.floor.spaces import Rectangle, Space
from labgym.layouts.floor.walls import Opening, Wall

SAME_POINT = 1e-3
"""Ends of walls that are nearer to a corner than this meet it, meters."""
INWARD: dict[Side, Literal["left", "right"]] = {"front": "left", "back": "right", "left": "right", "right": "left"}
"""Side of each wall of a rectangle on which the room lies, seen from the wall's start."""
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
                Opening(position=door.offset, width=door.width, height=door.height, swing=INWARD[side])
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
    if (opening.swing == INWARD[side]) == reverse:
        raise LabgymError(f"{READS} with doors that open into it; the door in the {side} wall opens outwards")
    length = width if side in ("front", "back") else depth
    offset = length - opening.position if reverse else opening.position
    return Door(wall=side, offset=offset, width=opening.width, height=opening.height)
