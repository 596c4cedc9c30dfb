"""Top-down pictures of layouts: room, objects, hazards, goal poses and the routes that policies drove."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from labgym.documents import write_bytes
from labgym.errors import OptionError
from labgym.eval import palette
from labgym.eval.plan_drawing import Route, draw_goals, draw_objects, draw_room, draw_routes
from labgym.eval.plan_panel import PANEL_INCHES, Panel
from labgym.layouts.model import Layout
from labgym.navigation import goal_poses
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLAN_INCHES = 6.4
MARGIN_INCHES = 0.25
DPI = 150


def topdown(layout: Layout, protocol: Protocol | None = None, routes: Sequence[Route] = ()) -> Figure:
    """Draw a layout from above, with a panel that explains it.

    Args:
        layout: what to draw.
        protocol: numbers its locations as goal poses; None leaves them out.
        routes: paths to draw; policies take their colours in the order in which they first occur.

    Returns:
        A matplotlib figure; `save_picture` writes it.
    """
    from matplotlib.figure import Figure

    room = layout.room
    span = (room.width + 2 * room.wall_thickness, room.depth + 2 * room.wall_thickness)
    scale = PLAN_INCHES / max(span[0], min(span[1], 1.25 * span[0]))
    plan = (span[0] * scale, span[1] * scale)
    size = (plan[0] + PANEL_INCHES + 3 * MARGIN_INCHES, plan[1] + 2 * MARGIN_INCHES)
    figure = Figure(figsize=size, facecolor="#ffffff")
    axes = figure.add_axes(
        (MARGIN_INCHES / size[0], MARGIN_INCHES / size[1], plan[0] / size[0], plan[1] / size[1]), frameon=False
    )
    axes.set_xlim(-room.wall_thickness, room.width + room.wall_thickness)
    axes.set_ylim(-room.wall_thickness, room.depth + room.wall_thickness)
    axes.set_axis_off()
    poses = goal_poses(layout, protocol) if protocol else {}
    colours = palette.policy_colours(list(dict.fromkeys(route.policy for route in routes)))
    draw_room(axes, room)
    draw_objects(axes, layout, 72.0 * scale)
    draw_routes(axes, routes, colours)
    draw_goals(axes, poses)
    left = (plan[0] + 2 * MARGIN_INCHES) / size[0]
    beside = figure.add_axes((left, MARGIN_INCHES / size[1], PANEL_INCHES / size[0], plan[1] / size[1]), frameon=False)
    panel = Panel(beside, plan[1])
    panel.title(layout, protocol)
    if poses:
        panel.stops(list(poses))
    if colours:
        panel.routes(routes, colours)
    panel.legend(layout)
    return figure


def save_picture(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG or SVG, by the path's ending; the same figure gives the same bytes.

    Raises:
        OptionError: another ending.
    """
    path = Path(path)
    if path.suffix not in (".png", ".svg"):
        raise OptionError(f"picture {path.name!r} must end in .png or .svg")
    return write_bytes(path, picture_bytes(figure, path.suffix[1:]))


def picture_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Return a figure as the bytes of a PNG or SVG file, free of dates and versions."""
    import matplotlib

    stream = io.BytesIO()
    metadata = {"Software": None} if kind == "png" else {"Date": None, "Creator": None}
    with matplotlib.rc_context({"svg.hashsalt": "labgym", "svg.fonttype": "path"}):
        figure.savefig(stream, format=kind, dpi=DPI, metadata=metadata)
    return stream.getvalue()
