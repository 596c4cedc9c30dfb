"""Inner walls of a ROS map: thin straight structures that begin at another wall, with the gaps in them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.exchange.drawing import Mark
from labgym.exchange.inner_walls import InnerWall, standing
from labgym.exchange.ros_files import RosMap
from labgym.exchange.strips import Point, Strip

if TYPE_CHECKING:
    from shapely import Polygon

THICKEST = 0.45
"""Thickness of the thickest inner wall that is read by default, meters; furniture is deeper."""
LONGEST_NOISE = 0.6
"""Longest gap that is closed, meters: no robot or person passes."""
PASSAGE = 2.5
"""Longest gap that is read as a passage, meters."""
STUB = 0.3
"""Length of the shortest part of an inner wall, meters."""
SHORTEST, SHORTEST_BETWEEN = 1.0, 0.5
"""Length of the shortest inner wall without its gaps, and of one with both ends at other walls, meters."""
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class _Band:
    """A horizontal inner wall in the aligned grid: rows r0 to r1 and columns c0 to c1, ends excluded."""

    r0: int
    r1: int
    c0: int
    c1: int

    @property
    def middle(self) -> float:
        return (self.r0 + self.r1) / 2.0


@dataclass(frozen=True)
class _Run:
    """A wall along a row: its ends, its gaps and its length without them, in cells; whether its ends are at walls."""

    ends: tuple[float, float]
    gaps: tuple[tuple[float, float], ...]
    solid: int
    held: tuple[bool, bool]


@dataclass(frozen=True)
class Aligned:
    """A map turned so that its main direction is x.

    Attributes:
        occupied, free, inner: (ny, nx) bool; inner cells lie between the outer walls.
        thin: whether a cell is free, or belongs to a structure that is thin in y.
        x, y: position of the outer corner of cell [0, 0] in the turned frame, meters. yaw: of that frame, radians.
        cell: side of a cell, meters. thickest: thickness of the thickest wall, meters.
    """

    occupied: Mask
    free: Mask
    inner: Mask
    thin: Mask
    x: float
    y: float
    yaw: float
    cell: float
    thickest: float


def partitions(
    grid: RosMap, inner: Polygon, doors: Sequence[Mark], yaw: float, thickest: float = THICKEST
) -> list[InnerWall]:
    """Return the inner walls of a map, with the passages in them.

    An inner wall is a thin straight structure along or across a direction. It is at least 1 m long and begins at an
    outer wall or at another inner wall, or at least 0.5 m long between two of them. A gap of 0.6 to 2.5 m up to the
    next wall is a passage. Where furniture stands against a wall the two cannot be distinguished; a wall without a free
    part of that length is not found. `standing` says which rows of furniture are not mistaken for walls.

    Args:
        inner: area between the outer walls, meters. doors: gaps in them. yaw: the direction, radians.
        thickest: thickness of the thickest wall, meters.
    """
    plans = _aligned(grid, inner, yaw, thickest)
    bands = [_bands(plan) for plan in plans]
    masks = [_mask(plan, own) for plan, own in zip(plans, bands, strict=True)]
    walls: list[InnerWall] = []
    for index, plan in enumerate(plans):
        crossing, mirrored = masks[1 - index].T, index == 1
        for line in _lines(plan, bands[index], crossing):
            wall = _wall(plan, line, crossing)
            if wall is not None:
                middle = float(np.mean([band.middle for band in line]))
                thickness = max(band.r1 - band.r0 for band in line) * plan.cell
                start, end = (_point(plan, at, middle, mirrored) for at in wall.ends)
                gaps = [tuple(_point(plan, at, middle, mirrored) for at in gap) for gap in wall.gaps]
                marks = tuple(Mark(low, high, "passage") for low, high in gaps)
                walls.append(InnerWall(Strip(start, end, thickness), marks, wall.solid * plan.cell, wall.held))
    return standing(walls, doors, inner, grid.resolution)


def _aligned(grid: RosMap, inner: Polygon, yaw: float, thickest: float) -> tuple[Aligned, Aligned]:
    """Return the cells of a map on a grid along a direction, and the same with x and y exchanged."""
    import shapely
    from shapely.affinity import rotate

    x0, y0, x1, y1 = rotate(inner, -yaw, (0.0, 0.0), use_radians=True).bounds
    cell, margin = grid.resolution, 3.0 * grid.resolution
    x0, y0 = x0 - margin, y0 - margin
    if abs(yaw - grid.origin[2]) < 1e-9:  # the cells of the map itself
        cosine, sine = math.cos(yaw), math.sin(yaw)
        ox, oy = grid.origin[0] * cosine + grid.origin[1] * sine, grid.origin[1] * cosine - grid.origin[0] * sine
        x0, y0 = ox + math.floor((x0 - ox) / cell) * cell, oy + math.floor((y0 - oy) / cell) * cell
    nx, ny = math.ceil((x1 + margin - x0) / cell), math.ceil((y1 + margin - y0) / cell)
    x, y = np.meshgrid(x0 + (np.arange(nx) + 0.5) * cell, y0 + (np.arange(ny) + 0.5) * cell)
    px, py = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    points = np.column_stack([px.ravel(), py.ravel()])
    occupied, free = (grid.sampled(cells, points).reshape(ny, nx) for cells in (grid.occupied, grid.free))
    within = np.asarray(shapely.contains_xy(inner, px, py))
    most = thickest / cell + 1e-9
    return (
        Aligned(occupied, free, within, _run_lengths(occupied) <= most, x0, y0, yaw, cell, thickest),
        Aligned(occupied.T, free.T, within.T, _run_lengths(occupied.T) <= most, y0, x0, yaw, cell, thickest),
    )


def _bands(plan: Aligned) -> list[_Band]:
    """Return the horizontal inner walls: long in x, thin in y, and clear of the outer walls."""
    thin = plan.occupied & plan.inner & plan.thin & ~_touching(plan.occupied, ~plan.inner)
    length = max(2, round(STUB / plan.cell))
    long = cv2.morphologyEx(thin.astype(np.uint8), cv2.MORPH_OPEN, np.ones((1, length), np.uint8))
    count, _, stats, _ = cv2.connectedComponentsWithStats(long, connectivity=4)
    return [
        _Band(int(top), int(top + height), int(left), int(left + width))
        for left, top, width, height, _ in stats[1:count]
        if height * plan.cell <= plan.thickest + 1e-9
    ]


def _run_lengths(occupied: Mask) -> NDArray[np.int64]:
    """Return, for each cell, the number of cells of the vertical run of occupied cells that it belongs to."""
    starts, labels = _runs(occupied)
    counts = np.bincount(labels.ravel(), minlength=starts + 1)
    return np.where(occupied, counts[labels], 0)


def _touching(occupied: Mask, other: Mask) -> Mask:
    """Return the cells whose vertical run of occupied cells has a cell in another mask."""
    count, labels = _runs(occupied)
    hit = np.zeros(count + 1, dtype=np.bool_)
    hit[labels[occupied & other]] = True
    return np.asarray(occupied & hit[labels])


def _runs(occupied: Mask) -> tuple[int, NDArray[np.int64]]:
    """Return the number of vertical runs and the run of each cell, counted from 1; free cells have 0."""
    columns = occupied.T
    before = np.zeros_like(columns)
    before[:, 1:] = columns[:, :-1]
    labels = np.cumsum((columns & ~before).ravel()).reshape(columns.shape)
    return int(labels.max(initial=0)), np.where(columns, labels, 0).T


def _mask(plan: Aligned, bands: list[_Band]) -> Mask:
    """Return the cells of bands, and those of the junctions with other walls at their ends."""
    mask = np.zeros(plan.occupied.shape, dtype=np.bool_)
    reach = round(plan.thickest / plan.cell)
    for band in bands:
        solid: Mask = np.asarray(plan.occupied[band.r0 : band.r1].all(axis=0), dtype=np.bool_).reshape(-1)
        low, high = band.c0, band.c1
        while low > max(band.c0 - reach, 0) and solid[low - 1]:
            low -= 1
        while high < min(band.c1 + reach, len(solid)) and solid[high]:
            high += 1
        mask[band.r0 : band.r1, low:high] = True
    return mask


def _anchors(plan: Aligned, row: int, crossing: Mask) -> Mask:
    """Return the columns at which a row is in an outer wall or in an inner wall that crosses it or ends at it."""
    return np.asarray(~plan.inner[row] | crossing[max(row - 1, 0) : row + 2].any(axis=0))


def _lines(plan: Aligned, bands: list[_Band], crossing: Mask) -> list[list[_Band]]:
    """Return the bands of each wall, from left to right: on one line, without another wall or a long gap between."""
    lines: list[list[_Band]] = []
    for band in sorted(bands, key=lambda each: each.c0):
        anchors = _anchors(plan, min(int(band.middle), plan.occupied.shape[0] - 1), crossing)
        for line in lines:
            start = line[-1].c1
            near = abs(line[0].middle - band.middle) <= 1.0 and 0 <= band.c0 - start <= PASSAGE / plan.cell
            if near and not anchors[start : band.c0].any():
                line.append(band)
                break
        else:
            lines.append([band])
    return lines


def _wall(plan: Aligned, line: list[_Band], crossing: Mask) -> _Run | None:
    """Return the wall that some bands are parts of; None if it is too short or stands alone."""
    row = min(int(line[0].middle), plan.occupied.shape[0] - 1)
    anchors = _anchors(plan, row, crossing)
    gaps: list[tuple[float, float]] = []
    for band, following in pairwise(line):
        gaps += _free_runs(plan.free[row], band.c1, following.c0)
    left, left_gap, left_anchored = _walk(plan, row, anchors, line[0].c0 - 1, -1)
    right, right_gap, right_anchored = _walk(plan, row, anchors, line[-1].c1, 1)
    solid = sum(band.c1 - band.c0 for band in line)
    if not (left_anchored or right_anchored):
        return None
    if solid * plan.cell < (SHORTEST_BETWEEN if left_anchored and right_anchored else SHORTEST):
        return None
    wide = tuple(gap for gap in [*left_gap, *gaps, *right_gap] if (gap[1] - gap[0]) * plan.cell >= LONGEST_NOISE)
    return _Run((left, right), wide, solid, (left_anchored, right_anchored))


def _walk(plan: Aligned, row: int, anchors: Mask, at: int, step: int) -> tuple[float, list[tuple[float, float]], bool]:
    """Follow a wall beyond its end to the next wall.

    Returns:
        The end of the wall, the gap before it if there is one, and whether it ends at a wall.
    """
    occupied, free, inner, thin = plan.occupied[row], plan.free[row], plan.inner[row], plan.thin[row]
    begin, most = (at if step > 0 else at + 1), len(anchors)
    gaps: list[tuple[float, float]] = []
    while True:
        while 0 <= at < most and occupied[at] and not anchors[at]:
            at += step
        end = at
        while 0 <= at < most and free[at] and not anchors[at]:
            at += step
        if not 0 <= at < most or abs(at - end) * plan.cell > PASSAGE:
            return float(begin), [], False
        if at != end:
            gaps.append((float(end), float(at)) if step > 0 else (float(at + 1), float(end + 1)))
        if anchors[at]:
            break
        if at == end or not (occupied[at] and thin[at]):
            return float(begin), [], False
    # The wall runs on through an inner wall, or a cell into an outer one, so that no gap is left at the joint.
    far = at
    while 0 <= far < most and anchors[far] and abs(far - at) * plan.cell < plan.thickest and inner[far]:
        far += step
    far = far if far != at else at + step
    return float(far if step > 0 else far + 1), gaps, True


def _free_runs(free: Mask, start: int, end: int) -> Iterator[tuple[float, float]]:
    """Yield the runs of free cells between two columns."""
    row = np.concatenate([[False], free[start:end], [False]]).astype(np.int8)
    edges = np.flatnonzero(np.diff(row)) + start
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        yield float(low), float(high)


def _point(plan: Aligned, along: float, across: float, mirrored: bool) -> Point:
    """Return a position in cells of the aligned grid in the map's frame, meters."""
    x, y = plan.x + along * plan.cell, plan.y + across * plan.cell
    if mirrored:
        x, y = y, x
    return x * math.cos(plan.yaw) - y * math.sin(plan.yaw), x * math.sin(plan.yaw) + y * math.cos(plan.yaw)
