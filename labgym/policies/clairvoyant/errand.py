"""A drive to make: where to, within which limits, and the shortest and fastest ways alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.navigation import Pose, ShortestPaths
from labgym.policies.clairvoyant.clearance import ClearanceField
from labgym.policies.clairvoyant.planning import Way, fastest_way
from labgym.policies.clairvoyant.route import Limits
from labgym.policies.foreknowledge import Foreknowledge

Array = NDArray[np.float64]

NUDGES = tuple((0.02 * ring, math.pi / 8.0 * k) for ring in range(1, 11) for k in range(16))
"""Distances, meters, and directions, radians, in which a free place is looked for."""


@dataclass(frozen=True, eq=False)
class Errand:
    """A drive to make.

    Attributes:
        world: the foreknowledge. paths, field: of the true floor.
        short: radius of the disc around the goal at whose edge the drive ends, meters.
        heading: at the goal, radians; None for any. limits: of the motion. weights: of the filter of the motion.
        taut: whether the length of the way counts, not its time.
    """

    world: Foreknowledge
    paths: ShortestPaths
    field: ClearanceField
    short: float
    heading: float | None
    limits: Limits
    weights: Sequence[float]
    taut: bool = False

    def points(self, pose: Pose) -> Array | None:
        """Return the shortest path from a pose to the goal, (n, 2) meters; None without a way.

        A robot that stands a little too near to something leaves for the nearest free place.
        """
        goal = self.world.goal[:2]
        path = self.paths.path(pose[:2], goal)
        if path is not None:
            return path.points
        for distance, angle in NUDGES:
            place = pose[0] + distance * math.cos(angle), pose[1] + distance * math.sin(angle)
            if self.paths.free(*place) and (path := self.paths.path(place, goal)) is not None:
                return np.vstack([pose[:2], path.points])
        return None

    def way(self, pose: Pose, quick: bool = False) -> Way | None:
        """Return the fastest way alone for a robot at rest; None without one."""
        points = self.points(pose)
        if points is None:
            return None
        return fastest_way(points, self.field, pose, self.limits, self.heading, self.short, quick, self.taut)
