"""The frame of LabBuilder's scenes and that of a room: meters, degrees and radians.

LabBuilder's origin is the outer front-left corner of a room with walls of 0.20 m, labgym's the inner one. Both turn
counter-clockwise, and an object's front looks along +y at 0 in both. The robot of goal_pairs.json also looks along +y
at 0, that of labgym along +x.
"""

from __future__ import annotations

import math

from labgym.geometry import wrap_angle

WALL_THICKNESS = 0.2
DIGITS = 9
"""Decimals of positions in meters and of headings in radians."""
DEGREE_DIGITS = 7
"""Decimals of angles in degrees: 2e-9 rad."""

Position = tuple[float, float, float]


def to_room(x: float, y: float, z: float) -> Position:
    """Return a position of the scene in the room's frame."""
    return round(x - WALL_THICKNESS, DIGITS), round(y - WALL_THICKNESS, DIGITS), round(z, DIGITS)


def to_scene(x: float, y: float, z: float) -> Position:
    """Return a position of the room in the scene's frame."""
    return round(x + WALL_THICKNESS, DIGITS), round(y + WALL_THICKNESS, DIGITS), round(z, DIGITS)


def to_radians(degrees: float) -> float:
    """Return an angle in (-pi, pi]."""
    return wrap_angle(math.radians(round(degrees % 360.0, DEGREE_DIGITS)))


def to_degrees(yaw: float) -> float:
    """Return an angle in [0, 360)."""
    return round(math.degrees(yaw) % 360.0, DEGREE_DIGITS) % 360.0


def heading(yaw: float) -> float:
    """Return a robot's heading as in goal_pairs.json: radians in [0, 2 pi), 0 along +y."""
    return round((yaw - math.pi / 2.0) % (2.0 * math.pi), DIGITS) % round(2.0 * math.pi, DIGITS)
