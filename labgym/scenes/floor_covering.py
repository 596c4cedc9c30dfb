"""The visible floor: the covering of each space up to its walls, and of the doorways."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from labgym.geometry import OrientedBox, to_world
from labgym.geometry.polygons import GRID_M, difference, grown, intersection, polygons, union
from labgym.layouts.floor import OUTSIDE, Doorway, Floor
from labgym.layouts.floor.walls import extensions
from labgym.scenes.finishes import floor_material
from labgym.scenes.patches import Array, Faces, Patch, join

FLOOR = "floor"
"""Name of the patches of the floor in place of a wall's; no picture hides it."""
WEDGE = 1.05
"""Largest gap between a space's region and an oblique wall that the covering fills, meters."""
LAP = 0.01
"""How far the floor of a doorway reaches into the spaces on its sides, meters."""
SMALLEST = 0.01
"""A piece of covering that shares less than this with its space lies behind a wall, square meters."""
CACHED = 32
"""Number of floors whose coverings are cached."""


def covering_patches(floor: Floor) -> tuple[Patch, ...]:
    """Return the covering of a floor, a patch for each material."""
    pieces: dict[str, list[Polygon]] = {}
    for space, outline in zip(floor.spaces, coverings(floor), strict=True):
        pieces.setdefault(floor_material(space.finishes), []).extend(polygons(outline))
    for doorway in floor.doorways:
        for space_id, outline in _threshold(doorway):
            pieces.setdefault(floor_material(floor.space(space_id).finishes), []).append(outline)
    patches = []
    for material, outlines in pieces.items():
        vertices, faces = join([flat_mesh(outline) for outline in outlines])
        patches.append(Patch(FLOOR, f"{FLOOR}/{material}", material, vertices, faces))
    return tuple(patches)


@lru_cache(maxsize=CACHED)
def coverings(floor: Floor) -> tuple[shapely.Geometry, ...]:
    """Return the covering of each space up to its walls: its region, and the wedges between it and its walls."""
    regions = [region_outline(space.boxes) for space in floor.spaces]
    walls = region_outline(
        [
            wall.piece(-reach[0], wall.length + reach[1], 0.0, wall.height)
            for wall, reach in zip(floor.walls, extensions(floor.walls), strict=True)
        ]
    )
    return tuple(_covering(regions, index, walls) for index in range(len(regions)))


def spaces_at(floor: Floor, points: Array) -> NDArray[np.int64]:
    """Return the index of the space on whose covering each point (n, 2) lies, shape (n,); -1 without a space."""
    index = np.full(len(points), -1)
    for k, outline in enumerate(coverings(floor)):
        index[shapely.contains_xy(outline, points[:, 0], points[:, 1])] = k
    return index


def region_outline(boxes: Sequence[OrientedBox]) -> shapely.Geometry:
    """Return the union of the footprints of boxes."""
    return union((Polygon(box.corners()) for box in boxes), GRID_M)


def _covering(regions: Sequence[shapely.Geometry], index: int, walls: shapely.Geometry) -> shapely.Geometry:
    others = union((region for k, region in enumerate(regions) if k != index), GRID_M)
    free = difference(difference(grown(regions[index], WEDGE), walls, GRID_M), others, GRID_M)
    return shapely.MultiPolygon(
        [piece for piece in polygons(free) if intersection(piece, regions[index]).area > SMALLEST]
    )


def _threshold(doorway: Doorway) -> Iterator[tuple[str, Polygon]]:
    """Yield the floor in a doorway: half of the wall for each of its spaces, all of it for that of an exit."""
    half, reach = doorway.width / 2.0, doorway.thickness / 2.0 + LAP
    before, behind = doorway.spaces
    if behind == OUTSIDE:
        yield before, _rectangle(doorway, half, (LAP - reach, reach))
        return
    yield before, _rectangle(doorway, half, (0.0, reach))
    yield behind, _rectangle(doorway, half, (-reach, 0.0))


def _rectangle(doorway: Doorway, half: float, across: tuple[float, float]) -> Polygon:
    low, high = across
    return Polygon(to_world([(-half, low), (half, low), (half, high), (-half, high)], doorway.pose))


def flat_mesh(outline: Polygon) -> tuple[Array, Faces]:
    """Return triangles of a polygon at height 0, which look up."""
    triangles = [part.exterior.coords[:3] for part in shapely.constrained_delaunay_triangles(outline).geoms]
    corners = np.array(triangles, dtype=np.float64)[:, :, :2]
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    turn = ax * by - ay * bx < 0.0
    corners[turn] = corners[turn][:, ::-1]
    points, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return np.column_stack([points, np.zeros(len(points))]), index.reshape(-1, 3).astype(np.int64)
