"""Egress: from every exit a way of the required width leads to every place of work, through interior doors if need be.

The way is judged without movable clutter: stools, bins and kits on the floor do not count. The clearance of the floor
is sampled on a grid; every distance on it is exact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.floor.solids import leaf
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.building import Building, Entrance, building_on
from labgym.layouts.rules.clearance import cells_to, lower_to_boxes
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, MOVABLE, PROTRUSION
from labgym.layouts.rules.zones import HEADROOM
from labgym.navigation import goal_pose

STEP = 0.025
"""Spacing of the grid, meters."""
MARGIN = STEP / 2.0
"""Half a step: the difference between the clearance of a grid point and that of the points next to it on its lines."""
ERROR = STEP / math.sqrt(2.0)
"""Greatest distance of a point from the nearest grid point, meters. The grid points nearest to the middle line of a way
are joined, and their clearance is at most this much less than half the width of the way."""
REACH = 0.30
"""A way leads to furniture narrower than itself if it passes this near to the place in front, meters: such furniture
may stand in a niche between deeper pieces."""
THINNED = 4
"""Every such line of the grid is looked at for spaces that no way reaches."""
WIDEST = 1.2
"""Widths are measured up to this value, meters."""


@dataclass(frozen=True)
class NarrowWay:
    """An exit from which some places of work are reached by no way of the required width.

    Attributes:
        entrance: name of the exit in messages.
        destinations: placements whose front is not reached.
        width: clear width of the widest way to the one that is hardest to reach, meters; 0 if there is no way.
    """

    entrance: str
    destinations: tuple[str, ...]
    width: float


def narrow_ways(
    arrangement: Arrangement, width: float = EGRESS_WIDTH, margin: float = -ERROR, leaves: bool = False
) -> list[NarrowWay]:
    """Return the exits from which a place of work is not reached by a way of a width in meters.

    A place of work is the point 0.60 m before the front of a floor object with a clearance in the catalog. The way
    covers it, or passes within `REACH` of it if the object is narrow. Fronts that are blocked are not considered here.

    Args:
        margin: added to half the width. With the default a way of the width is found at any angle, and the grid's error
            may let ways pass that are up to twice `ERROR` narrower; `MARGIN` demands a clearance that is at least the
            width between the grid points too.
        leaves: whether the leaves of open interior doors are in the way, as they stand.
    """
    scene = _scene(arrangement, width, leaves)
    exits = _narrow_exits(*scene, width / 2.0 + margin)
    return list(_narrow_ways(*scene[:3], exits)) if exits else []


def narrow_exits(
    arrangement: Arrangement, width: float = EGRESS_WIDTH, margin: float = -ERROR, leaves: bool = False
) -> list[tuple[str, ...]]:
    """Return the destinations of `narrow_ways`, without measuring the ways, which takes most of the time."""
    exits = _narrow_exits(*_scene(arrangement, width, leaves), width / 2.0 + margin)
    return [tuple(place.id for place in missed) for _, missed in exits]


def blocked_places(arrangement: Arrangement, width: float = EGRESS_WIDTH) -> tuple[str, ...]:
    """Return the placements whose place of work lies in an obstacle, so that no way of any width leads to it."""
    floor, obstacles, leaves, places = _scene(arrangement, width, leaves=False)
    field = _Clearance.of(floor, obstacles, leaves)
    return tuple(place.id for place in places if field.at(place.x, place.y) <= 0.0)


def cut_off(floor: Floor, width: float = EGRESS_WIDTH) -> dict[str, frozenset[str]]:
    """Return by exit the ids of the spaces to which no way of a width in meters leads from it, without furniture."""
    building, exits = _exits(floor)
    field = _Clearance.of(floor, (), ())
    x0, y0, _, _ = field.bounds
    ys, xs = np.indices(field.values.shape)[:, ::THINNED, ::THINNED] * STEP
    nodes = np.column_stack([x0 + xs.ravel(), y0 + ys.ravel()])
    inside = [space.contains(nodes).reshape(xs.shape) for space in floor.spaces]
    result = {}
    for entrance in exits:
        area = field.area(entrance, width / 2.0 - ERROR)
        reached = np.isin(area.labels[::THINNED, ::THINNED], list(area.inside))
        missed = (index for index in building.joined(entrance.space) if not (reached & inside[index]).any())
        result[entrance.label] = frozenset(floor.spaces[index].id for index in missed)
    return result


def _scene(
    arrangement: Arrangement, width: float, leaves: bool
) -> tuple[Floor, tuple[OrientedBox, ...], tuple[OrientedBox, ...], tuple[_Place, ...]]:
    """Return the building, the objects and the leaves that are in the way, and the places of work."""
    floor = arrangement.layout.floor
    open_leaves = tuple(_open_leaves(floor)) if leaves else ()
    obstacles, places = tuple(_obstacles(arrangement)), tuple(_places(arrangement, width))
    return floor, obstacles, open_leaves, places


@lru_cache(maxsize=64)
def _narrow_exits(
    floor: Floor,
    obstacles: tuple[OrientedBox, ...],
    leaves: tuple[OrientedBox, ...],
    destinations: tuple[_Place, ...],
    radius: float,
) -> tuple[tuple[int, tuple[_Place, ...]], ...]:
    """Return the number of each narrow exit, and the places that no way from it reaches."""
    building, exits = _exits(floor)
    if not exits:
        return ()
    field = _Clearance.of(floor, obstacles, leaves)
    places = [place for place in destinations if field.at(place.x, place.y) > 0.0]
    nodes = np.array([field.node(place.x, place.y) for place in places], dtype=np.intp).reshape(-1, 2)
    narrow = []
    for number, entrance in enumerate(exits):
        joined = building.joined(entrance.space)
        area = field.area(entrance, radius)
        served = area.covers(nodes)
        missed = tuple(
            place
            for place, is_covered in zip(places, served.tolist(), strict=True)
            if not is_covered and place.space in joined and not area.serves(place)
        )
        if missed:
            narrow.append((number, missed))
    return tuple(narrow)


@lru_cache(maxsize=64)
def _narrow_ways(
    floor: Floor,
    obstacles: tuple[OrientedBox, ...],
    leaves: tuple[OrientedBox, ...],
    narrow: tuple[tuple[int, tuple[_Place, ...]], ...],
) -> tuple[NarrowWay, ...]:
    _, exits = _exits(floor)
    field = _Clearance.of(floor, obstacles, leaves)
    return tuple(
        NarrowWay(exits[number].label, tuple(place.id for place in missed), _widest(field, exits[number], missed))
        for number, missed in narrow
    )


def _exits(floor: Floor) -> tuple[Building, list[Entrance]]:
    building = building_on(floor)
    return building, [entrance for entrance in building.entrances if entrance.exit]


@dataclass(frozen=True)
class _Place:
    """Where a person stands to use a placement, in which space, and how near a way has to come, meters."""

    id: str
    space: int
    x: float
    y: float
    reach: float


def _places(arrangement: Arrangement, width: float) -> list[_Place]:
    def find(rows: list[int]) -> list[_Place]:
        return [_place(arrangement, row, width) for row in rows]

    return arrangement.facts(f"place of work {width}", arrangement.workplaces, find)


def _place(arrangement: Arrangement, row: int, width: float) -> _Place:
    x, y, _ = goal_pose(arrangement.box(row))
    reach = REACH if arrangement.assets[row].size.width < width else 0.0
    return _Place(arrangement.placements[row].id, arrangement.spaces[row], x, y, reach)


def _obstacles(arrangement: Arrangement) -> list[OrientedBox]:
    """Floor objects that are not movable, and objects on walls that protrude."""
    obstacles = []
    for row in arrangement.standing:
        placement, asset = arrangement.placements[row], arrangement.assets[row]
        standing = placement.support == FLOOR and asset.subtype not in MOVABLE
        protruding = placement.support == WALL and asset.size.depth > PROTRUSION
        if (standing or protruding) and placement.position[2] < HEADROOM:
            obstacles.append(arrangement.box(row))
    return obstacles


def _open_leaves(floor: Floor) -> Iterator[OrientedBox]:
    for way in floor.doorways:
        if way.opening.kind == "door" and way.opening.state == "open" and not way.exit:
            yield leaf(floor.walls[way.wall], way.opening, way.opening.angle)


def _widest(field: _Clearance, entrance: Entrance, places: Sequence[_Place]) -> float:
    """Width of the widest way from an exit to all of some places, to a centimeter; 0 without a way."""
    low, high = -MARGIN, WIDEST / 2.0
    while high - low > 0.005:
        middle = (low + high) / 2.0
        area = field.area(entrance, middle)
        if all(area.serves(place) for place in places):
            low = middle
        else:
            high = middle
    return 2.0 * (low + MARGIN)


@dataclass(frozen=True)
class _Clearance:
    """Distance from grid points to the nearest wall or obstacle, (ny, nx) meters, up to half of WIDEST."""

    bounds: tuple[float, float, float, float]
    values: Array

    @classmethod
    def of(cls, floor: Floor, obstacles: tuple[OrientedBox, ...], leaves: tuple[OrientedBox, ...]) -> _Clearance:
        x0, y0, x1, y1 = bounds = building_on(floor).bounds
        values = _among(floor, obstacles)
        if leaves:
            values = values.copy()
            lower_to_boxes(values, _nodes(x0, x1), _nodes(y0, y1), leaves, WIDEST / 2.0)
        return cls(bounds, values)

    def node(self, x: float, y: float) -> tuple[int, int]:
        """Index of the grid point nearest to a point of the floor."""
        rows, columns = self.values.shape
        x0, y0, _, _ = self.bounds
        return min(max(round((y - y0) / STEP), 0), rows - 1), min(max(round((x - x0) / STEP), 0), columns - 1)

    def at(self, x: float, y: float) -> float:
        """Clearance at a point, meters; not positive inside an obstacle or outside the floor."""
        x0, y0, x1, y1 = self.bounds
        if not (x0 < x < x1 and y0 < y < y1):
            return 0.0
        return float(self.values[self.node(x, y)])

    def area(self, entrance: Entrance, radius: float) -> _Area:
        """Return where a disc moves freely from an exit."""
        labels = self._regions(radius)
        rows, columns, entry = self._entry(entrance, radius)
        starts = np.unique(labels[rows, columns][entry])
        return _Area(self, labels, frozenset(starts[starts > 0].tolist()), radius)

    def _regions(self, radius: float) -> NDArray[np.int32]:
        """Return labels of the regions in which a disc moves freely, (ny, nx), 0 where it does not fit."""
        if radius not in self._labels:
            free = (self.values >= radius - 1e-9).astype(np.uint8)
            _, labels = cv2.connectedComponents(free, connectivity=4, ltype=cv2.CV_32S)
            self._labels[radius] = np.asarray(labels, dtype=np.int32)
        return self._labels[radius]

    @cached_property
    def _labels(self) -> dict[float, NDArray[np.int32]]:
        """Regions that have been computed, by the radius of the disc."""
        return {}

    def _entry(self, entrance: Entrance, radius: float) -> tuple[slice, slice, NDArray[np.bool_]]:
        """Grid points where the disc has just come in through the exit: rows and columns around it, and which."""
        (x, y, yaw), (x0, y0, _, _) = entrance.pose, self.bounds
        play = max(entrance.width / 2.0 - radius, 0.0) + STEP
        reach = play + radius + 2.0 * STEP
        rows, columns = (
            slice(max(0, math.floor((at - reach - low) / STEP)), max(0, math.ceil((at + reach - low) / STEP) + 1))
            for at, low in ((y, y0), (x, x0))
        )
        height, width = self.values[rows, columns].shape
        dx = (x0 + (columns.start + np.arange(width)) * STEP)[None, :] - x
        dy = (y0 + (rows.start + np.arange(height)) * STEP)[:, None] - y
        lateral, inward = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
        return rows, columns, (np.abs(lateral) <= play) & (np.abs(inward - radius) <= 1.5 * STEP)


@dataclass(frozen=True)
class _Area:
    """Where a disc of a radius moves freely: the cells of a clearance grid with one of some labels."""

    field: _Clearance
    labels: NDArray[np.int32]
    inside: frozenset[int]
    radius: float

    def covers(self, nodes: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether the disc moves freely to grid points, given by row and column, (n, 2)."""
        return np.isin(self.labels[nodes[:, 0], nodes[:, 1]], list(self.inside))

    def serves(self, place: _Place) -> bool:
        """Whether the disc covers a place or comes within its reach."""
        limit = place.reach + STEP
        cells = cells_to(self.labels, self.inside, *self.field.node(place.x, place.y), (limit + self.radius) / STEP + 1)
        return bool(np.maximum(cells * STEP - self.radius, 0.0) <= limit)


@lru_cache(maxsize=2)
def _among(floor: Floor, obstacles: tuple[OrientedBox, ...]) -> Array:
    """Return the clearance of grid points from walls and obstacles, (ny, nx) meters, read-only.

    The rule and its strict version ask for the same obstacles one after the other.
    """
    x0, y0, x1, y1 = building_on(floor).bounds
    values = _between_walls(floor).copy()
    lower_to_boxes(values, _nodes(x0, x1), _nodes(y0, y1), obstacles, WIDEST / 2.0)
    values.setflags(write=False)
    return values


@lru_cache(maxsize=2)
def _between_walls(floor: Floor) -> Array:
    """Return the clearance of grid points from walls, (ny, nx) meters, read-only."""
    building = building_on(floor)
    x0, y0, x1, y1 = building.bounds
    values = building.clearance(_nodes(x0, x1), _nodes(y0, y1), WIDEST / 2.0)
    values.setflags(write=False)
    return values


def _nodes(low: float, high: float) -> Array:
    """Return the coordinates of grid points between two bounds."""
    return np.asarray(low + np.arange(math.floor((high - low) / STEP + 1e-9) + 1) * STEP, dtype=np.float64)
