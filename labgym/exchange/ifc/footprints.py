"""Footprints of the products of building models, from their extrusions and faces: no geometry kernel is needed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.geometry.polygons import polygons, union

if TYPE_CHECKING:
    from shapely import Geometry, Polygon

Entity = Any
Array = NDArray[np.float64]
MAX_DEPTH = 8
"""Deepest nesting of representations and curves."""
MAX_CLIPPINGS = 100
"""Largest number of parts that are cut off a solid one after another."""
MAX_POINTS = 200_000
"""Largest number of points of a product."""
CHORDS = 24
"""Number of chords of a circle."""
UPRIGHT = 1e-3
"""Largest slope of an extrusion that counts as vertical."""


def footprint(product: Entity, matrix: Array) -> tuple[Geometry, float, float] | None:
    """Return the area that a product covers seen from above, and its least and greatest height.

    Clippings are ignored: a wall below a roof keeps its full length.

    Args:
        matrix: (4, 4) transformation of the product's coordinates to those of the result.

    Returns:
        A shapely geometry and two heights; None without a body that is an extrusion or has faces.
    """
    shapes = getattr(product.Representation, "Representations", None) or ()
    bodies = [shape for shape in shapes if shape.RepresentationIdentifier in ("Body", "Facetation", None)]
    areas: list[Polygon] = []
    heights: list[float] = []
    count = 0
    for rings, hull in (part for body in bodies for item in body.Items for part in _parts(item, matrix, 0)):
        count += sum(map(len, rings))
        if count > MAX_POINTS:
            return None
        heights += [float(z) for ring in rings for z in (ring[:, 2].min(), ring[:, 2].max())]
        areas += _area(rings, hull)
    whole = union(areas)
    return None if whole.is_empty else (whole, min(heights), max(heights))


def _area(rings: Sequence[Array], hull: bool) -> list[Polygon]:
    """Return the polygons of an outer ring with holes seen from above, or of the hull of all points."""
    from shapely import MultiPoint, Polygon

    if hull:
        return list(polygons(MultiPoint(np.concatenate(rings)[:, :2]).convex_hull))
    if len(rings[0]) < 3:
        return []
    outer, *holes = ([tuple(point[:2]) for point in ring] for ring in rings if len(ring) >= 3)
    shape = Polygon(outer, holes)
    return list(polygons(shape if shape.is_valid else shape.buffer(0.0)))


def _parts(item: Entity, matrix: Array, depth: int) -> Iterator[tuple[list[Array], bool]]:
    """Yield rings (n, 3) of each solid or face, and whether their hull is what it covers."""
    for _ in range(MAX_CLIPPINGS):
        if item.is_a("IfcBooleanResult"):
            item = item.FirstOperand
    if depth > MAX_DEPTH:
        return
    if item.is_a("IfcExtrudedAreaSolid"):
        rings = [np.column_stack([ring, np.zeros(len(ring)), np.ones(len(ring))]) for ring in _profile(item.SweptArea)]
        place = matrix @ _axes(item.Position)
        along = place[:3, :3] @ np.array(item.ExtrudedDirection.DirectionRatios) * item.Depth
        if rings:
            low = [(ring @ place.T)[:, :3] for ring in rings]
            high = [ring + along for ring in low]
            upright = math.hypot(along[0], along[1]) <= UPRIGHT * abs(along[2])
            yield (low, False) if upright else ([low[0], high[0]], True)
            if upright:
                yield high, False
    elif item.is_a("IfcMappedItem"):
        from ifcopenshell.util.placement import get_mappeditem_transformation

        inner = matrix @ get_mappeditem_transformation(item)
        for part in item.MappingSource.MappedRepresentation.Items:
            yield from _parts(part, inner, depth + 1)
    else:
        for points in _faces(item):
            yield [(np.column_stack([points, np.ones(len(points))]) @ matrix.T)[:, :3]], False


def _faces(item: Entity) -> Iterator[Array]:
    """Yield the outer loops (n, 3) of the faces of a boundary representation or a face set."""
    if item.is_a("IfcTessellatedFaceSet"):
        table = np.array(item.Coordinates.CoordList, dtype=np.float64)
        faces = item.CoordIndex if item.is_a("IfcTriangulatedFaceSet") else [face.CoordIndex for face in item.Faces]
        for face in faces:
            yield table[np.array(face) - 1]
        return
    shells: Sequence[Entity] = ()
    if item.is_a("IfcManifoldSolidBrep"):
        shells = (item.Outer,)
    elif item.is_a("IfcShellBasedSurfaceModel"):
        shells = item.SbsmBoundary
    elif item.is_a("IfcFaceBasedSurfaceModel"):
        shells = item.FbsmFaces
    for face in (face for shell in shells for face in shell.CfsFaces):
        for bound in face.Bounds:
            if bound.Bound.is_a("IfcPolyLoop") and (bound.is_a("IfcFaceOuterBound") or len(face.Bounds) == 1):
                yield np.array([_point(point) for point in bound.Bound.Polygon])


def _profile(profile: Entity) -> list[Array]:
    """Return the outer ring (n, 2) of a profile and its holes; nothing of other kinds of profile."""
    place = _axes(getattr(profile, "Position", None))
    if profile.is_a("IfcRectangleProfileDef"):
        x, y = profile.XDim / 2.0, profile.YDim / 2.0
        rings = [np.array([(-x, -y), (x, -y), (x, y), (-x, y)])]
    elif profile.is_a("IfcCircleProfileDef"):
        rings = [_arc((0.0, 0.0), profile.Radius, 0.0, 2.0 * math.pi)]
    elif profile.is_a("IfcArbitraryClosedProfileDef"):
        curves = [profile.OuterCurve, *(getattr(profile, "InnerCurves", None) or ())]
        rings = [ring for curve in curves if len(ring := _curve(curve, 0)) >= 3]
    else:
        return []
    return [ring @ place[:2, :2].T + place[:2, 3] for ring in rings]


def _curve(curve: Entity, depth: int) -> Array:
    """Return points (n, 2) along a curve."""
    points: list[Sequence[float]] = []
    if depth > MAX_DEPTH:
        pass
    elif curve.is_a("IfcPolyline"):
        points = [_point(point)[:2] for point in curve.Points]
    elif curve.is_a("IfcIndexedPolyCurve"):
        table = [point[:2] for point in curve.Points.CoordList]
        indices = [index for segment in curve.Segments or () for index in segment.wrappedValue]
        points = [table[index - 1] for index in indices] or table
    elif curve.is_a("IfcCompositeCurve"):
        for segment in curve.Segments:
            part = _curve(segment.ParentCurve, depth + 1).tolist()
            points += part if segment.SameSense else part[::-1]
    elif curve.is_a("IfcTrimmedCurve"):
        return _trimmed(curve)
    elif curve.is_a("IfcCircle"):
        place = _axes(curve.Position)
        return _arc((place[0, 3], place[1, 3]), curve.Radius, 0.0, 2.0 * math.pi)
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def _trimmed(curve: Entity) -> Array:
    """Return points along a trimmed line or circle; its angles are degrees where they exceed a turn in radians."""
    ends = [[trim for trim in trims if hasattr(trim, "Coordinates")] for trims in (curve.Trim1, curve.Trim2)]
    values = [
        next((float(trim.wrappedValue) for trim in trims if not hasattr(trim, "Coordinates")), math.nan)
        for trims in (curve.Trim1, curve.Trim2)
    ]
    basis = curve.BasisCurve
    if basis.is_a("IfcLine") and not all(ends):
        start, along = np.array(_point(basis.Pnt)[:2]), np.array(basis.Dir.Orientation.DirectionRatios[:2])
        along *= basis.Dir.Magnitude / (np.hypot(*along) or 1.0)
        return np.array([start + value * along for value in values])
    if basis.is_a("IfcCircle"):
        place = _axes(basis.Position)
        if any(map(math.isnan, values)):
            local = [place[:2, :2].T @ (np.array(_point(end[0])[:2]) - place[:2, 3]) for end in ends if end]
            values = [math.atan2(y, x) for x, y in local]
        elif max(map(abs, values)) > 2.0 * math.pi + 1e-6:
            values = [math.radians(value) for value in values]
        if len(values) == 2:
            first, last = values if curve.SenseAgreement else values[::-1]
            ring = _arc((0.0, 0.0), basis.Radius, first, last + (2.0 * math.pi if last <= first else 0.0))
            ring = ring @ place[:2, :2].T + place[:2, 3]
            return ring if curve.SenseAgreement else ring[::-1]
    return np.array([_point(end[0])[:2] for end in ends if end], dtype=np.float64).reshape(-1, 2)


def _arc(center: tuple[float, float], radius: float, first: float, last: float) -> Array:
    angles = np.linspace(first, last, max(3, math.ceil(abs(last - first) / (2.0 * math.pi) * CHORDS) + 1))
    return np.column_stack([center[0] + radius * np.cos(angles), center[1] + radius * np.sin(angles)])


def _point(point: Entity) -> tuple[float, ...]:
    x, y, *z = (float(value) for value in point.Coordinates)
    return x, y, *(z or [0.0])


def _axes(placement: Entity | None) -> Array:
    """Return the matrix (4, 4) of a placement with axes; that of a 2D one turns about z."""
    if placement is None:
        return np.eye(4)
    if placement.is_a("IfcAxis2Placement2D"):
        matrix = np.eye(4)
        x, y = placement.RefDirection.DirectionRatios[:2] if placement.RefDirection else (1.0, 0.0)
        length = math.hypot(x, y) or 1.0
        matrix[:2, :2] = np.array([(x, -y), (y, x)]) / length
        matrix[:2, 3] = placement.Location.Coordinates[:2]
        return matrix
    from ifcopenshell.util.placement import get_axis2placement

    return np.asarray(get_axis2placement(placement), dtype=np.float64)
