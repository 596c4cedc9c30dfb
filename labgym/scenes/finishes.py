"""Materials of the finishes of a space and of its furniture, and which wall has the accent color."""

from __future__ import annotations

import math
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
WORKTOPS = {
    "white": "epoxy_white",
    "gray": "worktop_gray",
    "black": "epoxy_black",
    "sand": "worktop_sand",
    "slate": "worktop_slate",
}
FRONTS = {
    "white": "laminate_white",
    "oak": "front_oak",
    "blue": "front_blue",
    "gray": "front_gray",
    "walnut": "front_walnut",
    "mint": "front_mint",
}
EDGES = {
    "white": "edge_blue",
    "oak": "edge_gray",
    "blue": "edge_gray",
    "gray": "edge_teal",
    "walnut": "edge_brown",
    "mint": "edge_green",
}
"""Material of the edges of worktops and shelves by the finish of the fronts."""
DOORS = {
    "gray": "door_leaf",
    "white": "door_white",
    "oak": "door_oak",
    "walnut": "door_walnut",
    "green": "door_green",
}
TURNS = {"opposite": 0.0, "left": math.pi / 2.0, "door": math.pi, "right": -math.pi / 2.0}
"""Angle from the direction into a space through its main door to that of the accent wall, radians."""
METALS = ("stainless", "chrome", "aluminium", "galvanised", "brass")
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


def palette(finishes: Finishes) -> dict[str, str]:
    """Return the materials of furniture and doors that the finishes of a space replace, each with its replacement."""
    replaced = {
        "epoxy_white": WORKTOPS[finishes.worktop],
        "laminate_white": FRONTS[finishes.fronts],
        "edge_blue": EDGES[finishes.fronts],
        "door_leaf": DOORS[finishes.doors],
    }
    return {name: other for name, other in replaced.items() if other != name}


def finishes_at(floor: Floor, x: float, y: float) -> Finishes:
    """Return the finishes of the space at a point, or of the first space if the point is in no space."""
    return (floor.space_at(x, y) or floor.spaces[0]).finishes


@dataclass(frozen=True)
class EndWall:
    """The end of a space that has the accent color.

    Attributes:
        direction: unit vector towards the end. distance: of the end along it, meters from the origin.
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
    """Return the end of a space that has the accent color; None for a space without a door.

    It is the end opposite the main door, or another if the finishes name one.
    """
    door = main_door(floor, space)
    if door is None:
        return None
    yaw = door.side(space.id)[2] + TURNS[space.finishes.accent_wall]
    direction = (-np.sin(yaw), np.cos(yaw))
    corners = np.concatenate([box.corners() for box in space.boxes])
    return EndWall((float(direction[0]), float(direction[1])), float((corners @ direction).max()))


def main_door(floor: Floor, space: Space) -> Doorway | None:
    """Return the first exit of a space, or else its first doorway, None if it has neither."""
    doors = [doorway for doorway in floor.doorways if space.id in doorway.spaces]
    return next((doorway for doorway in doors if doorway.exit), doors[0] if doors else None)
