"""The physical phase of annotation: heading, origin, bounding box, closedness, and convex bodies for collisions."""

from __future__ import annotations

import importlib.util
import io
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import ValidationError

from labgym.assets.meshes.isolated import answering, run_isolated
from labgym.assets.meshes.model import Axis, Faces, MeshError, MeshFile, MeshPart, PhysicalMesh, Points
from labgym.assets.meshes.reading import TO_Z_UP
from labgym.assets.model import Size
from labgym.errors import check_name

Method = Literal["coacd", "convex hull"]
Convex = tuple[Points, Faces]

MAX_BODIES = 32
"""Most convex bodies of a mesh; a mesh of more parts is decomposed as one."""
MAX_FACES = 20_000
"""Meshes with more faces, convex parts apart, have hulls only: coacd would take minutes."""
MAX_CONCAVE_PARTS = 16
"""Meshes with more parts that are not convex have hulls only: coacd takes two seconds for each."""
MAX_BODIES_PER_PART = 16
"""Most convex bodies of a part."""
CPU_SECONDS, WALL_SECONDS, MEMORY_BYTES = 40, 400, 6 * 1024**3
"""Limits of the process that decomposes a mesh: processor time, wall-clock time (s) and memory (bytes)."""
THICKNESS_M = 1e-4
"""Least thickness of a convex body, meters: flat parts become plates."""

_OPTIONS = {
    "threshold": 0.05,
    "resolution": 500,
    "preprocess_resolution": 30,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "seed": 0,
}
"""A search of two seconds per part; coacd's defaults take eight times as long, and the bodies fit no better. Open parts
are closed on a grid of 30 cells, which takes a third of the time of the default of 50."""


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

    Parts that are convex or flat stay as they are. The others go through coacd if it is installed and they are at most
    16 with at most 20 000 faces together, in a process with bounded time and memory; otherwise each has its hull. The
    same parts give the same bodies unless the process exceeds its processor time.
    """
    grouped = _grouped(parts)
    concave = [k for k, part in enumerate(grouped) if not _is_convex(part)]
    faces = sum(len(grouped[k].faces) for k in concave)
    hulls = tuple(hull(part.vertices) for part in grouped)
    if not concave:
        return Decomposition(hulls, "coacd" if importlib.util.find_spec("coacd") else "convex hull")
    if importlib.util.find_spec("coacd") is None:
        return Decomposition(hulls, "convex hull")
    for count, most, what in ((faces, MAX_FACES, "faces"), (len(concave), MAX_CONCAVE_PARTS, "concave parts")):
        if count > most:
            note = f"{count} {what} are too many for convex decomposition (at most {most})"
            return Decomposition(hulls, "convex hull", f"{note}: each part collides as its hull")
    budget = min(MAX_BODIES_PER_PART, 1 + (MAX_BODIES - len(grouped)) // len(concave))
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
        if np.ptp(points, axis=0).min() >= THICKNESS_M:
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
    thick = np.maximum(high - low, THICKNESS_M)
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
    return bool(np.ptp(part.vertices, axis=0).min() < THICKNESS_M or (mesh.is_watertight and mesh.is_convex))


def _by_coacd(parts: Sequence[MeshPart], most: int) -> tuple[list[list[Points]], str]:
    """Return the vertices of each piece of each part, at most `most` pieces a part, or what went wrong."""
    stream = io.BytesIO()
    arrays = {f"{kind}{k}": getattr(part, kind) for k, part in enumerate(parts) for kind in ("vertices", "faces")}
    np.savez(stream, allow_pickle=False, **arrays)
    limits = [str(limit) for limit in (len(parts), most, CPU_SECONDS, MEMORY_BYTES)]
    try:
        child = run_isolated(__name__, limits, WALL_SECONDS, stream.getvalue())
    except subprocess.TimeoutExpired:
        return [], f"took more than {WALL_SECONDS} s"
    if child.returncode or not child.stdout:
        return [], f"took more than {CPU_SECONDS} s of processor time or {MEMORY_BYTES // 1024**2} MiB, or failed"
    with np.load(io.BytesIO(child.stdout), allow_pickle=False) as pieces:
        return [[pieces[f"{k}_{j}"] for j in range(int(pieces[f"count{k}"]))] for k in range(len(parts))], ""


def main() -> None:
    """Decompose the parts of an npz archive on standard input.

    The arguments are the number of parts, the most pieces of a part, processor seconds, and bytes of memory.
    The answer is an npz archive of the pieces' vertices.
    """
    count, most, seconds, memory = (int(argument) for argument in sys.argv[1:5])
    with answering(memory, seconds) as answer:
        import coacd
        import trimesh

        coacd.set_log_level("error")
        pieces: dict[str, np.ndarray] = {}
        with np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False) as arrays:
            for k in range(count):
                mesh = trimesh.Trimesh(arrays[f"vertices{k}"], arrays[f"faces{k}"])
                whole = coacd.Mesh(np.array(mesh.vertices), np.array(mesh.faces))
                bodies = coacd.run_coacd(whole, max_convex_hull=most, **_OPTIONS)[:most] if len(mesh.faces) else []
                pieces[f"count{k}"] = np.array(len(bodies))
                pieces |= {f"{k}_{j}": np.asarray(vertices, np.float64) for j, (vertices, _) in enumerate(bodies)}
        stream = io.BytesIO()
        np.savez(stream, allow_pickle=False, **pieces)
        answer.write(stream.getvalue())


DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "+x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "+y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "+z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
FRONTS: dict[Axis, str] = {"X": "+z", "Y": "+z", "Z": "+y"}
"""Direction of the front by default: as in glTF with y up, as in labgym's own files with z up."""


