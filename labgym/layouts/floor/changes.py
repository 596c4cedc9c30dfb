"""Changed floors: doors opened, spaces made longer, one more room at an exit."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from pydantic import ValidationError

from labgym.geometry import OrientedBox, to_local, to_world
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.floor.model import Floor
from labgym.layouts.floor.spaces import Rectangle, Space
from labgym.layouts.floor.walls import Opening, Wall


def closed_doors(floor: Floor) -> frozenset[tuple[int, Opening]]:
    """Return the closed doors between spaces, each with the index of its wall."""
    inner = ((way.wall, way.opening) for way in floor.doorways if not way.exit)
    return frozenset((wall, way) for wall, way in inner if way.kind == "door" and way.state == "closed")


def walls_with(floor: Floor, openings: Collection[tuple[int, Opening]], **changes: object) -> tuple[Wall, ...]:
    """Return the walls of a floor with some fields of some openings changed, unchecked.

    Args:
        openings: the openings, each with the index of its wall.
        changes: the fields.
    """
    return tuple(
        wall.model_copy(
            update={
                "openings": tuple(
                    opening.model_copy(update=changes) if (index, opening) in openings else opening
                    for opening in wall.openings
                )
            }
        )
        for index, wall in enumerate(floor.walls)
    )


Point = tuple[float, float]

ALONG = 1e-6
"""Angle to the axis below which a wall runs along it, radians."""
NARROW = 0.02
"""Gaps between parts that are narrower than this are not cut, meters."""
DIGITS = 6


@dataclass(frozen=True)
class Stretch:
    """A lengthening of a floor at a line.

    Attributes:
        floor: the longer floor.
        frame: pose of the frame in which the line is given. axis: 0 or 1, the axis of the frame along which it grew.
        cut: coordinate of the line, meters. by: how much longer, meters.
    """

    floor: Floor
    frame: PlanarPose
    axis: int
    cut: float
    by: float

    def moved(self, x: float, y: float) -> Point:
        """Return where a point of the old floor lies in the new one."""
        local = to_local([(x, y)], self.frame)[0]
        if local[self.axis] > self.cut:
            local[self.axis] += self.by
        point = to_world([local], self.frame)[0].tolist()
        return round(point[0], DIGITS) + 0.0, round(point[1], DIGITS) + 0.0


def stretched(floor: Floor, space_id: str, axis: int, by: float) -> Stretch | None:
    """Return a floor in which a space is longer along an axis of its frame; None if no straight cut allows it.

    The cut crosses no oblique wall, no opening, no column and no keep-out; other spaces that it crosses grow, too.

    Args:
        axis: 0 for x, 1 for y. by: meters.

    Raises:
        UnknownNameError: no space has that id.
    """
    space = floor.space(space_id)
    for cut in _cuts(floor, space, axis):
        stretch = Stretch(floor, space.frame, axis, cut, by)
        try:
            return Stretch(_grown(floor, stretch), space.frame, axis, cut, by)
        except (ValidationError, _UncutError):
            continue
    return None


class _UncutError(Exception):
    """The line crosses a part that cannot be cut."""


def _cuts(floor: Floor, space: Space, axis: int) -> Iterator[float]:
    """Yield the middles of the gaps between the parts in a space, the widest first."""
    low = min(r.x0 if axis == 0 else r.y0 for r in space.region)
    high = max(r.x1 if axis == 0 else r.y1 for r in space.region)
    points: list[Sequence[float]] = [end for wall in floor.walls for end in (wall.start, wall.end)]
    points += [corner for other in floor.spaces for box in other.boxes for corner in box.corners().tolist()]
    boxes = [*(keep_out.box for keep_out in floor.keep_outs), *_columns(floor)]
    points += [corner for box in boxes for corner in box.corners().tolist()]
    points += [(service.x, service.y) for service in floor.services]
    points += [
        wall.point(opening.position + side * opening.width / 2.0)
        for wall in floor.walls
        for opening in wall.openings
        for side in (-1.0, 1.0)
    ]
    values = np.unique(np.round(to_local(points, space.frame)[:, axis], DIGITS))
    inside = [low, *values[(values > low) & (values < high)].tolist(), high]
    gaps = sorted(((b - a, (a + b) / 2.0) for a, b in pairwise(inside) if b - a > NARROW), reverse=True)
    for _, middle in gaps:
        yield middle


def _columns(floor: Floor) -> list[OrientedBox]:
    return [OrientedBox(c.x, c.y, c.width, c.depth, c.yaw) for c in floor.columns]


def _grown(floor: Floor, stretch: Stretch) -> Floor:
    for box in (*(keep_out.box for keep_out in floor.keep_outs), *_columns(floor)):
        if _crosses(stretch, box.corners().tolist()):
            raise _UncutError
    changes: dict[str, object] = {
        "walls": tuple(_wall(wall, stretch) for wall in floor.walls),
        "spaces": tuple(_space(space, stretch) for space in floor.spaces),
    }
    for name in ("columns", "services", "keep_outs"):
        parts = getattr(floor, name)
        places = [stretch.moved(part.x, part.y) for part in parts]
        changes[name] = tuple(
            part.model_copy(update={"x": x, "y": y}) for part, (x, y) in zip(parts, places, strict=True)
        )
    fields = {name: getattr(floor, name) for name in Floor.model_fields}
    return Floor(**{**fields, **changes})


def _crosses(stretch: Stretch, points: Sequence[Sequence[float]]) -> bool:
    """Whether points lie on both sides of the line."""
    values = to_local(points, stretch.frame)[:, stretch.axis]
    return bool(values.min() < stretch.cut < values.max())


def _wall(wall: Wall, stretch: Stretch) -> Wall:
    start, end = stretch.moved(*wall.start), stretch.moved(*wall.end)
    if not _crosses(stretch, [wall.start, wall.end]):
        return wall.model_copy(update={"start": start, "end": end})
    turn = wall.yaw - stretch.frame[2] - stretch.axis * math.pi / 2.0
    if abs(math.sin(turn)) > ALONG:
        raise _UncutError
    openings: list[Opening] = []
    for opening in wall.openings:
        ends = [wall.point(opening.position + side * opening.width / 2.0) for side in (-1.0, 1.0)]
        if _crosses(stretch, ends):
            raise _UncutError
        position = math.dist(start, stretch.moved(*wall.point(opening.position)))
        openings.append(opening.model_copy(update={"position": round(position, DIGITS)}))
    return wall.model_copy(update={"start": start, "end": end, "openings": tuple(openings)})


def _space(space: Space, stretch: Stretch) -> Space:
    corners = [corner for box in space.boxes for corner in box.corners().tolist()]
    if not _crosses(stretch, corners):
        x, y = stretch.moved(space.x, space.y)
        origin_crossed = _crosses(stretch, [*corners, (space.x, space.y)])
        return space.model_copy(update=_reframed(space, stretch) if origin_crossed else {"x": x, "y": y})
    if abs(math.sin(2.0 * (space.yaw - stretch.frame[2]))) > ALONG:
        raise _UncutError
    return space.model_copy(update=_reframed(space, stretch))


def _reframed(space: Space, stretch: Stretch) -> dict[str, object]:
    """The region in the same frame with its corners moved."""
    region = []
    for r in space.region:
        ends = to_world([(r.x0, r.y0), (r.x1, r.y1)], space.frame).tolist()
        moved = to_local([stretch.moved(*end) for end in ends], space.frame)
        (x0, y0), (x1, y1) = (moved.min(axis=0) + 0.0).round(DIGITS).tolist(), moved.max(axis=0).round(DIGITS).tolist()
        region.append(Rectangle(x0=x0, y0=y0, x1=x1, y1=y1))
    return {"region": tuple(region)}


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
