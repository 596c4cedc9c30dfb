"""Planar rotations and angles: radians, counter-clockwise, yaw about +Z."""

from __future__ import annotations

import math


def rotate(x: float, y: float, yaw: float) -> tuple[float, float]:
    """Rotate the vector (x, y) by yaw."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return cosine * x - sine * y, sine * x + cosine * y


def wrap_angle(angle: float) -> float:
    """Return the angle in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)
