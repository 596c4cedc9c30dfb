"""A floor reduced to what a split is described by: its walls as clearances, boxes of furniture, and drives."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.errors import DocumentError
from labgym.geometry import OrientedBox
from labgym.layouts import Layout
from labgym.layouts.rules.building import Entrance, building_of
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.navigation.barriers import Barriers

STEP = 0.1
"""Spacing of the points at which the clearance from walls is stored, meters."""
MAX_BYTES = 64 * 1024**2
"""Largest size of a sketch when unpacked."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FloorSketch:
    """The part of a floor that a description reads.

    Attributes:
        walls: (ny, nx) distance of grid points from walls and columns, meters; 0 outside.
        low: (2,) coordinates of the first point.
        extent: (4,) axis-aligned bounds (x0, y0, x1, y1) of the spaces.
        entrance: (x, y, yaw) of the main door, with the front into the floor.
        furniture: (n, 5) x, y, width, depth and yaw of furniture below the robot's height.
        clutter: (m, 5) the same of loose objects and of open drawers and doors.
    """

    walls: NDArray[np.float16]
    low: Array
    extent: Array
    entrance: Array
    furniture: Array
    clutter: Array

    @property
    def size(self) -> tuple[float, float]:
        """Width and depth of the spaces' bounds, meters."""
        x0, y0, x1, y1 = self.extent.tolist()
        return x1 - x0, y1 - y0

    @property
    def obstacles(self) -> tuple[OrientedBox, ...]:
        """Furniture, loose objects and open parts."""
        return tuple(OrientedBox(*row) for row in np.concatenate([self.furniture, self.clutter]).tolist())

    def to_bytes(self) -> bytes:
        """Return the sketch as a compressed .npz file."""
        stream = io.BytesIO()
        np.savez_compressed(stream, **vars(self))
        return stream.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> FloorSketch:
        """Return the sketch in a .npz file.

        Raises:
            DocumentError: not such a file, or too large.
        """
        try:
            with zipfile.ZipFile(io.BytesIO(data)) as package:
                if sum(member.file_size for member in package.infolist()) > MAX_BYTES:
                    raise DocumentError("sketch", "", f"unpacks to more than {MAX_BYTES} bytes")
            with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
                return cls(**{name: arrays[name] for name in arrays.files})
        except DocumentError:
            raise
        except Exception as error:  # noqa: BLE001 - zipfile, zlib and numpy raise many types for a damaged file
            raise DocumentError("sketch", "", f"not the sketch of a floor ({type(error).__name__})") from None


def sketch_of(tidy: Layout, cluttered: Layout) -> FloorSketch:
    """Return the sketch of a layout, from the layout without and with its clutter."""
    barriers = Barriers.of(cluttered.replace(placements=()))
    xs, ys = (np.arange(low, high, STEP) for low, high in zip(barriers.low, barriers.high, strict=True))
    points = np.stack(np.meshgrid(xs, ys), axis=-1)
    flat = points.reshape(-1, 2)
    clearance = np.where(barriers.inside(flat), np.maximum(barriers.clearance(flat), 0.0), 0.0)
    corners = np.concatenate([box.corners() for space in cluttered.floor.spaces for box in space.boxes])
    furniture = _footprints(tidy)
    standing = set(map(tuple, furniture.tolist()))
    loose = [row for row in _footprints(cluttered).tolist() if tuple(row) not in standing]
    return FloorSketch(
        walls=clearance.reshape(points.shape[:2]).astype(np.float16),
        low=np.array([xs[0], ys[0]]),
        extent=np.concatenate([corners.min(axis=0), corners.max(axis=0)]),
        entrance=np.array(main_entrance(cluttered).pose),
        furniture=furniture,
        clutter=np.array(loose, dtype=np.float64).reshape(-1, 5),
    )


def main_entrance(layout: Layout) -> Entrance:
    """Return the first exit of a floor, seen from inside."""
    return next(entrance for entrance in building_of(layout).entrances if entrance.exit)


def _footprints(layout: Layout) -> Array:
    """Return x, y, width, depth and yaw of the obstacles of a layout, (n, 5)."""
    boxes = layout.obstacles(OBSTACLE_HEIGHT)
    return np.array([(b.x, b.y, b.width, b.depth, b.yaw) for b in boxes], dtype=np.float64).reshape(-1, 5)
