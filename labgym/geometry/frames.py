"""Planar frames: rotations, angles, and rigid transforms of points and poses. Radians, counter-clockwise about +Z.

A pose (x, y, yaw) is the place of a local frame in an outer frame. With R the rotation by yaw and t = (x, y), a point p
of the local frame is R p + t in the outer frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

PlanarPose = tuple[float, float, float]
"""(x, y, yaw): meters and radians."""

Array = NDArray[np.float64]


def rotate(x: float, y: float, yaw: float) -> tuple[float, float]:
    """Rotate the vector (x, y) by yaw."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return cosine * x - sine * y, sine * x + cosine * y


def wrap_angle(angle: float) -> float:
    """Return the angle in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


def to_world(points: ArrayLike, pose: Sequence[float] | NDArray[Any]) -> Array:
    """Transform points of a local frame to the outer frame: R p + t.

    Args:
        points: (n, 2) in the local frame.
        pose: (x, y, yaw) of the local frame in the outer frame.

    Returns:
        (n, 2) in the outer frame.
    """
    x, y = np.asarray(points, dtype=np.float64).T
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return np.column_stack([pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y])


def to_local(points: ArrayLike, pose: Sequence[float] | NDArray[Any]) -> Array:
    """Transform points of the outer frame to a local frame: R^T (p - t), the inverse of `to_world`.

    Args:
        points: (n, 2) in the outer frame.
        pose: (x, y, yaw) of the local frame in the outer frame.

    Returns:
        (n, 2) in the local frame.
    """
    x, y = (np.asarray(points, dtype=np.float64) - (pose[0], pose[1])).T
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x])


def compose(frame: Sequence[float] | NDArray[Any], pose: Sequence[float] | NDArray[Any]) -> PlanarPose:
    """Return a pose of a local frame as a pose of the outer frame.

    Args:
        frame: (x, y, yaw) of the local frame in the outer frame.
        pose: (x, y, yaw) in the local frame.
    """
    x, y = rotate(float(pose[0]), float(pose[1]), float(frame[2]))
    return float(frame[0]) + x, float(frame[1]) + y, wrap_angle(float(frame[2]) + float(pose[2]))


def relative(frame: Sequence[float] | NDArray[Any], pose: Sequence[float] | NDArray[Any]) -> PlanarPose:
    """Return a pose of the outer frame as a pose of a local frame, the inverse of `compose`.

    Args:
        frame: (x, y, yaw) of the local frame in the outer frame.
        pose: (x, y, yaw) in the outer frame.
    """
    x, y = rotate(float(pose[0]) - float(frame[0]), float(pose[1]) - float(frame[1]), -float(frame[2]))
    return x, y, wrap_angle(float(pose[2]) - float(frame[2]))
