"""USD's exact solids as triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from labgym.assets.meshes.model import Faces, Points
from labgym.assets.shapes.parts import local_mesh

_FROM_Z = {"X": (2, 0, 1), "Y": (1, 2, 0), "Z": (0, 1, 2)}
"""Which coordinate of a solid along z becomes x, y and z of one along that axis."""


def solid(prim: Any, time: Any) -> tuple[Points, Faces]:
    """Return vertices (n, 3) and faces (m, 3) of a Cube, Sphere, Cylinder, Cone or Capsule prim in its own frame."""
    kind = prim.GetTypeName()

    def value(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    if kind == "Cube":
        return local_mesh("box", (value("size"),) * 3)
    if kind == "Sphere":
        return local_mesh("sphere", (2.0 * value("radius"),) * 3)
    radius, height = value("radius"), value("height")
    if kind == "Cylinder":
        vertices, faces = local_mesh("cylinder", (2.0 * radius, 2.0 * radius, height))
    elif kind == "Capsule":
        vertices, faces = local_mesh("capsule", (2.0 * radius, 2.0 * radius, height + 2.0 * radius))
    else:
        outline = ((0.0, -height / 2.0), (radius, -height / 2.0), (0.0, height / 2.0))
        vertices, faces = local_mesh("revolve", (0.0, 0.0, 0.0), outline)
    order = list(_FROM_Z[str(prim.GetAttribute("axis").Get(time))])
    return np.ascontiguousarray(vertices[:, order]), faces
