"""Objects in a space that is being furnished, and the places along its walls that remain."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, BoxArray, OrientedBox, pairwise_penetration
from labgym.geometry import distance as gap_between
from labgym.layouts.brief import Unit
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.ground import Gate, Ground, Segment, without
from labgym.layouts.rules.zones import front_zone

WALL_GAP = 0.01
"""Gap between a unit and its wall, meters."""
SIDE_GAP = 0.02
"""Gap between neighbors, meters."""
OBLIQUE_GAP = 0.06
"""Gap between a unit and an oblique wall, meters: the region's staircase along the wall takes up to 0.05 m."""
STRIP = 0.1
"""Width of the strips into which an oblique box is cut, meters."""
SAMPLE = 0.05
"""Spacing of the places tried along an oblique wall, meters."""
DOOR_DISTANCE = 1.0 + SIDE_GAP
"""Distance of what holds flammables or oxidizers from doors, meters: the rule's 1.0 m and a margin."""
WATER_DISTANCE = 1.0 + SIDE_GAP
"""Distance of stored water-reactives from water points, meters: the rule's 1.0 m and a margin."""
TRAFFIC_WIDTH, SASH_TRAFFIC = 0.7, 1.0
"""Width of the ways between doors, and their distance from the front of a hood, meters (BS 7258-2: sash to route)."""
EPSILON = 1e-6
ASIDE = 1e-3
"""Angle to the frame's axes above which a box counts as oblique, radians."""
Intervals = list[tuple[float, float]]
Distances = Iterable[tuple[OrientedBox, float]]


