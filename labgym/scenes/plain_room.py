"""The visible faces of a floor that a `Room` describes: its walls, with doors and high windows, and its covering."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from labgym.assets.shapes import Part, tessellate
from labgym.assets.shapes.parts import block
from labgym.layouts.floor import Door, Finishes, Floor, Room
from labgym.layouts.floor.rooms import sides_of
from labgym.scenes.finishes import floor_material, paint
from labgym.scenes.floor_covering import FLOOR
from labgym.scenes.patches import Array, Faces, Patch, join
from labgym.scenes.wall_faces import upper, wall_name

Span = tuple[float, float]

SKIRTING = 0.10
"""Height of the skirting, meters."""
SILL = 2.45
"""Height of the sills of the high windows, meters: above fume hoods and wall cabinets."""
CAP = "wall_cap"
"""Material of the top of a wall."""
LINTEL = 0.12
"""Height of the wall above the high windows, meters."""
RECESS = 0.06
"""Distance of door leaves and panes behind the inner face of the wall, meters."""


def wall_parts(room: Room, wall: str, finishes: Finishes) -> Iterator[Part]:
    """Yield the blocks of a wall: u runs along the wall to the right as seen from inside, v outwards, z upwards."""
    length = room.width if wall in ("front", "back") else room.depth
    # Only the part of the wall in front of panes and door leaves is visible.
    recess = min(RECESS, room.wall_thickness / 2.0)
    thick = (0.0, min(recess + 0.02, room.wall_thickness))
    # Front and back walls include the corners of the room.
    reach = room.wall_thickness if wall in ("front", "back") else 0.0
    doors = [(_door_span(room, wall, door), door.height) for door in room.doors if door.wall == wall]
    panes = [] if wall == "front" else _window_spans(length, room.height)
    color = paint(finishes, accent=wall == "back")
    cuts = sorted({0.0, length, *[u for span, _ in doors for u in span], *[u for span in panes for u in span]})
    for left, right in pairwise(cuts):
        u, middle = (left, right), (left + right) / 2.0
        opening = next((top for span, top in doors if span[0] < middle < span[1]), 0.0)
        if opening == 0.0:
            yield block("skirting", u, thick, (0.0, SKIRTING))
        glazed = any(span[0] < middle < span[1] for span in panes) and opening < SILL
        low = max(opening, SKIRTING)
        if glazed:
            yield block(color, u, thick, (low, SILL))
            yield block(color, u, thick, (room.height - LINTEL, room.height))
        elif room.height - low > 1e-6:
            yield block(color, u, thick, (low, room.height))
    yield block(CAP, (-reach, length + reach), (0.0, room.wall_thickness), (room.height - 0.001, room.height))
    for span, top in doors:
        yield from _door(span, top, recess, thick[1])
    for span in panes:
        yield from _pane(span, (SILL, room.height - LINTEL), recess)


def _door_span(room: Room, wall: str, door: Door) -> Span:
    """Return the doorway's interval of u; the offsets of doors in front and right walls count from the far end."""
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


def room_patches(floor: Floor, room: Room) -> Iterator[Patch]:
    """Yield the faces of the walls that are visible from inside, and the walls' tops, without the floor.

    Without outward faces the walls are transparent from outside. A wall is one part, which pictures leave out whole.
    """
    for side, index in sides_of(room, floor.walls).items():
        yield from _wall_patches(room, side, upper(wall_name(index)), floor.spaces[0].finishes)


def room_covering(floor: Floor, room: Room) -> Patch:
    """Return the covering of the floor."""
    w, d = room.width, room.depth
    corners = np.array([[0.0, 0.0, 0.0], [w, 0.0, 0.0], [w, d, 0.0], [0.0, d, 0.0]])
    material = floor_material(floor.spaces[0].finishes)
    return Patch(FLOOR, FLOOR, material, corners, np.array([[0, 1, 2], [0, 2, 3]]))


def _wall_frame(room: Room, wall: str) -> tuple[Array, Array]:
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


def _wall_patches(room: Room, wall: str, name: str, finishes: Finishes) -> Iterator[Patch]:
    rotation, origin = _wall_frame(room, wall)
    pieces: dict[str, list[tuple[Array, Faces]]] = {}
    for part in wall_parts(room, wall, finishes):
        vertices, faces = tessellate(part)
        corners = vertices[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # Without outward faces a wall between the camera and the room does not hide it.
        top = vertices[faces][:, :, 2].min(axis=1) > room.height - 1e-9
        visible = (normal[:, 1] < 0.5) & (top == (part.material == CAP))
        pieces.setdefault(part.material, []).append((vertices @ rotation.T + origin, faces[visible]))
    for material, meshes in pieces.items():
        vertices, faces = join(meshes)
        yield Patch(name, f"{name}/{material}", material, vertices, faces)
