"""Sketches of rectangular rooms with a door in the middle of the front wall, at any pose."""

from __future__ import annotations

import math

import numpy as np

from labgym.eval.variety.sketch import STEP, FloorSketch


def sketch(width: float, depth: float, furniture: np.ndarray, clutter: np.ndarray | None = None) -> FloorSketch:
    """A room from (0, 0) to (width, depth)."""
    xs, ys = np.arange(0.0, width, STEP), np.arange(0.0, depth, STEP)
    x, y = np.meshgrid(xs, ys)
    walls = np.minimum(np.minimum(x, width - x), np.minimum(y, depth - y))
    return FloorSketch(
        walls=walls.astype(np.float16),
        low=np.zeros(2),
        extent=np.array([0.0, 0.0, width, depth]),
        entrance=np.array([width / 2.0, 0.0, 0.0]),
        furniture=np.asarray(furniture, dtype=np.float64).reshape(-1, 5),
        clutter=np.empty((0, 5)) if clutter is None else clutter,
    )


def turned(width: float, depth: float, furniture: np.ndarray) -> FloorSketch:
    """The same room turned by a quarter, with its door in the middle of the right wall of a room depth wide."""
    x, y, *sizes, yaw = furniture.T
    boxes = np.column_stack([depth - y, x, *sizes, yaw + math.pi / 2.0])
    room = sketch(depth, width, boxes)
    return FloorSketch(**{**vars(room), "entrance": np.array([depth, width / 2.0, math.pi / 2.0])})
