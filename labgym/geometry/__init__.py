"""Oriented footprints, distances and overlaps. Knows no laboratory."""

from labgym.geometry.boxes import BoxArray, OrientedBox, distance, pairwise_distance, pairwise_penetration, penetration
from labgym.geometry.frames import rotate, wrap_angle

__all__ = [
    "BoxArray",
    "OrientedBox",
    "distance",
    "pairwise_distance",
    "pairwise_penetration",
    "penetration",
    "rotate",
    "wrap_angle",
]
