"""The parts of a top-down picture: room, furniture, carried objects, goal poses, traces and violations."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.eval.drawing import palette
from labgym.eval.drawing.floor_drawing import draw_floor, draw_names, swings
from labgym.eval.drawing.plan_labels import FONT, label_furniture
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules import Violation
from labgym.layouts.rules.rule import FacilityIssue

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ON_TOP = 40
"""Drawing order from which traces and goal poses are above every object."""
MARK = 0.3
"""Distance below which violations share a mark, meters."""
ARROW = 0.42
"""Length of the arrow along a goal pose's heading, meters."""


@dataclass(frozen=True)
class DrivenPath:
    """A path to draw.

    Attributes:
        policy: name of the policy.
        points: (n, 2) positions of the robot's center, meters, room frame.
        success: whether the robot reached the goal; a cross marks the end of a path that did not.
    """

    policy: str
    points: NDArray[np.float64]
    success: bool = True


def draw_plan(axes: Axes, floor: Floor) -> None:
    """Draw floor, meter grid, walls and openings, and set the limits of the axes to them."""
    x0, y0, x1, y1 = floor.bounds
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    draw_floor(axes, floor)


def plan_size(floor: Floor) -> tuple[float, float]:
    """Return width and depth of a floor with its walls, meters."""
    x0, y0, x1, y1 = floor.bounds
    return x1 - x0, y1 - y0


def draw_objects(
    axes: Axes, layout: Layout, scale: float | None, poses: Iterable[tuple[float, float, float]] = ()
) -> None:
    """Draw placements, lower ones first, with front edges, names and hazards.

    Of the contents of storage cabinets only reagents are drawn.

    Args:
        scale: points of the picture per meter; None leaves names out.
        poses: goal poses, which names do not cover.
    """
    for placement in sorted(layout.placements, key=lambda p: (p.support != FLOOR, layout.box(p.id).z1, p.id)):
        asset, box = layout.asset(placement.id), layout.box(placement.id)
        if asset.kind == "reagent":
            _draw_reagent(axes, asset, box)
        elif placement.support == FLOOR:
            _draw_furniture(axes, asset, box, layout.open_parts(placement.id))
        elif placement.support == WALL or layout.asset(placement.support).storage_class is None:
            _draw_item(axes, asset, box, hanging=placement.support == WALL)
    if scale is not None:
        _draw_all_names(axes, layout, scale, poses)


def _draw_all_names(axes: Axes, layout: Layout, scale: float, poses: Iterable[tuple[float, float, float]]) -> None:
    furniture = [layout.box(placement.id) for placement in layout.placements if placement.support == FLOOR]
    occupied = [*swings(layout.floor), *draw_names(axes, layout.floor, scale, furniture)]
    for x, y, yaw in poses:
        ends = np.array([(x, y), (x + ARROW * math.cos(yaw), y + ARROW * math.sin(yaw))])
        low, high = ends.min(axis=0) - 0.13, ends.max(axis=0) + 0.13
        occupied.append((low[0], low[1], high[0], high[1]))
    label_furniture(axes, layout, scale, occupied)


def draw_violations(axes: Axes, layout: Layout, violations: Sequence[Violation | FacilityIssue]) -> None:
    """Outline the placements of each violation in red, with the violation's number."""
    from matplotlib.patches import Polygon

    for placement_id in dict.fromkeys(name for violation in violations for name in violation.ids):
        outline = layout.box(placement_id).corners()
        axes.add_patch(Polygon(outline, closed=True, fill=False, edgecolor=palette.ALARM, linewidth=1.8, zorder=33))
    places: dict[tuple[float, float], list[int]] = {}
    for number, violation in enumerate(violations, start=1):
        if violation.ids:
            middle = _middle(layout, violation)
            shared = next((place for place in places if math.dist(place, middle) < MARK), middle)
            places.setdefault(shared, []).append(number)
    for (x, y), numbers in places.items():
        style: dict[str, Any] = {
            "boxstyle": "round,pad=0.25",
            "facecolor": palette.ALARM,
            "edgecolor": "#ffffff",
            "linewidth": 0.8,
        }
        text = ", ".join(map(str, numbers))
        font: dict[str, Any] = {"fontsize": 6.6, "family": FONT, "weight": "bold", "color": "#ffffff"}
        axes.text(x, y, text, **font, bbox=style, ha="center", va="center", zorder=ON_TOP + 30)


