"""Names of furniture in a top-down picture: placed where they cover nothing, inside the outline or next to it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.eval.drawing import palette
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FONT = "DejaVu Sans"
SIZES = (7.0, 6.3, 5.6, 5.0)
"""Font sizes of names, points; the largest that fits is taken."""
LINE = 1.25
"""Height of a line of text relative to its font size."""
GAPS = (0.07, 0.3)
"""Distances of a name from its furniture if it is outside, meters; the larger one is for names in front."""
MARGIN = 0.03
"""Distance of a name from its furniture's outline if it is inside, meters."""
DOT = 0.07
"""Half the width of a reagent's dot, meters."""
STEPS = 13
"""Number of positions that are tried along each axis."""

_DIRECTIONS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
Rectangle = tuple[float, float, float, float]
"""x0, y0, x1, y1 in meters."""


@dataclass(frozen=True)
class Label:
    """A name in the picture: its center in meters, font size in points, and whether it reads upwards."""

    text: str
    x: float
    y: float
    size: float
    upright: bool

    def rectangle(self, scale: float) -> Rectangle:
        """Return the space that the text takes; `scale` is points per meter."""
        width, height = text_extent(self.text, self.size)
        across, up = (height, width) if self.upright else (width, height)
        across, up = across / scale / 2.0, up / scale / 2.0
        return self.x - across, self.y - up, self.x + across, self.y + up


def label_furniture(axes: Axes, layout: Layout, scale: float, occupied: Sequence[Rectangle] = ()) -> None:
    """Write the names of the placements on the floor.

    Args:
        scale: points of the picture per meter.
        occupied: rectangles on the floor that names must not cover, such as goal poses.
    """
    from matplotlib.patheffects import withStroke

    for placement_id, label in furniture_labels(layout, scale, occupied).items():
        outside = not _inside(layout.box(placement_id), np.array([label.rectangle(scale)]))[0]
        fill = palette.FLOOR if outside else palette.swatch(layout.asset(placement_id)).fill
        style: dict[str, Any] = {
            "fontsize": label.size,
            "family": FONT,
            "color": palette.MUTED if outside else palette.INK,
            "linespacing": 1.05,
            "zorder": 30,
            "path_effects": [withStroke(linewidth=1.6, foreground=fill)],
        }
        turn: dict[str, Any] = {
            "rotation": 90 if label.upright else 0,
            "rotation_mode": "anchor",
            "ha": "center",
            "va": "center",
        }
        axes.text(label.x, label.y, label.text, **style, **turn)


def furniture_labels(layout: Layout, scale: float, occupied: Sequence[Rectangle] = ()) -> dict[str, Label]:
    """Return a label for each placement on the floor that has room for one, by id.

    A label inside its furniture covers nothing that stands on it. Furniture without room for that has its label on
    the free floor next to it, in front if possible.
    """
    furniture = [placement for placement in layout.placements if placement.support == FLOOR]
    carried: dict[str, list[Rectangle]] = {placement.id: [] for placement in furniture}
    hanging: list[Rectangle] = []
    for placement in layout.placements:
        bounds = layout.box(placement.id).bounds()
        if layout.asset(placement.id).kind == "reagent":
            x, y, _ = placement.position
            bounds = (x - DOT, y - DOT, x + DOT, y + DOT)
        if placement.support == WALL:
            hanging.append(bounds)
        elif placement.support != FLOOR and _drawn(layout, placement):
            carried[layout.root(placement.id).id].append(bounds)
    labels: dict[str, Label] = {}
    for placement in furniture:
        label = _label_inside(layout, placement, scale, (carried[placement.id] + hanging, carried[placement.id]))
        if label is not None:
            labels[placement.id] = label
    taken = [layout.box(placement.id).bounds() for placement in furniture] + list(occupied)
    for placement in furniture:
        if placement.id not in labels:
            label = _label_outside(layout, placement, scale, taken)
            if label is not None:
                labels[placement.id] = label
                taken.append(label.rectangle(scale))
    return labels


def readable_name(name: str) -> str:
    """Return a CamelCase name as words in sentence case: "FumeHood1800" is "Fume hood 1800"."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[0-9]+|[a-z]+", name)
    rest = [part if part.isupper() and len(part) > 1 else part.lower() for part in parts[1:]]
    return " ".join([parts[0], *rest]) if parts else name


def _drawn(layout: Layout, placement: Placement) -> bool:
    """Return whether a carried placement is drawn: of the contents of storage cabinets only reagents are."""
    return layout.asset(placement.id).kind == "reagent" or layout.asset(placement.support).storage_class is None


def _label_inside(
    layout: Layout, placement: Placement, scale: float, obstacles: Iterable[Sequence[Rectangle]]
) -> Label | None:
    """Return the largest label inside a placement's outline; the first sequence of obstacles that allows one counts."""
    box = layout.box(placement.id)
    x0, y0, x1, y1 = box.bounds()
    for rectangles in obstacles:
        for text, size, upright in _styles(readable_name(placement.asset), tall=(y1 - y0) > 1.3 * (x1 - x0)):
            label = Label(text, 0.0, 0.0, size, upright)
            reach = label.rectangle(scale)[2:]
            x, y = _positions((x0 + reach[0], x1 - reach[0]), (y0 + reach[1], y1 - reach[1]))
            candidates = np.column_stack([x - reach[0], y - reach[1], x + reach[0], y + reach[1]])
            free = _inside(box, candidates) & ~_overlaps(candidates, rectangles)
            if free.any():
                off_centre = np.where(free, np.hypot(x - box.x, y - box.y), np.inf)
                nearest = int(off_centre.argmin())
                return Label(text, float(x[nearest]), float(y[nearest]), size, upright)
    return None


