"""Egress: from every door a way of the required width leads to every place of work.

The way is judged without movable clutter: stools, bins and kits on the floor do not count. The clearance of the floor
is sampled on a grid; every distance on it is exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.layouts.model import FLOOR, WALL, Door, Room
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, MOVABLE, PROTRUSION
from labgym.layouts.rules.zones import HEADROOM, door_pose
from labgym.navigation import goal_pose

STEP = 0.025
"""Spacing of the grid, meters."""
MARGIN = STEP / 2.0
"""Half a step: the difference between the clearance of a grid point and that of the points around it, meters."""
REACH = 0.30
"""A way leads to furniture narrower than itself if it passes this near to the place in front, meters: such furniture
may stand in a niche between deeper pieces."""
WIDEST = 1.2
"""Widths are measured up to this value, meters."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NarrowWay:
    """A door from which some places of work are reached by no way of the required width.

    Attributes:
        destinations: placements whose front is not reached.
        width: clear width of the widest way to the one that is hardest to reach, meters; 0 if there is no way.
    """

    door: Door
    destinations: tuple[str, ...]
    width: float


def narrow_ways(arrangement: Arrangement, width: float = EGRESS_WIDTH, margin: float = -MARGIN) -> list[NarrowWay]:
    """Return the doors from which a place of work is not reached by a way of a width in meters.

    A place of work is the point 0.60 m before the front of a floor object with a clearance in the catalog. The way
    covers it, or passes within `REACH` of it if the object is narrow. Fronts that are blocked are not considered here.

    Args:
        margin: added to half the width. The default finds only what is too narrow beyond the grid's error; `MARGIN`
            demands a clearance that is at least the width between the grid points too.
    """
    obstacles, places = tuple(_obstacles(arrangement)), tuple(_places(arrangement, width))
    return list(_narrow_ways(arrangement.layout.room, obstacles, places, width / 2.0 + margin))


@lru_cache(maxsize=64)
def _narrow_ways(
    room: Room, obstacles: tuple[OrientedBox, ...], destinations: tuple[_Place, ...], radius: float
) -> tuple[NarrowWay, ...]:
    if not room.doors:
        return ()
    field = _Clearance.of(room, obstacles)
    places = [place for place in destinations if field.at(place.x, place.y) > 0.0]
    narrow = []
    for door in room.doors:
        gap = field.gap(door, radius)
        missed = [place for place in places if not place.reached(field, gap)]
        if missed:
            widest = min(_widest(field, door, place) for place in missed)
            narrow.append(NarrowWay(door, tuple(place.id for place in missed), widest))
    return tuple(narrow)


@dataclass(frozen=True)
class _Place:
    """Where a person stands to use a placement, and how near a way has to come, meters."""

    id: str
    x: float
    y: float
    reach: float

    def reached(self, field: _Clearance, gap: Array) -> bool:
        return bool(gap[field.node(self.x, self.y)] <= self.reach + STEP)


def _places(arrangement: Arrangement, width: float) -> list[_Place]:
    places = []
    for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True):
        if placement.support == FLOOR and asset.clearance > 0.0 and asset.subtype not in MOVABLE:
            x, y, _ = goal_pose(arrangement.layout.box(placement.id))
            places.append(_Place(placement.id, x, y, REACH if asset.size.width < width else 0.0))
    return places


def _obstacles(arrangement: Arrangement) -> list[OrientedBox]:
    """Floor objects that are not movable, and objects on walls that protrude."""
    obstacles = []
    for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True):
        box = arrangement.layout.box(placement.id)
        standing = placement.support == FLOOR and asset.subtype not in MOVABLE
        protruding = placement.support == WALL and asset.size.depth > PROTRUSION
        if (standing or protruding) and box.z0 < HEADROOM:
            obstacles.append(box)
    return obstacles


def _widest(field: _Clearance, door: Door, place: _Place) -> float:
    """Width of the widest way from a door to a place, to a centimeter; 0 without a way."""
    low, high = -MARGIN, WIDEST / 2.0
    while high - low > 0.005:
        middle = (low + high) / 2.0
        if place.reached(field, field.gap(door, middle)):
            low = middle
        else:
            high = middle
    return 2.0 * (low + MARGIN)


@dataclass(frozen=True)
class _Clearance:
    """Distance from grid points to the nearest wall or obstacle, (ny, nx) meters, up to half of WIDEST."""

    room: Room
    values: Array

    @classmethod
    def of(cls, room: Room, obstacles: Sequence[OrientedBox]) -> _Clearance:
        xs = np.arange(math.floor(room.width / STEP + 1e-9) + 1) * STEP
        ys = np.arange(math.floor(room.depth / STEP + 1e-9) + 1) * STEP
        reach = WIDEST / 2.0
        across, along = np.minimum(xs, room.width - xs), np.minimum(ys, room.depth - ys)
        values = np.minimum(np.minimum(across[None, :], along[:, None]), reach)
        for box in obstacles:
            x0, y0, x1, y1 = box.bounds()
            columns = slice(max(0, math.floor((x0 - reach) / STEP)), max(0, math.ceil((x1 + reach) / STEP) + 1))
            rows = slice(max(0, math.floor((y0 - reach) / STEP)), max(0, math.ceil((y1 + reach) / STEP) + 1))
            dx, dy = xs[columns][None, :] - box.x, ys[rows][:, None] - box.y
            cosine, sine = math.cos(box.yaw), math.sin(box.yaw)
            out_x = np.abs(dx * cosine + dy * sine) - box.width / 2.0
            out_y = np.abs(dy * cosine - dx * sine) - box.depth / 2.0
            outside = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0))
            distance = outside + np.minimum(np.maximum(out_x, out_y), 0.0)
            values[rows, columns] = np.minimum(values[rows, columns], distance)
        return cls(room, values)

    def node(self, x: float, y: float) -> tuple[int, int]:
        """Index of the grid point nearest to a point of the room."""
        rows, columns = self.values.shape
        return min(max(round(y / STEP), 0), rows - 1), min(max(round(x / STEP), 0), columns - 1)

    def at(self, x: float, y: float) -> float:
        """Clearance at a point, meters; not positive inside an obstacle or outside the room."""
        if not (0.0 < x < self.room.width and 0.0 < y < self.room.depth):
            return 0.0
        return float(self.values[self.node(x, y)])

    def gap(self, door: Door, radius: float) -> Array:
        """Return the distance to what a disc covers that moves freely from a door, (ny, nx) meters; inf if nowhere."""
        free = (self.values >= radius - 1e-9).astype(np.uint8)
        _, labels = cv2.connectedComponents(free, connectivity=4, ltype=cv2.CV_32S)
        starts = np.unique(labels[self._entry(door, radius)])
        reached = np.isin(labels, starts[starts > 0])
        if not reached.any():
            return np.full(self.values.shape, np.inf)
        distance = cv2.distanceTransform((~reached).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return np.asarray(np.maximum(distance * STEP - radius, 0.0))

    def _entry(self, door: Door, radius: float) -> NDArray[np.bool_]:
        """Grid points where the disc has just come in through the door."""
        rows, columns = self.values.shape
        x, y, yaw = door_pose(self.room, door)
        dx, dy = np.arange(columns)[None, :] * STEP - x, np.arange(rows)[:, None] * STEP - y
        lateral, inward = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
        play = max(door.width / 2.0 - radius, 0.0) + STEP
        return np.asarray((np.abs(lateral) <= play) & (np.abs(inward - radius) <= 1.5 * STEP))
