"""The visible triangles of a layout, in chunks that a camera can skip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.world import World
from labgym.scenes import SceneMesh

FACES = 96
"""Largest number of triangles in a chunk."""


class Chunks(NamedTuple):
    """Triangles in groups of neighbors.

    Attributes:
        corners: (m, 9) x, y and z of the three corners of each triangle, meters, room frame; in single precision, as
            Embree reads them.
        first: (n + 1,) the first triangle of each chunk.
        center, half: (n, 3) center and half extents of the box around each chunk.
    """

    corners: NDArray[np.float32]
    first: NDArray[np.int64]
    center: NDArray[np.float64]
    half: NDArray[np.float64]


def chunks_of(world: World) -> Chunks:
    """Return what a camera sees of a world; it is built once."""
    return world.derived("planar chunks", lambda _: chunked(world.mesh("visual")))


def chunked(mesh: SceneMesh) -> Chunks:
    """Return the triangles of a mesh in chunks; a chunk belongs to one object."""
    order = np.argsort(mesh.owner, kind="stable")
    corners = mesh.vertices.astype(np.float32)[mesh.faces[order]]
    ends = np.flatnonzero(np.diff(mesh.owner[order], append=np.iinfo(np.int64).max)) + 1
    begins = np.concatenate([[0], ends[:-1]])
    parts = [np.arange(begin, end, FACES) for begin, end in zip(begins, ends, strict=True)]
    first = np.concatenate([*parts, [len(corners)]]).astype(np.int64)
    low = np.minimum.reduceat(corners.min(axis=1), first[:-1]).astype(np.float64)
    high = np.maximum.reduceat(corners.max(axis=1), first[:-1]).astype(np.float64)
    return Chunks(np.ascontiguousarray(corners.reshape(-1, 9)), first, (low + high) / 2.0, (high - low) / 2.0)
