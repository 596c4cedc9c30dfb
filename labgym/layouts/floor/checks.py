"""Checks that the walls, openings and spaces of a floor fit together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.floor.spaces import OUTSIDE, Space
from labgym.layouts.floor.walls import Wall

OVERLAP = 0.01
"""Depth by which spaces may reach into walls and into each other, meters."""
BLOCKED = 0.05
"""Depth by which walls and columns may reach into a doorway, meters."""
MAX_OPENINGS, MAX_RECTANGLES = 500, 512
"""Largest numbers of openings and of rectangles of all spaces of a floor."""


def check_counts(walls: Sequence[Wall], spaces: Sequence[Space], ids: Iterable[str]) -> None:
    """Check that ids are unique and that there are not too many parts.

    Raises:
        ValueError: names the id, or the number and its limit.
    """
    names: set[str] = set()
    for name in ids:
        if name in names:
            raise ValueError(f"the id {name!r} occurs twice among spaces, columns and keep-outs: rename one")
        names.add(name)
    openings, rectangles = sum(len(w.openings) for w in walls), sum(len(s.region) for s in spaces)
    for what, count, most in (("openings", openings, MAX_OPENINGS), ("rectangles", rectangles, MAX_RECTANGLES)):
        if count > most:
            raise ValueError(f"{count} {what} on one floor; at most {most} are allowed: split the floor")


def check_overlaps(spaces: Sequence[Space], walls: Sequence[OrientedBox]) -> None:
    """Check that spaces overlap neither each other nor walls by more than 1 cm.

    Raises:
        ValueError: names the two and the depth.
    """
    solid = BoxArray.of(walls)
    boxes = [BoxArray.of(space.boxes) for space in spaces]
    for index, (space, region) in enumerate(zip(spaces, boxes, strict=True)):
        for other in range(index + 1, len(spaces)):
            depth = float(pairwise_penetration(region, boxes[other]).max())
            if depth > OVERLAP:
                raise ValueError(
                    f"spaces {space.id!r} and {spaces[other].id!r} overlap by {depth:.2f} m, over {OVERLAP:g} m: "
                    "shrink a region"
                )
        depths = pairwise_penetration(region, solid).max(axis=0)
        if len(depths) and depths.max() > OVERLAP:
            raise ValueError(
                f"space {space.id!r} overlaps wall {depths.argmax()} by {depths.max():.2f} m, over {OVERLAP:g} m: "
                "end its region at the face of the wall"
            )


def check_doorways(doorways: Sequence[Doorway], walls: Sequence[OrientedBox], columns: Sequence[OrientedBox]) -> None:
    """Check that no other wall and no column stands in a doorway.

    Raises:
        ValueError: names the doorway and what blocks it.
    """
    if not doorways:
        return
    depths = pairwise_penetration(
        BoxArray.of([_hole(doorway) for doorway in doorways]), BoxArray.of([*walls, *columns])
    )
    depths[np.arange(len(doorways)), [doorway.wall for doorway in doorways]] = 0.0
    for way, solid in np.argwhere(depths > BLOCKED).tolist():
        doorway = doorways[way]
        what = f"wall {solid}" if solid < len(walls) else f"column {solid - len(walls)}"
        raise ValueError(f"{doorway.opening.label} of wall {doorway.wall} is blocked by {what}: move one of them")


def check_access(spaces: Sequence[Space], doorways: Sequence[Doorway]) -> None:
    """Check that every space has a door or a passage, and that doorways join it with an exit.

    Raises:
        ValueError: names the space.
    """
    for space in spaces:
        if not any(space.id in doorway.spaces for doorway in doorways):
            raise ValueError(f"space {space.id!r} has no door: add a door or a passage to one of its walls")
    if not any(doorway.exit for doorway in doorways):
        raise ValueError("the floor has no exit: add a door to the outside")
    reached = {OUTSIDE}
    for _ in spaces:
        for doorway in doorways:
            if not reached.isdisjoint(doorway.spaces):
                reached.update(doorway.spaces)
    for space in spaces:
        if space.id not in reached:
            raise ValueError(f"no way leads from an exit to space {space.id!r}: add a door or a passage")


def _hole(doorway: Doorway) -> OrientedBox:
    """Return the clear opening of a doorway as a box through its wall."""
    return OrientedBox(doorway.x, doorway.y, doorway.width, doorway.thickness, doorway.yaw, 0.0, doorway.opening.height)
