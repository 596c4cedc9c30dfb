"""How alike two floors are furnished: the overlap of their furniture under the best of the eight symmetries."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from labgym.eval.variety.sketch import FloorSketch

CELLS = 128
"""Number of cells along each side of a floor."""
ALIKE = 1.25
"""Floors whose areas, longer sides and shorter sides differ by at most this factor are of about one size."""

Mask = NDArray[np.bool_]


def occupied(floor: FloorSketch) -> Mask:
    """Return the cells that furniture without clutter takes, (128, 128).

    The bounds of the floor are stretched onto a square, so that walls of floors of different sizes coincide.
    """
    middles = (np.arange(CELLS) + 0.5) / CELLS
    px, py = np.meshgrid(floor.extent[0] + middles * floor.size[0], floor.extent[1] + middles * floor.size[1])
    taken = np.zeros((CELLS, CELLS), dtype=bool)
    for x, y, width, depth, yaw in floor.furniture.tolist():
        cosine, sine = math.cos(yaw), math.sin(yaw)
        dx, dy = px - x, py - y
        along, across = np.abs(dx * cosine + dy * sine), np.abs(dy * cosine - dx * sine)
        taken |= (along <= width / 2.0) & (across <= depth / 2.0)
    return taken


def best_overlap(first: Mask, second: Mask) -> float:
    """Return the largest intersection over union of two square masks, the second turned and mirrored; 0 if empty."""
    best = 0.0
    for image in symmetries(second):
        union = np.count_nonzero(first | image)
        best = max(best, np.count_nonzero(first & image) / union if union else 0.0)
    return best


def symmetries(image: Mask) -> Iterator[Mask]:
    """Yield the eight turned and mirrored images of a square mask."""
    for mirrored in (image, image[:, ::-1]):
        for quarter in range(4):
            yield np.rot90(mirrored, quarter)


def overlaps(floors: Sequence[FloorSketch], areas: Sequence[float]) -> list[float]:
    """Return the best overlap of each pair of floors of about one size."""
    images = [occupied(floor) for floor in floors]
    sizes = [(area, max(floor.size), min(floor.size)) for floor, area in zip(floors, areas, strict=True)]
    pairs = (
        (a, b)
        for a, b in combinations(range(len(floors)), 2)
        if all(max(one, other) <= ALIKE * min(one, other) for one, other in zip(sizes[a], sizes[b], strict=True))
    )
    return [best_overlap(images[a], images[b]) for a, b in pairs]
