"""The walls of a rectangular room: visible faces and solid boxes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from labgym.assets.shapes import tessellate
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Finishes, Room
from labgym.scenes.patches import Array, Faces, Patch, join
from labgym.scenes.wall_parts import CAP, wall_parts

WALLS = ("front", "back", "left", "right")


@lru_cache(maxsize=32)
def room_patches(room: Room, finishes: Finishes = Finishes()) -> tuple[Patch, ...]:  # noqa: B008 (a frozen record)
    """Return the faces of the walls that are visible from inside, and the walls' tops, without the floor.

    Without outward faces the walls are transparent from outside.
    """
    return tuple(patch for wall in WALLS for patch in _wall_patches(room, wall, finishes))


def room_solids(room: Room) -> dict[str, OrientedBox]:
    """Return the walls as solid boxes by name; doors are closed, so that each wall is one box."""
    w, d, t, h = room.width, room.depth, room.wall_thickness, room.height
    return {
        "front": OrientedBox(w / 2.0, -t / 2.0, w + 2.0 * t, t, 0.0, 0.0, h),
        "back": OrientedBox(w / 2.0, d + t / 2.0, w + 2.0 * t, t, 0.0, 0.0, h),
        "left": OrientedBox(-t / 2.0, d / 2.0, t, d, 0.0, 0.0, h),
        "right": OrientedBox(w + t / 2.0, d / 2.0, t, d, 0.0, 0.0, h),
    }


def room_covering(room: Room) -> tuple[Array, Faces]:
    """Return the floor's vertices and faces."""
    w, d = room.width, room.depth
    corners = np.array([[0.0, 0.0, 0.0], [w, 0.0, 0.0], [w, d, 0.0], [0.0, d, 0.0]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def walls_between(room: Room, x: float, y: float) -> tuple[str, ...]:
    """Return the walls between a point and the room: none if the point is inside."""
    beyond = {"front": y < 0.0, "back": y > room.depth, "left": x < 0.0, "right": x > room.width}
    return tuple(wall for wall in WALLS if beyond[wall])


def nearest_wall(room: Room, x: float, y: float) -> str:
    """Return the wall that is nearest to a point of the room."""
    gaps = {"front": y, "back": room.depth - y, "left": x, "right": room.width - x}
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


def _wall_patches(room: Room, wall: str, finishes: Finishes) -> Iterator[Patch]:
    rotation, origin = wall_frame(room, wall)
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
        yield Patch(wall, f"{wall}/{material}", material, vertices, faces)
