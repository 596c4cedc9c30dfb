"""Small objects at random spots on receptacles, as Holodeck spawns them in the simulator.

Public repository allenai/Holodeck, `small_objects.py`: at most 15 objects and 90% of the area on a receptacle, the
larger ones first, ten attempts each, and a random yaw for those under 25 cm that is drawn after the spot. Breakable
ones then stay; the simulator's physics separates the others, so they are turned here only if that fits. The
simulator AI2-THOR finds a free spot on one of the receptacle's surfaces; here spots are drawn uniformly.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.paper.rivals.piece import RivalPiece, named

ATTEMPTS = 10
"""Surfaces that are tried for each object, at random (`numPlacementAttempts`)."""
SPOTS = 20
"""Random spots that an attempt looks at, an assumption: AI2-THOR goes through a grid of points in random order."""
MOST = 15
"""Greatest number of objects on a receptacle."""
FULL = 0.9
"""Share of the receptacle's area that objects may take; also their greatest size relative to the receptacle's."""
LOOSE_FIT = 0.8
"""Factor on the two largest sides of an object, whose product counts as its area."""
SMALL = 0.25
"""Objects whose sides are all at most this long get a random yaw, meters."""
TOUCH = 1e-6
"""Overlaps smaller than this are none, meters."""


def spawn(
    parent: RivalPiece,
    assets: Sequence[Asset],
    generator: np.random.Generator,
    counts: Counter[str],
    present: Sequence[RivalPiece] = (),
    upright: bool = False,
) -> list[RivalPiece]:
    """Return the objects that find a place on or in a piece, largest first.

    Args:
        counts: numbers of ids that are in use, by asset; updated.
        present: what stands on the piece already.
        upright: whether all objects keep the orientation of the piece.
    """
    spawned: list[RivalPiece] = []
    for asset in sorted(admitted(parent.asset, assets, present), key=lambda one: -max(one.size.width, one.size.depth)):
        spot = _spot(parent, asset, [*present, *spawned], generator)
        if spot is None:
            continue
        slot, x, y = spot
        piece = RivalPiece(named(counts, asset), asset, x, y, parent.yaw, parent.surface(slot).z0, parent.id, slot)
        if not upright and max(asset.size.width, asset.size.depth, asset.size.height) <= SMALL:
            turned = replace(piece, yaw=parent.yaw + float(generator.uniform(-math.pi, math.pi)))
            if asset.hazards.glass_container or _rests(turned, parent, [*present, *spawned]):
                piece = turned
        spawned.append(piece)
    return spawned


def admitted(receptacle: Asset, assets: Sequence[Asset], present: Sequence[RivalPiece] = ()) -> list[Asset]:
    """Return the objects that a receptacle takes in addition to what is present, in order, until it is full."""
    size, area = receptacle.size, sum(_area(piece.asset) for piece in present)
    taken: list[Asset] = []
    for asset in assets:
        if asset.size.width >= FULL * size.width or asset.size.depth >= FULL * size.depth:
            continue
        area += _area(asset)
        count = len(present) + len(taken)
        if count >= MOST or (count and area > FULL * size.width * size.depth):
            break
        taken.append(asset)
    return taken


def _area(asset: Asset) -> float:
    sides = sorted((asset.size.width, asset.size.depth, asset.size.height))
    return LOOSE_FIT * sides[1] * sides[2]


def _spot(
    parent: RivalPiece, asset: Asset, others: Sequence[RivalPiece], generator: np.random.Generator
) -> tuple[int, float, float] | None:
    """A random slot and position at which an object lies within the surface and overlaps no other one, or None."""
    size = asset.size
    slots = [
        slot
        for slot, surface in enumerate(parent.asset.surfaces)
        if (surface.headroom is None or size.height <= surface.headroom)
        and size.width <= surface.width
        and size.depth <= surface.depth
    ]
    for _ in range(ATTEMPTS if slots else 0):
        slot = int(generator.choice(slots))
        surface = parent.surface(slot)
        reach = np.array([surface.width - size.width, surface.depth - size.depth]) / 2.0
        offsets = generator.uniform(-reach, reach, (SPOTS, 2))
        boxes = [
            OrientedBox(
                *surface.to_world(dx, dy), size.width, size.depth, surface.yaw, surface.z0, surface.z0 + size.height
            )
            for dx, dy in offsets.tolist()
        ]
        blocked = [other.box for other in others] + _fittings(parent)
        free = (pairwise_penetration(BoxArray.of(boxes), BoxArray.of(blocked)) <= TOUCH).all(axis=1)
        if free.any():
            box = boxes[int(np.argmax(free))]
            return slot, box.x, box.y
    return None


def _rests(piece: RivalPiece, parent: RivalPiece, others: Sequence[RivalPiece]) -> bool:
    """Whether a piece lies within its surface and overlaps nothing."""
    surface = parent.surface(piece.slot or 0)
    corners = [surface.to_local(x, y) for x, y in piece.box.corners().tolist()]
    inside = all(abs(x) <= surface.width / 2.0 and abs(y) <= surface.depth / 2.0 for x, y in corners)
    blocked = [other.box for other in others] + _fittings(parent)
    return inside and not (
        blocked and (pairwise_penetration(BoxArray.of([piece.box]), BoxArray.of(blocked)) > TOUCH).any()
    )


def _fittings(parent: RivalPiece) -> list[OrientedBox]:
    """Solids above a piece's surfaces: taps, rods, posts of shelves."""
    boxes = []
    for part in parent.asset.fittings:
        x, y = parent.box.to_world(part.x, part.y)
        box = OrientedBox(x, y, part.width, part.depth, parent.yaw)
        boxes.append(replace(box, z0=parent.z + part.z0, z1=parent.z + part.z1))
    return boxes