class Standing:
    """Solid things and areas that stay free of furniture, in the frame of a ground.

    Attributes:
        building, furniture: solid boxes. free: areas that stay free.
        traffic: the straight ways between gates, from which hoods keep a distance if they can.
        building_bounds, furniture_bounds, free_bounds: bounds of the boxes, (n, 4) each: x0, y0, x1, y1; oblique boxes
            are cut into strips.
    """

    def __init__(self, ground: Ground) -> None:
        self.ground = ground
        self.building: list[OrientedBox] = [*ground.outside, *ground.solid, *ground.leaves]
        self.furniture: list[OrientedBox] = []
        self.free: list[OrientedBox] = [*ground.clear]
        self.free += [gate.area for gate in ground.gates]
        self.traffic = strips([_way(*pair) for pair in combinations(ground.gates, 2)])
        self.building_bounds = strips(self.building)
        self.furniture_bounds = strips(())
        self.free_bounds = strips(self.free)
        self._along: dict[str, Array] = {}

    def copy(self) -> Standing:
        """Return a copy to which furniture can be added."""
        other = copy(self)
        other.furniture, other.free = list(self.furniture), list(self.free)
        return other

    def add(self, foot: OrientedBox, front: float = 0.0, clear: float = 0.0) -> None:
        """Add a unit, the free depth in front of it, and the distance that other furniture keeps from it, meters."""
        self.furniture.append(foot)
        self.furniture_bounds = np.concatenate([self.furniture_bounds, strips([foot])])
        areas = [front_zone(foot, front)] if front > 0.0 else []
        areas += [grown(foot, clear)] if clear > 0.0 else []
        self.free += areas
        self.free_bounds = np.concatenate([self.free_bounds, strips(areas)])

    def places(
        self, segment: Segment, unit: Unit, apart: Distances = (), off_doors: float = 0.0, off_traffic: bool = False
    ) -> Intervals:
        """Return the intervals of places for a unit along a segment: meters from its start to the unit's left end.

        The unit's back is at the wall, its footprint and the depth in front of it are free, and it stands in no area
        that stays free of furniture.

        Args:
            apart: boxes, and the distance in meters to keep from each.
            off_doors: distance of hoods from doors, and of flammables and oxidizers from exits, if more than the least.
            off_traffic: whether the front of a hood keeps its distance from the straight ways between gates.
        """
        apart = [*apart, *self._off_gates(unit, off_doors)]
        apart += [(point, WATER_DISTANCE) for point in self.ground.water if "dry" in unit.hazards]
        stretches = [
            (low, high - unit.width) for low, high in segment.free(unit.asset.size.height) if high - low >= unit.width
        ]
        if not segment.straight:
            return self._oblique_places(segment, unit, stretches, apart)
        foot = (WALL_GAP, WALL_GAP + unit.depth)
        front = (WALL_GAP, WALL_GAP + unit.depth + unit.front)
        around = max(unit.clear, SIDE_GAP)
        building = self._along.get(segment.id)
        if building is None:
            building = self._along[segment.id] = _along(segment, self.building_bounds)
        furniture = _along(segment, self.furniture_bounds)
        taken = _taken(building, unit.width, front, WALL_GAP)
        taken += _taken(furniture, unit.width, (foot[0], foot[1] + around), around)
        taken += _taken(furniture, unit.width, front, 0.0)
        taken += _taken(_along(segment, self.free_bounds), unit.width, foot, 0.0)
        for box, distance in apart:
            taken += _taken(_along(segment, strips([grown(box, distance)])), unit.width, foot, 0.0)
        if off_traffic and unit.asset.fume_hood:
            taken += _taken(_along(segment, self.traffic), unit.width, (foot[0], foot[1] + SASH_TRAFFIC), 0.0)
        return [place for stretch in stretches for place in without(stretch, taken)]

    def fit(
        self, feet: Sequence[OrientedBox], front: float = 0.0, gap: float = SIDE_GAP, wall_gap: float = 0.0
    ) -> NDArray[np.bool_]:
        """Return which of several footprints are free, shape (n,).

        Args:
            front: depth in front of each that is free too, meters.
            gap, wall_gap: distances to furniture and to the building, meters.
        """
        free = ~_hit([grown(foot, gap) for foot in feet], self.furniture) & ~_hit(feet, self.free)
        free &= ~_hit([grown(foot, wall_gap) for foot in feet], self.building)
        if front > 0.0:
            fronts = [front_zone(foot, front) for foot in feet]
            free &= ~_hit(fronts, self.furniture) & ~_hit(fronts, self.building)
        return free

    def along_its_wall(self, segment: Segment, foot: OrientedBox) -> bool:
        """Whether a footprint at an oblique segment is nearer to it than to all other walls: it is square to it."""
        others = [each.box(0.0, 0.0, each.length, EPSILON) for each in self.ground.segments if each is not segment]
        return all(gap_between(foot, other) > OBLIQUE_GAP + SIDE_GAP for other in others)

    def _off_gates(self, unit: Unit, off_doors: float) -> list[tuple[OrientedBox, float]]:
        """The gates' openings, and the distance in meters that a unit keeps from each."""
        apart = []
        for gate in self.ground.gates:
            gap = max(HOOD_DOOR_LEAST, off_doors) if unit.asset.fume_hood else 0.0
            if "burning" in unit.hazards and (gate.door or gate.exit):
                gap = max(gap, DOOR_DISTANCE, off_doors if gate.exit else 0.0)
            if gap > 0.0:
                apart.append((gate.opening, gap))
        return apart

    def oblique_foot(self, segment: Segment, along: float, unit: Unit) -> OrientedBox:
        """Return the footprint of a unit at a place along an oblique segment."""
        return segment.box(along, OBLIQUE_GAP, unit.width, unit.depth)

    def _oblique_places(self, segment: Segment, unit: Unit, stretches: Intervals, apart: Distances) -> Intervals:
        alongs = [float(at) for low, high in stretches for at in np.arange(low, high + EPSILON, SAMPLE)]
        if not alongs:
            return []
        feet = [self.oblique_foot(segment, at, unit) for at in alongs]
        free = self.fit(feet, unit.front, max(unit.clear, SIDE_GAP))
        for box, distance in apart:
            free &= ~_hit(feet, [grown(box, distance)])
        return [(at, at) for at, is_free in zip(alongs, free, strict=True) if is_free]


