"""The plan of a layout with its violations in red, as a picture of a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labgym.eval.drawing.pictures import picture_bytes
from labgym.eval.drawing.plan_drawing import draw_goals, draw_objects, draw_plan, draw_violations, plan_size
from labgym.eval.reports.report import Picture
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER, rule_set
from labgym.navigation import goal_poses
from labgym.paper.reproduction.page import Plate
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCHES = 4.4
"""Longer side of a plan."""
MOST_LINES = 8
"""Largest number of violations that are listed under a picture."""


def layout_plate(title: str, layout: Layout, protocol: Protocol | None, profile: str = "default") -> Plate:
    """Return the plan of a layout with its violations in red and a list of them."""
    assessment = evaluate_layout(layout, protocol, rule_set(PAPER, profile), navigation=True)
    violations = assessment.violations.items
    listed = [f"{number}. {item.message}" for number, item in enumerate(violations[:MOST_LINES], start=1)]
    if len(violations) > MOST_LINES:
        listed.append(f"and {len(violations) - MOST_LINES} more")
    lines = [_verdict(assessment), *listed]
    caption = f"Plan of {layout.id} with {len(violations)} violations in red"
    good = not violations and not assessment.missing
    picture = Picture(caption, picture_bytes(_figure(layout, protocol, assessment)))
    return Plate(title, picture, tuple(lines), good=good)


def _verdict(assessment: Assessment) -> str:
    """Return the checks of the paper's qualitative comparison in one line."""
    moves = assessment.transitions or ()
    feasible = sum(move.feasible for move in moves)
    missing = assessment.missing or ()
    parts = [
        f"v = {assessment.v}",
        f"out of bounds {len(assessment.out_of_bounds)}",
        f"collisions {len(assessment.collisions)}",
        f"unsafe or not stored {sum(instance.hard for instance in assessment.instances)}",
        f"transitions {feasible} of {len(moves)}",
        f"missing or out of bounds: {', '.join(missing[:5])}{', ...' if len(missing) > 5 else ''}"
        if missing
        else "all assets placed",
    ]
    return "; ".join(parts)


def _figure(layout: Layout, protocol: Protocol | None, assessment: Assessment) -> Figure:
    from matplotlib.figure import Figure

    span = plan_size(layout.floor)
    scale = INCHES / max(span)
    figure = Figure(figsize=(span[0] * scale, span[1] * scale), facecolor="#ffffff")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
    axes.set_axis_off()
    placed = protocol is not None and all(layout.find(name) is not None for name in protocol.locations)
    poses = goal_poses(layout, protocol) if placed else {}
    draw_plan(axes, layout.floor)
    draw_objects(axes, layout, 72.0 * scale, poses.values())
    draw_goals(axes, poses)
    draw_violations(axes, layout, assessment.violations.items)
    return figure
