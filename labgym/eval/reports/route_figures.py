"""Figures of a policy's routes on floor plans, and descriptions of its failures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from labgym.errors import LabgymError
from labgym.eval.drawing import palette
from labgym.eval.drawing.plan_drawing import DrivenPath, draw_objects, draw_plan, draw_traces
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.layouts import Layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANEL_INCHES = 2.6
COLUMNS = 5

STILL_STEPS, STILL_DISTANCE = 50, 0.15
"""A robot stood still if it moved less than `STILL_DISTANCE` meters over its last `STILL_STEPS` control steps."""
BACK_AND_FORTH = 3.0
"""A robot went back and forth if it drove this multiple of its largest distance from the start."""


def sampled(rows: Sequence[TransitionRow], count: int = 10) -> list[TransitionRow]:
    """Return `count` evenly spaced episodes: the same ones for every policy on a suite."""
    indices = np.linspace(0, len(rows) - 1, min(count, len(rows))).round().astype(int)
    return [rows[index] for index in indices]


def drives_figure(
    evaluation: TransitionEvaluation, layouts: Mapping[str, Layout], rows: Sequence[TransitionRow]
) -> Figure:
    """Draw episodes side by side on their floor plans: a ring at the start, the success disc at the goal.

    Args:
        evaluation: the evaluation that the episodes belong to.
        layouts: layouts by id, at least those of the rows.
        rows: the episodes.

    Raises:
        LabgymError: no episodes.
    """
    if not rows:
        raise LabgymError("no episodes to draw")
    figure, panels = panel_grid(len(rows), COLUMNS, PANEL_INCHES, title_inches=0.5)
    for axes, row in zip(panels, rows, strict=True):
        _draw_drive(axes, layouts[row.layout], row, evaluation.routes.get(row.key, ()))
    figure.tight_layout(pad=0.4)
    return figure


def panel_grid(count: int, columns: int, inches: float, title_inches: float) -> tuple[Figure, tuple[Axes, ...]]:
    """Return an empty figure and its panels without axes, line by line.

    Args:
        count: number of panels, at least 1.
        columns: most panels in a line.
        inches: width and height of a panel.
        title_inches: space above each panel.
    """
    from matplotlib.figure import Figure

    columns = min(columns, count)
    lines = math.ceil(count / columns)
    figure = Figure(figsize=(columns * inches, lines * (inches + title_inches)), facecolor="#ffffff")
    grid = figure.subplots(lines, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    return figure, tuple(grid.flat[:count])


def what_went_wrong(row: TransitionRow, route: Route) -> str:
    """Return in a few words how an episode failed, from its row and its poses (x, y, yaw)."""
    if row.error is not None:
        return f"the policy raised: {row.error}"
    points = np.array(route)[:, :2]
    touching = f", in contact for {row.contacts} of {row.steps} steps" if row.contacts > row.steps // 10 else ""
    last = points[-STILL_STEPS:]
    if float(np.linalg.norm(last - last[0], axis=1).max()) < STILL_DISTANCE:
        return f"stopped {row.final_distance:.1f} m from the goal{touching}"
    farthest = float(np.linalg.norm(points - points[0], axis=1).max())
    if row.path_length > BACK_AND_FORTH * max(farthest, 0.5):
        return f"went back and forth, {row.final_distance:.1f} m from the goal at the end{touching}"
    return f"time limit reached {row.final_distance:.1f} m from the goal{touching}"


def _draw_drive(axes: Axes, layout: Layout, row: TransitionRow, route: Route) -> None:
    from matplotlib.patches import Circle

    axes.set_aspect("equal")
    draw_plan(axes, layout.floor)
    draw_objects(axes, layout, scale=None)
    goal = Circle(row.goal[:2], 0.5, facecolor=palette.INK, alpha=0.25, zorder=60)
    start = Circle(row.start[:2], 0.27, facecolor="none", edgecolor=palette.INK, linewidth=1.2, zorder=60)
    axes.add_patch(goal)
    axes.add_patch(start)
    if route:
        trace = DrivenPath(row.policy, np.array(route, dtype=np.float64)[:, :2], row.success)
        draw_traces(axes, [trace], palette.policy_colors([row.policy]))
    outcome = (
        f"SPL {row.spl:.2f}" if row.success and row.spl is not None else f"failed, {row.final_distance:.1f} m left"
    )
    repeat = f", repeat {row.repeat}" if row.repeat else ""
    axes.set_title(f"{row.layout} {row.pair}{repeat}\n{outcome}", fontsize=7)
