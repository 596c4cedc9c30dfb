"""Pictures of layouts next to each other, with violations in red: one protocol by every variant, and failures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from labgym.eval.drawing.pictures import picture_bytes
from labgym.eval.drawing.plan_drawing import draw_goals, draw_objects, draw_plan, draw_violations, plan_size
from labgym.eval.reports.report import Picture
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER, rule_set
from labgym.navigation import goal_poses
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant
from labgym.paper.reproduction.page import Plate, StudySection
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


def comparison_section(
    rows: Sequence[LayoutRow], variants: Sequence[StudyVariant], protocol: Protocol, folder: Path, profile: str
) -> StudySection:
    """Return the layouts of one protocol and the first seed by every variant, next to each other."""
    seed = min(row.seed for row in rows)
    chosen = [row for row in rows if row.protocol == protocol.id and row.seed == seed]
    plates = [
        _plate(variant.title, row, protocol, folder, profile)
        for variant in variants
        for row in chosen
        if row.variant == variant.key
    ]
    return StudySection(
        f"{protocol.name}, by every method",
        (
            f"Protocol {protocol.id}, seed {seed}. Red outlines and numbers mark hard violations, which are listed "
            f"below each plan. Route: {' → '.join(protocol.route)}.",
        ),
        plates=tuple(plates),
    )


def failure_section(
    rows: Sequence[LayoutRow],
    variants: Sequence[StudyVariant],
    protocols: Sequence[Protocol],
    folder: Path,
    profile: str,
) -> StudySection:
    """Return the worst layout of every variant: the one with the greatest v."""
    by_id = {protocol.id: protocol for protocol in protocols}
    plates, clean = [], []
    for variant in variants:
        own = [row for row in rows if row.variant == variant.key and row.v is not None]
        if not own:
            continue
        worst = min(own, key=_worst)
        if worst.v or worst.metrics.get("asset") == 0.0:
            title = f"{variant.title}: {worst.protocol}, seed {worst.seed}"
            plates.append(_plate(title, worst, by_id[worst.protocol], folder, profile))
        else:
            clean.append(f"{variant.title} ({len(own)} layouts)")
    text = [
        "The worst layout of each method: the greatest number of hard violations v, then the most missing assets, then "
        "the lowest fitness, then the first protocol and seed."
    ]
    text += [f"No violation and no missing asset: {', '.join(clean)}."] if clean else []
    return StudySection("Failures", tuple(text), plates=tuple(plates))


def _worst(row: LayoutRow) -> tuple[float, float, float, str, int]:
    asset, fitness = row.metrics.get("asset"), row.metrics.get("fitness")
    return (
        -(row.v or 0),
        1.0 if asset is None else asset,
        1.0 if fitness is None else fitness,
        row.protocol,
        row.seed,
    )


def _plate(title: str, row: LayoutRow, protocol: Protocol, folder: Path, profile: str) -> Plate:
    layout = row.layout(folder)
    if layout is None:
        return Plate(title, Picture("No layout", _nothing()), (f"No layout: {row.failure}",), good=False)
    return layout_plate(title, layout, protocol, profile)


def _nothing() -> bytes:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(INCHES, INCHES), facecolor="#ffffff")
    figure.text(0.5, 0.5, "no layout", ha="center", va="center")
    return picture_bytes(figure)