def normalize(mesh: MeshFile, front: str | None = None, hulls_only: bool = False) -> PhysicalMesh:
    """Return a mesh in an asset's frame: front along +y, origin at the center of the bottom face, with its physics.

    Args:
        mesh: returned by `read_mesh`.
        front: direction of the front in the file's own axes: "+x", "-x", ... "-z".
        hulls_only: take the convex hull of each part, without coacd.

    Raises:
        MeshError: the bounding box is flat or beyond the 10 m of an asset, or the front looks up or down.
        UnknownNameError: no such direction.
    """
    import trimesh  # here, so that the process that reads USD starts without it

    turn = _heading(mesh, FRONTS[mesh.up_axis] if front is None else front)
    turned = [part.vertices @ turn.T for part in mesh.parts]
    low = np.min([vertices.min(axis=0) for vertices in turned], axis=0)
    high = np.max([vertices.max(axis=0) for vertices in turned], axis=0)
    size = _size(mesh, high - low)
    origin = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
    parts = tuple(
        MeshPart(part.name, vertices - origin, part.faces, part.color, part.material)
        for part, vertices in zip(mesh.parts, turned, strict=True)
    )
    closed = [trimesh.Trimesh(part.vertices, part.faces) for part in parts]
    watertight = all(body.is_watertight and body.is_winding_consistent for body in closed)
    if hulls_only:
        bodies = Decomposition(tuple(hull(part.vertices) for part in parts), "convex hull")
    else:
        bodies = decompose(parts)
    volume = float(sum(abs(body.volume) for body in closed)) if watertight else None
    return PhysicalMesh(mesh.name, parts, size, watertight, volume, bodies.bodies, bodies.method, bodies.note)


def _heading(mesh: MeshFile, front: str) -> Points:
    """Return the rotation about z that takes the file's front to +y."""
    check_name("direction", front, DIRECTIONS)
    x, y, z = TO_Z_UP[mesh.up_axis] @ np.array(DIRECTIONS[front])
    if z:
        sides = ", ".join(name for name in DIRECTIONS if name[1] != mesh.up_axis.lower())
        raise MeshError(mesh.path, f"front {front!r} is the vertical of this file; name one of {sides}")
    return np.array([[y, -x, 0.0], [x, y, 0.0], [0.0, 0.0, 1.0]])


def _size(mesh: MeshFile, extents: Points) -> Size:
    width, depth, height = (float(extent) for extent in extents)
    try:
        return Size(width=width, depth=depth, height=height)
    except ValidationError:
        shown = f"{width:.4g} x {depth:.4g} x {height:.4g} m"
        read = f"read in {mesh.source_unit} ({mesh.unit_from})"
        problem = f"measures {shown}, {read}; expected each side above 0 and at most 10 m"
        remedy = "give --unit or --scale, or give the model a thickness"
        raise MeshError(mesh.path, f"{problem}: {remedy}") from None
