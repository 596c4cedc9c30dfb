"""Normals of triangle meshes, smooth over round surfaces and sharp at edges."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

CREASE = math.cos(math.radians(42.5))
"""Cosine of the angle between face normals beyond which an edge is sharp: rounds of nine sides or more look smooth."""


def face_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return unit normals of faces, shape (m, 3); zero for faces without area."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-18))


def corner_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return unit normals of face corners, shape (m, 3, 3).

    A corner's normal is the area-weighted mean over the faces that share its vertex and meet its face at less than
    the crease angle.
    """
    flat = face_normals(vertices, faces)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    # All pairs of corners that share a vertex: sort corners by vertex, then pair within each run.
    vertex = faces.ravel()
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex, minlength=len(vertices))
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    run = counts[vertex]
    first = np.repeat(np.arange(len(vertex)), run)
    offset = np.arange(len(first)) - np.repeat(np.cumsum(run) - run, run)
    second = order[starts[vertex[first]] + offset]
    blunt = np.einsum("ij,ij->i", flat[first // 3], flat[second // 3]) > CREASE
    first, second = first[blunt], second[blunt]
    weighted = flat * area[:, None]
    total = np.stack([np.bincount(first, weighted[second // 3, k], minlength=len(vertex)) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    smooth = np.where(length > 1e-18, total / np.maximum(length, 1e-18), np.repeat(flat, 3, axis=0))
    return smooth.reshape(-1, 3, 3)
