"""Areas of spaces as polygons: what walls enclose, and rings that lie in each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from labgym.exchange.strips import Point
from labgym.exchange.structure import polygon as footprint
from labgym.exchange.wall_lines import TOUCHING
from labgym.layouts.floor import Wall
from labgym.layouts.floor.joints import extensions

if TYPE_CHECKING:
    from shapely import Polygon

LEAST_AREA = 1.0
"""Area of the smallest enclosed space, square meters."""


def enclosed(walls: Sequence[Wall]) -> list[Polygon]:
    """Return the areas that walls with closed openings enclose, largest first."""
    from shapely import Polygon, union_all

    boxes = [
        wall.piece(-before, wall.length + after, 0.0, wall.height)
        for wall, (before, after) in zip(walls, extensions(walls), strict=True)
    ]
    solid = union_all([footprint(box) for box in boxes]).buffer(TOUCHING, join_style="mitre")
    areas = [
        Polygon(ring).buffer(TOUCHING, join_style="mitre").simplify(1e-3)
        for part in getattr(solid, "geoms", [solid])
        for ring in part.interiors
    ]
    return sorted((area for area in areas if area.area >= LEAST_AREA), key=lambda area: -area.area)


def nested(rings: Sequence[tuple[Point, ...]]) -> list[Polygon]:
    """Return polygons from rings; a ring inside another is a hole of it, one inside a hole is a polygon again."""
    from shapely import Polygon

    polygons = sorted((Polygon(ring) for ring in rings if len(ring) >= 3), key=lambda each: -each.area)
    polygons = [polygon if polygon.is_valid else polygon.buffer(0.0) for polygon in polygons]
    polygons = [polygon for polygon in polygons if polygon.geom_type == "Polygon" and polygon.area > 0.0]
    outer: list[Polygon] = []
    owners: list[int] = []
    for index, polygon in enumerate(polygons):
        enclosing = [other for other in range(index) if polygons[other].contains(polygon.representative_point())]
        if len(enclosing) % 2 and enclosing[-1] in owners:
            place = owners.index(enclosing[-1])
            outer[place] = outer[place].difference(polygon)
        else:
            outer.append(polygon)
            owners.append(index)
    return [polygon for polygon in outer if polygon.area >= LEAST_AREA]


def corners(polygon: Polygon) -> list[Point]:
    """Return the corners of a polygon, counter-clockwise."""
    from shapely.geometry.polygon import orient

    return [(x, y) for x, y, *_ in orient(polygon.simplify(1e-3)).exterior.coords[:-1]]
