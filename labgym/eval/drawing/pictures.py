"""Top-down pictures of layouts: room, objects, hazards, goal poses and the traces that policies drove."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.distance import cdist

from labgym.documents import write_bytes
from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.plan_drawing import Trace, draw_goals, draw_objects, draw_room, draw_traces
from labgym.eval.drawing.plan_panel import PANEL_INCHES, Panel
from labgym.layouts.model import Layout
from labgym.navigation import goal_poses
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLAN_INCHES = 6.4
MARGIN_INCHES = 0.25
DPI = 150


def topdown(layout: Layout, protocol: Protocol | None = None, traces: Sequence[Trace] = ()) -> Figure:
    """Draw a layout from above, with a panel that explains it.

    Args:
        layout: what to draw.
        protocol: numbers its locations as goal poses; None leaves them out.
        traces: paths to draw; policies take their colours in the order in which they first occur.

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
    colours = palette.policy_colours(list(dict.fromkeys(trace.policy for trace in traces)))
    draw_room(axes, room)
    draw_objects(axes, layout, 72.0 * scale)
    draw_traces(axes, traces, colours)
    draw_goals(axes, poses)
    left = (plan[0] + 2 * MARGIN_INCHES) / size[0]
    beside = figure.add_axes((left, MARGIN_INCHES / size[1], PANEL_INCHES / size[0], plan[1] / size[1]), frameon=False)
    panel = Panel(beside, plan[1])
    panel.title(layout, protocol)
    if poses:
        panel.stops(list(poses))
    if colours:
        panel.traces(traces, colours)
    panel.legend(layout)
    return figure


def save_picture(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG, SVG or PDF, by the path's ending; the same figure gives the same bytes.

    Raises:
        OptionError: another ending.
    """
    path = Path(path)
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise OptionError(f"picture {path.name!r} must end in .png, .svg or .pdf")
    return write_bytes(path, picture_bytes(figure, path.suffix[1:]))


def save_view(layout: Layout, path: str | Path, camera: str = "overview", width: int = 1280, height: int = 720) -> Path:
    """Render a view of a layout's scene and write it as PNG.

    Raises:
        OptionError: the path ends in something else than .png.
        UnknownNameError: the scene has no such camera.
    """
    from PIL import Image

    from labgym.scenes import render

    path = Path(path)
    if path.suffix != ".png":
        raise OptionError(f"view {path.name!r} must end in .png")
    stream = io.BytesIO()
    Image.fromarray(render(layout, width, height, camera)).save(stream, "png", optimize=True)
    return write_bytes(path, stream.getvalue())


def picture_bytes(figure: Figure, kind: str = "png") -> bytes:
    """Return a figure as the bytes of a PNG, SVG or PDF file, without dates and versions."""
    import matplotlib

    stream = io.BytesIO()
    metadata: dict[str, None] = {
        "png": {"Software": None},
        "svg": {"Date": None, "Creator": None},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    }[kind]
    with matplotlib.rc_context({"svg.hashsalt": "labgym", "svg.fonttype": "path"}):
        figure.savefig(stream, format=kind, dpi=DPI, metadata=metadata)
    return _with_palette(stream) if kind == "png" else stream.getvalue()


def _with_palette(png: io.BytesIO) -> bytes:
    """Return a PNG of the picture's 255 commonest colours, a quarter of the size: a plan has few but for soft edges."""
    from PIL import Image

    pixels = np.asarray(Image.open(png).convert("RGBX")).view("<u4")[:, :, 0]
    packed, index, counts = np.unique(pixels, return_inverse=True, return_counts=True)
    colours = packed.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :3]
    common = colours[np.argsort(-counts, kind="stable")[:255]]
    nearest = cdist(colours, common).argmin(axis=1).astype(np.uint8)
    indexed = Image.fromarray(nearest[index].reshape(pixels.shape))
    indexed.putpalette(common.tobytes())
    stream = io.BytesIO()
    indexed.save(stream, "png", optimize=True)
    return stream.getvalue()
