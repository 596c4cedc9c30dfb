"""What the depth camera has shown of the floor so far: cells that are occupied, free, or not seen yet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE, RANGE, pixel_slopes
from labgym.errors import OptionError
from labgym.navigation import OBSTACLE_HEIGHT, RESOLUTION, OccupancyGrid, Pose

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Point = tuple[float, float]

FLOOR_HEIGHT = 0.05
"""Returns from below this height are the floor, metres."""

DEEPER = 0.01
"""How far behind the surface that it shows a return is entered, metres: surfaces often lie on the edge of a cell."""

SUBPIXEL_BITS = 8


@dataclass(frozen=True, eq=False)
class KnownFloor:
    """A part of the map at one moment.

    Attributes:
        grid: cells in which something was seen are occupied; it includes some unseen floor on every side.
        unknown: (ny, nx), cells that were never seen; specks narrower than three cells are left out.
    """

    grid: OccupancyGrid
    unknown: Mask


class DepthMap:
    """A map of the floor that grows with each depth picture, in the frame in which the poses are given.

    The inverse sensor model is that of an exact camera in a place where nothing moves: what was seen stays. A
    return between 5 cm and 1.40 m above the floor, where it would be in the robot's way, occupies the cell that
    it lies in, and no later picture frees that cell: near the robot the picture's cone passes over low things and under
    high ones, so that seeing past a place does not clear it. In each column of the picture the floor from the lens
    to the nearest such return is free. Columns are vertical planes because the camera is level.

    Args:
        reach: the map covers [-reach, reach] along x and y, metres; what lies beyond is not entered.
        robot: gives the camera's place and field of view.
        resolution: side of a cell, metres.

    Raises:
        OptionError: the reach or the resolution is not positive.
    """

    def __init__(self, reach: float, robot: RobotSpec = ROBOT, resolution: float = RESOLUTION) -> None:
        if not (0.0 < resolution < reach < math.inf):
            raise OptionError(f"reach {reach} m and resolution {resolution} m of a map must be positive, reach larger")
        side = 2 * math.ceil(reach / resolution)
        self.resolution = resolution
        self._robot = robot
        self._origin = -side / 2 * resolution
        self._occupied = np.zeros((side, side), dtype=bool)
        self._seen = np.zeros((side, side), dtype=np.uint8)
        self._left, self._up = pixel_slopes(robot)

    def add(self, depth: ArrayLike, pose: Pose) -> Array:
        """Enter a depth picture that was taken from a pose.

        Args:
            depth: planar depth, 72 x 128 metres in any shape, rows from the top.
            pose: (x, y, yaw) of the robot's axis.

        Returns:
            Centres of the cells that became occupied, (n, 2) metres.

        Raises:
            OptionError: the picture has another number of pixels.
        """
        picture = np.asarray(depth, dtype=np.float64)
        if picture.size != math.prod(IMAGE_SHAPE):
            raise OptionError(f"depth picture of shape {picture.shape} must have {IMAGE_SHAPE} pixels")
        picture = picture.reshape(IMAGE_SHAPE)
        height = self._robot.camera_height + picture * self._up[:, None]
        solid = (picture < RANGE) & (height >= FLOOR_HEIGHT) & (height < OBSTACLE_HEIGHT)
        nearest = np.where(solid, picture, RANGE).min(axis=0)
        self._see(nearest, pose)
        _, columns = np.nonzero(solid)
        ahead = picture[solid] + DEEPER
        return self.occupy(self._outward(ahead, ahead * self._left[columns], pose))

    def occupy(self, points: Array) -> Array:
        """Occupy the cells that hold points (m, 2) of the map's frame, metres; return as `add` does."""
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
        """Return the part of the map that holds everything seen and some points.

        Args:
            around: (m, 2) points, metres.
            margin: how much farther it extends on every side, metres; cells there that were not seen are unknown.
        """
        cells = np.floor((np.asarray(around, dtype=np.float64).reshape(-1, 2) - self._origin) / self.resolution)
        spare, side = math.ceil(margin / self.resolution), len(self._seen)
        spans = []
        for axis in range(2):
            seen = np.flatnonzero(self._seen.any(axis=axis))
            ends = np.concatenate([seen, cells[:, axis]])
            low, high = int(ends.min(initial=side)) - spare, int(ends.max(initial=0)) + spare + 1
            spans.append((min(max(low, 0), side - 1), min(max(high, 1), side)))
        (x0, x1), (y0, y1) = spans
        origin = (self._origin + x0 * self.resolution, self._origin + y0 * self.resolution)
        grid = OccupancyGrid(self._occupied[y0:y1, x0:x1].copy(), self.resolution, origin)
        unseen = (self._seen[y0:y1, x0:x1] == 0).astype(np.uint8)
        unknown = cv2.morphologyEx(unseen, cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8))
        return KnownFloor(grid, unknown.astype(bool))

    def _see(self, nearest: Array, pose: Pose) -> None:
        """Mark as seen the floor from the lens to the nearest return of each column, and under the robot."""
        depths = np.concatenate([[0.0], nearest])
        outline = self._outward(depths, depths * np.concatenate([[0.0], self._left]), pose)
        cv2.fillPoly(self._seen, [self._fixed_point(outline)], (1,), shift=SUBPIXEL_BITS)
        (centre,) = self._fixed_point(np.array([pose[:2]])).tolist()
        radius = round(self._robot.chassis_radius / self.resolution * 2**SUBPIXEL_BITS)
        cv2.circle(self._seen, centre, radius, (1,), cv2.FILLED, shift=SUBPIXEL_BITS)

    def _outward(self, ahead: Array, left: Array, pose: Pose) -> Array:
        """Express points given from the lens, each (n,) metres ahead and to the left, in the map's frame, (n, 2)."""
        x, y, yaw = pose
        forward = ahead + self._robot.camera_forward
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return np.column_stack([x + cosine * forward - sine * left, y + sine * forward + cosine * left])

    def _fixed_point(self, points: Array) -> NDArray[np.int32]:
        """Return points (n, 2) as OpenCV's drawing takes them: cells from the first one's centre, in fixed point."""
        cells = (points - self._origin) / self.resolution - 0.5
        return np.asarray(np.rint(cells * 2**SUBPIXEL_BITS), dtype=np.int32)
