"""Areas of spaces as polygons: what walls enclose, and rings that lie in each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from labgym.exchange.strips import Point
from labgym.exchange.structure import polygon as footprint
from labgym.exchange.wall_lines import TOUCHING
from labgym.geometry.polygons import difference, grown, largest, polygons, union
from labgym.layouts.floor import Wall
from labgym.layouts.floor.walls import extensions

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon

LEAST_AREA = 1.0
"""Area of the smallest enclosed space, square meters."""


def enclosed(walls: Sequence[Wall]) -> list[Polygon]:
    """Return the areas that walls with closed openings enclose, largest first."""
    from shapely import Polygon

    boxes = [
        wall.piece(-before, wall.length + after, 0.0, wall.height)
        for wall, (before, after) in zip(walls, extensions(walls), strict=True)
    ]
    solid = grown(union(footprint(box) for box in boxes), TOUCHING)
    areas = [
        largest(grown(Polygon(ring), TOUCHING).simplify(1e-3)) for part in polygons(solid) for ring in part.interiors
    ]
    return sorted((area for area in areas if area.area >= LEAST_AREA), key=lambda area: -area.area)


def nested(rings: Sequence[tuple[Point, ...]]) -> list[Polygon]:
    """Return polygons from rings; a ring inside another is a hole of it, one inside a hole is a polygon again."""
    from shapely import Polygon

    parts = [part for ring in rings if len(ring) >= 3 for part in polygons(Polygon(ring))]
    parts.sort(key=lambda part: -part.area)
    outer: dict[int, Polygon | MultiPolygon] = {}
    for index, part in enumerate(parts):
        enclosing = [other for other in range(index) if parts[other].contains(part.representative_point())]
        if len(enclosing) % 2 and enclosing[-1] in outer:
            outer[enclosing[-1]] = difference(outer[enclosing[-1]], part)
        else:
            outer[index] = part
    return [part for area in outer.values() for part in polygons(area) if part.area >= LEAST_AREA]


def corners(polygon: Polygon) -> list[Point]:
    """Return the corners of a polygon, counter-clockwise."""
    from shapely.geometry.polygon import orient

    return [(x, y) for x, y, *_ in orient(largest(polygon.simplify(1e-3))).exterior.coords[:-1]]
