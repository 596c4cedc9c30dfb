"""The free positions of a disc among rectangles, and the free arcs on the rounded corners that bound them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.navigation.barriers import Barriers
from labgym.navigation.clearance import Index, Obstacles
from labgym.navigation.tangents import QUARTER, Contacts, Corners

CELLS_PER_RADIUS = 5
MAX_CELLS = 2_000_000
NEAR_CELLS = 3
"""Number of rows and columns on each side of a point in which open cells are looked up."""
SAMPLE_COUNTS = (1, 2, 4, 8, 16, 32)
"""Numbers of sample points of a segment, one after the other until one of them is blocked."""
Array = NDArray[np.float64]

TOLERANCE = 1e-7
"""A path may be nearer than the radius by this much, meters: the rounding error of a path that touches."""
SAME_ANGLE = 1e-6
"""Contacts this far outside an arc count as on it, radians."""
SPACING = 4.0
"""Distance of the arcs on a line that has them one after the other: more than a quarter's pi / 2."""


class CertainCells:
    """Cells in which no position of the disc's center is free, and others around which every position is.

    A cell counts as blocked only if all of it is nearer than the radius to one rectangle, so a segment through a
    blocked cell is never free. The converse does not hold: this is a filter in front of the exact test. A cell is open
    if the disc is free at its center and moves freely from there to the centers of the open cells next to it.

    Args:
        obstacles: the rectangles.
        radius: radius of the disc, meters.
        low: (2,) least corner of the part of the plane that matters, meters.
        high: (2,) greatest corner, meters.
    """

    def __init__(self, obstacles: Obstacles, radius: float, low: Array, high: Array) -> None:
        extent = np.maximum(high - low, 0.0)
        self._size = max(radius / CELLS_PER_RADIUS, math.sqrt(float(extent.prod()) / MAX_CELLS))
        # A ring of cells around the part stands for everything outside of it and is neither blocked nor open.
        self._origin = low - self._size
        columns, rows = (int(count) + 3 for count in extent // self._size)
        self._blocked = np.zeros((rows, columns), dtype=bool)
        self._open = np.zeros((rows, columns), dtype=bool)
        self._open[1:-2, 1:-2] = True
        self._mark(obstacles, max(radius - 1e-6 - self._size * math.sqrt(0.5), 0.0), radius + 1e-6 + self._size / 2.0)

    @cached_property
    def _regions(self) -> NDArray[np.intp]:
        """Number of the region of each open cell, 0 for other cells."""
        _, labels = cv2.connectedComponents(self._open.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
        return np.asarray(labels, dtype=np.intp)

    def regions_near(self, point: Array) -> tuple[Array, Index]:
        """Return the centers of the open cells near a point (2,), (m, 2), and their regions, (m,)."""
        column, row = ((point - self._origin) / self._size).astype(np.intp).tolist()
        top, left = max(row - NEAR_CELLS, 0), max(column - NEAR_CELLS, 0)
        rows, columns = np.nonzero(self._regions[top : row + NEAR_CELLS + 1, left : column + NEAR_CELLS + 1])
        rows, columns = rows + top, columns + left
        return self._origin + (np.column_stack([columns, rows]) + 0.5) * self._size, self._regions[rows, columns]

    def block(self, starts: Array, ends: Array) -> NDArray[np.bool_]:
        """Whether some sample point of each segment (m, 2)-(m, 2) is in a blocked cell, (m,)."""
        blocked = np.zeros(len(starts), dtype=bool)
        rest = np.arange(len(starts))
        # In cells, so that sampling is one multiplication, one addition and one look-up.
        begin, direction = (starts - self._origin) / self._size, (ends - starts) / self._size
        rows, columns = self._blocked.shape
        for count in SAMPLE_COUNTS:
            share = (np.arange(count) + 0.5) / count
            x = (begin[rest, 0, None] + direction[rest, 0, None] * share).astype(np.intp)
            y = (begin[rest, 1, None] + direction[rest, 1, None] * share).astype(np.intp)
            hit = self._blocked[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)].any(axis=1)
            blocked[rest[hit]] = True
            rest = rest[~hit]
        return blocked

    def _mark(self, obstacles: Obstacles, covered: float, near: float) -> None:
        """Set the cells whose center is nearer to a rectangle than one distance, and close those within another."""
        boxes = obstacles.boxes
        rows, columns = self._blocked.shape
        axes, corners = boxes.axes(), boxes.corners()
        first = np.floor((corners.min(axis=1) - near - self._origin) / self._size).astype(int)
        last = np.ceil((corners.max(axis=1) + near - self._origin) / self._size).astype(int)
        for k in range(len(boxes)):
            c0, c1 = max(1, int(first[k, 0])), min(columns - 1, int(last[k, 0]))
            r0, r1 = max(1, int(first[k, 1])), min(rows - 1, int(last[k, 1]))
            if c0 >= c1 or r0 >= r1:
                continue
            x = self._origin[0] + (np.arange(c0, c1) + 0.5) * self._size - boxes.centre[k, 0]
            y = (self._origin[1] + (np.arange(r0, r1) + 0.5) * self._size - boxes.centre[k, 1])[:, None]
            ax, ay = axes[k]
            along = np.maximum(np.abs(x * ax[0] + y * ax[1]) - boxes.half[k, 0], 0.0)
            across = np.maximum(np.abs(x * ay[0] + y * ay[1]) - boxes.half[k, 1], 0.0)
            away = along**2 + across**2
            self._blocked[r0:r1, c0:c1] |= away < covered**2
            self._open[r0:r1, c0:c1] &= away >= near**2


class FreeSpace:
    """The positions of a disc's center: on the floor, and at least r from every barrier.

    Attributes:
        barriers: what the disc keeps its distance from.
        obstacles: the rectangles among the barriers.
        low, high: (2,) corners of a rectangle that contains the positions.

    Args:
        area: (2,) and (2,) corners of the part of the plane for which cells are made; by default that of the positions.
    """

    def __init__(self, barriers: Barriers, radius: float, area: tuple[Array, Array] | None = None) -> None:
        self.obstacles, self.radius = barriers.obstacles, radius
        self.low, self.high = barriers.low + radius, barriers.high - radius
        self.barriers, self._area = barriers, area

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (m, 2) are free."""
        free = self.in_bounds(points) & (self.obstacles.nearest(points) >= self.radius - TOLERANCE)
        free[free] = self.barriers.discs_inside(points[free], self.radius)
        return np.asarray(free)

    def joins(self, starts: Array, ends: Array) -> NDArray[np.bool_]:
        """Whether segments (m, 2)-(m, 2) from free points are free along their whole length."""
        good: NDArray[np.bool_] = self.in_bounds(starts) & self.in_bounds(ends)
        rest = np.flatnonzero(good)
        blocked = self.cells.block(starts[rest], ends[rest])
        good[rest[blocked]] = False
        rest = rest[~blocked]
        good[rest] = self.obstacles.segments_clear(starts[rest], ends[rest], self.radius - TOLERANCE)
        return good

    def in_bounds(self, points: Array) -> NDArray[np.bool_]:
        """Whether the disc at points (m, 2) stays within the bounds of the floor and its walls."""
        return np.asarray(((points >= self.low - TOLERANCE) & (points <= self.high + TOLERANCE)).all(axis=-1))

    @cached_property
    def cells(self) -> CertainCells:
        """The cells of the floor."""
        low, high = (self.low, self.high) if self._area is None else self._area
        return CertainCells(self.obstacles, self.radius, np.maximum(low, self.low), np.minimum(high, self.high))

    def regions(self, point: Array) -> Index:
        """Return the regions of open cells to whose centers a straight way leads from a free point (2,), ascending.

        Points with a common region are joined by a way; others may be joined by one through a narrow passage.
        """
        centers, regions = self.cells.regions_near(point)
        return np.unique(regions[self.joins(np.broadcast_to(point, centers.shape), centers)])


@dataclass(frozen=True)
class Arcs:
    """Pieces of quarter circles, in ascending order of corner and angle.

    Attributes:
        corner: (a,) corner index.
        span: (a, 2) begin and end along the quarter, radians in [0, pi/2].
    """

    corner: Index
    span: Array

    def of(self, corners: Corners, contacts: Contacts) -> tuple[Index, Array]:
        """Return the arc that each contact lies on, -1 for none, and its angle along the quarter, each (m,)."""
        turn = corners.turned(contacts.corner, contacts.normal)
        place = contacts.corner * SPACING + turn
        arc = np.searchsorted(self._begin, place + SAME_ANGLE, side="right") - 1
        on_arc = arc >= 0
        on_arc[on_arc] = place[on_arc] <= self._end[arc[on_arc]] + SAME_ANGLE
        return np.where(on_arc, arc, -1), turn

    @cached_property
    def _begin(self) -> Array:
        return self.corner * SPACING + self.span[:, 0]

    @cached_property
    def _end(self) -> Array:
        return self.corner * SPACING + self.span[:, 1]


def free_arcs(corners: Corners, space: FreeSpace) -> Arcs:
    """Return the maximal free arcs of the quarter circles.

    Each quarter is cut where it crosses the boundary of a dilated rectangle or the line of a wall; a piece is free if
    its middle is free.
    """
    pairs = _close_pairs(corners, space)
    corner, angle = _cuts(corners, space, pairs)
    count = len(corners.begin)
    ends = np.arange(count)
    corner = np.concatenate([ends, corner, ends])
    angle = np.concatenate([np.zeros(count), angle, np.full(count, QUARTER)])
    order = np.lexsort((angle, corner))
    corner, angle = corner[order], angle[order]
    wide = np.flatnonzero((corner[1:] == corner[:-1]) & (angle[1:] - angle[:-1] > 1e-9))
    corner, begin, end = corner[wide], angle[wide], angle[wide + 1]
    free = _free_points(corner, corners.at_turn(corner, (begin + end) / 2.0), pairs, space)
    # Consecutive free pieces of a quarter are one arc.
    first = free.copy()
    first[1:] &= ~(free[:-1] & (corner[1:] == corner[:-1]))
    last = free.copy()
    last[:-1] &= ~(free[1:] & (corner[1:] == corner[:-1]))
    return Arcs(corner[first], np.column_stack([begin[first], end[last]]))


def _close_pairs(corners: Corners, space: FreeSpace) -> tuple[Index, Index]:
    """Return the pairs of a corner, ascending, and a rectangle within two radii: the others do not touch its arc."""
    reach = 2.0 * corners.radius + 1e-6
    corner, box = space.obstacles.near(corners.centre - reach, corners.centre + reach)
    close = space.obstacles.paired_distances(corners.centre[corner], box) <= reach
    return corner[close], box[close]


def _cuts(corners: Corners, space: FreeSpace, pairs: tuple[Index, Index]) -> tuple[Index, Array]:
    """Return where the quarters cross dilated rectangles and walls: corner (c,) and angle along the quarter (c,)."""
    radius, boxes, (corner, box) = corners.radius, space.obstacles.boxes, pairs
    centre = corners.centre[corner]
    axes, vertices = boxes.axes(), boxes.corners()
    angles: list[Array] = []
    walls: list[Array] = []
    with np.errstate(invalid="ignore", divide="ignore"):
        for vertex in range(4):
            offset = vertices[box, vertex] - centre
            length = np.hypot(offset[:, 0], offset[:, 1])
            spread = np.arccos(np.where(length > 1e-9, length / (2.0 * radius), np.nan))
            towards = np.arctan2(offset[:, 1], offset[:, 0])
            angles += [towards + spread, towards - spread]
        local = ((centre - boxes.centre[box])[:, None, :] * axes[box]).sum(axis=-1)
        for axis in range(2):
            for side in (1.0, -1.0):
                turn = np.arccos((side * (boxes.half[box, axis] + radius) - local[:, axis]) / radius)
                base = boxes.yaw[box] + axis * QUARTER
                angles += [base + turn, base - turn]
            for wall in (space.low, space.high):
                turn = np.arccos((wall[axis] - corners.centre[:, axis]) / radius)
                walls += [axis * QUARTER + turn, axis * QUARTER - turn]
    of_boxes, of_walls = np.column_stack(angles), np.column_stack(walls)
    row, _ = here = np.nonzero(_on_quarter(corners, corner, of_boxes))
    turned = (of_boxes[here] - corners.begin[corner[row]]) % (2.0 * math.pi)
    # Most angles are of the lines and circles beyond the boundary of the dilated rectangle: those cut nothing.
    gap = space.obstacles.paired_distances(corners.at_turn(corner[row], turned), box[row])
    on_boundary = np.abs(gap - radius) <= 1e-6
    at_wall, _ = there = np.nonzero(_on_quarter(corners, np.arange(len(corners.begin)), of_walls))
    return (
        np.concatenate([corner[row[on_boundary]], at_wall]),
        np.concatenate([turned[on_boundary], (of_walls[there] - corners.begin[at_wall]) % (2.0 * math.pi)]),
    )


def _on_quarter(corners: Corners, corner: Index, angles: Array) -> NDArray[np.bool_]:
    """Whether angles (m, n) are within the quarters of corners (m,); False for NaN."""
    return np.asarray((angles - corners.begin[corner][:, None]) % (2.0 * math.pi) < QUARTER)


def _free_points(corner: Index, points: Array, pairs: tuple[Index, Index], space: FreeSpace) -> NDArray[np.bool_]:
    """Whether points (m, 2) on the quarters of corners (m,) are free; `pairs` are the close rectangles of corners."""
    free = space.in_bounds(points)
    rest = np.flatnonzero(free)
    begin = np.searchsorted(pairs[0], corner[rest], side="left")
    count = np.searchsorted(pairs[0], corner[rest], side="right") - begin
    point = np.repeat(rest, count)
    within = np.arange(len(point)) - np.repeat(np.cumsum(count) - count, count)
    near = space.obstacles.paired_distances(points[point], pairs[1][np.repeat(begin, count) + within])
    free[point[near < space.radius - TOLERANCE]] = False
    return free
