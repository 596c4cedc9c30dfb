"""The path of a clairvoyant robot: an exact shortest path with as much clearance as it costs little length."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.navigation import PLANNING_RADIUS, FloorPlan, Pose, ShortestPaths

Array = NDArray[np.float64]

MARGINS = (0.15, 0.10, 0.05, 0.02, 0.0)
"""Distances that paths keep beyond the planning radius, tried in this order, meters."""
LONGER = 1.03
"""A path with more clearance is taken if it is at most this many times as long as the shortest one."""
SPACING = 0.02
"""Distance between the samples of a path, meters."""
BEND = 0.12
"""Length over which the curvature is measured, meters."""
SLOWEST = 0.15
"""Least speed limit in turns, m/s."""


def clear_path(plan: FloorPlan, start: Pose, goal: Pose) -> Array | None:
    """Return the path of a disc from start to goal, (n, 2) meters; None if it cannot get there.

    Exact shortest paths for larger discs are tried first: their arcs are wider, so that they may be faster, too.
    """
    shortest = ShortestPaths(plan).path(start, goal)
    if shortest is None:
        return None
    for margin in MARGINS[:-1]:
        wider = ShortestPaths(plan, PLANNING_RADIUS + margin).path(start, goal)
        if wider is not None and wider.length <= LONGER * shortest.length:
            return sampled(wider.points)
    return sampled(shortest.points)


def sampled(points: Array) -> Array:
    """Return a polyline (n, 2) at even steps of about 2 cm."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    steps = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / SPACING) + 1))
    return np.column_stack([np.interp(steps, along, points[:, axis]) for axis in range(2)])


def speed_limits(path: Array, lateral: float, robot: RobotSpec = ROBOT) -> Array:
    """Return the greatest speed at each point of a path at even steps, (n,) m/s.

    Args:
        path: (n, 2) meters. lateral: limit of the acceleration across the way, m/s2. robot: its limits.
    """
    step = np.diff(path, axis=0)
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    half = max(1, round(BEND / SPACING / 2.0))
    padded = np.pad(heading, half, mode="edge")
    turning = np.abs(padded[2 * half :] - padded[: -2 * half])
    curvature = np.append(turning, turning[-1:]) / BEND
    with np.errstate(divide="ignore"):
        limit = np.minimum(np.sqrt(lateral / curvature), 0.9 * robot.w_max / curvature)
    return np.clip(limit, SLOWEST, robot.v_max)
