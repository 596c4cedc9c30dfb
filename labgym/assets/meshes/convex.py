"""Convex bodies that stand for a mesh in collisions."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from typing import Literal

import numpy as np

from labgym.assets.meshes.model import Faces, MeshPart, Points

Method = Literal["coacd", "convex hull"]
Convex = tuple[Points, Faces]

MAX_BODIES = 64
"""More parts than this are decomposed as one."""
MAX_FACES = 20_000
"""Meshes of more faces, convex parts apart, have hulls alone: coacd would take minutes."""
HULLS_A_PART = 16
_COACD = {"threshold": 0.05, "resolution": 500, "mcts_nodes": 10, "mcts_iterations": 60, "mcts_max_depth": 2, "seed": 0}
"""A search of two seconds a part; coacd's own settings take eight times as long for no tighter bodies."""
THIN = 1e-4
"""Least thickness of a convex body, metres: flat parts become plates."""


def decompose(parts: Sequence[MeshPart]) -> tuple[tuple[Convex, ...], Method]:
    """Return convex bodies that cover the parts, and how they were made.

    Parts that are convex or flat stay as they are. The others go through coacd where it is installed and they have at
    most 20 000 faces together; else each has its hull. The same parts give the same bodies.
    """
    grouped = _grouped(parts)
    hollow = [not _is_convex(part) for part in grouped]
    faces = sum(len(part.faces) for part, turns_in in zip(grouped, hollow, strict=True) if turns_in)
    if faces > MAX_FACES or importlib.util.find_spec("coacd") is None:
        return tuple(hull(part.vertices) for part in grouped), "convex hull"
    bodies: list[Convex] = []
    for part, turns_in in zip(grouped, hollow, strict=True):
        bodies += _decomposed(part) if turns_in else [hull(part.vertices)]
    return tuple(bodies), "coacd"


def hull(points: Points) -> Convex:
    """Return the convex hull of points (n, 3), wound outwards; a box at least 0.1 mm thick where they are flat."""
    import trimesh
    from scipy.spatial import ConvexHull, QhullError

    try:
        if np.ptp(points, axis=0).min() >= THIN:
            found = ConvexHull(points)
            used = np.sort(found.vertices)
            vertices, faces = found.points[used], np.searchsorted(used, found.simplices)
            corners = vertices[faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            inward = np.einsum("ij,ij->i", normals, found.equations[:, :3]) < 0.0
            faces[inward] = faces[inward][:, ::-1]
            return vertices, faces.astype(np.int64)
    except QhullError:
        pass  # flat in a slanted plane
    low, high = points.min(axis=0), points.max(axis=0)
    thick = np.maximum(high - low, THIN)
    box = trimesh.creation.box(extents=thick)
    return np.array(box.vertices) + (low + high) / 2.0, np.array(box.faces, dtype=np.int64)


def _grouped(parts: Sequence[MeshPart]) -> Sequence[MeshPart]:
    if len(parts) <= MAX_BODIES:
        return parts
    offsets = np.cumsum([0, *[len(part.vertices) for part in parts[:-1]]])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)])
    return [MeshPart("all", np.concatenate([part.vertices for part in parts]), faces)]


def _is_convex(part: MeshPart) -> bool:
    """Return whether the hull is the part: it is closed and turns in nowhere, or it is flat."""
    import trimesh

    mesh = trimesh.Trimesh(part.vertices, part.faces)
    return bool(np.ptp(part.vertices, axis=0).min() < THIN or (mesh.is_watertight and mesh.is_convex))


def _decomposed(part: MeshPart) -> list[Convex]:
    import coacd
    import trimesh

    mesh = trimesh.Trimesh(part.vertices, part.faces)
    coacd.set_log_level("error")
    whole = coacd.Mesh(np.array(mesh.vertices), np.array(mesh.faces))
    pieces = coacd.run_coacd(whole, max_convex_hull=HULLS_A_PART, **_COACD)
    return [hull(np.asarray(vertices, dtype=np.float64)) for vertices, _ in pieces] or [hull(part.vertices)]
