"""Names of furniture in a top-down picture: wrapped, shrunk and turned to fit, aside of what stands there."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.eval.drawing import palette
from labgym.layouts.model import FLOOR, WALL, Layout, Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FONT = "DejaVu Sans"
SIZES = (7.0, 6.3, 5.6, 5.0)
"""Sizes that a name may have, points: the largest that fits is taken, and none is written where none fits."""

LINE = 1.25
"""Height of a line of text over its size."""


def label_furniture(axes: Axes, layout: Layout, scale: float) -> None:
    """Write the names of what stands on the floor.

    Args:
        scale: points of the picture that a metre takes.
    """
    carried: dict[str, list[Placement]] = {}
    for placement in layout.placements:
        if placement.support not in (FLOOR, WALL):
            carried.setdefault(layout.root(placement.id).id, []).append(placement)
    for placement in layout.placements:
        if placement.support == FLOOR:
            _label(axes, layout, placement, carried.get(placement.id, []), scale)


def readable_name(name: str) -> str:
    """Return a CamelCase name as words in sentence case: "FumeHood1800" is "Fume hood 1800"."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[0-9]+|[a-z]+", name)
    rest = [part if part.isupper() and len(part) > 1 else part.lower() for part in parts[1:]]
    return " ".join([parts[0], *rest]) if parts else name


def _label(axes: Axes, layout: Layout, placement: Placement, carried: Sequence[Placement], scale: float) -> None:
    from matplotlib.patheffects import withStroke

    box = layout.box(placement.id)
    x0, y0, x1, y1 = box.bounds()
    upright = (y1 - y0) > 1.3 * (x1 - x0)
    length, breadth = ((y1 - y0), (x1 - x0)) if upright else ((x1 - x0), (y1 - y0))
    fitted = _fitted(readable_name(placement.asset), length * scale, breadth * scale)
    if fitted is None:
        return
    text, size = fitted
    centres = [(layout.box(item.id).x - box.x, layout.box(item.id).y - box.y) for item in carried]
    across = [dx if upright else dy for dx, dy in centres]
    shift = _aside(across, breadth - _extent(text, size)[1] / scale)
    x, y = (box.x + shift, box.y) if upright else (box.x, box.y + shift)
    halo = [withStroke(linewidth=1.6, foreground=palette.swatch(layout.asset(placement.id)).fill)]
    style: dict[str, Any] = {
        "fontsize": size,
        "family": FONT,
        "color": palette.INK,
        "linespacing": 1.05,
        "zorder": 30,
        "path_effects": halo,
    }
    turn: dict[str, Any] = {"rotation": 90 if upright else 0, "rotation_mode": "anchor", "ha": "center", "va": "center"}
    axes.text(x, y, text, **style, **turn)


def _aside(across: Sequence[float], play: float) -> float:
    """Return how far to move a name off the middle, towards the side that carries less, with `play` to move in."""
    if not across or play <= 0.0:
        return 0.0
    heavier = sum(across) / len(across)
    return -math.copysign(0.4 * play, heavier)


def _fitted(text: str, length: float, breadth: float) -> tuple[str, float] | None:
    """Return the wrapped text and size that fit a rectangle given in points, or None."""
    for size in SIZES:
        for wrapped in _wrappings(text):
            width, height = _extent(wrapped, size)
            if width <= 0.96 * length and height <= 0.96 * breadth:
                return wrapped, size
    return None


def _wrappings(text: str) -> Iterable[str]:
    """Yield a text on one line, then on two and three, broken as evenly as its words allow."""
    parts = text.split(" ")
    yield text
    for lines in range(2, min(len(parts), 3) + 1):
        rows = np.array_split(np.array(parts, dtype=object), lines)
        yield "\n".join(" ".join(row) for row in rows)


def _extent(text: str, size: float) -> tuple[float, float]:
    """Return a text's width and height in points."""
    lines = text.split("\n")
    return max(_width(line) for line in lines) * size, len(lines) * LINE * size


@cache
def _width(line: str) -> float:
    """Return a line's width over its size."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    across = TextPath((0, 0), line, size=100.0, prop=FontProperties(family=FONT)).vertices[:, 0]
    return float(across.max() - across.min()) / 100.0
