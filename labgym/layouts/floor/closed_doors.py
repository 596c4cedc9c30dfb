"""Closed doors between the spaces of a floor, and the walls of a floor with changed openings."""

from __future__ import annotations

from collections.abc import Collection

from labgym.layouts.floor.model import Floor
from labgym.layouts.floor.walls import Opening, Wall


def closed_doors(floor: Floor) -> frozenset[tuple[int, Opening]]:
    """Return the closed doors between spaces, each with the index of its wall."""
    inner = ((way.wall, way.opening) for way in floor.doorways if not way.exit)
    return frozenset((wall, way) for wall, way in inner if way.kind == "door" and way.state == "closed")


def walls_with(floor: Floor, openings: Collection[tuple[int, Opening]], **changes: object) -> tuple[Wall, ...]:
    """Return the walls of a floor with some fields of some openings changed, unchecked.

    Args:
        openings: the openings, each with the index of its wall.
        changes: the fields.
    """
    return tuple(
        wall.model_copy(
            update={
                "openings": tuple(
                    opening.model_copy(update=changes) if (index, opening) in openings else opening
                    for opening in wall.openings
                )
            }
        )
        for index, wall in enumerate(floor.walls)
    )
