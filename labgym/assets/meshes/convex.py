"""Convex bodies that stand for a mesh in collisions."""

from __future__ import annotations

import importlib.util
import io
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labgym.assets.meshes.model import Faces, MeshPart, Points

Method = Literal["coacd", "convex hull"]
Convex = tuple[Points, Faces]

MAX_BODIES = 32
"""Most convex bodies of a mesh; a mesh of more parts is decomposed as one."""
MAX_FACES = 20_000
"""Meshes with more faces, convex parts apart, have hulls only: coacd would take minutes."""
HULLS_A_PART = 16
"""Most convex bodies of a part."""
CPU_SECONDS, WALL_SECONDS, MEMORY = 40, 400, 6 * 1024**3
"""Limits of the process that decomposes a mesh: processor time, wall-clock time (s) and memory (bytes)."""
THIN = 1e-4
"""Least thickness of a convex body, meters: flat parts become plates."""


@dataclass(frozen=True)
class Decomposition:
    """Convex bodies that cover a mesh.

    Attributes:
        bodies: (vertices (n, 3), faces (m, 3)) of each. method: how they were made.
        note: why each part has only its hull although coacd is installed, else "".
    """

    bodies: tuple[Convex, ...]
    method: Method
    note: str = ""


def decompose(parts: Sequence[MeshPart]) -> Decomposition:
    """Return at most 32 convex bodies that cover the parts.

    Parts that are convex or flat stay as they are. The others go through coacd if it is installed and they have at
    most 20 000 faces together, in a process with bounded time and memory; otherwise each has its hull. The same parts
    give the same bodies unless the process exceeds its processor time.
    """
    grouped = _grouped(parts)
    concave = [k for k, part in enumerate(grouped) if not _is_convex(part)]
    faces = sum(len(grouped[k].faces) for k in concave)
    hulls = tuple(hull(part.vertices) for part in grouped)
    if not concave:
        return Decomposition(hulls, "coacd" if importlib.util.find_spec("coacd") else "convex hull")
    if importlib.util.find_spec("coacd") is None:
        return Decomposition(hulls, "convex hull")
    if faces > MAX_FACES:
        note = f"{faces} faces are too many for convex decomposition (at most {MAX_FACES})"
        return Decomposition(hulls, "convex hull", f"{note}: each part collides as its hull")
    budget = min(HULLS_A_PART, 1 + (MAX_BODIES - len(grouped)) // len(concave))
    pieces, problem = _by_coacd([grouped[k] for k in concave], budget)
    if problem:
        return Decomposition(hulls, "convex hull", f"convex decomposition {problem}: each part collides as its hull")
    bodies: list[Convex] = []
    for k, whole in enumerate(hulls):
        bodies += [hull(points) for points in pieces[concave.index(k)]] or [whole] if k in concave else [whole]
    return Decomposition(tuple(bodies), "coacd")


def hull(points: Points) -> Convex:
    """Return the convex hull of points (n, 3), wound outwards; a box at least 0.1 mm thick if they are flat."""
    import trimesh
    from scipy.spatial import ConvexHull, QhullError

    try:
        if np.ptp(points, axis=0).min() >= THIN:
            solid = ConvexHull(points)
            used = np.sort(solid.vertices)
            vertices, faces = solid.points[used], np.searchsorted(used, solid.simplices)
            corners = vertices[faces]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            inward = np.einsum("ij,ij->i", normals, solid.equations[:, :3]) < 0.0
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
    """Return whether the hull is the part: it is closed and nowhere concave, or it is flat."""
    import trimesh

    mesh = trimesh.Trimesh(part.vertices, part.faces)
    return bool(np.ptp(part.vertices, axis=0).min() < THIN or (mesh.is_watertight and mesh.is_convex))


def _by_coacd(parts: Sequence[MeshPart], most: int) -> tuple[list[list[Points]], str]:
    """Return the vertices of each piece of each part, at most `most` pieces a part, or what went wrong."""
    stream = io.BytesIO()
    arrays = {f"{kind}{k}": getattr(part, kind) for k, part in enumerate(parts) for kind in ("vertices", "faces")}
    np.savez(stream, allow_pickle=False, **arrays)
    limits = [str(limit) for limit in (len(parts), most, CPU_SECONDS, MEMORY)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        child = subprocess.run(
            [sys.executable, "-P", "-m", "labgym.assets.meshes.decomposer", *limits],
            input=stream.getvalue(),
            capture_output=True,
            timeout=WALL_SECONDS,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return [], f"took more than {WALL_SECONDS} s"
    if child.returncode or not child.stdout:
        return [], f"took more than {CPU_SECONDS} s of processor time or {MEMORY // 1024**2} MiB, or failed"
    with np.load(io.BytesIO(child.stdout), allow_pickle=False) as pieces:
        return [[pieces[f"{k}_{j}"] for j in range(int(pieces[f"count{k}"]))] for k in range(len(parts))], ""
