"""Panes of glass: straight lines through single returns, drawn on to where the lidar could not have seen them yet."""

from __future__ import annotations

import math

import numpy as np

from labgym.envs.sensors import LIDAR_RAYS
from labgym.geometry import Array
from labgym.navigation import Pose

LINE_TOLERANCE_M, END_TOLERANCE_M = 0.12, 1.3
"""Distance from a line within which a return belongs to it, and from its ends along it, meters."""
CONTINUATION_M = 0.6
"""Length by which a pane is drawn on beyond what was seen of it, meters."""
SQUARE_COSINE = math.cos(math.radians(7.0))
"""Cosine of the angle to a pane's normal up to which the lidar certainly sees it."""
PASSING_MARGIN_M = 0.15
"""Distance by which a ray must pass a place for nothing to be there, meters."""
CERTAIN_EXTENT_M = 0.3
"""Extent of the part seen from which the direction of a pane is certain, meters."""
FITTED_RETURNS, FITTED_EXTENT_M = 5, 0.15
"""Number of returns and their extent, meters, from which their line is fitted; before, it is square to the ray."""
MOST_RETURNS = 300
"""Greatest number of returns of a pane that are stored."""
PANE_SPACING_M = 0.04
"""Distance between the points of a pane, meters."""


class SeenPane:
    """A pane that was seen in part: a line, the part seen, and the places along it that are known to be open."""

    def __init__(self, point: Array, origin: Array) -> None:
        self._points: list[Array] = [point]
        away = point - origin
        self._square = np.array([-away[1], away[0]]) / max(float(np.linalg.norm(away)), 1e-9)
        self.low, self.high = -math.inf, math.inf
        self._fit()

    def holds(self, point: Array) -> bool:
        """Whether a return belongs to the pane."""
        offset = point - self.middle
        along, across = float(offset @ self.along), float(offset @ self.normal)
        return abs(across) < LINE_TOLERANCE_M and self.first - END_TOLERANCE_M < along < self.last + END_TOLERANCE_M

    def add(self, point: Array) -> None:
        """Take in a return of the pane."""
        if len(self._points) < MOST_RETURNS:
            self._points.append(point)
        place = float((point - self.middle) @ self.along)
        # What was seen is there, whatever a ray suggested.
        self.low, self.high = min(self.low, place), max(self.high, place)
        self._fit()

    def open(self, pose: Pose, ranges: Array) -> None:
        """Note where rays at right angles pass the line beyond what was seen of it, once the line is certain."""
        if self.last - self.first < CERTAIN_EXTENT_M:
            return
        places = np.concatenate([self.first - self._steps, self.last + self._steps])
        points = self.middle + places[:, None] * self.along
        dx, dy = points[:, 0] - pose[0], points[:, 1] - pose[1]
        away = np.maximum(np.hypot(dx, dy), 1e-9)
        bearing = np.arctan2(dy, dx) - pose[2]
        ray = np.round((bearing + math.pi) / (2.0 * math.pi) * LIDAR_RAYS).astype(np.intp) % LIDAR_RAYS
        square = np.abs(dx * self.normal[0] + dy * self.normal[1]) / away > SQUARE_COSINE
        passed = places[square & (ranges[ray] > away + PASSING_MARGIN_M)]
        before, after = passed[passed < self.first], passed[passed > self.last]
        self.low = max(self.low, float(before.max(initial=-math.inf)))
        self.high = min(self.high, float(after.min(initial=math.inf)))

    def points(self, further: float) -> Array:
        """Return points of the pane and of its assumed continuation by a length, meters, (n, 2) meters."""
        first, last = max(self.first - further, self.low), min(self.last + further, self.high)
        count = max(2, math.ceil((last - first) / PANE_SPACING_M) + 1)
        return np.asarray(self.middle + np.linspace(first, last, count)[:, None] * self.along)

    @property
    def _steps(self) -> Array:
        return np.arange(PANE_SPACING_M, CONTINUATION_M + PANE_SPACING_M, PANE_SPACING_M)

    def _fit(self) -> None:
        """Fit the line; places along it are counted from its first return."""
        points = np.array(self._points)
        along = self._square
        if len(points) >= FITTED_RETURNS:
            centered = points - points.mean(axis=0)
            _, sizes, axes = np.linalg.svd(centered, full_matrices=False)
            if float(np.ptp(centered @ axes[0])) > FITTED_EXTENT_M and sizes[1] < 0.3 * sizes[0]:
                along = axes[0] if float(axes[0] @ self._square) > 0.0 else -axes[0]
        self.middle, self.along = points[0], along
        self.normal = np.array([-along[1], along[0]])
        places = (points - self.middle) @ along
        self.first, self.last = float(places.min()), float(places.max())


class SeenPanes:
    """The panes that were seen so far, in a world whose map lacks nothing else."""

    def __init__(self) -> None:
        self._panes: list[SeenPane] = []
        self._further = CONTINUATION_M

    def doubt(self) -> None:
        """Draw panes on by half as much from now on: the robot is stuck."""
        self._further /= 2.0

    def observe(self, pose: Pose, ranges: Array, returns: Array, origins: Array) -> Array:
        """Take in a scan and return points of all panes and of their assumed continuations, (n, 2) meters.

        Args:
            pose: of the robot in the map's frame. ranges: (180,) of the scan, meters.
            returns: (m, 2) those of panes, in the map's frame, meters. origins: (m, 2) from where they were seen.
        """
        for point, origin in zip(returns, origins, strict=True):
            pane = next((each for each in self._panes if each.holds(point)), None)
            if pane is None:
                self._panes.append(SeenPane(point, origin))
            else:
                pane.add(point)
        for pane in self._panes:
            pane.open(pose, ranges)
        return np.concatenate([pane.points(self._further) for pane in self._panes] or [np.empty((0, 2))])
