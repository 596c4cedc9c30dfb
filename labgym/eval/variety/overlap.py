"""How alike two floors are furnished: the overlap of their furniture under the best of the eight symmetries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.eval.variety.sketch import FloorSketch

CELLS = 128
"""Number of cells along each side of a floor."""
ALIKE = 1.25
"""Floors whose areas, longer sides and shorter sides differ by at most this factor are of about one size."""
SUBPIXELS = 4

Mask = NDArray[np.bool_]


def occupied(floor: FloorSketch) -> Mask:
    """Return the cells that furniture without clutter takes, (128, 128).

    The bounds of the floor are stretched onto a square, so that walls of floors of different sizes coincide.
    """
    image = np.zeros((CELLS, CELLS), dtype=np.uint8)
    low, size = floor.extent[:2], np.array(floor.size)
    for x, y, width, depth, yaw in floor.furniture.tolist():
        cosine, sine = np.cos(yaw), np.sin(yaw)
        axes = np.array([[cosine, sine], [-sine, cosine]])
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        corners = np.array([x, y]) + (signs * (width / 2.0, depth / 2.0)) @ axes
        pixels = (corners - low) / size * CELLS - 0.5
        cv2.fillConvexPoly(image, (pixels * 2**SUBPIXELS).round().astype(np.int32), (1,), shift=SUBPIXELS)
    return np.asarray(image > 0)


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
