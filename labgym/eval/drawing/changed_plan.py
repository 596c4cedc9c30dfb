"""Draws the true floor of an episode over the map of before: what was added, moved, opened or shut is in color."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.eval.drawing import palette
from labgym.eval.drawing.plan_drawing import ON_TOP, DrivenPath, draw_objects, draw_plan, draw_traces, plan_size
from labgym.eval.drawing.plan_labels import FONT
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CHANGED, GONE = "#e0561b", "#2f6fb7"
"""Colors of things that the map lacks, and of things on the map that are gone."""
PUSHED = "#f5b041"
"""Fill of things that the robot can push."""
LEGEND = ((CHANGED, "not on the map"), (PUSHED, "not on the map; can be pushed"), (GONE, "on the map only"))
INCHES, MARGIN, LINE, CAPTION = 8.0, 0.1, 0.17, 0.6
"""Longer side of the plan, margin, height of a line of the legend, and height of the legend, inches."""


def changed_plan(
    before: Layout,
    after: Layout,
    pushable: Sequence[str] = (),
    traces: Sequence[DrivenPath] = (),
) -> Figure:
    """Draw the true floor with its changes against a map.

    Args:
        before: the map. after: the true floor. pushable: ids of placements that the robot can push.
        traces: paths to draw.

    Returns:
        A matplotlib figure; `labgym.eval.drawing.pictures.save_picture` writes it.
    """
    from matplotlib.figure import Figure

    width, depth = plan_size(after.floor)
    scale = INCHES / max(width, depth)
    size = width * scale + 2 * MARGIN, depth * scale + MARGIN + CAPTION
    figure = Figure(figsize=size, facecolor="#ffffff")
    place = (MARGIN / size[0], CAPTION / size[1], width * scale / size[0], depth * scale / size[1])
    axes = figure.add_axes(place, frameon=False)
    axes.set_axis_off()
    draw_plan(axes, after.floor)
    draw_objects(axes, after, 72.0 * scale)
    draw_changes(axes, before, after, pushable)
    draw_traces(axes, traces, palette.policy_colors(list(dict.fromkeys(trace.policy for trace in traces))))
    for row, (color, text) in enumerate(LEGEND):
        style: dict[str, Any] = {"fontsize": 9.0, "family": FONT, "weight": "bold", "color": color, "va": "top"}
        figure.text(place[0], place[1] - (0.06 + LINE * row) / size[1], text, **style)
    return figure


def draw_changes(axes: Axes, before: Layout, after: Layout, pushable: Sequence[str] = ()) -> None:
    """Draw what differs between a map and the true floor: placements, open parts, and doors."""
    from matplotlib.patches import Polygon

    for placement in before.placements:
        now = after.by_id.get(placement.id)
        if placement.support == FLOOR and (now is None or _pose(now) != _pose(placement)):
            outline = before.box(placement.id).corners()
            style: dict[str, Any] = {"edgecolor": GONE, "linewidth": 1.4, "linestyle": (0, (3, 2))}
            axes.add_patch(Polygon(outline, fill=False, zorder=ON_TOP, **style))
    for placement in after.placements:
        then = before.by_id.get(placement.id)
        if placement.support != FLOOR:
            continue
        if then is None or _pose(then) != _pose(placement):
            fill = PUSHED if placement.id in pushable else CHANGED
            outline = after.box(placement.id).corners()
            look: dict[str, Any] = {"facecolor": fill, "edgecolor": CHANGED, "linewidth": 1.6, "alpha": 0.85}
            axes.add_patch(Polygon(outline, zorder=ON_TOP + 1, **look))
        open_before = [] if then is None or _pose(then) != _pose(placement) else before.open_parts(placement.id)
        for part in after.open_parts(placement.id):
            if part not in open_before:
                axes.add_patch(Polygon(part.corners(), facecolor=CHANGED, edgecolor=CHANGED, zorder=ON_TOP + 1))
    _draw_doors(axes, before, after)


def _draw_doors(axes: Axes, before: Layout, after: Layout) -> None:
    """Draw doors that are shut now, and those that are open now and were not."""
    for old, new in zip(before.floor.walls, after.floor.walls, strict=False):
        for was, opening in zip(old.openings, new.openings, strict=False):
            if was.state != opening.state:
                ends = np.array([new.point(along) for along in opening.span])
                color = CHANGED if opening.state == "closed" else GONE
                axes.plot(*ends.T, color=color, linewidth=4.0, solid_capstyle="butt", zorder=ON_TOP + 2)


def _pose(placement: Placement) -> tuple[object, float]:
    return placement.position, placement.yaw
