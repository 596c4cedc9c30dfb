"""Occupancy grids of a floor plan and their dilation by a disc."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.geometry import OrientedBox
from labgym.navigation.barriers import Barriers
from labgym.navigation.plan import OBSTACLE_HEIGHT, FloorPlan

RESOLUTION = 0.05
"""Side of a cell, meters."""

MAX_CELLS = 4_000_000
SAMPLES = 10
"""Spacing of the cells that are looked up first to find the regions on the floor, cells."""
TOUCH = 1e-9
"""Overlaps smaller than this count as touching, meters."""


@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A grid of square cells over the floor; everything outside the grid is occupied.

    Attributes:
        occupied: (ny, nx) bool; row is y, column is x.
        resolution: side of a cell, meters.
        origin: coordinates of the outer corner of cell [0, 0], meters.
    """

    occupied: NDArray[np.bool_]
    resolution: float = RESOLUTION
    origin: tuple[float, float] = (0.0, 0.0)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.occupied.shape[0], self.occupied.shape[1]

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Return (row, column) of the cell that contains a point; it may be outside the grid."""
        column = math.floor((x - self.origin[0]) / self.resolution)
        return math.floor((y - self.origin[1]) / self.resolution), column

    def centre_of(self, row: int, column: int) -> tuple[float, float]:
        """Return the coordinates (x, y) of the center of a cell."""
        return self.origin[0] + (column + 0.5) * self.resolution, self.origin[1] + (row + 0.5) * self.resolution

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the x of the columns (nx,) and the y of the rows (ny,), at the centers of the cells."""
        ny, nx = self.shape
        columns, rows = np.arange(nx, dtype=np.float64), np.arange(ny, dtype=np.float64)
        return self.origin[0] + (columns + 0.5) * self.resolution, self.origin[1] + (rows + 0.5) * self.resolution

    def holds(self, row: int, column: int) -> bool:
        """Whether a cell is inside the grid."""
        ny, nx = self.shape
        return 0 <= row < ny and 0 <= column < nx

    def free(self, x: float, y: float) -> bool:
        """Whether the cell that contains a point is inside the grid and free."""
        row, column = self.cell_of(x, y)
        return self.holds(row, column) and not bool(self.occupied[row, column])

    def dilated(self, radius: float) -> OccupancyGrid:
        """Return the grid in which a cell is free if a disc at its center fits.

        A cell becomes occupied if the open disc around its center intersects an occupied cell, taken as a square, or
        leaves the grid. `occupancy` enlarges obstacles by less than a cell, which is conservative; a position differs
        from the center of its cell by up to half a diagonal, which is not.

        Raises:
            OptionError: the radius is negative or not finite.
        """
        if not (0.0 <= radius < math.inf):
            raise OptionError(f"dilation radius {radius} must be a length of at least 0 m")
        cells = radius / self.resolution
        reach = max(0, math.ceil(cells + 0.5))
        gap = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0.0)
        kernel = np.hypot(gap[:, None], gap[None, :]) < cells - TOUCH / self.resolution
        kernel[reach, reach] = True
        grown = cv2.dilate(
            self.occupied.astype(np.uint8), kernel.astype(np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=(1,)
        )
        return OccupancyGrid(grown.astype(bool), self.resolution, self.origin)

    @cached_property
    def components(self) -> NDArray[np.int32]:
        """Labels of the connected free regions, (ny, nx): 0 for occupied cells, 1 and above for free ones.

        Cells are connected through their sides. A diagonal step without corner cutting requires that both adjacent
        cells are free, so these are also the regions of the 8-connected search.
        """
        _, labels = cv2.connectedComponents((~self.occupied).astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
        return np.asarray(labels, dtype=np.int32)

    def connected(self, start: tuple[float, float], goal: tuple[float, float]) -> bool:
        """Whether a path between two points exists: both cells are free and in the same region."""
        if not (self.free(*start) and self.free(*goal)):
            return False
        return bool(self.components[self.cell_of(*start)] == self.components[self.cell_of(*goal)])


def occupancy(plan: FloorPlan, resolution: float = RESOLUTION, below: float = OBSTACLE_HEIGHT) -> OccupancyGrid:
    """Rasterize a floor plan.

    A cell is occupied if its interior intersects the footprint of an obstacle, a wall or a column, or extends outside
    the floor. A footprint that only touches the cell does not count. The grid covers the bounds of the floor with its
    walls, and its cells begin at multiples of the resolution.

    Args:
        plan: the layout.
        resolution: side of a cell, meters.
        below: objects whose bottom is above this height are ignored, meters.

    Raises:
        OptionError: the resolution is not positive, or gives more than four million cells.
    """
    barriers = Barriers.of(plan, below)
    width, depth = (barriers.high - barriers.low).tolist()
    if not (resolution > 0.0) or width * depth / resolution**2 > MAX_CELLS:
        raise OptionError(f"resolution {resolution} m must be positive and give at most {MAX_CELLS} cells")
    boxes = barriers.obstacles.sources
    first = [math.floor(edge / resolution + TOUCH) for edge in barriers.low.tolist()]
    columns, rows = (math.ceil(e / resolution - TOUCH) - f for e, f in zip(barriers.high.tolist(), first, strict=True))
    origin = first[0] * resolution, first[1] * resolution
    occupied = np.zeros((rows, columns), dtype=bool)
    _mark(occupied, [replace(box, x=box.x - origin[0], y=box.y - origin[1]) for box in boxes], resolution)
    grid = OccupancyGrid(occupied, resolution, origin)
    return OccupancyGrid(occupied | ~_on_floor(grid, barriers), resolution, origin)


def _on_floor(grid: OccupancyGrid, barriers: Barriers) -> NDArray[np.bool_]:
    """Return the free cells of the regions that are on the floor, (ny, nx).

    Walls enclose the floor, so a region of free cells is on it if any of its cells has its center there.
    """
    regions, (x, y) = grid.components, grid.centres()
    reached = np.zeros(int(regions.max(initial=0)) + 1, dtype=bool)
    # Few cells tell for most regions; only the cells of the others are looked up one by one.
    for stride in (SAMPLES, 1):
        rows, columns = np.nonzero(~reached[regions[::stride, ::stride]] & ~grid.occupied[::stride, ::stride])
        inside = barriers.inside(np.column_stack([x[columns * stride], y[rows * stride]]))
        reached[regions[rows[inside] * stride, columns[inside] * stride]] = True
    return np.asarray(reached[regions])


def _mark(occupied: NDArray[np.bool_], boxes: Iterable[OrientedBox], resolution: float) -> None:
    """Set the cells that oriented rectangles overlap (separating-axis test between cell and rectangle)."""
    ny, nx = occupied.shape
    for box in boxes:
        x0, y0, x1, y1 = (edge / resolution for edge in box.bounds())
        c0, c1 = max(0, math.floor(x0 + TOUCH)), min(nx, math.ceil(x1 - TOUCH))
        r0, r1 = max(0, math.floor(y0 + TOUCH)), min(ny, math.ceil(y1 - TOUCH))
        if c0 >= c1 or r0 >= r1:
            continue
        cosine, sine = math.cos(box.yaw), math.sin(box.yaw)
        if min(abs(cosine), abs(sine)) < TOUCH:
            occupied[r0:r1, c0:c1] = True
            continue
        dx = (np.arange(c0, c1) + 0.5)[None, :] * resolution - box.x
        dy = (np.arange(r0, r1) + 0.5)[:, None] * resolution - box.y
        reach = resolution / 2.0 * (abs(cosine) + abs(sine)) - TOUCH
        along = np.abs(dx * cosine + dy * sine) < box.width / 2.0 + reach
        across = np.abs(dy * cosine - dx * sine) < box.depth / 2.0 + reach
        occupied[r0:r1, c0:c1] |= along & across
