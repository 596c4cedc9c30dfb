"""The physical phase of annotation: heading, origin, bounding box, closedness, convex bodies."""

from __future__ import annotations

import numpy as np
from pydantic import ValidationError

from labgym.assets.meshes.convex import Decomposition, decompose, hull
from labgym.assets.meshes.model import Axis, MeshError, MeshFile, MeshPart, PhysicalMesh, Points
from labgym.assets.meshes.reading import TO_Z_UP
from labgym.assets.model import Size
from labgym.errors import UnknownNameError

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


def normalise(mesh: MeshFile, front: str | None = None, hulls_only: bool = False) -> PhysicalMesh:
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
    if front not in DIRECTIONS:
        raise UnknownNameError("direction", front, DIRECTIONS)
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
