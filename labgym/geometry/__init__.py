"""Oriented boxes, distances, overlaps and planar frames, independent of laboratories."""

from labgym.geometry.boxes import (
    BoxArray,
    OrientedBox,
    distance,
    interpenetrating,
    overlapping_bounds,
    pairwise_distance,
    pairwise_penetration,
    penetration,
)
from labgym.geometry.frames import Array, compose, relative, rotate, to_local, to_world, wrap_angle

__all__ = [
    "Array",
    "BoxArray",
    "OrientedBox",
    "compose",
    "distance",
    "interpenetrating",
    "overlapping_bounds",
    "pairwise_distance",
    "pairwise_penetration",
    "penetration",
    "relative",
    "rotate",
    "to_local",
    "to_world",
    "wrap_angle",
]
