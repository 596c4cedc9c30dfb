"""Polygons of any number of corners as triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.assets.meshes.model import Faces, Points

MAX_CONCAVE_CORNERS, MAX_ALL_CONCAVE_CORNERS = 512, 50_000
"""Most corners of a polygon that is not convex, and of all such polygons together: cutting takes up to 0.1 ms each."""


def triangulate(points: Points, counts: NDArray[np.int64], corners: NDArray[np.int64]) -> tuple[Faces, Faces]:
    """Return triangles (m, 3) of planar polygons and the polygon of each triangle, shape (m,).

    Convex polygons become fans, others are cut ear by ear. Polygons of fewer than three corners are left out.

    Args:
        points: (n, 3). counts: corners of each polygon. corners: indices into points, polygon after polygon.

    Raises:
        ValueError: a polygon that is not convex has more than 512 corners, or all together have more than 50 000.
    """
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else np.zeros(0, dtype=np.int64)
    faces: list[Faces] = []
    owners: list[Faces] = []
    total = 0
    for count in np.unique(counts[counts >= 3]).tolist():
        which = np.flatnonzero(counts == count)
        rings = corners[starts[which][:, None] + np.arange(count)]
        convex = _convex(points[rings]) if count > 3 else np.ones(len(rings), dtype=bool)
        fan = np.stack([np.zeros(count - 2, dtype=np.int64), np.arange(1, count - 1), np.arange(2, count)], axis=1)
        faces.append(rings[convex][:, fan].reshape(-1, 3))
        owners.append(np.repeat(which[convex], count - 2))
        total += count * int((~convex).sum())
        for number, most, what in (
            (0 if convex.all() else count, MAX_CONCAVE_CORNERS, "a polygon that is not convex has"),
            (total, MAX_ALL_CONCAVE_CORNERS, "polygons that are not convex have"),
        ):
            if number > most:
                raise ValueError(f"{what} {number} corners, expected at most {most}")
        for ring, polygon in zip(rings[~convex], which[~convex], strict=True):
            ears = ring[_ears(points[ring])]
            faces.append(ears)
            owners.append(np.full(len(ears), polygon))
    if not faces:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(faces)[order], owner[order]


def _normals(rings: Points) -> Points:
    """Return the area vectors of polygons (k, n, 3) by Newell's sum, shape (k, 3)."""
    from_first = rings - rings[:, :1]
    return np.asarray(np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1))


def _convex(rings: Points) -> NDArray[np.bool_]:
    """Return which polygons (k, n, 3) turn one way at every corner and go round once."""
    after = np.roll(rings, -1, axis=1) - rings
    turns = np.einsum("knj,kj->kn", np.cross(np.roll(after, 1, axis=1), after), _normals(rings))
    scale = np.abs(turns).max(axis=1, keepdims=True)
    one_way = (turns >= -1e-9 * scale).all(axis=1)
    # A star turns one way too, but goes round more than once: its fan has triangles of the other sign.
    fan = rings[:, 1:] - rings[:, :1]
    areas = np.einsum("knj,kj->kn", np.cross(fan[:, :-1], fan[:, 1:]), _normals(rings))
    limit = -1e-9 * np.abs(areas).max(axis=1, keepdims=True)
    return np.asarray(one_way & (areas >= limit).all(axis=1))


def _ears(ring: Points) -> Faces:
    """Return triangles of one polygon (n, 3) as indices into it, cut off at corners that hold no other corner."""
    normal = _normals(ring[None])[0]
    drop = int(np.argmax(np.abs(normal)))
    flat = np.delete(ring, drop, axis=1) * np.array([1.0, -1.0 if (drop == 1) != (normal[drop] < 0.0) else 1.0])
    left, remains = list(range(len(ring))), np.ones(len(ring), dtype=bool)

    def is_ear(k: int) -> bool:
        a, b, c = (flat[left[i % len(left)]] for i in (k - 1, k, k + 1))
        return _turn(a, b, c) > 0.0 and not _inside(a, b, c, flat[remains]).any()

    ears = [is_ear(k) for k in range(len(left))]
    triangles = []
    while len(left) > 3:
        k = ears.index(True) if True in ears else 1  # crosses itself if it has no ear: any cut is as good
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        remains[left.pop(k)] = False
        ears.pop(k)
        # A cut changes only its neighbors: of the corners in an ear one is reflex, and a reflex corner is not cut.
        for near in (k - 1, k % len(left)):
            ears[near] = is_ear(near)
    return np.array([*triangles, tuple(left)], dtype=np.int64)


def _turn(a: Points, b: Points, c: Points) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _inside(a: Points, b: Points, c: Points, points: Points) -> NDArray[np.bool_]:
    """Return which points (n, 2) lie in a counter-clockwise triangle and on none of its corners."""
    within = np.ones(len(points), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        edge = q - p
        within &= edge[0] * (points[:, 1] - p[1]) - edge[1] * (points[:, 0] - p[0]) >= 0.0
    corner = np.any([np.all(points == corner, axis=1) for corner in (a, b, c)], axis=0)
    return np.asarray(within & ~corner)
