"""OB: objects out of their room, off their support's surface, or above or below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.thresholds import HEIGHT_TOLERANCE, ROOM_TOLERANCE, SURFACE_TOLERANCE, WALL_TOLERANCE

FREE_STANDING_HEIGHT_M = 1.2
"""Desktop assets of this height and more, such as gas cylinders, also stand on the floor, meters: on a bench of 0.9 m
they would end above the 1.9 to 2.1 m that a standing person reaches."""
PORTABLE = frozenset({"container", "spill", "fire", "carton"})
"""Subtypes of floor assets that also stand on furniture: containers on a waste station, a spill kit on a shelf."""

Cause = Literal["room", "surface", "height", "support"]


@dataclass(frozen=True)
class BoundsFault:
    """One way in which one object is out of bounds.

    Attributes:
        cause: `room` (in a wall or a column, or outside of all rooms), `surface` (over the edge of its support, or, if
            wall-mounted, away from every wall or over an opening), `height` (above or below its support), `support`
            (on something that does not carry such an object; `support_faults` only).
        amount: by how much, meters; 0 for `support`.
    """

    id: str
    cause: Cause
    amount: float


def bounds_faults(arrangement: Arrangement) -> tuple[BoundsFault, ...]:
    """Return every fault, in the order room, surface, height; an object with several faults counts as one OB.

    A wall-mounted object may be at any height, but must lie inside the room and have a side along a wall, off its
    openings.
    """
    if not len(arrangement):
        return ()
    rows: dict[Cause, NDArray[np.float64]] = {
        "room": np.array(arrangement.facts("outside", range(len(arrangement)), lambda new: _outside(arrangement, new))),
        "surface": np.zeros(len(arrangement)),
        "height": np.zeros(len(arrangement)),
    }
    limits = {"room": ROOM_TOLERANCE, "surface": SURFACE_TOLERANCE, "height": HEIGHT_TOLERANCE}
    floor = [row for row in arrangement.standing if arrangement.placements[row].support == FLOOR]
    rows["height"][floor] = np.abs(arrangement.boxes.z[floor, 0])
    hung = [row for row in arrangement.standing if arrangement.placements[row].support == WALL]
    if hung:
        off = np.array(arrangement.facts("off_wall", hung, lambda new: _off_walls(arrangement, new)))
        rows["surface"][hung] = np.where(off > WALL_TOLERANCE, off, 0.0)
    supported = arrangement.supported
    if supported:
        over = arrangement.facts("off_surface", supported, lambda new: _off_surfaces(arrangement, new), carried=True)
        rows["surface"][supported], rows["height"][supported] = np.array(over).T
    return tuple(
        BoundsFault(arrangement.placements[row].id, cause, float(amounts[row]))
        for cause, amounts in rows.items()
        for row in np.flatnonzero(amounts > limits[cause] + 1e-9)
    )


def _outside(arrangement: Arrangement, rows: list[int]) -> list[float]:
    """Return how far objects reach out of the free space of their rooms, meters."""
    depths: list[float] = arrangement.building.outside(arrangement.take(rows)).tolist()
    return depths


def _off_walls(arrangement: Arrangement, rows: list[int]) -> list[float]:
    """Return how far the nearest side of each object is off a wall, or the object over an opening, meters.

    The farther end of a side counts; negative beyond the face of the wall.
    """
    over = arrangement.building.over_openings(arrangement.take(rows))
    off: list[float] = np.maximum(wall_gap(arrangement, rows), over).tolist()
    return off


def _off_surfaces(arrangement: Arrangement, rows: list[int]) -> list[tuple[float, float]]:
    """Return how far each object reaches over the edge of its surface, and how far it is above or below it, meters."""
    surfaces, boxes = BoxArray.of([arrangement.surface(row) for row in rows]), arrangement.take(rows)
    over, off = -paired_inset(boxes, surfaces), np.abs(boxes.z[:, 0] - surfaces.z[:, 0])
    return list(zip(over.tolist(), off.tolist(), strict=True))


def wall_gap(arrangement: Arrangement, rows: Sequence[int]) -> NDArray[np.float64]:
    """Return the distance of each footprint's nearest side to a wall, negative beyond; the farther end counts."""
    gaps = arrangement.building.gaps(arrangement.corners[list(rows)])
    return np.asarray(np.sort(gaps, axis=-1)[..., 1].min(axis=0))


def back_gap(arrangement: Arrangement, rows: Sequence[int]) -> NDArray[np.float64]:
    """Return the distance of each footprint's back to a wall, negative beyond; the farther end counts."""
    return np.asarray(arrangement.building.gaps(arrangement.corners[list(rows), :2]).max(axis=-1).min(axis=0))


def support_faults(arrangement: Arrangement) -> tuple[BoundsFault, ...]:
    """Return a fault for each object that stands on the wrong kind of support.

    Desktop assets stand on other objects, floor assets on the floor (portable ones also on furniture), and wall assets
    hang on a wall.
    """

    def find(rows: list[int]) -> list[bool]:
        return [_carried(arrangement, arrangement.placements[row].support, arrangement.assets[row]) for row in rows]

    carried = arrangement.facts("carried", range(len(arrangement)), find, carried=True)
    return tuple(
        BoundsFault(placement.id, "support", 0.0)
        for placement, is_carried in zip(arrangement.placements, carried, strict=True)
        if not is_carried
    )


def fallen(arrangement: Arrangement, row: int) -> bool:
    """Return whether an object, or what finally carries it, is a desktop asset on the floor or on a wall."""
    root = arrangement.layout.root(arrangement.placements[row].id)
    asset = arrangement.layout.asset(root.id)
    return asset.placing == "desktop" and not _carried(arrangement, root.support, asset)


def _carried(arrangement: Arrangement, support: str, asset: Asset) -> bool:
    if asset.placing == "floor":
        return support == FLOOR or (support != WALL and asset.subtype in PORTABLE)
    if asset.placing == "wall":
        return support == WALL
    if support == FLOOR:
        return asset.size.height >= FREE_STANDING_HEIGHT_M
    return support != WALL and arrangement.layout.asset(support).subtype != "seat"
