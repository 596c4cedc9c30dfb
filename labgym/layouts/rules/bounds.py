"""OB: objects out of their room, off their support's surface, or above or below it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray
from labgym.geometry.overlap import paired_inset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.thresholds import HEIGHT_TOLERANCE, ROOM_TOLERANCE, SURFACE_TOLERANCE, WALL_TOLERANCE

Cause = Literal["room", "surface", "height", "support"]


@dataclass(frozen=True)
class BoundsFault:
    """One way in which one object is out of bounds.

    Attributes:
        cause: `room` (in a wall or a column, or outside of all rooms), `surface` (over the edge of its support, or, if
            wall-mounted, away from every wall or over an opening), `height` (above or below its support), `support`
            (on something that does not carry such an object; touchstone-v2 only).
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
        "room": arrangement.building.outside(arrangement.boxes),
        "surface": np.zeros(len(arrangement)),
        "height": np.zeros(len(arrangement)),
    }
    limits = {"room": ROOM_TOLERANCE, "surface": SURFACE_TOLERANCE, "height": HEIGHT_TOLERANCE}
    supports = np.array([placement.support for placement in arrangement.placements])
    floor, wall = supports == FLOOR, supports == WALL
    rows["height"][floor] = np.abs(arrangement.boxes.z[floor, 0])
    gap = _wall_gap(arrangement)
    over = arrangement.building.over_openings(arrangement.boxes)
    rows["surface"][wall] = np.where(np.maximum(gap, over)[wall] > WALL_TOLERANCE, np.maximum(gap, over)[wall], 0.0)
    supported = arrangement.supported
    if supported:
        surfaces = BoxArray.of([arrangement.surface(row) for row in supported])
        rows["surface"][supported] = -paired_inset(arrangement.take(supported), surfaces)
        rows["height"][supported] = np.abs(arrangement.boxes.z[supported, 0] - surfaces.z[:, 0])
    return tuple(
        BoundsFault(arrangement.placements[row].id, cause, float(amounts[row]))
        for cause, amounts in rows.items()
        for row in np.flatnonzero(amounts > limits[cause] + 1e-9)
    )


def _wall_gap(arrangement: Arrangement) -> NDArray[np.float64]:
    """Distance of each footprint's nearest side to a wall, negative beyond; its farther end counts, shape (n,)."""
    gaps = arrangement.building.gaps(arrangement.corners)
    return np.asarray(np.sort(gaps, axis=-1)[..., 1].min(axis=0))
