"""The picture of a floor that is recognized: free and solid cells along the main direction, from a map or a drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.exchange.strips import Point

Mask = NDArray[np.bool_]
Array = NDArray[np.float64]

MAX_PIXELS = 4_000_000
"""Largest number of cells of a picture."""
MAX_POINTS = 40_000
"""Largest number of points from which a main direction is found."""
UPRIGHT = math.radians(0.4)
"""Main directions below this angle count as 0."""


@dataclass(frozen=True)
class Picture:
    """Cells of a floor in a frame along its main direction.

    Attributes:
        free: (ny, nx) bool, where the floor is seen and nothing stands, row 0 at the least y.
        solid: (ny, nx) bool, where a wall or furniture is seen.
        outside: (ny, nx) bool, where the building certainly does not extend to.
        cell: side of a cell, meters.
        x, y: position of the outer corner of cell [0, 0] in the turned frame, meters.
        yaw: of the turned frame in that of the file, radians.
        doors: ends of the closed leaves of doors that the file draws, in the turned frame, meters.
        unit: meters per unit of the file; 1 for a map.
        rooms: (ny, nx) number of the room of each cell, 0 for none, if the file states the rooms.
        outlines: corners (n, 2) of rooms that answers state, in the turned frame, meters.
        drawn: whether the file is a drawing, whose lines are exact and whose rooms may have closed doors.
    """

    free: Mask
    solid: Mask
    outside: Mask
    cell: float
    x: float
    y: float
    yaw: float = 0.0
    doors: tuple[tuple[Point, Point], ...] = ()
    unit: float = 1.0
    drawn: bool = False
    rooms: NDArray[np.int32] | None = None
    outlines: tuple[Array, ...] = ()

    def cells(self, length: float, least: int = 1) -> int:
        """Return a length in meters as a number of cells."""
        return max(least, round(length / self.cell))

    def to_file(self, points: Array) -> Array:
        """Return points (n, 2) of the turned frame in the frame of the file, meters."""
        return turned(points, self.yaw)

    def from_file(self, points: Array) -> Array:
        """Return points (n, 2) of the file's frame in the turned frame, meters."""
        return turned(points, -self.yaw)

    def pixels(self, points: Array) -> NDArray[np.int64]:
        """Return the columns and rows (n, 2) of the cells that hold points of the turned frame."""
        return np.floor((points - (self.x, self.y)) / self.cell).astype(np.int64)

    def sampled(self, mask: Mask, points: Array) -> Mask:
        """Return the values of the cells that hold points (n, 2) of the turned frame; False outside, shape (n,)."""
        columns, rows = self.pixels(points).T
        inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
        values = np.zeros(len(points), dtype=np.bool_)
        values[inside] = mask[rows[inside], columns[inside]]
        return values

    def with_walls(self, lines: tuple[tuple[Point, Point], ...], thickness: float) -> Picture:
        """Return the picture with straight walls between points of the file's frame, meters."""
        drawn = np.zeros(self.free.shape, dtype=np.uint8)
        for line in lines:
            (c0, r0), (c1, r1) = self.pixels(self.from_file(np.array(line))).tolist()
            limit = 4 * max(drawn.shape)
            ends = [tuple(int(np.clip(value, -limit, limit)) for value in end) for end in ((c0, r0), (c1, r1))]
            cv2.line(drawn, ends[0], ends[1], 1, self.cells(thickness, 2))
        walls = drawn > 0
        return replace(self, free=self.free & ~walls, solid=self.solid | walls)

    def with_floor(self, areas: tuple[tuple[Point, Point], ...]) -> Picture:
        """Return the picture with free areas, between two corners in the file's frame along the main direction."""
        cleared = np.zeros(self.free.shape, dtype=np.bool_)
        for corners in areas:
            places = self.pixels(self.from_file(np.array(corners)))
            (c0, r0), (c1, r1) = np.clip(places, 0, np.array(self.free.shape[::-1])).tolist()
            cleared[min(r0, r1) : max(r0, r1) + 1, min(c0, c1) : max(c0, c1) + 1] = True
        return replace(self, free=self.free | cleared, solid=self.solid & ~cleared, outside=self.outside & ~cleared)

    def inside(self, corners: Array) -> Mask:
        """Return the cells within a polygon of the turned frame, (n, 2), meters."""
        drawn = np.zeros(self.free.shape, dtype=np.uint8)
        limit = 4 * max(drawn.shape)
        cv2.fillPoly(drawn, [np.clip(self.pixels(corners), -limit, limit).astype(np.int32)], 1)
        return drawn > 0


