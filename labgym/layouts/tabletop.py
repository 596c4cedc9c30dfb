"""Arranges things on one surface: a seeded scan of a centimetre grid, largest item first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GRID = 0.01
"""Spacing of the places that are tried, metres."""
GAP = 0.03
"""Least gap between neighbours, metres."""
DOUBLE = 1.2
"""Surfaces from this depth on are used from both sides, metres; others have their back to a wall."""
TRIES = 6
"""Arrangements tried before a surface counts as full."""


@dataclass(frozen=True)
class Item:
    """A thing to stand on a surface: footprint and height in metres, and the margin that it wants to every edge."""

    name: str
    width: float
    depth: float
    height: float
    margin: float


@dataclass(frozen=True)
class Spot:
    """Where an item stands: its centre relative to the surface's centre, metres, and its yaw to the surface."""

    x: float
    y: float
    yaw: float
    width: float
    depth: float


def pack(
    items: Sequence[Item],
    width: float,
    depth: float,
    headroom: float | None,
    generator: np.random.Generator,
    taken: Sequence[Spot] = (),
) -> dict[int, Spot]:
    """Return spots for as many items as fit, by index into `items`.

    Bulky items go to the back, small ones to the middle; nothing overlaps, every margin holds where the surface
    allows it at all. Items higher than the headroom are left out.
    """
    fitting = [i for i, item in enumerate(items) if headroom is None or item.height <= headroom]
    order = sorted(fitting, key=lambda i: (-items[i].width * items[i].depth, items[i].name, i))
    best: dict[int, Spot] = {}
    for _ in range(TRIES):
        found: dict[int, Spot] = {}
        for index in order:
            spot = _place(items[index], width, depth, generator, [*taken, *found.values()])
            if spot is not None:
                found[index] = spot
        if len(found) > len(best):
            best = found
        if len(best) == len(fitting):
            break
    return best


def _place(
    item: Item, width: float, depth: float, generator: np.random.Generator, taken: Sequence[Spot]
) -> Spot | None:
    for yaw, w, d in ((0.0, item.width, item.depth), (math.pi / 2.0, item.depth, item.width)):
        if w > width + 1e-9 or d > depth + 1e-9:
            continue
        xs, ys = _offsets(width, w, item.margin), _offsets(depth, d, item.margin)
        grid_x, grid_y = np.meshgrid(xs, ys)
        free = np.ones(grid_x.shape, dtype=np.bool_)
        for spot in taken:
            near_x = np.abs(grid_x - spot.x) < (w + spot.width) / 2.0 + GAP
            near_y = np.abs(grid_y - spot.y) < (d + spot.depth) / 2.0 + GAP
            free &= ~(near_x & near_y)
        if not free.any():
            continue
        bulky = w * d > 0.03
        wanted_y = (-depth / 2.0 if depth < DOUBLE else generator.choice((-0.5, 0.5)) * depth) if bulky else 0.0
        wanted_x = generator.uniform(-width / 2.0, width / 2.0)
        cost = np.abs(grid_x - wanted_x) + 2.0 * np.abs(grid_y - wanted_y) + generator.uniform(0.0, 0.05, free.shape)
        row, column = np.unravel_index(np.argmin(np.where(free, cost, np.inf)), free.shape)
        return Spot(round(float(xs[column]), 4), round(float(ys[row]), 4), yaw, w, d)
    return None


def _offsets(length: float, size: float, margin: float) -> NDArray[np.float64]:
    """Centres on the grid, symmetric about 0, that keep the margin; the middle alone where it cannot be kept."""
    reach = max((length - size) / 2.0 - margin, 0.0)
    steps = math.floor(reach / GRID + 1e-9)
    return np.arange(-steps, steps + 1, dtype=np.float64) * GRID
