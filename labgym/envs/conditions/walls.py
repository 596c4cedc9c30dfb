"""Where walls and furniture are nearest to people."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray
from labgym.layouts import Layout
from labgym.navigation.barriers import Barriers

Array = NDArray[np.float64]


class Walls:
    """The rectangles that people do not enter; a segment is a rectangle without width.

    Args:
        boxes: the rectangles.
    """

    def __init__(self, boxes: BoxArray) -> None:
        self._center, self._half = np.ascontiguousarray(boxes.centre), np.ascontiguousarray(boxes.half)
        self._cosine, self._sine = np.cos(boxes.yaw), np.sin(boxes.yaw)

    @property
    def boxes(self) -> tuple[Array, Array, Array, Array]:
        """Centers (m, 2) and halves (m, 2), meters, and cosines (m,) and sines (m,) of the rectangles."""
        return self._center, self._half, self._cosine, self._sine

    @classmethod
    def of(cls, layout: Layout) -> Walls:
        """Return the furniture below 1.40 m and the walls of a layout."""
        return cls(Barriers.of(layout).obstacles.boxes)

    def near(self, points: Array, reach: float) -> list[list[tuple[float, float]]]:
        """Return, for each point (n, 2), the vectors to the nearest points of the rectangles within reach, meters."""
        dx = points[:, 0:1] - self._center[:, 0]
        dy = points[:, 1:2] - self._center[:, 1]
        # From the nearest point of a rectangle to the point, in the frame of the rectangle.
        along, across = dx * self._cosine + dy * self._sine, dy * self._cosine - dx * self._sine
        along = along - np.clip(along, -self._half[:, 0], self._half[:, 0])
        across = across - np.clip(across, -self._half[:, 1], self._half[:, 1])
        rows, boxes = np.nonzero(along * along + across * across < reach * reach)
        x, y = along[rows, boxes], across[rows, boxes]
        cosine, sine = self._cosine[boxes], self._sine[boxes]
        vectors: list[list[tuple[float, float]]] = [[] for _ in range(len(points))]
        for row, wx, wy in zip(
            rows.tolist(), (y * sine - x * cosine).tolist(), (-x * sine - y * cosine).tolist(), strict=True
        ):
            vectors[row].append((wx, wy))
        return vectors
