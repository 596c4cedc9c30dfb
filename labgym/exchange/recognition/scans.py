"""Pictures of floors from maps of ROS and images of plans: along the main direction, without beams and furniture."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from labgym.exchange.recognition.picture import (
    MAX_PIXELS,
    Mask,
    Picture,
    along,
    components,
    main_direction,
    near,
    opened,
    turned,
)
from labgym.exchange.recognition.plans import MARGIN, outside_of
from labgym.exchange.ros_files import RosMap

THINNEST_WALL, LONGEST_SYMBOL = 0.07, 0.8
"""Thickness of thin walls, and length of the longest letter or symbol, in an image of a plan, meters."""
LEAST_TURN = math.radians(2.0)
"""Angle above which a map counts as turned although its grid looks aligned."""
AROUND = 1.0
"""Width of what is kept around the free cells of a map, meters."""
BEAM = 0.3
"""Free parts that are narrower belong to single beams of a lidar, meters."""
LEAST_PART = 5.0
"""Area of the smallest free part without a way to the others, square meters."""
SPECK = 4
"""Number of cells of the largest speck."""
LARGEST_FURNITURE = 14.0
"""Area of the largest object that stands free and is taken for furniture, square meters."""
THICKEST_WALL, LONGEST_SHORT = 0.45, 1.5
"""A free-standing object that is thinner and longer than these is a wall, meters."""
FRONT = 0.15
"""Distance around an unknown area and around a free one within which solid cells are fronts of furniture, meters."""
BARE = 0.5
"""Length of a wall without furniture that tells it from the front of furniture, meters."""
SHORTEST_WALL, DOOR = 0.6, 1.3
"""Length of the shortest piece of wall, and of the widest gap between two pieces of one wall, meters."""
NARROWEST = 0.2
"""Width of the narrowest furniture, meters."""
MOSTLY_THIN = 0.2
"""Largest share of a wall that may be thicker."""


def picture_of(grid: RosMap) -> Picture:
    """Return the picture of a map. Free-standing furniture is free in it."""
    grid = _cropped(grid)
    rows, columns = np.nonzero(grid.occupied)
    points = np.asarray((np.column_stack([columns, rows]) + 0.5) * grid.resolution, dtype=np.float64)
    yaw = main_direction(points, grid.resolution)
    if yaw == 0.0:  # In intervals of one cell, the columns of the grid look like lines.
        coarse = main_direction(points, 2.0 * grid.resolution)
        yaw = coarse if abs(coarse) > LEAST_TURN else 0.0
    picture = _turned(grid, yaw)
    free = _without_furniture(_without_beams(picture), picture)
    return Picture(free, picture.solid & ~free, picture.outside, picture.cell, picture.x, picture.y, picture.yaw)


def _cropped(grid: RosMap) -> RosMap:
    """Return the part of a map around its free cells."""
    rows, columns = (np.flatnonzero(grid.free.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return grid
    margin = math.ceil(AROUND / grid.resolution)
    row, column = max(int(rows[0]) - margin, 0), max(int(columns[0]) - margin, 0)
    window = np.s_[row : int(rows[-1]) + margin + 1, column : int(columns[-1]) + margin + 1]
    corner = turned(np.array([(column, row)]) * grid.resolution, grid.origin[2])[0].tolist()
    origin = (grid.origin[0] + corner[0], grid.origin[1] + corner[1], grid.origin[2])
    return RosMap(grid.occupied[window], grid.free[window], grid.resolution, origin)


def picture_of_plan(grid: RosMap) -> Picture:
    """Return the picture of an image of a floor plan: dark walls on a light ground. Symbols and thin lines are free."""
    cell = grid.resolution
    margin = math.ceil(MARGIN / cell)
    count, labels, stats = components(grid.occupied)
    strokes = opened(grid.occupied, max(2, round(THINNEST_WALL / cell)))
    walls = strokes if count and strokes.sum() >= 0.4 * grid.occupied.sum() else grid.occupied
    large = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) * cell >= LONGEST_SYMBOL
    large[0] = False
    walls = np.pad(walls & large[labels], margin)
    origin = (-margin * cell, -margin * cell, 0.0)
    rows, columns = np.nonzero(walls)
    yaw = main_direction(np.asarray((np.column_stack([columns, rows]) + 0.5) * cell, dtype=np.float64), cell)
    picture = _turned(RosMap(walls, ~walls, cell, origin), yaw)
    outside = outside_of(~picture.solid, picture.cell)
    return replace(picture, free=~picture.solid & ~outside, outside=outside, unit=cell, drawn=True)


def _turned(grid: RosMap, yaw: float) -> Picture:
    """Return the cells of a map on a grid along a direction of the map's own grid."""
    ny, nx = grid.occupied.shape
    cell = grid.resolution
    bounds = turned(np.array([(0.0, 0.0), (nx, 0.0), (nx, ny), (0.0, ny)]) * cell, -yaw)
    low, high = bounds.min(axis=0), bounds.max(axis=0)
    step = max(cell, math.sqrt(float(np.prod(high - low)) / MAX_PIXELS))
    width, height = (math.ceil(extent / step) for extent in high - low)
    # Row and column of the map for the center of each cell of the picture, as an affine map of OpenCV.
    cosine, sine = math.cos(yaw), math.sin(yaw)
    ratio = step / cell
    linear = np.array([[cosine, -sine], [sine, cosine]]) * ratio
    start = turned((low + step / 2.0)[None], yaw)[0] / cell - 0.5
    matrix = np.column_stack([linear, start])

    def warped(mask: Mask) -> Mask:
        values = cv2.warpAffine(
            mask.astype(np.float32), matrix, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        return np.asarray(values > 0.4)

    solid = warped(grid.occupied)
    free = warped(grid.free) & ~solid
    x0, y0, angle = grid.origin
    at = turned(np.array([[x0, y0]]), -(angle + yaw))[0] + low
    nowhere = np.zeros(free.shape, dtype=np.bool_)
    return Picture(free, solid, nowhere, step, float(at[0]), float(at[1]), angle + yaw)


def _without_beams(picture: Picture) -> Mask:
    """Return the large free parts, without parts that are narrower than some cells."""
    # Small specks in the free area do not make beams of what is around them.
    free = picture.free
    _, parts, stats, _ = cv2.connectedComponentsWithStats((~free).astype(np.uint8), connectivity=8)
    specks = stats[:, cv2.CC_STAT_AREA] <= SPECK
    specks[0] = False
    wide = opened(free | specks[parts], picture.cells(BEAM, 2))
    _, labels, stats = components(wide)
    large = stats[:, cv2.CC_STAT_AREA] * picture.cell**2 >= LEAST_PART
    large[0] = False
    return np.asarray(large[labels])


def _without_furniture(free: Mask, picture: Picture) -> Mask:
    """Return the free area with the objects in it that are no walls."""
    inside = _pockets(free, picture)
    thin = picture.solid & ~free
    thin &= ~opened(thin, picture.cells(THICKEST_WALL) + 1)
    walls = _wall_lines(thin, inside, picture)
    count, labels, stats = components(~free)
    thick = opened(~free, picture.cells(THICKEST_WALL) + 1)
    result = free.copy()
    height, width = free.shape
    for part in range(1, count + 1):
        x, y, w, h, area = (int(value) for value in stats[part])
        at_border = x == 0 or y == 0 or x + w == width or y + h == height
        if at_border or area * picture.cell**2 > LARGEST_FURNITURE:
            continue
        window = np.s_[y : y + h, x : x + w]
        own = labels[window] == part
        mostly_thin = float((thick[window] & own).sum()) <= MOSTLY_THIN * area
        if not (mostly_thin and max(w, h) * picture.cell >= LONGEST_SHORT):
            result[window] |= own & ~walls[window]
    return result | ((inside | _fronts(result, inside, thin, picture)) & ~walls)


def _pockets(free: Mask, picture: Picture) -> Mask:
    """Return the inside of furniture of which the map shows all sides: unknown areas between solid ones."""
    unknown = ~free & ~picture.solid
    size = picture.cells(NARROWEST, 2)
    _, labels, stats = components(opened(unknown, size))
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    pocket = stats[:, cv2.CC_STAT_AREA] * picture.cell**2 <= LARGEST_FURNITURE
    pocket[np.unique(border)] = False
    pocket[0] = False
    return near(pocket[labels], size) & unknown


def _wall_lines(thin: Mask, inside: Mask, picture: Picture) -> Mask:
    """Return the thin straight solid lines, with doors, that are longer than the furniture that stands against them."""
    beside = near(inside, picture.cells(FRONT))
    result = np.zeros(thin.shape, dtype=np.bool_)
    for axis in (0, 1):
        lines = along(thin, 3, 1 - axis, cv2.MORPH_DILATE)
        lines = along(lines, picture.cells(SHORTEST_WALL), axis, cv2.MORPH_OPEN)
        _, labels, _ = components(along(lines, picture.cells(DOOR), axis, cv2.MORPH_CLOSE))
        labels = np.where(lines & thin, labels, 0)
        away = (labels > 0) & ~beside
        bare = np.unique(np.column_stack([labels[away], np.nonzero(away)[axis]]), axis=0)[:, 0]
        wall = np.bincount(bare, minlength=int(labels.max(initial=0)) + 1) >= picture.cells(BARE)
        wall[0] = False
        result |= wall[labels]
    return result


def _fronts(free: Mask, inside: Mask, thin: Mask, picture: Picture) -> Mask:
    """Return the sides of furniture: solid cells between its inside and the free area, and between two pieces."""
    reach = picture.cells(FRONT)
    return near(inside, reach) & (near(free, reach) | thin)
