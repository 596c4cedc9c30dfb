"""Unions, differences and intersections of areas in the plane: the result is polygons of positive area, nothing else.

Shapes that touch, coincide or have no area leave lines, points and collections of them behind. Some overlays refuse
these as input, and they have no exterior. Every function here drops them, from its arguments and from its result.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

import shapely
from shapely import MultiPolygon, Polygon

GRID_M = 1e-6
"""Grid to which corners are rounded where shapes meet along edges that differ by rounding, meters."""


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
    return polygonal(shapely.union_all(parts, grid_size=grid))


def difference(shape: shapely.Geometry, other: shapely.Geometry, grid: float | None = None) -> Polygon | MultiPolygon:
    """Return the area of a shape that another does not cover; `grid` as in `union`."""
    return polygonal(shapely.difference(polygonal(shape), polygonal(other), grid_size=grid))


def intersection(shape: shapely.Geometry, other: shapely.Geometry, grid: float | None = None) -> Polygon | MultiPolygon:
    """Return the area that two shapes share; `grid` as in `union`."""
    return polygonal(shapely.intersection(polygonal(shape), polygonal(other), grid_size=grid))


def grown(shape: shapely.Geometry, distance: float) -> Polygon | MultiPolygon:
    """Return a shape with each side moved outwards by a distance in meters, inwards if negative; corners stay sharp."""
    return polygonal(polygonal(shape).buffer(distance, join_style="mitre"))
