"""Via points from a single range scan: points from which the rest of the way seems open."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, rotate, to_local
from labgym.navigation import Pose

Mask = NDArray[np.bool_]
Point = tuple[float, float]


@dataclass(frozen=True)
class ViaPointOptions:
    """Options of `ViaPoints`.

    Attributes:
        directions: number of bearings of the candidates.
        step, reach: distances of the candidates are multiples of `step` up to `reach`, meters.
        gain: length by which another way must be shorter to replace the current one, meters.
        arrived: distance within which a via point counts as reached, meters.
        goal_radius: obstacles nearer to the goal than this do not block the way to it, meters.
    """

    directions: int = 60
    step: float = 0.5
    reach: float = 6.0
    gain: float = 0.5
    arrived: float = 0.35
    goal_radius: float = 0.4


class ViaPoints:
    """Chooses the target of each scan: the goal if the straight way to it is open, else a via point.

    A via point can be reached on a straight line, and nothing in the scan blocks the straight line from it to the goal;
    space that the scan does not see counts as open. The one with the shortest total way is chosen and kept until the
    robot reaches it, a scan shows it blocked, or another is shorter by a margin. If there is no via point, the
    farthest point that can be reached on a straight line is chosen and kept in the same way.

    Args:
        goal: (x, y) in the fixed frame of the poses, meters.
        options: options of the candidates.
    """

    def __init__(self, goal: Point, options: ViaPointOptions | None = None) -> None:
        self._goal = goal
        self._options = options or ViaPointOptions()
        self._chosen: Point | None = None
        self._leads_on = False

    def target(self, points: Array, pose: Pose, radius: float) -> Point:
        """Return the point to steer for, in the fixed frame.

        Args:
            points: (m, 2) hits of the present scan in the robot frame, meters.
            pose: (x, y, yaw) in the fixed frame.
            radius: radius of the disc that must fit along the way, meters.
        """
        goal = _local(self._goal, pose)
        scan = _Scan(points, goal, radius, self._options.goal_radius)
        if scan.leads_on(np.zeros((1, 2)))[0]:
            self._chosen = None
            return self._goal
        candidates = self._candidates(scan)
        length = np.linalg.norm(candidates, axis=1)
        cost = np.where(scan.leads_on(candidates), length + np.linalg.norm(goal - candidates, axis=1), math.inf)
        present = self._present_length(scan, pose)
        best = cost.min(initial=math.inf)
        if self._chosen is not None and present is not None and present <= best + self._options.gain:
            return self._chosen
        if len(candidates) == 0:
            self._chosen = None
            return self._goal
        self._leads_on = bool(np.isfinite(cost).any())
        via = candidates[int(np.argmin(cost) if self._leads_on else np.argmax(length))]
        x, y = rotate(float(via[0]), float(via[1]), pose[2])
        self._chosen = pose[0] + x, pose[1] + y
        return self._chosen

    def _present_length(self, scan: _Scan, pose: Pose) -> float | None:
        """Return the length of the way over the present via point; None if it has to be replaced."""
        if self._chosen is None:
            return None
        via = _local(self._chosen, pose)[None]
        length = float(np.linalg.norm(via))
        if length < self._options.arrived or not scan.reaches(via)[0]:
            return None
        if not self._leads_on:
            return math.inf
        return length + float(np.linalg.norm(scan.goal - via)) if scan.leads_on(via)[0] else None

    def _candidates(self, scan: _Scan) -> Array:
        """Return the points that can be reached on a straight line, (n, 2) in the robot frame."""
        options = self._options
        angles = np.linspace(-math.pi, math.pi, options.directions, endpoint=False)
        heading = np.column_stack([np.cos(angles), np.sin(angles)])
        distances = np.arange(1, round(options.reach / options.step) + 1) * options.step
        free = straight_clearance(np.zeros_like(heading), heading, scan.points, scan.radius)
        reached = distances <= free[:, None]
        return np.asarray((distances[:, None] * heading[:, None, :])[reached])


@dataclass(frozen=True, eq=False)
class _Scan:
    """The present scan, in the robot frame.

    Attributes:
        points: (m, 2) hits.
        goal: (2,).
        radius: radius of the disc.
        goal_radius: obstacles nearer to the goal than this do not block the way to it.
    """

    points: Array
    goal: Array
    radius: float
    goal_radius: float

    def reaches(self, ends: Array) -> Mask:
        """Return whether the robot can drive straight to points (n, 2)."""
        return _open(np.zeros_like(ends), ends, self.points, self.radius)

    def leads_on(self, starts: Array) -> Mask:
        """Return whether the straight way from points (n, 2) to the goal is open."""
        obstacles = self.points[np.linalg.norm(self.points - self.goal, axis=1) > self.goal_radius]
        return _open(starts, np.broadcast_to(self.goal, starts.shape), obstacles, self.radius)


def straight_clearance(starts: Array, headings: Array, points: Array, radius: float) -> Array:
    """Return the distance that a disc travels straight before it touches a point.

    A point that the disc touches at the start counts, with distance 0, if the motion leads towards it.

    Args:
        starts: (n, 2) of the disc's center.
        headings: (n, 2) unit vectors.
        points: (m, 2).
        radius: radius of the disc.

    Returns:
        (n,) meters; inf if it meets no point.
    """
    x, y = (points[:, axis] - starts[:, axis, None] for axis in range(2))
    along = headings[:, :1] * x + headings[:, 1:] * y
    across = headings[:, :1] * y - headings[:, 1:] * x
    chord = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    met = (np.abs(across) < radius) & (along > 0.0)
    return np.asarray(np.where(met, np.maximum(along - chord, 0.0), math.inf).min(axis=1, initial=math.inf))


def _open(starts: Array, ends: Array, points: Array, radius: float) -> Mask:
    """Return whether a disc can travel straight from starts (n, 2) to ends (n, 2) past points (m, 2)."""
    step = ends - starts
    length = np.linalg.norm(step, axis=1)
    headings = step / np.maximum(length, 1e-9)[:, None]
    return np.asarray(straight_clearance(starts, headings, points, radius) >= length)


def _local(point: Point, pose: Pose) -> Array:
    """Return a point of the fixed frame in the robot frame, (2,)."""
    return np.asarray(to_local([point], pose)[0])
