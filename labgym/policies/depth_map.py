"""A map of the floor from depth images: cells that are occupied, free or unseen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE, RANGE, pixel_slopes
from labgym.errors import OptionError
from labgym.geometry import Array, to_world
from labgym.navigation import OBSTACLE_HEIGHT, RESOLUTION, OccupancyGrid, Pose

Mask = NDArray[np.bool_]
Point = tuple[float, float]

FLOOR_HEIGHT_M = 0.05
"""Returns below this height are the floor, meters."""

RETURN_DEPTH_M = 0.01
"""Distance behind its surface at which a return is entered, meters: surfaces often lie on the edge of a cell."""

NOISY_RANGE_M = 3.0
"""Depth up to which a camera with errors is used, meters: beyond, a pixel that shows its neighbor's depth is off by a
robot's margin."""
NOISY_ROWS = 2.0
"""Rows of the image by which such a camera errs: the height below which a return is the floor grows with the depth."""

SUBPIXEL_BITS = 8


@dataclass(frozen=True, eq=False)
class KnownFloor:
    """A part of the map at one moment.

    Attributes:
        grid: cells with a return are occupied; it includes some unseen floor on every side.
        unknown: (ny, nx), unseen cells; specks narrower than three cells are left out.
    """

    grid: OccupancyGrid
    unknown: Mask


