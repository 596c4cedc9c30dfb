"""Smooth paths: an elastic band between barriers that bends no more than a robot at full speed can turn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from labgym.policies.clairvoyant.clearance import NODE, ClearanceField
from labgym.policies.clairvoyant.smoothing_kernel import cost_terms

Array = NDArray[np.float64]

STEP = 0.10
"""Distance between the points of the band, meters."""
EVALUATIONS = 300
"""Most evaluations of a path's cost."""


@dataclass(frozen=True)
class Band:
    """Weights of the terms of a path's cost, in meters of length.

    Attributes:
        bend: of curvature squared, m2 for each meter. sharp: of curvature beyond `curvature` squared.
        twist: of the change of curvature squared, m4 for each meter.
        curvature: at which the robot turns at its greatest rate at full speed, 1/m.
        radius: distance to keep from barriers, meters. wall: of what is missing of it squared, 1/m2 for each meter.
        guide: of the distance from the polyline squared, 1/m2 for each meter.
    """

    bend: float = 0.02
    sharp: float = 1.0
    twist: float = 0.004
    curvature: float = 1.3
    radius: float = 0.32
    wall: float = 2e4
    guide: float = 0.0


def smooth_path(
    points: Array, field: ClearanceField, band: Band, start_yaw: float | None = None, goal_yaw: float | None = None
) -> Array:
    """Return a smooth path along a polyline, (n, 2) meters at even steps of about 10 cm.

    Args:
        points: (m, 2), the polyline; its ends stay. field: of the floor. band: the weights.
        start_yaw, goal_yaw: headings with which it begins and ends, radians; None for any.
    """
    path = resampled(points, STEP)
    guide = path.copy()
    count = len(path)
    if count < 6:
        return path
    h = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) / (count - 1)
    first, last = 1, count - 1
    if start_yaw is not None:
        path[1] = path[0] + h * np.array([math.cos(start_yaw), math.sin(start_yaw)])
        first = 2
    if goal_yaw is not None:
        path[-2] = path[-1] - h * np.array([math.cos(goal_yaw), math.sin(goal_yaw)])
        last = count - 2

    def cost(flat: Array) -> tuple[float, Array]:
        path[first:last] = flat.reshape(-1, 2)
        value, gradient = _cost(path, h, field, band)
        if band.guide:
            off = path - guide
            value += h * band.guide * float((off**2).sum())
            gradient += 2.0 * h * band.guide * off
        return value, gradient[first:last].ravel()

    # Without BLAS, whose last bits depend on the processor.
    found = minimize(cost, path[first:last].ravel(), jac=True, method="TNC", options={"maxfun": EVALUATIONS})
    path[first:last] = found.x.reshape(-1, 2)
    return path


def resampled(points: Array, step: float) -> Array:
    """Return a polyline (m, 2) at even steps of about `step` meters, (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    steps = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / step) + 1))
    return np.column_stack([np.interp(steps, along, points[:, axis]) for axis in range(2)])


def _cost(path: Array, h: float, field: ClearanceField, band: Band) -> tuple[float, Array]:
    """Return the cost of a path (n, 2) at steps of about h, meters, and its gradient, (n, 2)."""
    weights = band.radius, band.curvature, band.bend, band.sharp, band.twist, band.wall
    gradient, edges, sizes, overs, thirds, misses = cost_terms(path, h, h**2, weights, field.low, NODE, field.values)
    value = float(edges.sum()) / (2.0 * h)
    value += h * float(band.bend * sizes.sum() + band.sharp * overs.sum())
    value += h * band.twist * float(thirds.sum())
    value += h * band.wall * float(misses.sum())
    return value, gradient
