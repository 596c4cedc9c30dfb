"""The room itself: walls with doorways and high windows, as faces to look at and boxes to bump into."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes import Part, tessellate
from labgym.assets.shapes.parts import block
from labgym.geometry import OrientedBox
from labgym.layouts import Door, Layout, Placement, Room
from labgym.layouts.model import WALL

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Span = tuple[float, float]

WALLS = ("front", "back", "left", "right")
SKIRTING = 0.10
"""Height of the skirting, metres."""
SILL = 2.45
"""Height of the high windows' sills, metres: above fume hoods and wall cabinets."""
CAP = "wall_cap"
LINTEL = 0.12
"""Height of the wall above the high windows, metres."""
RECESS = 0.06
"""How far door leaves and panes stand back from the wall's face, metres."""


@dataclass(frozen=True)
class Patch:
    """Faces of one material of a wall in the room frame: vertices (n, 3), faces (m, 3), seen from inside the room."""

    wall: str
    name: str
    material: str
    vertices: Array
    faces: Faces


@lru_cache(maxsize=32)
def room_patches(room: Room) -> tuple[Patch, ...]:
    """Return what one sees of the walls from inside, and their top edges; from outside one looks through them.

    The floor is not among them.
    """
    return tuple(patch for wall in WALLS for patch in _wall_patches(room, wall))


def room_solids(room: Room) -> dict[str, OrientedBox]:
    """Return the walls as solid boxes by name; doors are shut, so a wall is one box."""
    w, d, t, h = room.width, room.depth, room.wall_thickness, room.height
    return {
        "front": OrientedBox(w / 2.0, -t / 2.0, w + 2.0 * t, t, 0.0, 0.0, h),
        "back": OrientedBox(w / 2.0, d + t / 2.0, w + 2.0 * t, t, 0.0, 0.0, h),
        "left": OrientedBox(-t / 2.0, d / 2.0, t, d, 0.0, 0.0, h),
        "right": OrientedBox(w + t / 2.0, d / 2.0, t, d, 0.0, 0.0, h),
    }


def walls_between(room: Room, x: float, y: float) -> tuple[str, ...]:
    """Return the walls that stand between a point and the room: none where the point is inside."""
    beyond = {"front": y < 0.0, "back": y > room.depth, "left": x < 0.0, "right": x > room.width}
    return tuple(wall for wall in WALLS if beyond[wall])


def hanging_on(layout: Layout, placement: Placement) -> str | None:
    """Return the wall that a wall-mounted placement hangs on, None for what stands."""
    if placement.support != WALL:
        return None
    x, y, _ = placement.position
    gaps = {"front": y, "back": layout.room.depth - y, "left": x, "right": layout.room.width - x}
    return min(WALLS, key=lambda wall: gaps[wall])


def wall_frame(room: Room, wall: str) -> tuple[Array, Array]:
    """Return a wall's rotation, shape (3, 3), and origin, shape (3,).

    In the wall's frame u runs along it to the right as seen from inside, v outwards from its inner face, z up.
    """
    w, d = room.width, room.depth
    along, outward, origin = {
        "back": ((1.0, 0.0), (0.0, 1.0), (0.0, d)),
        "front": ((-1.0, 0.0), (0.0, -1.0), (w, 0.0)),
        "left": ((0.0, 1.0), (-1.0, 0.0), (0.0, 0.0)),
        "right": ((0.0, -1.0), (1.0, 0.0), (w, d)),
    }[wall]
    rotation = np.array([[along[0], outward[0], 0.0], [along[1], outward[1], 0.0], [0.0, 0.0, 1.0]])
    return rotation, np.array([origin[0], origin[1], 0.0])


def _wall_patches(room: Room, wall: str) -> Iterator[Patch]:
    rotation, origin = wall_frame(room, wall)
    pieces: dict[str, list[tuple[Array, Faces]]] = {}
    for part in _wall_parts(room, wall):
        vertices, faces = tessellate(part)
        corners = vertices[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # Without outward faces a wall between the camera and the room does not hide it.
        top = vertices[faces][:, :, 2].min(axis=1) > room.height - 1e-9
        seen = (normal[:, 1] < 0.5) & (top == (part.material == CAP))
        pieces.setdefault(part.material, []).append((vertices @ rotation.T + origin, faces[seen]))
    for material, meshes in pieces.items():
        vertices, faces = join(meshes)
        yield Patch(wall, f"{wall}/{material}", material, vertices, faces)


def join(meshes: list[tuple[Array, Faces]]) -> tuple[Array, Faces]:
    """Concatenate meshes, each (vertices, faces)."""
    offsets = np.cumsum([0, *[len(vertices) for vertices, _ in meshes[:-1]]])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)]),
    )


