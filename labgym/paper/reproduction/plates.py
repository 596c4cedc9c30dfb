"""Pictures of layouts next to each other, with violations in red: one protocol by every variant, and failures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labgym.eval.drawing.pictures import picture_bytes
from labgym.eval.reports.report import Picture
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant
from labgym.paper.reproduction.page import Plate, StudySection
from labgym.paper.reproduction.plans import INCHES, layout_plate
from labgym.protocols import Protocol


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
