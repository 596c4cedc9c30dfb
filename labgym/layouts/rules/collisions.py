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
    name = f"collisions {depth}"
    if name not in arrangement.local:
        arrangement.local[name] = dict(enumerate(_collisions(arrangement, depth, name)))
    return tuple(arrangement.local[name].values())


def _collisions(arrangement: Arrangement, depth: float, name: str) -> list[Collision]:
    """Return the collisions; those between objects that have not moved are taken over."""
    before, bounds = arrangement.replacement, arrangement.bounds
    if before is None or name not in before.local:
        first, second = overlapping_bounds(bounds, bounds, depth)
        return _among(arrangement, depth, first[first < second], second[first < second])
    moved, rows = before.rows, arrangement.index
    hit, others = overlapping_bounds((bounds[0][moved], bounds[1][moved]), bounds, depth)
    pairs = {(min(pair), max(pair)) for pair in zip(moved[hit].tolist(), others.tolist(), strict=True)}
    first, second = np.array(sorted((a, b) for a, b in pairs if a != b), dtype=np.intp).reshape(-1, 2).T
    gone = {arrangement.placements[row].id for row in moved.tolist()}
    kept = [one for one in before.local[name].values() if gone.isdisjoint(one.ids)]
    return sorted([*kept, *_among(arrangement, depth, first, second)], key=lambda one: tuple(rows[i] for i in one.ids))


def _among(
    arrangement: Arrangement, depth: float, first: NDArray[np.intp], second: NDArray[np.intp]
) -> list[Collision]:
    """Return the collisions among pairs of rows."""
    if not len(first):
        return []
    chosen = np.unique(np.concatenate([first, second]))
    own = arrangement.solids(chosen.tolist())
    pair, a, b = _solid_pairs(np.searchsorted(chosen, first), np.searchsorted(chosen, second), own)
    depths = paired_penetration(own.boxes.take(a), own.boxes.take(b))
    deepest = np.full(len(first), -np.inf)
    np.maximum.at(deepest, pair, depths)
    bounds = np.searchsorted(pair, np.arange(len(first) + 1))
    overlaps = []
    for k in np.flatnonzero(deepest > depth + 1e-9):
        if arrangement.assembled(int(first[k]), int(second[k])):
            continue
        parts = bounds[k] + np.flatnonzero(depths[bounds[k] : bounds[k + 1]] > 0.0)
        volume = sum(overlap_volume(_box(own.boxes, int(a[p])), _box(own.boxes, int(b[p]))) for p in parts)
        ids = arrangement.placements[first[k]].id, arrangement.placements[second[k]].id
        overlaps.append(Collision(ids, float(deepest[k]), volume))
    return overlaps


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