def _wall_parts(room: Room, wall: str) -> Iterator[Part]:
    """Blocks of a wall in its own frame (u, v, z)."""
    length = room.width if wall in ("front", "back") else room.depth
    # What stands behind a pane or a door leaf is never seen, so a wall is only as deep as its openings.
    recess = min(RECESS, room.wall_thickness / 2.0)
    thick = (0.0, min(recess + 0.02, room.wall_thickness))
    # Front and back walls close the corners.
    reach = room.wall_thickness if wall in ("front", "back") else 0.0
    doors = [(_door_span(room, wall, door), door.height) for door in room.doors if door.wall == wall]
    panes = [] if wall == "front" else _window_spans(length, room.height)
    paint = "wall_accent" if wall == "back" else "wall_paint"
    cuts = sorted({0.0, length, *[u for span, _ in doors for u in span], *[u for span in panes for u in span]})
    for left, right in pairwise(cuts):
        u, middle = (left, right), (left + right) / 2.0
        opening = next((top for span, top in doors if span[0] < middle < span[1]), 0.0)
        if opening == 0.0:
            yield block("skirting", u, thick, (0.0, SKIRTING))
        glazed = any(span[0] < middle < span[1] for span in panes) and opening < SILL
        low = max(opening, SKIRTING)
        if glazed:
            yield block(paint, u, thick, (low, SILL))
            yield block(paint, u, thick, (room.height - LINTEL, room.height))
        elif room.height - low > 1e-6:
            yield block(paint, u, thick, (low, room.height))
    yield block(CAP, (-reach, length + reach), (0.0, room.wall_thickness), (room.height - 0.001, room.height))
    for span, top in doors:
        yield from _door(span, top, recess, thick[1])
    for span in panes:
        yield from _pane(span, (SILL, room.height - LINTEL), recess)


def _door_span(room: Room, wall: str, door: Door) -> Span:
    """The doorway along u; offsets count from the wall's start, which front and right walls have at their far u."""
    length = room.width if wall in ("front", "back") else room.depth
    middle = length - door.offset if wall in ("front", "right") else door.offset
    return middle - door.width / 2.0, middle + door.width / 2.0


def _window_spans(length: float, height: float) -> list[Span]:
    if height < SILL + 0.4 or length < 2.0:
        return []
    count = max(1, int((length - 0.6) // 1.5))
    pitch = (length - 0.6) / count
    return [(0.3 + k * pitch + 0.08, 0.3 + (k + 1) * pitch - 0.08) for k in range(count)]


def _door(u: Span, top: float, recess: float, thick: float) -> Iterator[Part]:
    frame = 0.05
    leaf, inner = (recess, thick), (u[0] + frame, u[1] - frame)
    for side in ((u[0], inner[0]), (inner[1], u[1])):
        yield block("door_frame", side, (0.0, thick), (0.0, top))
    yield block("door_frame", inner, (0.0, thick), (top - frame, top))
    wide = u[1] - u[0]
    pane = (u[0] + 0.56 * wide, u[0] + 0.80 * wide)
    low, high = 0.48 * top, 0.88 * top
    yield block("door_leaf", (inner[0], pane[0]), leaf, (0.0, top - frame))
    yield block("door_leaf", (pane[1], inner[1]), leaf, (0.0, top - frame))
    yield block("door_leaf", pane, leaf, (0.0, low))
    yield block("door_leaf", pane, leaf, (high, top - frame))
    yield block("daylight", pane, ((leaf[0] + leaf[1]) / 2.0, leaf[1]), (low, high))
    yield block("stainless", (inner[0] + 0.03, inner[1] - 0.03), (leaf[0] - 0.002, leaf[0]), (0.02, 0.24))
    yield block("stainless", (inner[0] + 0.05, inner[0] + 0.17), (0.3 * recess, 0.6 * recess), (1.02, 1.045))
    yield block("stainless", (inner[0] + 0.05, inner[0] + 0.08), (0.6 * recess, recess), (0.96, 1.10))


def _pane(u: Span, z: Span, recess: float) -> Iterator[Part]:
    rail = 0.03
    depth = (recess * 0.5, recess)
    for side in ((u[0], u[0] + rail), (u[1] - rail, u[1])):
        yield block("plastic_white", side, depth, z)
    for level in ((z[0], z[0] + rail), (z[1] - rail, z[1])):
        yield block("plastic_white", (u[0] + rail, u[1] - rail), depth, level)
    yield block("daylight", (u[0] + rail, u[1] - rail), (recess * 0.9, recess), (z[0] + rail, z[1] - rail))
