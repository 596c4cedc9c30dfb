"""Ray casting with equal results on every processor.

Embree computes with approximate reciprocals, whose last bits differ between instruction sets and between makers. That
changes the last bit of ranges, and which of two faces is hit where both are equally near. Here Embree only selects the
face. The range is that of the face's plane, in double precision and in plain products. A ray through the edge of two
faces, or through two faces of different material in one plane, hits the one with the lower index.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.layouts import Layout
from labgym.scenes.mesh import SceneMesh
from labgym.scenes.rays import Geometry, RayScene

EDGE = 1e-4
"""Share of a face's height within which a hit counts as at its edge."""
INSIDE = -1e-6
"""Smallest barycentric coordinate of a point of a face, to allow for rounding."""
LEVEL = 1e-5
"""Largest difference of the ranges of two faces at one point, meters."""
TOUCHING = 1e-6
"""Distance within which the bounding boxes of two faces overlap, meters."""

Array = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Rivals:
    """Faces that a ray may hit in place of another face.

    Attributes:
        groups: (m, k), the groups of each face.
        first: (g + 1,), the first place of each group in `members`.
        members: faces, group by group.
    """

    groups: NDArray[np.integer]
    first: NDArray[np.integer]
    members: NDArray[np.integer]

    @classmethod
    def of_pairs(cls, groups: NDArray[np.integer], faces: NDArray[np.integer], count: int) -> Rivals:
        """Return the members of `count` groups from pairs (n,) of a group and a face."""
        order = np.argsort(groups, kind="stable")
        return cls(groups[:, None], np.searchsorted(groups[order], np.arange(count + 1)), faces[order])

    def any(self, faces: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Return whether each face has a rival."""
        groups = self.groups[faces]
        return np.asarray((self.first[groups + 1] > self.first[groups]).any(axis=1))

    def of(self, faces: NDArray[np.integer]) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
        """Return all pairs of an index into `faces` and a rival of that face."""
        groups = self.groups[faces]
        first, count = self.first[groups.ravel()], self.first[groups.ravel() + 1] - self.first[groups.ravel()]
        group = np.repeat(np.arange(groups.size), count)
        place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[group]
        return group // groups.shape[1], self.members[place]


class ExactRayScene(RayScene):
    """A layout as a static scene whose ranges and faces do not depend on the processor."""

    def __init__(self, layout: Layout | None, geometry: Geometry = "visual", mesh: SceneMesh | None = None) -> None:
        super().__init__(layout, geometry, mesh)
        # In single precision, as Embree's: the last bits of the mesh may differ between processors.
        corners = self.mesh.vertices.astype(np.float32).astype(np.float64)[self.mesh.faces]
        a, b, c = (corners[:, k] for k in range(3))
        self._start, self._sides = a, (b - a, c - a)
        self._normal = _cross(b - a, c - a)
        self._around = _around_corners(self.mesh)
        self._coplanar = _coplanar(corners, self._normal, self.mesh.material)

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], Faces]:
        """Return the distance to the first hit of each ray, and the face that it hits, as `RayScene.cast`."""
        hits = self._hits(origins, directions, max_range)
        start, along = (np.asarray(array, dtype=np.float32).astype(np.float64) for array in (origins, directions))
        faces: Faces = hits["primID"].copy()
        margin = np.minimum(np.minimum(hits["u"], hits["v"]), 1.0 - hits["u"] - hits["v"])
        hit = np.flatnonzero(faces >= 0)
        for rivals, unclear in (
            (self._around, hit[margin[hit] < EDGE]),
            (self._coplanar, hit[self._coplanar.any(faces[hit])]),
        ):
            faces[unclear] = self._settled(rivals, faces[unclear], start[unclear], along[unclear])
        distances: NDArray[np.float32] = hits["tfar"].copy()
        ranges = self._ranges(faces[hit], start[hit], along[hit])
        distances[hit] = np.where(np.isfinite(ranges), ranges, distances[hit])
        return distances, faces

    def _ranges(self, faces: NDArray[np.integer], start: Array, along: Array) -> Array:
        """Return the distances (n,) along rays to the planes of faces; inf or NaN for a ray within the plane."""
        normal = self._normal[faces]
        with np.errstate(divide="ignore", invalid="ignore"):
            return _dot(normal, self._start[faces] - start) / _dot(normal, along)

    def _settled(self, rivals: Rivals, faces: Faces, start: Array, along: Array) -> Faces:
        """Return the lowest of the faces that each ray hits at one point: its face and the rivals of that face."""
        if not len(faces):
            return faces
        ray, other = rivals.of(faces)
        here = self._ranges(faces, start, along)
        there = self._ranges(other, start[ray], along[ray])
        with np.errstate(invalid="ignore"):
            level = np.flatnonzero(np.abs(there - here[ray]) < LEVEL)
            ray, other, there = ray[level], other[level], there[level]
            point = start[ray] + there[:, None] * along[ray] - self._start[other]
            first, second = (side[other] for side in self._sides)
            normal = self._normal[other]
            area = _dot(normal, normal)
            u, v = _dot(_cross(point, second), normal) / area, _dot(_cross(first, point), normal) / area
            candidate = np.minimum(np.minimum(u, v), 1.0 - u - v) >= INSIDE
        settled = faces.copy()
        np.minimum.at(settled, ray[candidate], other[candidate].astype(np.int32))
        return settled


def _around_corners(mesh: SceneMesh) -> Rivals:
    """Return the faces that share a corner with each face; corners at one position count as one."""
    _, corner = np.unique(mesh.vertices.astype(np.float32), axis=0, return_inverse=True)
    corners = corner.ravel()[mesh.faces]
    at_corner = Rivals.of_pairs(corners.ravel(), np.repeat(np.arange(len(corners)), 3), int(corners.max()) + 1)
    return Rivals(corners, at_corner.first, at_corner.members)


def _coplanar(corners: Array, normal: Array, material: NDArray[np.integer]) -> Rivals:
    """Return the faces of other materials that overlap each face in one plane and have the same front side."""
    unit = normal / np.maximum(np.sqrt(_dot(normal, normal)), 1e-12)[:, None]
    plane = np.column_stack([np.rint(unit * 1e3), np.rint(_dot(unit, corners[:, 0]) * 1e4)]).astype(np.int64)
    _, plane_of = np.unique(plane, axis=0, return_inverse=True)
    order = np.argsort(plane_of.ravel(), kind="stable")
    low, high = corners.min(axis=1), corners.max(axis=1)
    mine, others = [], []
    for faces in np.split(order, np.flatnonzero(np.diff(plane_of.ravel()[order])) + 1):
        if len(np.unique(material[faces])) < 2:
            continue
        overlap = material[faces, None] != material[None, faces]
        for axis in range(3):
            overlap &= low[faces, None, axis] < high[None, faces, axis] + TOUCHING
            overlap &= low[None, faces, axis] < high[faces, None, axis] + TOUCHING
        first, second = np.nonzero(overlap)
        mine.append(faces[first])
        others.append(faces[second])
    none = np.empty(0, dtype=np.intp)
    pairs = Rivals.of_pairs(np.concatenate([none, *mine]), np.concatenate([none, *others]), len(corners))
    return Rivals(np.arange(len(corners))[:, None], pairs.first, pairs.members)


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar products (n,) of rows; written out, because a matrix product may round differently."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def _cross(a: Array, b: Array) -> Array:
    """Return the vector products (n, 3) of rows."""
    return np.column_stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ]
    )
