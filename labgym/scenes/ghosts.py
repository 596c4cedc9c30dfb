"""Furniture that a picture draws as a ghost: where a wall is cut away, what stands against it shows its blank back."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.geometry.boxes import distance
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.scenes.cutaway import Point
from labgym.scenes.mesh import ROOM, SceneMesh, box_faces
from labgym.scenes.wall_faces import CUT, upper, wall_name

AGAINST = 0.3
"""Greatest distance between a wall and what stands against it, meters."""
BLANK = 0.5
"""Least share of its back that a panel covers: neither a shower nor a gas cylinder has a blank back."""
ALIGNED = 0.9
"""Least cosine between a direction and the normal of a face that looks along it."""
TOPS = (0.3, 1.2)
"""Heights of the worktops and shelves that stay as they are, meters."""
EDGE = 0.02
"""Width of the edges that outline a ghost, meters."""


def blank_backs(mesh: SceneMesh, layout: Layout, position: Point, hidden: Collection[str]) -> list[int]:
    """Return the indices of the furniture against cut walls that turns a blank back to a camera."""
    cut = [wall.box for k, wall in enumerate(layout.floor.walls) if upper(wall_name(k)) in hidden]
    vectors = _vectors(mesh)
    backs = []
    for index, placement in enumerate(layout.placements if cut else ()):
        box = layout.box(placement.id)
        if placement.support != FLOOR or box.z1 < CUT or box.to_local(*position[:2])[1] > -box.depth / 2.0:
            continue
        if min(distance(box, wall) for wall in cut) < AGAINST:
            rearward = vectors[mesh.owner == index] @ (-box.front[0], -box.front[1], 0.0)
            panel = rearward[rearward > ALIGNED * np.linalg.norm(vectors[mesh.owner == index], axis=1)].sum()
            if panel > BLANK * box.width * (box.z1 - box.z0):
                backs.append(index)
    return backs


def ghost_faces(mesh: SceneMesh, ghosts: Collection[int]) -> NDArray[np.bool_]:
    """Return which faces of a mesh are translucent, shape (m,): those of ghosts, without worktops and shelves."""
    vectors = _vectors(mesh)
    level = vectors[:, 2] > ALIGNED * np.linalg.norm(vectors, axis=1)
    height = mesh.vertices[mesh.faces[:, 0], 2]
    return np.asarray(np.isin(mesh.owner, list(ghosts)) & ~(level & (height > TOPS[0]) & (height < TOPS[1])))


def outlines(mesh: SceneMesh, layout: Layout, ghosts: Collection[int]) -> Iterator[SceneMesh]:
    """Yield bars along the edges of the boxes around ghosts, in the color of most of each ghost."""
    areas = np.linalg.norm(_vectors(mesh), axis=1)
    for index in ghosts:
        mine = mesh.owner == index
        material = int(np.bincount(mesh.material[mine], areas[mine]).argmax())
        for box in _edges(layout.box(layout.placements[index].id)):
            vertices, faces = box_faces(box)
            yield SceneMesh(vertices, faces, np.full(len(faces), material), np.full(len(faces), ROOM))


def _vectors(mesh: SceneMesh) -> NDArray[np.float64]:
    """Return the normals of faces, as long as their areas, shape (m, 3)."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a) / 2.0)


def _edges(box: OrientedBox) -> Iterator[OrientedBox]:
    """Yield the twelve bars along the edges of a box."""
    u, v, half = (box.width - EDGE) / 2.0, (box.depth - EDGE) / 2.0, EDGE / 2.0

    def bar(x: float, y: float, width: float, depth: float, z: tuple[float, float]) -> OrientedBox:
        return OrientedBox(*box.to_world(x, y), width, depth, box.yaw, *z)

    for side, z in product((-1, 1), (box.z0 + half, box.z1 - half)):
        yield bar(0.0, side * v, box.width, EDGE, (z - half, z + half))
        yield bar(side * u, 0.0, EDGE, box.depth, (z - half, z + half))
    for i, j in product((-1, 1), (-1, 1)):
        yield bar(i * u, j * v, EDGE, EDGE, (box.z0, box.z1))
