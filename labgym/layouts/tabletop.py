"""Arranges objects on one surface: a seeded scan of a centimeter grid, largest object first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.rules.thresholds import ONE_SIDED

GRID = 0.01
"""Spacing of the spots that are tried, meters."""
GAP = 0.03
"""Least gap between neighbors, meters."""
BULKY = 0.03
"""Footprint above which an item goes to the back, square meters: a hot plate, not a flask."""
ROW_COST, NOISE = 2.0, 0.05
"""Cost of a meter off the row, against 1 for a meter along it, and of the noise that makes seeds differ."""
TRIES = 6
"""Number of arrangements tried before a surface counts as full."""
STRETCH_COST = 20.0
"""Cost of a meter beyond the reach of an arm: it outweighs the place in the row."""


@dataclass(frozen=True)
class SurfaceItem:
    """An object to stand on a surface: footprint and height in meters, and the margin that it needs to every edge."""

    name: str
    width: float
    depth: float
    height: float
    margin: float

    @classmethod
    def of(cls, asset: Asset, margin: float) -> SurfaceItem:
        """Return an asset as an item."""
        return cls(asset.name, asset.size.width, asset.size.depth, asset.size.height, margin)


@dataclass(frozen=True)
class SurfaceSpot:
    """Where an item stands: center relative to the surface's center, meters, and yaw relative to the surface."""

    x: float
    y: float
    yaw: float
    width: float
    depth: float

    def inset(self, surface: OrientedBox) -> float:
        """Return the distance of the item from the nearest edge of a surface, meters."""
        return min((surface.width - self.width) / 2.0 - abs(self.x), (surface.depth - self.depth) / 2.0 - abs(self.y))


@dataclass(frozen=True)
class Arm:
    """The arm that works on a surface: its shoulder in front of the surface's middle, and its reach, meters.

    Attributes:
        x, y: shoulder relative to the surface's center. z: its height above the surface.
        reach: from the shoulder to the middle of an item.
    """

    x: float
    y: float
    z: float
    reach: float


def pack(
    items: Sequence[SurfaceItem],
    width: float,
    depth: float,
    headroom: float | None,
    generator: np.random.Generator,
    taken: Sequence[SurfaceSpot] = (),
    arm: Arm | None = None,
) -> dict[int, SurfaceSpot]:
    """Return spots for as many items as fit, by index into `items`.

    Bulky items go to the back, small ones to the middle. Nothing overlaps; margins are kept if the surface is large
    enough for them. Items higher than the headroom are left out. With an arm, spots in its reach are preferred.
    """
    fitting = [i for i, item in enumerate(items) if headroom is None or item.height <= headroom]
    order = sorted(fitting, key=lambda i: (-items[i].width * items[i].depth, items[i].name, i))
    best: dict[int, SurfaceSpot] = {}
    for _ in range(TRIES):
        spots: dict[int, SurfaceSpot] = {}
        for index in order:
            spot = _place(items[index], width, depth, generator, [*taken, *spots.values()], arm)
            if spot is not None:
                spots[index] = spot
        if len(spots) > len(best):
            best = spots
        if len(best) == len(fitting):
            break
    return best


def _place(
    item: SurfaceItem,
    width: float,
    depth: float,
    generator: np.random.Generator,
    taken: Sequence[SurfaceSpot],
    arm: Arm | None = None,
) -> SurfaceSpot | None:
    for yaw, w, d in ((0.0, item.width, item.depth), (math.pi / 2.0, item.depth, item.width)):
        if w > width + 1e-9 or d > depth + 1e-9:
            continue
        xs, ys = _offsets(width, w, item.margin), _offsets(depth, d, item.margin)
        free = np.ones((len(ys), len(xs)), dtype=np.bool_)
        for spot in taken:
            near_x = np.abs(xs - spot.x) < (w + spot.width) / 2.0 + GAP
            near_y = np.abs(ys - spot.y) < (d + spot.depth) / 2.0 + GAP
            free &= ~(near_x[None, :] & near_y[:, None])
        if not free.any():
            continue
        bulky = w * d > BULKY
        row_y = (-depth / 2.0 if depth < ONE_SIDED else generator.choice((-0.5, 0.5)) * depth) if bulky else 0.0
        column_x = generator.uniform(-width / 2.0, width / 2.0)
        cost = np.abs(xs - column_x)[None, :] + (ROW_COST * np.abs(ys - row_y))[:, None]
        cost = cost + generator.uniform(0.0, NOISE, free.shape)
        if arm is not None:
            lift = item.height / 2.0 - arm.z
            far = np.sqrt((xs - arm.x)[None, :] ** 2 + (ys - arm.y)[:, None] ** 2 + lift**2)
            cost += STRETCH_COST * np.maximum(far - arm.reach, 0.0)
        row, column = np.unravel_index(np.argmin(np.where(free, cost, np.inf)), free.shape)
        return SurfaceSpot(round(float(xs[column]), 4), round(float(ys[row]), 4), yaw, w, d)
    return None


def _offsets(length: float, size: float, margin: float) -> NDArray[np.float64]:
    """Centers on the grid, symmetric about 0, that keep the margin; only the middle if the margin cannot be kept."""
    reach = max((length - size) / 2.0 - margin, 0.0)
    steps = math.floor(reach / GRID + 1e-9)
    return np.arange(-steps, steps + 1, dtype=np.float64) * GRID
