"""The walls around one rectangular space, cut to its corners as those of a room are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError

from labgym.exchange.strips import Point
from labgym.exchange.wall_lines import FRAME
from labgym.layouts.floor import Opening, Rectangle, Space, Wall
from labgym.layouts.floor.rooms import Room, rectangle_parts


def squared(walls: Sequence[Wall], spaces: Sequence[Space]) -> tuple[list[Wall], list[Space]]:
    """Return the four walls of one rectangular space cut to its corners, other walls as they are."""
    plain = (list(walls), list(spaces))
    if len(spaces) != 1 or len(spaces[0].region) != 1 or len(walls) != 4:
        return plain
    space = spaces[0]
    if max(abs(space.x), abs(space.y), abs(space.yaw)) > 1e-6 or len({wall.thickness for wall in walls}) != 1:
        return plain
    corner: Rectangle = space.region[0]
    try:
        room = Room(width=corner.x1, depth=corner.y1, wall_thickness=walls[0].thickness, height=space.ceiling, doors=())
    except ValidationError:
        return plain
    sides, square = rectangle_parts(room)
    cut: list[Wall] = []
    for side in sides:
        for wall in walls:
            ends = [_off(side, wall.start), _off(side, wall.end)]
            if max(ends) <= FRAME and abs(wall.height - space.ceiling) < 1e-6:
                cut.append(_projected(wall, side))
                break
        else:
            return plain
    return cut, [space.model_copy(update={"x": 0.0, "y": 0.0, "yaw": 0.0, "region": square.region})]


def _off(side: Wall, point: Point) -> float:
    """Return the distance of a point from the middle line of a side."""
    (x0, y0), (x1, y1) = side.start, side.end
    return abs((x1 - x0) * (point[1] - y0) - (y1 - y0) * (point[0] - x0)) / side.length


def _projected(wall: Wall, side: Wall) -> Wall:
    """Return the wall of a side with the openings of a drawn wall."""
    forward = math.cos(wall.yaw - side.yaw) > 0.0
    openings = []
    for opening in wall.openings:
        x, y = wall.point(opening.position)
        position = (x - side.start[0]) * math.cos(side.yaw) + (y - side.start[1]) * math.sin(side.yaw)
        changes: dict[str, Any] = {"position": round(position, 6)}
        if not forward:
            changes["hinge"] = "end" if opening.hinge == "start" else "start"
            changes["swing"] = "right" if opening.swing == "left" else "left"
        openings.append(Opening(**{**{name: getattr(opening, name) for name in Opening.model_fields}, **changes}))
    return Wall(start=side.start, end=side.end, thickness=wall.thickness, height=wall.height, openings=tuple(openings))
