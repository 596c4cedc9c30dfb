"""The walls behind the edges of a region, and where furniture can stand against them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.geometry import wrap_angle
from labgym.layouts.floor import Opening
from labgym.layouts.ground.segments import Cut, Segment, without

TOUCH = 0.03
"""Greatest distance between an edge of a region and the face of the wall behind it, meters."""
PARALLEL = 1e-3
"""Greatest angle between an edge and the wall behind it, radians."""
REACH = 0.05
"""How far past the ends of its middle line a wall still backs furniture, meters."""
JOINT = 0.01
"""Half the width of the cut between two walls, meters."""
FRAME = 0.06
"""Width of the frame around a door, meters: furniture does not cover it."""


@dataclass(frozen=True)
class LocalWall:
    """A wall in the frame of a ground: start and direction of its middle line, length and thickness."""

    x: float
    y: float
    yaw: float
    length: float
    thickness: float
    openings: tuple[Opening, ...]


def backed(segment: Segment, walls: Sequence[LocalWall]) -> Segment:
    """Return a segment with the cuts of the walls behind it; a stretch without a wall is cut as by a door.

    It is also cut where one wall ends and the next begins, so that nothing stands against two of them.
    """
    cuts: list[Cut] = []
    covered: list[tuple[float, float]] = []
    behind: list[int] = []
    for index, wall in enumerate(walls):
        interval = _behind(segment, wall)
        if interval is None:
            continue
        covered.append(interval)
        behind.append(index)
        forward = math.cos(wall.yaw - segment.yaw) > 0.0
        for opening in wall.openings:
            offset = opening.position if forward else wall.length - opening.position
            base = _along(segment, wall.x, wall.y) if forward else _along(segment, *_end(wall))
            middle = base + offset
            if not -opening.width / 2.0 < middle < segment.length + opening.width / 2.0:
                continue
            way = opening.kind in ("door", "passage")
            half = opening.width / 2.0 + (FRAME if way else 0.0)
            cuts.append(Cut(middle - half, middle + half, 0.0 if way else opening.sill))
    cuts += [Cut(start, end, 0.0) for start, end in without((0.0, segment.length), covered)]
    ends = {end for interval in covered for end in interval if 0.0 < end < segment.length}
    cuts += [Cut(end - JOINT, end + JOINT, 0.0) for end in sorted(ends)]
    return replace(segment, cuts=tuple(cuts), walls=tuple(behind))


def faces(wall: LocalWall) -> tuple[Segment, Segment]:
    """Return both faces of a wall as segments."""
    half = wall.thickness / 2.0
    normal = (-math.sin(wall.yaw) * half, math.cos(wall.yaw) * half)
    x1, y1 = _end(wall)
    left = Segment("", wall.x + normal[0], wall.y + normal[1], wall.yaw, wall.length, straight=False)
    back = wrap_angle(wall.yaw + math.pi)
    return left, Segment("", x1 - normal[0], y1 - normal[1], back, wall.length, straight=False)


def _end(wall: LocalWall) -> tuple[float, float]:
    return wall.x + wall.length * math.cos(wall.yaw), wall.y + wall.length * math.sin(wall.yaw)


def _along(segment: Segment, x: float, y: float) -> float:
    return (x - segment.x) * math.cos(segment.yaw) + (y - segment.y) * math.sin(segment.yaw)


def _behind(segment: Segment, wall: LocalWall) -> tuple[float, float] | None:
    """The interval of a segment that a wall backs, None if the wall is not behind it."""
    if abs(math.sin(wall.yaw - segment.yaw)) > PARALLEL:
        return None
    inward = (wall.y - segment.y) * math.cos(segment.yaw) - (wall.x - segment.x) * math.sin(segment.yaw)
    if abs(inward + wall.thickness / 2.0) > TOUCH:
        return None
    ends = sorted((_along(segment, wall.x, wall.y), _along(segment, *_end(wall))))
    low, high = max(0.0, ends[0] - REACH), min(segment.length, ends[1] + REACH)
    return (low, high) if high > low else None