def _middle(layout: Layout, violation: Violation | FacilityIssue) -> tuple[float, float]:
    """Return the middle of the overlap of a violation's placements, or of the gap between them."""
    bounds = np.array([layout.box(placement_id).bounds() for placement_id in violation.ids])
    x, y = (bounds[:, :2].max(axis=0) + bounds[:, 2:].min(axis=0)) / 2.0
    return float(x), float(y)


def _draw_furniture(axes: Axes, asset: Asset, box: OrientedBox, open_parts: Iterable[OrientedBox] = ()) -> None:
    from matplotlib.patches import Polygon

    look = palette.swatch(asset)
    corners = box.corners()
    for part in open_parts:
        axes.add_patch(Polygon(part.corners(), facecolor=look.fill, edgecolor=look.edge, linewidth=0.8, zorder=7))
    axes.add_patch(Polygon(corners, closed=True, facecolor=look.fill, edgecolor=look.edge, linewidth=0.8, zorder=8))
    # Corners 3 and 2 are the ends of the front edge.
    front = np.array([corners[3], corners[2]])
    stripe = palette.STORAGE_COLORS.get(asset.storage_class or "", look.edge)
    axes.plot(*front.T, color=stripe, linewidth=2.6, solid_capstyle="butt", zorder=9)


def _draw_item(axes: Axes, asset: Asset, box: OrientedBox, hanging: bool) -> None:
    from matplotlib.patches import Ellipse, Polygon

    look = palette.swatch(asset)
    edge = palette.HEAT if asset.heat_class else look.edge
    width = 1.1 if asset.heat_class else 0.6
    style = {"facecolor": look.fill, "edgecolor": edge, "linewidth": width, "zorder": 14 if not hanging else 16}
    if hanging:
        style |= {"facecolor": "none", "linestyle": (0, (2, 1.5))}
    if asset.hazards.glass_container and not hanging:
        axes.add_patch(Ellipse((box.x, box.y), box.width, box.depth, angle=math.degrees(box.yaw), **style))
    else:
        axes.add_patch(Polygon(box.corners(), closed=True, **style))


def _draw_reagent(axes: Axes, asset: Asset, box: OrientedBox) -> None:
    storage = asset.chemistry.storage_class if asset.chemistry else "General"
    edge = palette.FLAME if asset.hazards.flammable else "#ffffff"
    color = palette.STORAGE_COLORS[storage]
    axes.plot(box.x, box.y, "o", markersize=4.0, color=color, markeredgecolor=edge, markeredgewidth=0.8, zorder=31)


def draw_traces(axes: Axes, traces: Sequence[DrivenPath], colors: dict[str, str]) -> None:
    """Draw paths, those of the first policy on top; a cross marks the end of a path that missed its goal."""
    for depth, policy in enumerate(colors):
        for trace in traces:
            if trace.policy != policy:
                continue
            order = ON_TOP + len(colors) - depth
            color = colors[policy]
            width = 1.9 if depth == 0 else 1.2
            axes.plot(
                *trace.points.T,
                color="#ffffff",
                linewidth=width + 1.2,
                alpha=0.7,
                solid_capstyle="round",
                zorder=ON_TOP,
            )
            axes.plot(*trace.points.T, color=color, linewidth=width, solid_capstyle="round", zorder=order)
            if not trace.success:
                axes.plot(*trace.points[-1], "x", color=color, markersize=6, markeredgewidth=1.8, zorder=order)


def draw_goals(axes: Axes, poses: dict[str, tuple[float, float, float]]) -> None:
    """Draw numbered goal poses in the order of the mapping, an arrow along each heading."""
    for number, (x, y, yaw) in enumerate(poses.values(), start=1):
        tip = (x + ARROW * math.cos(yaw), y + ARROW * math.sin(yaw))
        arrow = {"arrowstyle": "-|>,head_width=0.22,head_length=0.4", "color": palette.INK, "linewidth": 1.3}
        axes.annotate("", xy=tip, xytext=(x, y), arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0}, zorder=ON_TOP + 20)
        axes.plot(
            x,
            y,
            "o",
            markersize=11,
            color=palette.INK,
            markeredgecolor="#ffffff",
            markeredgewidth=1.0,
            zorder=ON_TOP + 21,
        )
        axes.text(
            x,
            y,
            str(number),
            fontsize=6.6,
            family=FONT,
            color="#ffffff",
            weight="bold",
            ha="center",
            va="center_baseline",
            zorder=ON_TOP + 22,
        )
