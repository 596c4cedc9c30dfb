"""Draws the true floor of an episode over the map of before: what was added, moved, opened or shut is in color."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.panes import FRAMED, FRAMELESS
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


@dataclass(frozen=True)
class MapChange:
    """A difference between a map and the true floor.

    Attributes:
        kind: a placement that is "gone", "added" or "movable" (added, and the robot can push it), a pane of "glass", an
            open "part" of furniture, or a door that is "shut" or "opened".
        name: asset of the thing; "door". points: (n, 2) its corners, or the ends of the door, meters.
    """

    kind: Literal["gone", "added", "movable", "glass", "part", "shut", "opened"]
    name: str
    points: NDArray[np.float64]


def map_changes(before: Layout, after: Layout, pushable: Collection[str] = ()) -> Iterator[MapChange]:
    """Yield what differs between a map and the true floor, and all panes of glass.

    Args:
        before: the map. after: the true floor. pushable: ids of placements that the robot can push.
    """
    for placement in before.placements:
        if placement.support == FLOOR and not _stands(placement, after.by_id.get(placement.id)):
            yield MapChange("gone", placement.asset, before.box(placement.id).corners())
    for placement in after.placements:
        stands, corners = _stands(placement, before.by_id.get(placement.id)), after.box(placement.id).corners()
        if placement.asset in (FRAMED, FRAMELESS):
            yield MapChange("glass", placement.asset, corners)
        elif placement.support == FLOOR:
            if not stands:
                yield MapChange("movable" if placement.id in pushable else "added", placement.asset, corners)
            known = before.open_parts(placement.id) if stands else []
            for part in after.open_parts(placement.id):
                if part not in known:
                    yield MapChange("part", placement.asset, part.corners())
    for old, new in zip(before.floor.walls, after.floor.walls, strict=False):
        for was, opening in zip(old.openings, new.openings, strict=False):
            if was.state != opening.state:
                ends = np.array([new.point(along) for along in opening.span])
                yield MapChange("shut" if opening.state == "closed" else "opened", "door", ends)


def _stands(placement: Placement, other: Placement | None) -> bool:
    return other is not None and (placement.position, placement.yaw) == (other.position, other.yaw)


def draw_changes(axes: Axes, before: Layout, after: Layout, pushable: Sequence[str] = ()) -> None:
    """Draw what differs between a map and the true floor: placements, open parts, and doors, without panes of glass."""
    from matplotlib.patches import Polygon

    for change in map_changes(before, after, pushable):
        if change.kind == "glass":
            continue
        style: dict[str, Any] = {"facecolor": CHANGED, "edgecolor": CHANGED, "zorder": ON_TOP + 1}
        if change.kind in ("shut", "opened"):
            color = CHANGED if change.kind == "shut" else GONE
            axes.plot(*change.points.T, color=color, linewidth=4.0, solid_capstyle="butt", zorder=ON_TOP + 2)
            continue
        if change.kind == "gone":
            style = {"fill": False, "edgecolor": GONE, "linewidth": 1.4, "linestyle": (0, (3, 2)), "zorder": ON_TOP}
        elif change.kind in ("added", "movable"):
            fill = PUSHED if change.kind == "movable" else CHANGED
            style |= {"facecolor": fill, "linewidth": 1.6, "alpha": 0.85}
        axes.add_patch(Polygon(change.points, **style))
