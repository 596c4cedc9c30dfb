"""A point to head for, read from a single range scan: one from which the rest of the way seems open."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import rotate
from labgym.navigation import Pose

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Point = tuple[float, float]


@dataclass(frozen=True)
class ViaPointOptions:
    """Which points are considered.

    Attributes:
        directions: bearings of the candidates.
        step, reach: their distances are multiples of `step` up to `reach`, metres.
        gain: by how much a new way must be shorter for the one chosen before to be left, metres.
        arrived: a via point is passed within this distance, metres.
        goal_radius: what stands nearer to the goal than this does not block the way to it, metres.
    """

    directions: int = 60
    step: float = 0.5
    reach: float = 6.0
    gain: float = 0.5
    arrived: float = 0.35
    goal_radius: float = 0.4


class ViaPoints:
    """Chooses what to steer for, scan by scan: the goal where the straight way to it is open, else a via point.

    A via point can be reached straight, and nothing in the scan blocks the straight line from it to the goal; what the
    scan does not see is taken for open. Of these it takes the one with the shortest way in all, and stays with
    it until the robot is there, a scan shows it blocked, or another is shorter by a margin. Where there is none it
    takes the farthest point that can be reached straight, and stays with it likewise.

    Args:
        goal: (x, y) in the fixed frame of the poses, metres.
        options: which points are considered.
    """

    def __init__(self, goal: Point, options: ViaPointOptions | None = None) -> None:
        self._goal = goal
        self._options = options or ViaPointOptions()
        self._chosen: Point | None = None
        self._leads_on = False

    def target(self, points: Array, pose: Pose, radius: float) -> Point:
        """Return the point to steer for, in the fixed frame.

        Args:
            points: (m, 2) returns of the present scan in the robot frame, metres.
            pose: (x, y, yaw) in the fixed frame.
            radius: of the disc that must fit along the way, metres.
        """
        goal = _local(self._goal, pose)
        scan = _Scan(points, goal, radius, self._options.goal_radius)
        if scan.leads_on(np.zeros((1, 2)))[0]:
            self._chosen = None
            return self._goal
        candidates = self._candidates(scan)
        length = np.linalg.norm(candidates, axis=1)
        cost = np.where(scan.leads_on(candidates), length + np.linalg.norm(goal - candidates, axis=1), math.inf)
        kept = self._kept(scan, pose)
        if self._chosen is not None and kept is not None and kept <= cost.min(initial=math.inf) + self._options.gain:
            return self._chosen
        if len(candidates) == 0:
            self._chosen = None
            return self._goal
        self._leads_on = bool(np.isfinite(cost).any())
        best = candidates[int(np.argmin(cost) if self._leads_on else np.argmax(length))]
        x, y = rotate(float(best[0]), float(best[1]), pose[2])
        self._chosen = pose[0] + x, pose[1] + y
        return self._chosen

    def _kept(self, scan: _Scan, pose: Pose) -> float | None:
        """Return the length of the way over the via point chosen before; None where it is to be left."""
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
        """Return the points that can be reached straight, (n, 2) in the robot frame."""
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
        points: (m, 2) returns. goal: (2,). radius: of the disc.
        goal_radius: what is nearer to the goal does not block the way to it.
    """

    points: Array
    goal: Array
    radius: float
    goal_radius: float

    def reaches(self, ends: Array) -> Mask:
        """Whether the robot can go straight to points (n, 2)."""
        return _open(np.zeros_like(ends), ends, self.points, self.radius)

    def leads_on(self, starts: Array) -> Mask:
        """Whether the straight way from points (n, 2) to the goal is open."""
        in_the_way = self.points[np.linalg.norm(self.points - self.goal, axis=1) > self.goal_radius]
        return _open(starts, np.broadcast_to(self.goal, starts.shape), in_the_way, self.radius)


def straight_clearance(starts: Array, headings: Array, points: Array, radius: float) -> Array:
    """Return how far a disc goes straight before it touches a point.

    A point that it touches from the start counts, at 0, where the motion leads towards it.

    Args:
        starts: (n, 2) of the disc's centre. headings: (n, 2) unit vectors.
        points: (m, 2).
        radius: of the disc.

    Returns:
        (n,) metres; inf where it meets none.
    """
    x, y = (points[:, axis] - starts[:, axis, None] for axis in range(2))
    along = headings[:, :1] * x + headings[:, 1:] * y
    across = headings[:, :1] * y - headings[:, 1:] * x
    chord = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    met = (np.abs(across) < radius) & (along > 0.0)
    return np.asarray(np.where(met, np.maximum(along - chord, 0.0), math.inf).min(axis=1, initial=math.inf))


def _open(starts: Array, ends: Array, points: Array, radius: float) -> Mask:
    """Whether a disc can go straight from starts (n, 2) to ends (n, 2) past points (m, 2)."""
    step = ends - starts
    length = np.linalg.norm(step, axis=1)
    headings = step / np.maximum(length, 1e-9)[:, None]
    return np.asarray(straight_clearance(starts, headings, points, radius) >= length)


def _local(point: Point, pose: Pose) -> Array:
    """Return a point of the fixed frame in the robot frame, (2,)."""
    return np.array(rotate(point[0] - pose[0], point[1] - pose[1], -pose[2]))
