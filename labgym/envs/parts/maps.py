"""Privileged sensors: the map around the robot, and the objects in the picture."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.assets import Catalog
from labgym.envs.checks import MAX_CELLS, count, positive
from labgym.envs.parts.noise import NoisySensor
from labgym.envs.parts.protocols import Noise, Reading
from labgym.envs.parts.rays import CameraSensor
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.layouts import Layout
from labgym.navigation import OccupancyGrid, occupancy

NOTHING, BUILDING, OTHER = 0, 1, 2
"""Labels of nothing within reach, of floor and walls, and of assets that the catalog lacks."""


@registered("sensor", "occupancy", frozen=False)
class OccupancySensor(NoisySensor):
    """The true map around the robot, in its frame: (cells, cells, 1) uint8, 255 where occupied, else 0. Privileged.

    The robot is at the center and drives upwards in the picture: rows run from ahead to behind, columns from left to
    right. Outside the floor everything is occupied.

    Attributes:
        cells: number of cells along each side. resolution: side of a cell, meters.
    """

    name: str = "occupancy"
    cells: int = 64
    resolution: float = 0.1
    noise: tuple[Noise, ...] = ()

    def __post_init__(self) -> None:
        count(self, "cells", most=MAX_CELLS)
        positive(self, "resolution")
        super().__post_init__()
        self._layout: Layout | None = None
        steps = (np.arange(self.cells) - (self.cells - 1) / 2.0) * self.resolution
        self._ahead, self._left = -steps[:, None], -steps[None, :]

    @property
    def space(self) -> spaces.Space[Any]:
        """An 8-bit image."""
        return spaces.Box(0, 255, (self.cells, self.cells, 1), np.uint8)

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Draw the map of a new layout."""
        if self._layout is not state.task.layout:
            self._layout = state.task.layout
            self._grid: OccupancyGrid = occupancy(self._layout)

    def measured(self, state: State) -> Reading:
        """Return the picture."""
        x, y, yaw = state.pose
        cosine, sine = math.cos(yaw), math.sin(yaw)
        (x0, y0), grid = self._grid.origin, self._grid
        columns = np.floor((x + cosine * self._ahead - sine * self._left - x0) / grid.resolution).astype(np.int64)
        rows = np.floor((y + sine * self._ahead + cosine * self._left - y0) / grid.resolution).astype(np.int64)
        ny, nx = grid.shape
        inside = (rows >= 0) & (rows < ny) & (columns >= 0) & (columns < nx)
        occupied = np.ones(inside.shape, dtype=bool)
        occupied[inside] = grid.occupied[rows[inside], columns[inside]]
        return np.where(occupied, np.uint8(255), np.uint8(0))[:, :, None]


@registered("sensor", "segmentation")
class SegmentationSensor(CameraSensor):
    """The asset that each pixel of a camera shows: (rows * columns,) int32, labels as in `asset_labels`. Privileged.

    `reshape(rows, columns)` gives the image, first row at the top.
    """

    name: str = "segmentation"

    @property
    def space(self) -> spaces.Space[Any]:
        """All labels."""
        return spaces.Box(0, OTHER + len(asset_labels()), (self.rows * self.columns,), np.int32)

    def measured(self, state: State) -> Reading:
        """Return the labels."""
        faces, layout = self._view(state).faces, state.task.layout
        owners = state.rays("visual").owners(np.maximum(faces, 0))
        labels: NDArray[np.int32] = np.where(faces >= 0, _table(layout)[owners], np.int32(NOTHING))
        return labels.astype(np.int32, copy=False)


@cache
def asset_labels() -> dict[str, int]:
    """Return the label of each asset of the catalog by its name: 3, 4, ... in the order of the names.

    0 is nothing within reach, 1 floor and walls, 2 an asset that the catalog lacks.
    """
    return {name: OTHER + 1 + index for index, name in enumerate(Catalog.load().names)}


def _table(layout: Layout) -> NDArray[np.int32]:
    """Return the labels of the placements of a layout, and last that of floor and walls (owner -1)."""
    labels = asset_labels()
    return np.array([*(labels.get(each.asset, OTHER) for each in layout.placements), BUILDING], dtype=np.int32)
