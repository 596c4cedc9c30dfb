"""The building of a layout: visible walls and floor, and solid boxes."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.scenes.floor_covering import covering_patches
from labgym.scenes.patches import Patch
from labgym.scenes.rectangle import room_covering, room_patches
from labgym.scenes.wall_faces import column_patches, wall_patches
from labgym.scenes.wall_openings import opening_patches

CACHED = 32
"""Number of floors whose faces are cached."""


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
