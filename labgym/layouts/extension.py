"""Floors with one more room, added outside at an exit."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.geometry import to_world
from labgym.layouts.floor import Doorway, Floor, Opening, Rectangle, Space, Wall

THICKNESS = 0.2
"""Thickness of the walls of the room, meters."""


def extended(floor: Floor, width: float, depth: float) -> Iterator[tuple[int, Floor]]:
    """Yield floors with a rectangular laboratory at one exit each, and the index of the exit's wall.

    The exit becomes a door between spaces; the new room has an exit of the same size in the wall opposite. Exits before
    which another part of the building stands are left out.

    Args:
        width: of the room along the wall of the exit, meters. depth: across it, meters.
    """
    names = {part.id for parts in (floor.spaces, floor.columns, floor.keep_outs) for part in parts}
    name = next(name for k in range(1, len(names) + 2) if (name := f"added_{k}") not in names)
    for way in floor.doorways:
        if not way.exit:
            continue
        try:
            yield way.wall, _with_room(floor, way, name, width, depth)
        except ValueError:
            continue


def _with_room(floor: Floor, way: Doorway, name: str, width: float, depth: float) -> Floor:
    inner = next(space for space in way.spaces if space != "outside")
    x, y, yaw = way.side(inner)
    wall = floor.walls[way.wall]
    # The room's frame: its origin in the middle of the door on the outer face of the wall, y away from it.
    back = wall.thickness
    frame = (x + math.sin(yaw) * back, y - math.cos(yaw) * back, yaw + math.pi)
    low, high = _span(wall, way.opening.position, width, forward=math.cos(frame[2] - wall.yaw) > 0.0)
    half, t = width / 2.0, THICKNESS / 2.0
    corners = [(low - t, 0.0), (low - t, depth + t), (high + t, depth + t), (high + t, 0.0)]
    a, b, c, d = (tuple(point) for point in to_world(corners, frame).round(6).tolist())
    exit_ = Opening(position=half + t, width=way.width, height=way.opening.height, swing="right")
    walls = tuple(
        Wall(start=start, end=end, thickness=THICKNESS, height=wall.height, openings=openings)
        for start, end, openings in ((a, b, ()), (b, c, (exit_,)), (c, d, ()))
    )
    space = Space(
        id=name,
        x=round(frame[0], 6),
        y=round(frame[1], 6),
        yaw=math.remainder(frame[2], 2.0 * math.pi),
        region=(Rectangle(x0=round(low, 6), y0=0.0, x1=round(high, 6), y1=depth),),
        ceiling=min(floor.space(inner).ceiling, wall.height),
    )
    fields = {field: getattr(floor, field) for field in Floor.model_fields}
    return Floor(**{**fields, "walls": (*floor.walls, *walls), "spaces": (*floor.spaces, space)})


def _span(wall: Wall, position: float, width: float, forward: bool) -> tuple[float, float]:
    """The room's extent along a wall relative to the door, before the wall if it is long enough."""
    start = position - width / 2.0
    if wall.length >= width:
        start = min(max(start, 0.0), wall.length - width)
    low = start - position
    return (low, low + width) if forward else (-low - width, -low)
