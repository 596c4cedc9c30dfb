"""The panel next to a top-down picture: title, stops of the protocol, routes, violations and legend."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from labgym.eval.drawing import palette
from labgym.eval.drawing.floor_drawing import SERVICES, service_style
from labgym.eval.drawing.plan_drawing import DrivenPath
from labgym.eval.drawing.plan_labels import FONT, readable_name
from labgym.layouts.floor import Floor
from labgym.layouts.model import Layout
from labgym.layouts.rules import Violation
from labgym.layouts.rules.rule import FacilityIssue
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_INCHES = 2.5
TEXT = 7.5
LINE = 0.165
"""Font size of the text in points, and the height of its lines in inches."""
MOST_VIOLATIONS = 6


def floor_size(floor: Floor) -> str:
    """Return the size of a floor as text: the number of its spaces, and its extent with its walls."""
    x0, y0, x1, y1 = floor.bounds
    count = len(floor.spaces)
    return f"{count} space{'s' if count > 1 else ''}, {x1 - x0:.1f} x {y1 - y0:.1f} m"


class Panel:
    """A column of text and swatches, written from top to bottom; `y` is the distance from the top in inches."""

    def __init__(self, axes: Axes) -> None:
        self.axes = axes
        self.y = 0.0
        axes.set_xlim(0.0, PANEL_INCHES)
        axes.set_axis_off()

    def title(self, layout: Layout, protocol: Protocol | None) -> None:
        """Write the protocol's name, those of the others of the layout, and the layout's id and size."""
        for line in textwrap.wrap(protocol.name if protocol else layout.id, 30)[:3]:
            self._text(line, 10.0, weight="bold", line=0.19)
        others = [each.name for each in layout.protocols if protocol is None or each.id != protocol.id]
        for name in others if len(layout.protocols) > 1 else ():
            for line in textwrap.wrap(f"and {name}", 42)[:2]:
                self._text(line)
        size, count = floor_size(layout.floor), f"{len(layout.placements)} objects, grid 1 m"
        for line in (layout.id, size, count):
            self._text(line, color=palette.MUTED)

    def stops(self, locations: Sequence[str]) -> None:
        """List the numbered locations."""
        self._heading("Route of the protocol")
        for number, location in enumerate(locations, start=1):
            centre = (0.1, self.y + LINE / 2.0)
            self.axes.plot(*centre, "o", markersize=9, color=palette.INK)
            style: dict[str, Any] = {
                "family": FONT,
                "weight": "bold",
                "color": "#ffffff",
                "ha": "center",
                "va": "center_baseline",
            }
            self.axes.text(*centre, str(number), fontsize=6, **style)
            self._text(readable_name(location), indent=0.3)

    def traces(self, traces: Sequence[DrivenPath], colors: dict[str, str]) -> None:
        """List the policies with their numbers of successful drives."""
        self._heading("Routes")
        for policy, color in colors.items():
            drives = [trace for trace in traces if trace.policy == policy]
            self._line(color, f"{policy}: {sum(trace.success for trace in drives)} of {len(drives)} reach the goal")

    def violations(self, violations: Sequence[Violation | FacilityIssue]) -> None:
        """List the violations with their numbers."""
        self._heading(f"Violations: {len(violations)}")
        for number, violation in enumerate(violations[:MOST_VIOLATIONS], start=1):
            mark: dict[str, Any] = {"family": FONT, "weight": "bold", "color": palette.ALARM, "ha": "center"}
            self.axes.text(0.1, self.y + LINE / 2.0, str(number), fontsize=TEXT, va="center_baseline", **mark)
            lines = textwrap.wrap(violation.message, 42)
            for line in [*lines[:2], "..."][: len(lines)] if len(lines) > 3 else lines:
                self._text(line, size=6.3, indent=0.3, line=0.14)
        if len(violations) > MOST_VIOLATIONS:
            self._text(f"and {len(violations) - MOST_VIOLATIONS} more: see `labgym score`", size=6.3, indent=0.3)

    def legend(self, layout: Layout) -> None:
        """Explain the colors that occur in the layout."""
        assets = [layout.asset(placement.id) for placement in layout.placements]
        self._heading("Objects")
        swatches = {palette.swatch(asset).label: palette.swatch(asset) for asset in assets if asset.kind != "reagent"}
        for label in sorted(swatches):
            self._box(swatches[label].fill, swatches[label].edge, label)
        if any(asset.heat_class for asset in assets):
            self._box("#ffffff", palette.HEAT, "heat source")
        classes = {
            asset.storage_class or (asset.chemistry.storage_class if asset.chemistry else None) for asset in assets
        }
        self._heading("Reagents (dots) and fronts of cabinets")
        present = [name for name in palette.STORAGE_COLORS if name in classes]
        top = self.y
        for place, name in enumerate(present):
            # Two columns, filled downwards.
            rows = (len(present) + 1) // 2
            self.y = top + place % rows * LINE
            self._line(
                palette.STORAGE_COLORS[name], readable_name(name).lower(), left=place // rows * PANEL_INCHES / 2.0
            )
        self.y = top + (len(present) + 1) // 2 * LINE
        self._dot(palette.STORAGE_COLORS["Flammable"], palette.FLAME, "red rim: flammable")

    def fixtures(self, floor: Floor) -> None:
        """Explain the marks of services and keep-outs that occur on the floor."""
        kinds = [kind for kind in SERVICES if any(service.kind == kind for service in floor.services)]
        if not kinds and not floor.keep_outs:
            return
        self._heading("Building")
        for kind in kinds:
            self.axes.text(0.1, self.y + LINE / 2.0, SERVICES[kind], **service_style())
            self._text(kind, indent=0.3)
        if floor.keep_outs:
            self._hatched("no furniture")

    def _hatched(self, text: str) -> None:
        from matplotlib.patches import Rectangle

        low = self.y + (LINE - 0.11) / 2.0
        style: dict[str, Any] = {"edgecolor": palette.MUTED, "linewidth": 0.7, "hatch": "////", "alpha": 0.5}
        self.axes.add_patch(Rectangle((0.01, low), 0.18, 0.11, fill=False, **style))
        self._text(text, indent=0.3)

    def _heading(self, text: str) -> None:
        self.y += 0.12
        self._text(text, weight="bold", line=0.18)

    def _line(self, color: str, text: str, left: float = 0.0) -> None:
        ends = [left, left + 0.2]
        self.axes.plot(ends, [self.y + LINE / 2.0] * 2, color=color, linewidth=2.6, solid_capstyle="butt")
        self._text(text, indent=left + 0.3)

    def _dot(self, fill: str, edge: str, text: str) -> None:
        self.axes.plot(
            0.1, self.y + LINE / 2.0, "o", markersize=5.5, color=fill, markeredgecolor=edge, markeredgewidth=1.1
        )
        self._text(text, indent=0.3)

    def _box(self, fill: str, edge: str, text: str) -> None:
        from matplotlib.patches import Rectangle

        low = self.y + (LINE - 0.11) / 2.0
        self.axes.add_patch(Rectangle((0.01, low), 0.18, 0.11, facecolor=fill, edgecolor=edge, linewidth=0.9))
        self._text(text, indent=0.3)

    def _text(
        self,
        text: str,
        size: float = TEXT,
        weight: str = "normal",
        color: str = palette.INK,
        indent: float = 0.0,
        line: float = LINE,
    ) -> None:
        style: dict[str, Any] = {
            "family": FONT,
            "fontsize": size,
            "weight": weight,
            "color": color,
            "ha": "left",
            "va": "center_baseline",
        }
        self.axes.text(indent, self.y + line / 2.0, text, **style)
        self.y += line
