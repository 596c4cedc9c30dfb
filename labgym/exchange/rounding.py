"""Coordinates of floors that are read: rounded to a micrometer, without negative zeros."""

from __future__ import annotations


def tidy(length: float) -> float:
    """Return a length in meters rounded to a micrometer, without a negative zero."""
    return round(length, 6) + 0.0


def tidy_point(point: tuple[float, float]) -> tuple[float, float]:
    """Return a point in meters rounded to a micrometer, without negative zeros."""
    return tidy(point[0]), tidy(point[1])
