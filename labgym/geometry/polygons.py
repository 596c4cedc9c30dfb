"""Unions, differences and intersections of areas in the plane: the result is polygons of positive area, nothing else.

Shapes that touch, coincide or have no area leave lines, points and collections of them behind. Some overlays refuse
these as input, and they have no exterior. Every function here drops them, from its arguments and from its result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain

import shapely
from shapely import MultiPolygon, Polygon

GRID_M = 1e-6
"""Grid to which corners are rounded where shapes meet along edges that differ by rounding, meters."""
AREA_TOLERANCE_M2 = 1e-6
"""Error of an area from which on an overlay counts as failed and is computed again on the grid, square meters."""


def polygons(shape: shapely.Geometry) -> list[Polygon]:
    """Return the polygons of positive area in a geometry; rings that cross themselves are repaired."""
    if shape is None or shape.is_empty:
        return []
    if shape.geom_type == "Polygon":
        if shape.is_valid:
            return [shape] if shape.area > 0.0 else []
        return polygons(shapely.make_valid(shape))
    if shape.geom_type in ("MultiPolygon", "GeometryCollection"):
        parts = shapely.get_parts(shape if shape.is_valid else shapely.make_valid(shape))
        return list(chain.from_iterable(map(polygons, parts)))
    return []


def polygonal(shape: shapely.Geometry) -> Polygon | MultiPolygon:
    """Return the part of a geometry that has an area; an empty polygon if no part has."""
    parts = polygons(shape)
    return parts[0] if len(parts) == 1 else MultiPolygon(parts) if parts else Polygon()


def largest(shape: shapely.Geometry) -> Polygon:
    """Return the largest polygon of a geometry; an empty polygon if no part has an area."""
    return max(polygons(shape), key=lambda part: part.area, default=Polygon())


def union(shapes: Iterable[shapely.Geometry], grid: float | None = None) -> Polygon | MultiPolygon:
    """Return the area that any of some shapes covers.

    Args:
        grid: side of the grid to which corners are rounded, meters; None for no rounding.
    """
    parts = list(chain.from_iterable(map(polygons, shapes)))
    areas = [part.area for part in parts]
    return _overlay(lambda size: shapely.union_all(parts, grid_size=size), grid, max(areas, default=0.0), sum(areas))


def difference(shape: shapely.Geometry, other: shapely.Geometry, grid: float | None = None) -> Polygon | MultiPolygon:
    """Return the area of a shape that another does not cover; `grid` as in `union`."""
    first, second = polygonal(shape), polygonal(other)
    least = first.area - second.area
    return _overlay(lambda size: shapely.difference(first, second, grid_size=size), grid, least, first.area)


def intersection(shape: shapely.Geometry, other: shapely.Geometry, grid: float | None = None) -> Polygon | MultiPolygon:
    """Return the area that two shapes share; `grid` as in `union`."""
    first, second = polygonal(shape), polygonal(other)
    most = min(first.area, second.area)
    return _overlay(lambda size: shapely.intersection(first, second, grid_size=size), grid, 0.0, most)


def _overlay(
    operation: Callable[[float | None], shapely.Geometry], grid: float | None, least: float, most: float
) -> Polygon | MultiPolygon:
    """Return the result of an overlay; on the grid if its area shows that the overlay without rounding went wrong.

    Args:
        least, most: bounds of the area, square meters.
    """
    result = polygonal(operation(grid))
    if grid is None and not least - AREA_TOLERANCE_M2 <= result.area <= most + AREA_TOLERANCE_M2:
        return polygonal(operation(GRID_M))
    return result


def grown(shape: shapely.Geometry, distance: float) -> Polygon | MultiPolygon:
    """Return a shape with each side moved outwards by a distance in meters, inwards if negative; corners stay sharp."""
    return polygonal(polygonal(shape).buffer(distance, join_style="mitre"))
