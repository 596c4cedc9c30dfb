"""CN: unordered pairs of objects whose solids interpenetrate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox, overlapping_bounds
from labgym.geometry.overlap import overlap_volume, paired_penetration
from labgym.layouts.rules.arrangement import Arrangement, Solids
from labgym.layouts.rules.thresholds import PENETRATION


@dataclass(frozen=True)
class Collision:
    """Two objects that interpenetrate.

    Attributes:
        ids: the two placements, in the layout's order.
        depth: least overlap over all separating axes of the deepest pair of solids, meters.
        volume: volume that their solids share, cubic meters.
    """

    ids: tuple[str, str]
    depth: float
    volume: float


def collisions(arrangement: Arrangement, depth: float = PENETRATION) -> tuple[Collision, ...]:
    """Return the pairs that overlap by more than a depth in meters on every axis, by default 1 mm.

    Solids are bounding boxes, and of hollow objects the shell, so that an item inside collides with walls and shelves
    and not with the hollow; open drawers and doors are solids of their object. Parts of one object never collide, nor
    do the pieces of one assembled apparatus; touching objects do not collide.
    """
    first, second = _close_pairs(arrangement, depth)
    if not len(first):
        return ()
    solids = arrangement.solids.boxes
    pair, a, b = _solid_pairs(first, second, arrangement.solids)
    depths = paired_penetration(solids.take(a), solids.take(b))
    deepest = np.full(len(first), -np.inf)
    np.maximum.at(deepest, pair, depths)
    bounds = np.searchsorted(pair, np.arange(len(first) + 1))
    overlaps = []
    for k in np.flatnonzero(deepest > depth + 1e-9):
        if arrangement.assembled(int(first[k]), int(second[k])):
            continue
        parts = bounds[k] + np.flatnonzero(depths[bounds[k] : bounds[k + 1]] > 0.0)
        volume = sum(overlap_volume(_box(solids, int(a[p])), _box(solids, int(b[p]))) for p in parts)
        ids = arrangement.placements[first[k]].id, arrangement.placements[second[k]].id
        overlaps.append(Collision(ids, float(deepest[k]), volume))
    return tuple(overlaps)


def _close_pairs(arrangement: Arrangement, depth: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows i < j whose axis-aligned bounds overlap by more than the permitted depth."""
    first, second = overlapping_bounds(arrangement.bounds, arrangement.bounds, depth)
    return first[first < second], second[first < second]


def _solid_pairs(
    first: NDArray[np.intp], second: NDArray[np.intp], solids: Solids
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Expand object pairs to all pairs of their solids: (index of the object pair, solid of first, solid of second)."""
    starts, counts = solids.starts, solids.counts
    sizes = counts[first] * counts[second]
    pair = np.repeat(np.arange(len(first)), sizes)
    within = np.arange(len(pair)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    width = counts[second][pair]
    return pair, starts[first][pair] + within // width, starts[second][pair] + within % width


def _box(boxes: BoxArray, row: int) -> OrientedBox:
    (x, y), (half_width, half_depth), (z0, z1) = boxes.centre[row], boxes.half[row], boxes.z[row]
    yaw = float(boxes.yaw[row])
    return OrientedBox(float(x), float(y), 2 * float(half_width), 2 * float(half_depth), yaw, float(z0), float(z1))
