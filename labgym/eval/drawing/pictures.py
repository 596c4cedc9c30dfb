"""Top-down pictures of layouts: room, objects, hazards, goal poses, traces of policies and violations."""

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
from labgym.eval.drawing.plan_drawing import (
    DrivenPath,
    draw_goals,
    draw_objects,
    draw_plan,
    draw_traces,
    draw_violations,
    plan_size,
)
from labgym.eval.drawing.plan_panel import PANEL_INCHES, Panel
from labgym.layouts.model import Layout
from labgym.layouts.rules import Violation
from labgym.layouts.rules.rule import FacilityIssue
from labgym.navigation import Pose
from labgym.navigation.goals import location_pose
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLAN_INCHES = 6.4
MARGIN_INCHES = 0.25
LEAST_SCALE, MOST_INCHES = 0.6, 16.0
"""Inches per meter below which the picture of a floor is larger, and its largest side."""
DPI = 150


def topdown(
    layout: Layout,
    protocol: Protocol | None = None,
    traces: Sequence[DrivenPath] = (),
    violations: Sequence[Violation | FacilityIssue] = (),
) -> Figure:
    """Draw a layout from above, with a panel that explains it.

    Args:
        protocol: the protocol whose locations are drawn as numbered goal poses, as far as the layout has them; None
            draws none.
        traces: paths to draw; policies get colors in the order in which they first occur.
        violations: violations and broken facility rules, to mark in red and list in the panel with their numbers.

    Returns:
        A matplotlib figure; `save_picture` writes it.
    """
    from matplotlib.figure import Figure

    span = plan_size(layout.floor)
    scale = PLAN_INCHES / max(span[0], min(span[1], 1.25 * span[0]))
    scale = min(max(scale, LEAST_SCALE), MOST_INCHES / max(span))
    plan = (span[0] * scale, span[1] * scale)
    figure = Figure(facecolor="#ffffff")
    axes, column = (figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False, label=label) for label in ("plan", "panel"))
    axes.set_axis_off()
    poses = goal_poses(layout, protocol)
    colors = palette.policy_colors(list(dict.fromkeys(trace.policy for trace in traces)))
    draw_plan(axes, layout.floor)
    draw_objects(axes, layout, 72.0 * scale, poses.values())
    draw_traces(axes, traces, colors)
    draw_goals(axes, poses)
    draw_violations(axes, layout, violations)
    panel = Panel(column)
    panel.title(layout, protocol)
    if poses:
        panel.stops(list(poses))
    if colors:
        panel.traces(traces, colors)
    if violations:
        panel.violations(violations)
    panel.fixtures(layout.floor)
    panel.legend(layout)
    # The figure is as tall as the plan or the panel; both begin at its top.
    inner = max(plan[1], panel.y)
    width, height = plan[0] + PANEL_INCHES + 3 * MARGIN_INCHES, inner + 2 * MARGIN_INCHES
    figure.set_size_inches(width, height)
    left, right = MARGIN_INCHES / width, (plan[0] + 2 * MARGIN_INCHES) / width
    axes.set_position((left, (MARGIN_INCHES + inner - plan[1]) / height, plan[0] / width, plan[1] / height))
    column.set_position((right, MARGIN_INCHES / height, PANEL_INCHES / width, inner / height))
    column.set_ylim(inner, 0.0)
    return figure


def goal_poses(layout: Layout, protocol: Protocol | None) -> dict[str, Pose]:
    """Return the goal poses of the locations that the layout has, in the order of their first visit."""
    placed = [location for location in (protocol.locations if protocol else ()) if layout.find(location) is not None]
    return {location: location_pose(layout, location) for location in placed}


def save_picture(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG, SVG or PDF, by the path's suffix; the same figure gives the same bytes.

    Raises:
        OptionError: the path has another suffix.
    """
    path = Path(path)
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise OptionError(f"picture {path.name!r} must end in .png, .svg or .pdf")
    return write_bytes(path, picture_bytes(figure, path.suffix[1:]))


def save_view(layout: Layout, path: str | Path, camera: str = "overview", width: int = 1280, height: int = 720) -> Path:
    """Render a view of a layout's scene and write it as PNG.

    Raises:
        OptionError: the path does not end in .png.
        UnknownNameError: the camera does not exist.
    """
    path = Path(path)
    if path.suffix != ".png":
        raise OptionError(f"view {path.name!r} must end in .png")
    return write_bytes(path, view_bytes(layout, camera, width, height))


def view_bytes(layout: Layout, camera: str = "overview", width: int = 1280, height: int = 720) -> bytes:
    """Render a view of a layout's scene and return it as the bytes of a PNG file.

    Raises:
        UnknownNameError: the camera does not exist.
    """
    from PIL import Image

    from labgym.scenes import render

    stream = io.BytesIO()
    Image.fromarray(render(layout, width, height, camera)).save(stream, "png", optimize=True)
    return stream.getvalue()


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
    return with_palette(stream) if kind == "png" else stream.getvalue()


def with_palette(png: io.BytesIO) -> bytes:
    """Return a PNG with the picture's 255 most frequent colors, which is a quarter of the size."""
    from PIL import Image

    pixels = np.asarray(Image.open(png).convert("RGBX")).view("<u4")[:, :, 0]
    packed, index, counts = np.unique(pixels, return_inverse=True, return_counts=True)
    colors = packed.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :3]
    common = colors[np.argsort(-counts, kind="stable")[:255]]
    nearest = cdist(colors, common).argmin(axis=1).astype(np.uint8)
    indexed = Image.fromarray(nearest[index].reshape(pixels.shape))
    indexed.putpalette(common.tobytes())
    stream = io.BytesIO()
    indexed.save(stream, "png", optimize=True)
    return stream.getvalue()