def _way(first: Gate, second: Gate) -> OrientedBox:
    """The straight way between two gates."""
    dx, dy = second.x - first.x, second.y - first.y
    return OrientedBox(first.x + dx / 2.0, first.y + dy / 2.0, math.hypot(dx, dy), TRAFFIC_WIDTH, math.atan2(dy, dx))


def grown(box: OrientedBox, gap: float) -> OrientedBox:
    """Return a box enlarged by a gap on all sides."""
    return replace(box, width=box.width + 2.0 * gap, depth=box.depth + 2.0 * gap)


def strips(boxes: Sequence[OrientedBox]) -> Array:
    """Return the bounds of boxes, (n, 4): x0, y0, x1, y1; an oblique box is cut into strips that cover it."""
    rows: list[tuple[float, float, float, float]] = []
    for box in boxes:
        if abs(math.sin(2.0 * box.yaw)) < ASIDE:
            rows.append(box.bounds())
        else:
            rows += _cut(box)
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


@lru_cache(maxsize=4096)
def _cut(box: OrientedBox) -> list[tuple[float, float, float, float]]:
    """Bounds of the parts of an oblique box between lines of equal x."""
    corners = box.corners()
    x0, y0, x1, y1 = box.bounds()
    edges = np.linspace(x0, x1, max(2, math.ceil((x1 - x0) / STRIP) + 1))
    parts = []
    sides = list(zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True))
    for low, high in pairwise(edges.tolist()):
        ys = [y for x, y in corners.tolist() if low <= x <= high]
        ys += [
            ay + (by - ay) * (x - ax) / (bx - ax)
            for (ax, ay), (bx, by) in sides
            for x in (low, high)
            if min(ax, bx) < x < max(ax, bx)
        ]
        parts.append((low, min(ys, default=y0), high, max(ys, default=y1)))
    return parts


def _along(segment: Segment, bounds: Array) -> Array:
    """Return axis-aligned boxes as a straight segment has them, (4, n): ends along it, distances from the wall."""
    if not len(bounds):
        return np.empty((4, 0))
    cosine, sine = round(math.cos(segment.yaw)), round(math.sin(segment.yaw))
    dx, dy = bounds[:, [0, 2]] - segment.x, bounds[:, [1, 3]] - segment.y
    along, inward = dx * cosine + dy * sine, dy * cosine - dx * sine
    return np.stack([along.min(axis=1), along.max(axis=1), inward.min(axis=1), inward.max(axis=1)])


def _taken(boxes: Array, width: float, across: tuple[float, float], gap: float) -> Intervals:
    """The places along a straight segment at which an object would meet one of some axis-aligned boxes.

    Args:
        boxes: the boxes, as `_along` returns them.
        width: of the object, meters.
        across: the distances from the wall between which the object lies.
        gap: distance along the wall to keep from the boxes.
    """
    start, end, near, far = boxes
    meets = (near < across[1] - EPSILON) & (far > across[0] + EPSILON)
    low, high = start[meets] - width - gap + EPSILON, end[meets] + gap - EPSILON
    return list(zip(low.tolist(), high.tolist(), strict=True))


def _hit(boxes: Sequence[OrientedBox], others: Sequence[OrientedBox]) -> NDArray[np.bool_]:
    """Which boxes overlap one of the others on the plan, shape (n,)."""
    if not boxes or not others:
        return np.zeros(len(boxes), dtype=np.bool_)
    flat = [replace(box, z0=0.0, z1=1.0) for box in others]
    depths = pairwise_penetration(BoxArray.of([replace(box, z0=0.0, z1=1.0) for box in boxes]), BoxArray.of(flat))
    return np.asarray((depths > EPSILON).any(axis=1))
