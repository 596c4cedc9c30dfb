"""The solid boxes of a scene, and those around a point."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

BOX_FIELDS = ("pos", "quat", "size", "rbound", "aabb", "sameframe")
"""Fields of a geom in which the boxes of a scene differ."""
CONTACT_FIELDS = (
    "contype", "conaffinity", "condim", "priority", "friction", "solmix", "solref", "solimp", "margin", "gap", "fluid",
)  # fmt: skip
"""Fields of a geom that decide how it touches others: those of a new geom in every box."""


@dataclass(frozen=True, eq=False)
class Solids:
    """The n solid boxes of a scene that a robot may touch, in the order of their geoms.

    Attributes:
        fields: `BOX_FIELDS` of each, (n, ...). low, high: (n, 3) corners of their bounds, meters.
        normals: (m, 2) outward normals of the sides of their outlines, box by box. offsets: (m,), meters.
        first: (n,), the first side of each box.
    """

    fields: tuple[NDArray[np.float64], ...]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    first: NDArray[np.intp]

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        geoms: NDArray[np.intp],
        corners: NDArray[np.float64],
        outlines: list[NDArray[np.float64]],
    ) -> Solids | None:
        """Return solid geoms of a scene; None if they are not boxes of the world that touch as new geoms do.

        Args:
            geoms: (n,) ascending. corners: (n, 8, 3) of the boxes, meters. outlines: convex, each (k, 2), meters.
        """
        single = _new_box()
        boxes = (model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_BOX) & (model.geom_bodyid[geoms] == 0)
        alike = all(
            (getattr(model, f"geom_{name}")[geoms] == getattr(single, f"geom_{name}")[0]).all()
            for name in CONTACT_FIELDS
        )
        if not boxes.all() or not alike:
            return None
        fields = tuple(np.array(getattr(model, f"geom_{name}")[geoms]) for name in BOX_FIELDS)
        normals, offsets = _sides(outlines)
        first = np.cumsum([0, *(len(outline) for outline in outlines)])[:-1].astype(np.intp)
        return cls(fields, corners.min(axis=1), corners.max(axis=1), normals, offsets, first)

    def around(self, x: float, y: float, distance: float) -> NDArray[np.intp]:
        """Return the boxes of which a part may lie within a distance of a point; none that does is left out."""
        if not len(self.first):
            return self.first
        beyond = self.normals[:, 0] * x + self.normals[:, 1] * y - self.offsets
        return np.flatnonzero(np.maximum.reduceat(beyond, self.first) <= distance)


def _sides(outlines: list[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return outward normals (m, 2) and offsets (m,) of the sides of convex outlines; zeros for a side of no length."""
    if not outlines:
        return np.empty((0, 2)), np.empty(0)
    points = np.concatenate(outlines)
    along = np.concatenate([np.roll(outline, -1, axis=0) - outline for outline in outlines])
    lengths = np.linalg.norm(along, axis=1)
    middles = np.concatenate([np.repeat(outline.mean(axis=0)[None], len(outline), axis=0) for outline in outlines])
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(lengths, 1e-12)[:, None]
    outward = np.where(((points - middles) * normals).sum(axis=1) < 0.0, -1.0, 1.0)
    normals *= outward[:, None]
    return normals, (normals * points).sum(axis=1)


def _new_box() -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 1.0])
    return spec.compile()
