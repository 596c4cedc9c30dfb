"""The leaves of interior doors as moving bodies: where they are hinged and how far they turn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.scenes.building import building_solids
from labgym.scenes.wall_openings import leaf_material

LEAF_MASS = 27.0
"""Mass per area, kg/m²: 45 mm of solid core of 600 kg/m³ (assumption)."""
LEAF_FORCE = 10.0
"""Resistance at the free edge, N: assumption without a door closer; ADA 404.2.9 allows at most 22.2 N (5 lbf)."""
LEAF_DAMPING = 10.0
"""Resistance at the free edge per speed, N s/m (assumption)."""


@dataclass(frozen=True)
class Leaf:
    """The leaf of an interior door.

    Attributes:
        name: of its solid in `building_solids`.
        box: its box in the floor's frame, at its angle.
        hinge: (x, y) of its axis in the frame of the box, origin in the middle of its bottom, meters.
        turn: 1 if it opens counter-clockwise, -1 if clockwise.
        angle: from its closed position, radians. travel: greatest angle, radians.
        material: of the leaf.
    """

    name: str
    box: OrientedBox
    hinge: tuple[float, float]
    turn: float
    angle: float
    travel: float
    material: str


def leaves_of(floor: Floor) -> Iterator[Leaf]:
    """Yield the leaves of the interior doors of a floor; exits stay closed."""
    ways = {(way.wall, way.opening): way for way in floor.doorways}
    names = {box: name for name, box in building_solids(floor).items()}
    for part in floor.parts:
        if part.kind != "leaf" or part.opening is None:
            continue
        opening = floor.walls[part.source].openings[part.opening]
        toward = 1.0 if opening.hinge == "start" else -1.0
        side = 1.0 if opening.swing == "left" else -1.0
        yield Leaf(
            name=names[part.box],
            box=part.box,
            hinge=(-toward * part.box.width / 2.0, side * part.box.depth / 2.0),
            turn=toward * side,
            angle=opening.angle if opening.state == "open" else 0.0,
            travel=max(math.pi / 2.0, opening.angle),
            material=leaf_material(floor, ways[part.source, opening]),
        )
