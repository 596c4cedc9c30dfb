"""The building of a layout: visible walls and floor, solid boxes, and the leaves of interior doors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.scenes.floor_covering import covering_patches
from labgym.scenes.patches import Patch
from labgym.scenes.plain_room import room_covering, room_patches
from labgym.scenes.wall_faces import column_patches, wall_patches
from labgym.scenes.wall_openings import leaf_material, opening_patches

CACHED = 32
"""Number of floors whose faces are cached."""
LEAF_MASS = 27.0
"""Mass per area, kg/m²: 45 mm of solid core of 600 kg/m³ (assumption)."""
LEAF_FORCE = 10.0
"""Resistance at the free edge, N: assumption without a door closer; ADA 404.2.9 allows at most 22.2 N (5 lbf)."""
LEAF_DAMPING = 10.0
"""Resistance at the free edge per speed, N s/m (assumption)."""


def building_patches(floor: Floor, leaves: bool = True) -> tuple[Patch, ...]:
    """Return the visible faces of walls, doors, windows and columns, without the floor.

    Faces that are turned away from all spaces are left out, so that walls are transparent from outside.

    Args:
        leaves: whether to include the leaves of interior doors.
    """
    return _patches(floor, leaves)


def floor_patches(floor: Floor) -> tuple[Patch, ...]:
    """Return the covering of the floor, a patch for each material."""
    return _coverings(floor)


def building_solids(floor: Floor, leaves: bool = True) -> dict[str, OrientedBox]:
    """Return the solid boxes of the building by name: those of `Floor.solids`.

    Args:
        leaves: whether to include the leaves of interior doors.
    """
    solids: dict[str, OrientedBox] = {}
    count: Counter[str] = Counter()
    for part in floor.parts:
        if part.kind == "leaf" and not leaves:
            continue
        stem = f"column_{part.source}" if part.kind == "column" else f"wall_{part.source}/{part.kind}"
        solids[f"{stem}_{count[stem]}"] = part.box
        count[stem] += 1
    return solids


@lru_cache(maxsize=CACHED)
def _patches(floor: Floor, leaves: bool) -> tuple[Patch, ...]:
    if floor.as_room is not None:
        return tuple(room_patches(floor, floor.as_room))
    return (*wall_patches(floor), *opening_patches(floor, leaves), *column_patches(floor))


@lru_cache(maxsize=CACHED)
def _coverings(floor: Floor) -> tuple[Patch, ...]:
    return covering_patches(floor) if floor.as_room is None else (room_covering(floor, floor.as_room),)


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