def turned(points: Array, yaw: float) -> Array:
    """Return points (n, 2) turned counter-clockwise about the origin."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.column_stack([points[:, 0] * cosine - points[:, 1] * sine, points[:, 0] * sine + points[:, 1] * cosine])


def main_direction(points: Array, cell: float) -> float:
    """Return the direction in [-pi/4, pi/4) along and across which points (n, 2) form the sharpest lines, radians.

    It is the angle whose two projections have the greatest sum of squared counts; steps of lines that are drawn in
    cells do not change it.

    Args:
        cell: width of the intervals in which projections are counted, meters.
    """
    if len(points) < 2:
        return 0.0
    points = points[:: -(-len(points) // MAX_POINTS)]
    points = points - points.mean(axis=0)
    best = 0.0
    for spread, step in ((45.0, 1.0), (1.0, 0.1)):
        angles = best + np.radians(np.arange(-spread, spread + step / 2.0, step))
        best = float(angles[int(np.argmax([_sharpness(points, angle, cell) for angle in angles.tolist()]))])
    best = math.remainder(best, math.pi / 2.0)
    return 0.0 if abs(best) < UPRIGHT else best


def _sharpness(points: Array, angle: float, cell: float) -> float:
    total = 0.0
    for along in turned(points, -angle).T:
        bins = np.floor((along - along.min()) / cell).astype(np.int64)
        counts = np.bincount(bins).astype(np.float64)
        total += float(counts @ counts)
    return total


def opened(mask: Mask, size: int) -> Mask:
    """Return the cells of a mask that a square of some cells within it covers."""
    kernel = np.ones((size, size), np.uint8)
    padded = cv2.copyMakeBorder(mask.astype(np.uint8), size, size, size, size, cv2.BORDER_CONSTANT, value=0)
    # The anchors of an even square are opposite, or the result is off by a cell.
    result = cv2.dilate(cv2.erode(padded, kernel), kernel, anchor=(size - 1 - size // 2,) * 2)
    return np.asarray(result[size:-size, size:-size] > 0)


def closed(mask: Mask, size: int) -> Mask:
    """Return a mask with the parts filled into which no square of some cells fits."""
    return ~opened(np.pad(~mask, size, constant_values=True), size)[size:-size, size:-size]


def along(mask: Mask, size: int, axis: int, operation: int) -> Mask:
    """Return a morphological operation along the rows (axis 1) or the columns (axis 0) of a mask."""
    size |= 1  # an even kernel shifts the result
    kernel = np.ones((1, size) if axis else (size, 1), np.uint8)
    result = cv2.morphologyEx(mask.astype(np.uint8), operation, kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(result > 0)


def near(mask: Mask, cells: int) -> Mask:
    """Return the cells within a square of some cells to each side around those of a mask."""
    kernel = np.ones((2 * cells + 1, 2 * cells + 1), np.uint8)
    return np.asarray(cv2.dilate(mask.astype(np.uint8), kernel) > 0)


def components(mask: Mask) -> tuple[int, NDArray[np.int32], NDArray[np.int32]]:
    """Return the number of connected parts, the part of each cell from 1 on, and the statistics of OpenCV by part."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return count - 1, np.asarray(labels), np.asarray(stats)
