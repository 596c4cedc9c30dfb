"""Holodeck's wall objects: on grid points along the walls, above their target if they have one.

Public repository allenai/Holodeck, `wall_objects.py`: the first branch of its depth-first search, which takes the spot
nearest to the target, or a random one; heights come from the plan and stay 0.20 m below the ceiling.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.paper.rivals.chamber import SLACK, Chamber
from labgym.paper.rivals.piece import WALL, RivalPiece, named
from labgym.paper.rivals.plan import Hung

BELOW_CEILING = 0.20
"""Least distance of a wall object's top from the ceiling, meters."""
OFF_WALL = 0.01
"""Gap to the wall, meters."""


def mount(
    chamber: Chamber,
    hung: Sequence[Hung],
    standing: Sequence[RivalPiece],
    homes: dict[str, RivalPiece],
    step: float,
    generator: np.random.Generator,
    counts: Counter[str],
) -> list[RivalPiece]:
    """Return the wall objects that find a place.

    Args:
        hung: objects to hang. standing: pieces that they must not overlap. homes: large pieces by name in the plan.
        step: spacing of the points along the walls, meters.
        counts: numbers of ids that are in use, by asset; updated.
    """
    mounted: list[RivalPiece] = []
    for one in hung:
        spots = _spots(chamber, one, step)
        if not spots:
            continue
        blocked = [piece.box for piece in (*standing, *mounted)]
        blocked += [replace(box, z0=0.0, z1=chamber.ground.ceiling) for box in chamber.ground.solid]
        free = np.ones(len(spots), dtype=np.bool_)
        if blocked:
            free = np.all(pairwise_penetration(BoxArray.of(spots), BoxArray.of(blocked)) <= SLACK, axis=1)
        rows = np.flatnonzero(free)
        if not len(rows):
            continue
        row = int(generator.choice(rows))
        if one.above in homes:
            x, y = homes[one.above].x, homes[one.above].y
            row = int(min(rows, key=lambda k: ((spots[k].x - x) ** 2 + (spots[k].y - y) ** 2, k)))
        box = spots[row]
        mounted.append(RivalPiece(named(counts, one.asset), one.asset, box.x, box.y, box.yaw, box.z0, WALL))
    return mounted


def _spots(chamber: Chamber, one: Hung, step: float) -> list[OrientedBox]:
    """Boxes with their back at a wall, one grid step apart, clear of doors, windows and the wall's ends."""
    size = one.asset.size
    height = max(min(one.height, chamber.ground.ceiling - BELOW_CEILING - size.height), 0.0)
    spots = []
    for segment in chamber.ground.segments:
        for low, high in segment.free(height + size.height):
            for along in np.arange(low, high - size.width + 1e-9, step).tolist():
                x, y = segment.point(along + size.width / 2.0, OFF_WALL + size.depth / 2.0)
                spots.append(OrientedBox(x, y, size.width, size.depth, segment.yaw, height, height + size.height))
    return spots
