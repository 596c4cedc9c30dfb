"""Materials of the finishes of a space, and which wall has the accent color."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.layouts.floor import Doorway, Finishes, Floor, Space

FLOORS = {
    "vinyl": "floor_vinyl",
    "epoxy": "floor_epoxy",
    "tile": "floor_tile",
    "terrazzo": "floor_terrazzo",
    "concrete": "floor_concrete",
}
WALLS = {
    "white": "wall_paint",
    "cream": "wall_cream",
    "gray": "wall_gray",
    "sage": "wall_sage",
    "sky": "wall_sky",
}
ACCENTS = {
    "teal": "wall_accent",
    "navy": "accent_navy",
    "ochre": "accent_ochre",
    "brick": "accent_brick",
    "graphite": "accent_graphite",
}
JOINTS = {"floor_vinyl": 0.6, "floor_tile": 0.3}
"""Side of the tiles of floor coverings that have joints, meters."""
PLAIN = WALLS["white"]
"""Material of the faces of walls that no space lies in front of."""
OPPOSITE = 0.9
"""Least cosine of the angle between the directions of a main door and of a wall opposite it."""
NEAR_END = 0.25
"""A wall at most this far from the end of a space, seen from its main door, is its end wall, meters."""

Array = NDArray[np.float64]


def floor_material(finishes: Finishes) -> str:
    """Return the material of the floor covering."""
    return FLOORS[finishes.floor]


def paint(finishes: Finishes, accent: bool) -> str:
    """Return the material of a wall, or of the wall with the accent color."""
    return ACCENTS[finishes.accent] if accent and finishes.accent else WALLS[finishes.walls]


@dataclass(frozen=True)
class EndWall:
    """The end of a space opposite its main door.

    Attributes:
        direction: unit vector from the door into the space. distance: of the end along it, meters from the origin.
    """

    direction: tuple[float, float]
    distance: float

    def holds(self, points: Array, normals: Array) -> NDArray[np.bool_]:
        """Return whether points (n, 2) of faces with normals (n, 2) are on the end wall, shape (n,)."""
        direction = np.array(self.direction)
        return np.asarray(
            (normals @ direction < -OPPOSITE) & (points @ direction > self.distance - NEAR_END), dtype=np.bool_
        )


def end_wall(floor: Floor, space: Space) -> EndWall | None:
    """Return the end of a space opposite its main door: its first exit, or else its first doorway; None without one."""
    door = main_door(floor, space)
    if door is None:
        return None
    yaw = door.side(space.id)[2]
    direction = (-np.sin(yaw), np.cos(yaw))
    corners = np.concatenate([box.corners() for box in space.boxes])
    return EndWall((float(direction[0]), float(direction[1])), float((corners @ direction).max()))


def main_door(floor: Floor, space: Space) -> Doorway | None:
    """Return the first exit of a space, or else its first doorway, None if it has neither."""
    doors = [doorway for doorway in floor.doorways if space.id in doorway.spaces]
    return next((doorway for doorway in doors if doorway.exit), doors[0] if doors else None)
