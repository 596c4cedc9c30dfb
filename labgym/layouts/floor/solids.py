"""The solid parts of a floor: pieces of wall around openings, leaves, panes, columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from labgym.geometry import OrientedBox, rotate
from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.floor.spaces import Column
from labgym.layouts.floor.walls import Opening, Wall

LEAF = 0.05
"""Thickness of the leaf of a door, meters."""
PANE = 0.03
"""Thickness of a window or a glazed part, meters."""


@dataclass(frozen=True)
class FloorPart:
    """A solid part of a floor.

    Attributes:
        kind: what it is; a lintel is above an opening, a sill below it.
        box: its extent in the floor's frame.
        source: index of the wall, or of the column.
        opening: index of the opening in the wall; None for plain wall and columns.
    """

    kind: Literal["wall", "lintel", "sill", "leaf", "pane", "column"]
    box: OrientedBox
    source: int
    opening: int | None = None


def solid_parts(
    walls: Sequence[Wall],
    extensions: Sequence[tuple[float, float]],
    doorways: Sequence[Doorway],
    columns: Sequence[Column],
    ceiling: float,
) -> Iterator[FloorPart]:
    """Yield the parts of a floor. Walls run through its exits, so that nothing leaves it.

    Args:
        extensions: by how much each wall runs on past its ends, meters.
        ceiling: height of columns, meters.
    """
    exits = {(doorway.wall, doorway.opening) for doorway in doorways if doorway.exit}
    for index, (wall, reach) in enumerate(zip(walls, extensions, strict=True)):
        closed = frozenset(k for k, opening in enumerate(wall.openings) if (index, opening) in exits)
        yield from _wall_parts(index, wall, reach, closed)
    for index, column in enumerate(columns):
        box = OrientedBox(column.x, column.y, column.width, column.depth, column.yaw, 0.0, ceiling)
        yield FloorPart("column", box, index)


def leaf(wall: Wall, opening: Opening, angle: float) -> OrientedBox:
    """Return the leaf of a door at an angle from its closed position, radians.

    It is hinged at an edge of the opening, on the face of the wall on the side to which it opens.
    """
    thickness = min(LEAF, wall.thickness)
    low, high = opening.span
    edge, toward = (low, 1.0) if opening.hinge == "start" else (high, -1.0)
    side = 1.0 if opening.swing == "left" else -1.0
    # In the wall's frame: the middle of the closed leaf from the hinge, turned about it towards the swing.
    turn = angle * toward * side
    dx, dy = rotate(toward * opening.width / 2.0, -side * thickness / 2.0, turn)
    x, y = wall.point(edge + dx, side * wall.thickness / 2.0 + dy)
    return OrientedBox(x, y, opening.width, thickness, wall.yaw + turn, 0.0, opening.height)


def pane(wall: Wall, opening: Opening) -> OrientedBox:
    """Return the pane of a window or a glazed part."""
    x, y = wall.point(opening.position)
    thickness = min(PANE, wall.thickness)
    return OrientedBox(x, y, opening.width, thickness, wall.yaw, opening.sill, opening.top)


def _wall_parts(index: int, wall: Wall, reach: tuple[float, float], closed: frozenset[int]) -> Iterator[FloorPart]:
    at = -reach[0]
    for k in sorted(range(len(wall.openings)), key=lambda k: wall.openings[k].position):
        if k in closed:
            continue
        opening = wall.openings[k]
        low, high = max(opening.span[0], 0.0), min(opening.span[1], wall.length)
        if low - at > 1e-9:
            yield FloorPart("wall", wall.piece(at, low, 0.0, wall.height), index)
        if opening.sill > 0.0:
            yield FloorPart("sill", wall.piece(low, high, 0.0, opening.sill), index, k)
        if wall.height - opening.top > 1e-9:
            yield FloorPart("lintel", wall.piece(low, high, opening.top, wall.height), index, k)
        if opening.kind in ("window", "glazing"):
            yield FloorPart("pane", pane(wall, opening), index, k)
        elif opening.kind == "door":
            turn = opening.angle if opening.state == "open" else 0.0
            yield FloorPart("leaf", leaf(wall, opening, turn), index, k)
        at = high
    if wall.length + reach[1] - at > 1e-9:
        yield FloorPart("wall", wall.piece(at, wall.length + reach[1], 0.0, wall.height), index)
