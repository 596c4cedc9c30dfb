"""The visible faces of a floor that a `Room` describes: its walls, with doors and high windows, and its covering."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labgym.assets.shapes import tessellate
from labgym.layouts.floor import Finishes, Floor, Room
from labgym.layouts.floor.rooms import sides_of
from labgym.scenes.finishes import floor_material
from labgym.scenes.floor_covering import FLOOR
from labgym.scenes.patches import Array, Faces, Patch, join
from labgym.scenes.wall_faces import upper, wall_name
from labgym.scenes.wall_parts import CAP, wall_parts


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
