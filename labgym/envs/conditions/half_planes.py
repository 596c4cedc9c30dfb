"""The velocity that a half-plane program selects: the nearest one that is permitted, or the one least forbidden.

A half-plane (x, y, c) permits the velocities v with (x, y) . v >= c, where (x, y) is a unit vector. Everything is plain
arithmetic in double precision and in a fixed order, so equal arguments give equal bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

Vector = tuple[float, float]

PARALLEL = 1e-10
"""Lines whose directions differ by less than this sine count as parallel."""
ROUNDING = 1e-9
"""Excess over a half-plane that counts as rounding, m/s."""


class HalfPlane(NamedTuple):
    """The velocities v with (x, y) . v >= least.

    Attributes:
        x, y: unit normal, towards what is permitted. least: m/s.
    """

    x: float
    y: float
    least: float


def permitted_velocity(
    preferred: Vector, fastest: float, hard: Sequence[HalfPlane], soft: Sequence[HalfPlane]
) -> Vector:
    """Return the velocity nearest to a preferred one that all half-planes permit, m/s.

    If none does, it is one that the hard half-planes permit and whose greatest violation of a soft one is least (van
    den Berg et al. 2011, sections 5.2 and 5.3).

    Args:
        preferred: m/s. fastest: greatest speed, m/s.
        hard: half-planes that permit rest. soft: the others.
    """
    planes = [*hard, *soft]
    velocity, met = nearest_velocity(preferred, fastest, planes)
    if met == len(planes):
        return velocity
    if met < len(hard):
        return 0.0, 0.0  # by rounding alone: all hard half-planes permit rest
    return least_forbidden(velocity, fastest, hard, soft, met - len(hard))


def nearest_velocity(preferred: Vector, fastest: float, planes: Sequence[HalfPlane]) -> tuple[Vector, int]:
    """Return the velocity nearest to a preferred one that all half-planes permit, and the number of half-planes.

    If none does, return one that the first k permit, and k, the greatest such number.

    Args:
        preferred: m/s. fastest: greatest speed, m/s. planes: in the order in which they are added.
    """
    px, py = preferred
    speed = math.sqrt(px * px + py * py)
    x, y = (px, py) if speed <= fastest else (px * fastest / speed, py * fastest / speed)
    for number, plane in enumerate(planes):
        if plane.x * x + plane.y * y < plane.least - ROUNDING * 1e-3:
            interval = _on_line(number, fastest, planes)
            if interval is None:
                return (x, y), number
            low, high = interval
            along = min(max(px * -plane.y + py * plane.x, low), high)
            x, y = plane.least * plane.x - along * plane.y, plane.least * plane.y + along * plane.x
    return (x, y), len(planes)


def fastest_velocity(toward: Vector, fastest: float, planes: Sequence[HalfPlane]) -> Vector | None:
    """Return the permitted velocity that is the greatest along a direction; None if none is permitted.

    Args:
        toward: unit vector. fastest: greatest speed, m/s. planes: the half-planes.
    """
    x, y = toward[0] * fastest, toward[1] * fastest
    for number, plane in enumerate(planes):
        if plane.x * x + plane.y * y < plane.least - ROUNDING * 1e-3:
            interval = _on_line(number, fastest, planes)
            if interval is None:
                return None
            low, high = interval
            slope = toward[1] * plane.x - toward[0] * plane.y
            along = high if slope > 0.0 else low
            x, y = plane.least * plane.x - along * plane.y, plane.least * plane.y + along * plane.x
    return x, y


def least_forbidden(
    start: Vector, fastest: float, hard: Sequence[HalfPlane], soft: Sequence[HalfPlane], first: int = 0
) -> Vector:
    """Return a velocity that hard half-planes permit and whose greatest violation of a soft one is least.

    The violation t is a third coordinate of the program: with soft half-plane i added, the least t is on its plane
    t = least_i - n_i . v, where the earlier ones become half-planes of v again.

    Args:
        start: a velocity that the hard half-planes and the first soft ones permit. fastest: greatest speed, m/s.
        hard: half-planes that permit rest. soft: the others. first: number of soft ones that permit `start`.
    """
    (x, y), violation = start, 0.0
    for number in range(first, len(soft)):
        plane = soft[number]
        if plane.least - plane.x * x - plane.y * y <= violation + ROUNDING * 1e-3:
            continue
        planes = [*hard]
        for other in soft[:number]:
            dx, dy = other.x - plane.x, other.y - plane.y
            length = math.sqrt(dx * dx + dy * dy)
            if length > PARALLEL:
                planes.append(HalfPlane(dx / length, dy / length, (other.least - plane.least) / length))
        velocity = fastest_velocity((plane.x, plane.y), fastest, planes)
        if velocity is not None:  # None by rounding alone: the velocity so far is as good
            x, y = velocity
            violation = plane.least - plane.x * x - plane.y * y
    return x, y


def _on_line(number: int, fastest: float, planes: Sequence[HalfPlane]) -> tuple[float, float] | None:
    """Return the part of a half-plane's line that the earlier half-planes and the greatest speed permit.

    Places on the line are the distances along (-y, x) from the point nearest to rest.
    """
    nx, ny, least = planes[number]
    square = fastest * fastest - least * least
    if square < 0.0:
        return None
    high = math.sqrt(square)
    low = -high
    for x, y, other in planes[:number]:
        slope, rest = y * nx - x * ny, other - least * (x * nx + y * ny)
        if abs(slope) <= PARALLEL:
            if rest > ROUNDING:
                return None
        elif slope > 0.0:
            low = max(low, rest / slope)
        else:
            high = min(high, rest / slope)
        if low > high + ROUNDING:
            return None
    return low, max(low, high)
