"""The sheet of a plan: paper, scale, scale bar, title block, legend and key."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from labgym import __version__
from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.layouts import Layout
from labgym.layouts.placement import WALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAPERS: tuple[tuple[str, float, float, int], ...] = (
    ("A3", 420.0, 297.0, 75),
    ("A2", 594.0, 420.0, 100),
    ("A1", 841.0, 594.0, 100),
    ("A0", 1189.0, 841.0, 200),
)
"""Paper sizes (ISO 216, landscape): name, width and height in millimeters, and the smallest scale drawn on them."""
SCALES = (20, 25, 50, 75, 100, 200)
BORDER = 10.0
"""Distance of the frame from the edge of the paper, millimeters."""
COLUMN = 88.0
"""Width of the column with title block, legend and key, millimeters."""
BAR = 14.0
"""Height of the strip with the scale bar below the plan, millimeters."""
MM_PER_INCH = 25.4
FONT = "DejaVu Sans"


@dataclass(frozen=True)
class Sheet:
    """A sheet of paper and the scale of the plan on it.

    Attributes:
        paper: name of the paper size. width, height: of the paper, millimeters.
        scale: denominator of the scale.
    """

    paper: str
    width: float
    height: float
    scale: int

    @property
    def points_per_meter(self) -> float:
        """Printed length of a meter in points."""
        return 1000.0 / self.scale / MM_PER_INCH * 72.0

    def length(self, meters: float) -> float:
        """Return the printed length of meters, in millimeters."""
        return 1000.0 * meters / self.scale


def sheet_for(width: float, depth: float) -> Sheet:
    """Return the smallest sheet that shows an area of that size in meters, at the largest scale.

    Raises:
        OptionError: the area fits no sheet.
    """
    for paper, across, up, smallest in PAPERS:
        room = across - 2.0 * BORDER - COLUMN, up - 2.0 * BORDER - BAR
        for scale in SCALES:
            if scale <= smallest and 1000.0 * width / scale <= room[0] and 1000.0 * depth / scale <= room[1]:
                return Sheet(paper, across, up, scale)
    raise OptionError(f"a plan of {width:.0f} x {depth:.0f} m fits no sheet up to A0 at 1:{SCALES[-1]}")


def draw_scale_bar(axes: Axes, sheet: Sheet, x: float, y: float) -> None:
    """Draw a bar of 5 m, or of 2 m at large scales, with its left end at (x, y) in millimeters."""
    from matplotlib.patches import Rectangle

    meters = 2 if sheet.scale <= 25 else 5
    for index in range(meters):
        color = palette.INK if index % 2 == 0 else "#ffffff"
        place = (x + sheet.length(index), y)
        axes.add_patch(Rectangle(place, sheet.length(1.0), 1.6, facecolor=color, edgecolor=palette.INK, linewidth=0.5))
    for index in range(meters + 1):
        label = f"{index} m" if index == meters else str(index)
        _text(axes, x + sheet.length(index), y + 2.6, label, 6.0, ha="center", va="bottom")
    _text(axes, x + sheet.length(meters) + 12.0, y + 0.2, f"1:{sheet.scale} on {sheet.paper}", 7.0)


class SheetColumn:
    """The column at the right of a sheet, written downwards from `y`, in millimeters."""

    def __init__(self, axes: Axes, sheet: Sheet) -> None:
        self.axes = axes
        self.x = sheet.width - BORDER - COLUMN + 4.0
        self.right = sheet.width - BORDER
        self.y = sheet.height - BORDER - 4.0
        axes.plot([self.x - 4.0] * 2, [BORDER, sheet.height - BORDER], color=palette.INK, linewidth=0.6)

    def title(self, layout: Layout, sheet: Sheet, area: float) -> None:
        """Write the title block: protocols, layout, hash, scale, area and version."""
        names = [protocol.name for protocol in layout.protocols] or [layout.id]
        for name in names[:3]:
            for line in textwrap.wrap(name, 40)[:2]:
                self.line(line, 9.0, weight="bold")
        rows = (
            ("Layout", layout.id),
            ("Hash", layout.hash[:16]),
            ("Scale", f"1:{sheet.scale} on {sheet.paper}, lengths in meters"),
            ("Floor area", f"{area:.1f} m²"),
            ("Objects", str(len(layout.placements))),
            ("Drawn by", f"labgym {__version__}"),
        )
        for name, value in rows:
            _text(self.axes, self.x, self.y - 3.4, name, 6.5, color=palette.MUTED)
            _text(self.axes, self.x + 18.0, self.y - 3.4, value[:48], 6.5)
            self.y -= 3.8
        self.rule()

    def legend(self, layout: Layout) -> None:
        """Explain fills and lines."""
        from matplotlib.patches import Rectangle

        swatches = {
            palette.swatch(layout.asset(placement.id)).label: palette.swatch(layout.asset(placement.id))
            for placement in layout.placements
            if layout.asset(placement.id).kind != "reagent"
        }
        self.line("Legend", 7.5, weight="bold")
        entries: list[tuple[str, dict[str, Any]]] = [
            ("wall", {"facecolor": palette.WALL, "edgecolor": palette.WALL}),
            *((label, {"facecolor": each.fill, "edgecolor": each.edge}) for label, each in sorted(swatches.items())),
        ]
        if any(placement.support == WALL for placement in layout.placements):
            hanging = {"facecolor": "none", "edgecolor": palette.MUTED, "linestyle": (0, (2, 1.5))}
            entries.append(("mounted on a wall", hanging))
        if layout.floor.keep_outs:
            entries.append(("no furniture here", KEEP_OUT))
        for label, style in entries:
            self.axes.add_patch(Rectangle((self.x, self.y - 3.3), 5.0, 2.4, **{"linewidth": 0.6, **style}))
            _text(self.axes, self.x + 7.5, self.y - 3.3, label, 6.5)
            self.y -= 3.8
        kinds = sorted({service.kind for service in layout.floor.services})
        if kinds:
            self.axes.plot(self.x + 2.5, self.y - 2.1, "o", markersize=5.5, **SERVICE)
            _text(self.axes, self.x + 7.5, self.y - 3.3, ", ".join(f"{kind[0].upper()} {kind}" for kind in kinds), 6.5)
            self.y -= 3.8
        lines = (("length between walls, width of an opening", DIMENSION), ("narrowest width of an aisle", AISLE))
        for label, color in lines:
            self.axes.plot([self.x, self.x + 5.0], [self.y - 2.1] * 2, color=color, linewidth=0.8)
            _text(self.axes, self.x + 7.5, self.y - 3.3, label, 6.5)
            self.y -= 3.8
        self.rule()

    def key(self, names: Sequence[str]) -> None:
        """List the ids of the numbered objects."""
        if not names:
            return
        self.line("Key", 7.5, weight="bold")
        for number, name in enumerate(names, start=1):
            if self.y < BORDER + 6.0:
                self.line(f"and {len(names) - number + 1} more: see the bill of materials", 6.0)
                return
            _text(self.axes, self.x + 4.0, self.y - 3.0, str(number), 6.2, ha="right", weight="bold")
            _text(self.axes, self.x + 7.5, self.y - 3.0, name[:52], 6.2)
            self.y -= 3.3

    def line(self, text: str, size: float, weight: str = "normal") -> None:
        """Write a line."""
        self.y -= 0.5 * size
        _text(self.axes, self.x, self.y, text, size, weight=weight)
        self.y -= 1.0

    def rule(self) -> None:
        """Draw a line across the column."""
        self.y -= 2.0
        self.axes.plot([self.x - 4.0, self.right], [self.y] * 2, color=palette.INK, linewidth=0.6)
        self.y -= 1.5


DIMENSION, AISLE = "#23282d", "#0060a8"
"""Colors of dimensions."""
SERVICE: dict[str, Any] = {"color": "#ffffff", "markeredgecolor": "#7b4fa3", "markeredgewidth": 0.8}
KEEP_OUT: dict[str, Any] = {"facecolor": "none", "edgecolor": "#e9899b", "hatch": "///", "linewidth": 0.5}
"""Looks of service points and of areas without furniture."""


def _text(axes: Axes, x: float, y: float, text: str, size: float, **style: Any) -> None:
    axes.text(x, y, text, fontsize=size, family=FONT, **{"color": palette.INK, "va": "baseline", **style})
