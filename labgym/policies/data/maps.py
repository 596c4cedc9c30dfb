"""Privileged maps of a layout: the cost of a path at each cell, and the distance to the nearest obstacle."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from labgym.navigation import FloorPlan, OccupancyGrid, occupancy
from labgym.policies.grid_planner import clearance_field

Floats = NDArray[np.float32]

CLEARANCE_M = 0.35
"""Cells whose center is nearer to an obstacle count as non-free, meters: the planning radius plus one cell."""

BLUR_CELLS = 2.0
"""Standard deviation of the Gaussian that smooths the cost map, cells."""

MARGIN_CELLS = 20
"""Cells of wall around the room, so that the cost of a path that leaves the room has a gradient back."""


@dataclass(frozen=True, eq=False)
class Maps:
    """Fields over the floor in cells of 5 cm; row is y, column is x, as in `OccupancyGrid`.

    Attributes:
        cost: (ny, nx), log(1 + blurred depth inside the non-free space in cells): about 0 where the robot fits.
        distance: (ny, nx), from the cell's center to the nearest obstacle, meters.
        origin: room coordinates of the outer corner of cell [0, 0], meters.
        resolution: side of a cell, meters.
    """

    cost: Floats
    distance: Floats
    origin: tuple[float, float]
    resolution: float


def privileged_maps(plan: FloorPlan) -> Maps:
    """Return the maps of a floor plan."""
    room = occupancy(plan)
    shift = MARGIN_CELLS * room.resolution
    walled = np.pad(room.occupied, MARGIN_CELLS, constant_values=True)
    grid = OccupancyGrid(walled, room.resolution, (room.origin[0] - shift, room.origin[1] - shift))
    return Maps(
        cost=cost_map(grid.dilated(CLEARANCE_M).occupied),
        distance=clearance_field(grid).astype(np.float32),
        origin=grid.origin,
        resolution=grid.resolution,
    )


def cost_map(blocked: NDArray[np.bool_]) -> Floats:
    """Return the cost of each cell, (ny, nx): zero away from blocked cells, and higher deeper inside them."""
    depth = cv2.distanceTransform(blocked.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    smooth = gaussian_filter(depth.astype(np.float64), BLUR_CELLS, mode="nearest")
    return np.asarray(np.log1p(smooth), dtype=np.float32)
