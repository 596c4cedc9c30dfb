"""A map around the robot that grows with the readings of the lidar."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs.checks import MAX_CELLS, count, positive
from labgym.envs.wrappers.checks import observed, point_nav

FREE, UNKNOWN, OCCUPIED = 0, 127, 255
"""Values of the cells."""

Pose = tuple[float, float, float]


class EgocentricMap(gym.ObservationWrapper[Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Add a map around the robot to the observation, drawn from the lidar alone since the start of the episode.

    The entry is uint8, (cells, cells, 1): 0 free, 127 not seen yet, 255 occupied. The robot is at the center and drives
    upwards in the picture: rows run from ahead to behind, columns from left to right, as in the privileged sensor
    "occupancy". Readings are put together by the entry "odometry" if the observation has one, with its drift, otherwise
    by the true pose. Cells beyond the window are remembered. Of two readings of a cell the later one counts; a cell is
    free where both rays next to its center reach beyond it.

    Args:
        env: an environment with the entry "lidar".
        cells: number of cells along each side. resolution: side of a cell, meters. name: of the entry.

    Raises:
        OptionError: an argument is out of range, or the observation has no lidar or has an entry of this name.
    """

    def __init__(self, env: gym.Env[Any, Any], cells: int = 64, resolution: float = 0.1, name: str = "map") -> None:
        gym.utils.RecordConstructorArgs.__init__(self, cells=cells, resolution=resolution, name=name)
        gym.ObservationWrapper.__init__(self, env)
        self.cells, self.resolution, self.name = cells, resolution, name
        count(self, "cells", most=MAX_CELLS)
        positive(self, "resolution")
        point_nav(env, "EgocentricMap")
        space = observed(env, "EgocentricMap", "lidar", name)
        self._reach = float(space["lidar"].high.max())  # type: ignore[attr-defined]
        self._reckoned = "odometry" in space.spaces
        picture = spaces.Box(FREE, OCCUPIED, (cells, cells, 1), np.uint8)
        self.observation_space = spaces.Dict({**space.spaces, name: picture})
        steps = (np.arange(cells, dtype=np.float64) - (cells - 1) / 2.0) * resolution
        self._ahead, self._left = -steps[:, None], -steps[None, :]
        self._map = _Map(resolution)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode with an empty map."""
        self._map = _Map(self.resolution)
        return super().reset(seed=seed, options=options)

    def observation(self, observation: Any) -> Any:
        """Return the observation with the map after its reading."""
        pose = self._pose(observation)
        radius = (self.cells / 2.0 + 1.0) * math.sqrt(2.0) * self.resolution
        self._map.add(pose, np.asarray(observation["lidar"], np.float64), self._reach, radius)
        return {**observation, self.name: self._map.around(pose, self._ahead, self._left)[:, :, None]}

    def _pose(self, observation: Any) -> Pose:
        if not self._reckoned:
            return point_nav(self.env, "EgocentricMap").state.pose
        x, y, cosine, sine = (float(value) for value in observation["odometry"][:4])
        return x, y, math.atan2(sine, cosine)


class _Map:
    """Cells in the frame of the poses, in an array that grows.

    Args:
        resolution: side of a cell, meters.
    """

    def __init__(self, resolution: float) -> None:
        self._resolution = resolution
        self._row = self._column = 0
        self._cells: NDArray[np.uint8] = np.empty((0, 0), np.uint8)

    def add(self, pose: Pose, ranges: NDArray[np.float64], reach: float, radius: float) -> None:
        """Draw a reading.

        Args:
            ranges: (n,) meters; ray i points -pi + 2 pi i / n from the heading. reach: ranges from here on hit nothing.
            radius: distance within which cells are drawn, meters.
        """
        x, y, yaw = pose
        side = self._resolution
        row, column = math.floor((y - radius) / side), math.floor((x - radius) / side)
        width = math.ceil(2.0 * radius / side) + 1
        self._grow(row, column, width)
        cells = self._cells[row - self._row :, column - self._column :][:width, :width]
        dy = ((np.arange(width) + row + 0.5) * side - y)[:, None]
        dx = ((np.arange(width) + column + 0.5) * side - x)[None, :]
        turns = (np.arctan2(dy, dx) - yaw + math.pi) / (2.0 * math.pi) * len(ranges)
        before = np.floor(turns).astype(np.int64)
        nearer = np.minimum(ranges[before % len(ranges)], ranges[(before + 1) % len(ranges)])
        cells[np.hypot(dx, dy) <= np.minimum(nearer - side * math.sqrt(0.5), radius)] = FREE
        hits = ranges < min(reach, radius)
        bearing = yaw - math.pi + 2.0 * math.pi / len(ranges) * np.flatnonzero(hits)
        rows = np.floor((y + ranges[hits] * np.sin(bearing)) / side).astype(np.int64) - row
        columns = np.floor((x + ranges[hits] * np.cos(bearing)) / side).astype(np.int64) - column
        cells[rows, columns] = OCCUPIED

    def around(self, pose: Pose, ahead: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the cells at offsets in the frame of a pose, broadcast together."""
        x, y, yaw = pose
        cosine, sine = math.cos(yaw), math.sin(yaw)
        rows = np.floor((y + sine * ahead + cosine * left) / self._resolution).astype(np.int64)
        columns = np.floor((x + cosine * ahead - sine * left) / self._resolution).astype(np.int64)
        return self._cells[rows - self._row, columns - self._column]

    def _grow(self, row: int, column: int, width: int) -> None:
        """Make the array cover a square of cells."""
        if not self._cells.size:
            self._row, self._column = row, column
        rows, columns = self._cells.shape
        below, left = max(self._row - row, 0), max(self._column - column, 0)
        above = max(row + width - self._row - rows, 0)
        right = max(column + width - self._column - columns, 0)
        if below or left or above or right:
            self._cells = np.pad(self._cells, ((below, above), (left, right)), constant_values=UNKNOWN)
            self._row, self._column = self._row - below, self._column - left