class DepthMap:
    """A map of the floor that grows with each depth image, in the frame of the poses.

    The inverse sensor model assumes an exact camera and a static world. A return between 5 cm and 1.40 m above the
    floor, the height of the robot, occupies its cell, and no later image frees that cell: near the robot the camera
    looks over low objects and under high ones, so that seeing past a place does not clear it. In each column of the
    image, the floor from the lens to the nearest such return is free. Columns are vertical planes because the camera
    is level. A depth of 0 is a lost reading, and says nothing.

    Args:
        reach: the map covers [-reach, reach] along x and y, meters; returns beyond are ignored.
        robot: gives the pose and field of view of the camera.
        resolution: side of a cell, meters.
        noisy: whether the camera has errors, of up to two rows and columns: it is then used up to 3 m.

    Raises:
        OptionError: the reach or the resolution is not positive.
    """

    def __init__(
        self, reach: float, robot: RobotSpec = ROBOT, resolution: float = RESOLUTION, noisy: bool = False
    ) -> None:
        if not (0.0 < resolution < reach < math.inf):
            raise OptionError(f"map: reach is {reach} m and resolution {resolution} m; expected 0 < resolution < reach")
        side = 2 * math.ceil(reach / resolution)
        self.resolution = resolution
        self._robot = robot
        self._origin = -side / 2 * resolution
        self._occupied = np.zeros((side, side), dtype=bool)
        self._seen = np.zeros((side, side), dtype=np.uint8)
        self._left, self._up = pixel_slopes(hfov=robot.camera_hfov)
        self._range = NOISY_RANGE_M if noisy else RANGE
        self._slack = NOISY_ROWS * abs(float(self._up[1] - self._up[0])) if noisy else 0.0

    def add(self, depth: ArrayLike, pose: Pose) -> Array:
        """Add a depth image taken from a pose.

        Args:
            depth: planar depth, 72 x 128 meters in any shape, rows from the top.
            pose: (x, y, yaw) of the robot's axis.

        Returns:
            Centers of the newly occupied cells, (n, 2) meters.

        Raises:
            OptionError: the image has another number of pixels.
        """
        picture = np.asarray(depth, dtype=np.float64)
        if picture.size != math.prod(IMAGE_SHAPE):
            raise OptionError(f"depth image has shape {picture.shape}; expected {IMAGE_SHAPE} pixels")
        picture = picture.reshape(IMAGE_SHAPE)
        height = self._robot.camera_height + picture * self._up[:, None]
        floor = FLOOR_HEIGHT_M + self._slack * picture
        solid = (picture > 0.0) & (picture < self._range) & (height >= floor) & (height < OBSTACLE_HEIGHT)
        nearest = np.where(solid, picture, self._range).min(axis=0)
        self._see(nearest, pose)
        _, columns = np.nonzero(solid)
        ahead = picture[solid] + RETURN_DEPTH_M
        return self.occupy(self._outward(ahead, ahead * self._left[columns], pose))

    def occupy(self, points: Array) -> Array:
        """Occupy the cells of points (m, 2), meters; return the centers of the newly occupied ones, (n, 2) meters."""
        cells = np.floor((points - self._origin) / self.resolution).astype(np.intp)
        side = len(self._occupied)
        columns, rows = cells[((cells >= 0) & (cells < side)).all(axis=1)].T
        fresh = ~self._occupied[rows, columns]
        numbers = np.unique(rows[fresh] * side + columns[fresh])
        self._occupied.ravel()[numbers] = True
        self._seen.ravel()[numbers] = 1
        rows, columns = np.divmod(numbers, side)
        return self._origin + (np.column_stack([columns, rows]) + 0.5) * self.resolution

    def known(self, around: ArrayLike, margin: float) -> KnownFloor:
        """Return the part of the map that contains all seen cells and some points.

        Args:
            around: (m, 2) points, meters.
            margin: added on every side, meters.
        """
        cells = np.floor((np.asarray(around, dtype=np.float64).reshape(-1, 2) - self._origin) / self.resolution)
        spare, side = math.ceil(margin / self.resolution), len(self._seen)
        spans = []
        for axis in range(2):
            inside = np.flatnonzero(self._seen.any(axis=axis))
            ends = np.concatenate([inside, cells[:, axis]])
            low, high = int(ends.min(initial=side)) - spare, int(ends.max(initial=0)) + spare + 1
            spans.append((min(max(low, 0), side - 1), min(max(high, 1), side)))
        (x0, x1), (y0, y1) = spans
        origin = (self._origin + x0 * self.resolution, self._origin + y0 * self.resolution)
        grid = OccupancyGrid(self._occupied[y0:y1, x0:x1].copy(), self.resolution, origin)
        unseen = (self._seen[y0:y1, x0:x1] == 0).astype(np.uint8)
        unknown = cv2.morphologyEx(unseen, cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8))
        return KnownFloor(grid, unknown.astype(bool))

    def window(self, place: Point, reach: float) -> OccupancyGrid:
        """Return the occupied cells in a square, cut off at the edge of the map.

        Args:
            place: center of the square, meters; on the map. reach: half its side, meters.
        """
        side = len(self._occupied)
        (x0, x1), (y0, y1) = (
            (
                max(math.floor((each - reach - self._origin) / self.resolution), 0),
                min(math.ceil((each + reach - self._origin) / self.resolution), side),
            )
            for each in place
        )
        origin = (self._origin + x0 * self.resolution, self._origin + y0 * self.resolution)
        return OccupancyGrid(self._occupied[y0:y1, x0:x1].copy(), self.resolution, origin)

    def _see(self, nearest: Array, pose: Pose) -> None:
        """Mark the floor under the robot and from the lens to the nearest return of each column as seen."""
        depths = np.concatenate([[0.0], nearest])
        outline = self._outward(depths, depths * np.concatenate([[0.0], self._left]), pose)
        cv2.fillPoly(self._seen, [self._fixed_point(outline)], (1,), shift=SUBPIXEL_BITS)
        (centre,) = self._fixed_point(np.array([pose[:2]])).tolist()
        radius = round(self._robot.chassis_radius / self.resolution * 2**SUBPIXEL_BITS)
        cv2.circle(self._seen, centre, radius, (1,), cv2.FILLED, shift=SUBPIXEL_BITS)

    def _outward(self, ahead: Array, left: Array, pose: Pose) -> Array:
        """Return the points `ahead` and `left` of the lens, each (n,) meters, in the map's frame, (n, 2)."""
        return to_world(np.column_stack([ahead + self._robot.camera_forward, left]), pose)

    def _fixed_point(self, points: Array) -> NDArray[np.int32]:
        """Return points (n, 2) in OpenCV's drawing coordinates: cells from the first one's center, in fixed point."""
        cells = (points - self._origin) / self.resolution - 0.5
        return np.asarray(np.rint(cells * 2**SUBPIXEL_BITS), dtype=np.int32)