def _label_outside(layout: Layout, placement: Placement, scale: float, taken: Sequence[Rectangle]) -> Label | None:
    """Return the largest horizontal label on the free floor next to a placement."""
    box = layout.box(placement.id)
    x0, y0, x1, y1 = box.bounds()
    front = np.array(box.corners()[2:4]).mean(axis=0) - (box.x, box.y)
    for text, size, upright in _styles(readable_name(placement.asset), tall=False):
        if upright:
            continue
        label = Label(text, 0.0, 0.0, size, upright)
        reach = np.array(label.rectangle(scale)[2:])
        half = np.array([(x1 - x0) / 2.0, (y1 - y0) / 2.0])
        places = [
            (direction, along, gap)
            for direction, along, gap in itertools.product(_DIRECTIONS, np.linspace(-0.6, 0.6, STEPS), GAPS)
            if gap == GAPS[0] or np.dot(direction, front) > 0.0
        ]
        # The center of the name stays next to its furniture.
        centres = np.array(
            [
                (x0 + half[0], y0 + half[1])
                + direction * (half + reach + gap)
                + direction[::-1] ** 2 * along * np.minimum(half, np.abs(half - reach))
                for direction, along, gap in places
            ]
        )
        candidates = np.column_stack([centres - reach, centres + reach])
        free = ~_overlaps(candidates, taken)
        free &= _in_one_space(layout.floor, candidates)
        if free.any():
            # In front first, then as near to the middle of a side as possible.
            cost = [-float(np.dot(direction, front)) + 0.4 * abs(along) + gap for direction, along, gap in places]
            best = int(np.where(free, cost, np.inf).argmin())
            return Label(text, float(centres[best, 0]), float(centres[best, 1]), size, upright)
    return None


def _in_one_space(floor: Floor, candidates: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which candidates (n, 4) lie in one space, by their corners, shape (n,)."""
    corners = candidates[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 2)
    within = [space.contains(corners).reshape(-1, 4).all(axis=1) for space in floor.spaces]
    return np.asarray(np.logical_or.reduce(within))


def _styles(text: str, tall: bool) -> Iterator[tuple[str, float, bool]]:
    """Yield wrapped texts with font sizes and orientations, the best first."""
    styles = itertools.product(_wrappings(text), SIZES, (False, True))
    turned = 0.5 if tall else 1.5
    # Costs are in points of size.
    yield from sorted(styles, key=lambda style: SIZES[0] - style[1] + turned * style[2] + 0.23 * style[0].count("\n"))


def _positions(x: tuple[float, float], y: tuple[float, float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a grid of points over two intervals as flat arrays; none if an interval is empty."""
    if x[0] > x[1] or y[0] > y[1]:
        return np.zeros(0), np.zeros(0)
    grid = np.meshgrid(np.linspace(*x, STEPS), np.linspace(*y, STEPS))
    return grid[0].ravel(), grid[1].ravel()


def _inside(box: OrientedBox, rectangles: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rectangles (n, 4) lie inside a box's outline, with a margin, shape (n,)."""
    corners = rectangles[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 4, 2) - (box.x, box.y)
    cosine, sine = np.cos(box.yaw), np.sin(box.yaw)
    local = np.abs(corners @ np.array([[cosine, -sine], [sine, cosine]]))
    limits = np.maximum(np.array([box.width, box.depth]) / 2.0 - MARGIN, 0.0)
    inside: NDArray[np.bool_] = np.logical_and.reduce(local <= limits, axis=(1, 2))
    return inside


def _overlaps(candidates: NDArray[np.float64], rectangles: Sequence[Rectangle]) -> NDArray[np.bool_]:
    """Return which candidates (n, 4) overlap any rectangle, shape (n,)."""
    others = np.array(rectangles, dtype=np.float64).reshape(-1, 4)
    low = np.maximum(candidates[:, None, :2], others[None, :, :2])
    high = np.minimum(candidates[:, None, 2:], others[None, :, 2:])
    overlap: NDArray[np.bool_] = np.logical_and.reduce(low < high - 1e-9, axis=2)
    return np.asarray(np.logical_or.reduce(overlap, axis=1))


def _wrappings(text: str) -> Iterator[str]:
    """Yield a text on one line, then on two and three, broken as evenly as its words allow."""
    parts = text.split(" ")
    yield text
    for lines in range(2, min(len(parts), 3) + 1):
        rows = np.array_split(np.array(parts, dtype=object), lines)
        yield "\n".join(" ".join(row) for row in rows)


def text_extent(text: str, size: float) -> tuple[float, float]:
    """Return a text's width and height in points."""
    lines = text.split("\n")
    return max(_width(line) for line in lines) * size, len(lines) * LINE * size


@cache
def _width(line: str) -> float:
    """Return a line's width relative to its font size."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    across = TextPath((0, 0), line, size=100.0, prop=FontProperties(family=FONT)).vertices[:, 0]
    return float(across.max() - across.min()) / 100.0
