"""Table 1: reagents, instruments, steps and moves per protocol; and the entries of the knowledge base."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from labgym.assets import Catalog
from labgym.documents import Record, canonical_hash
from labgym.eval.drawing import palette
from labgym.eval.drawing.pictures import picture_bytes
from labgym.eval.reports.paper import paper
from labgym.eval.reports.report import Picture
from labgym.layouts.places import published_protocols
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    PublishedFigures,
    paper_line,
    plain_cells,
)
from labgym.paper.reproduction.page import Plate, StudySection
from labgym.paper.reproduction.study import Study, code_facts, rows_output
from labgym.protocols import protocols
from labgym.protocols.library import Summary, statistics
from labgym.runs import Shard, ShardOutput

COUNTS = ("reagents", "instruments", "steps", "moves")
KINDS = {"reagent": "reagents", "instrument": "instruments", "facility": "furniture, safety and building elements"}
PAPER_ENTRIES = 176.0
"""Entries of the paper's knowledge base, section 3.1; it prints no counts by kind or category."""


class CountRow(Record):
    """Counts of a protocol, or an entry of the catalog.

    Attributes:
        of: which of both. name: id of the protocol, or name of the asset.
        group: reaction type, or kind of the asset. category: of the asset.
        counts: numbers by `COUNTS`; of an asset, 1 for each hazard flag that is set.
        core: whether the asset is one of those that the paper's knowledge base corresponds to.
        variant: whether the asset is another shape of one that is listed.
    """

    of: Literal["protocol", "asset"]
    name: str
    group: str
    category: str = ""
    counts: dict[str, int]
    core: bool = False
    variant: bool = False


@dataclass(frozen=True)
class ProtocolsStudy(Study[CountRow]):
    """Counts of the protocols that were published with the rooms, and of the catalog."""

    name: ClassVar[str] = "protocols"
    unit: ClassVar[str] = "part"
    row: ClassVar[type[Record]] = CountRow

    def inputs(self) -> dict[str, Any]:
        """Return the hash of the protocols."""
        return {"protocols": canonical_hash([protocol.to_json() for protocol in published_protocols().values()])}

    def shards(self) -> Sequence[Shard]:
        """Return a shard for the protocols and one for the catalog."""
        return (Shard("protocols", count_protocols), Shard("assets", count_assets))

    def figures(self, rows: Sequence[CountRow]) -> PublishedFigures:
        """Return Table 1 and the counts of the catalog."""
        entries = [row for row in rows if row.of == "asset"]
        originals = [row for row in entries if not row.variant]
        summary = (
            f"{len(published_protocols())} protocols, whose counts are distributed as in Table 1. "
            "They are labgym's own, not the experiments of the paper.",
            _corrected(),
            f"The catalog has {len(entries)} entries: {len(originals)} and {len(entries) - len(originals)} variants in "
            f"other shapes. {sum(row.core for row in entries)} of them are core entries, as many as the paper's "
            "knowledge base has.",
        )
        tables = (_table_1(), _entries(entries), _categories(originals), _hazards(entries), _types(rows))
        return PublishedFigures(
            study=self.name,
            title="Protocols and knowledge base",
            source="Table 1",
            summary=summary,
            facts={"protocols": f"{len(published_protocols())} as published", **code_facts()},
            tables=tables,
        )

    def sections(self, rows: Sequence[CountRow], folder: Path) -> Sequence[StudySection]:
        """Return a chart of the catalog's categories and one of the protocols' counts."""
        del folder
        assets = [row for row in rows if row.of == "asset" and not row.variant]
        names = [row for row in rows if row.of == "protocol"]
        charts = (
            Plate("Entries of the knowledge base by category", Picture("Bars: entries by category", _chart(assets))),
            Plate("Counts per protocol", Picture("Histograms of the four counts", _histograms(names))),
        )
        return (
            StudySection("Charts", ("Variants are left out of the chart of categories.",), plates=charts, wide=True),
        )


def count_protocols() -> ShardOutput:
    """Return a row for each protocol."""
    return rows_output(
        "protocols",
        (
            CountRow(
                of="protocol",
                name=protocol.id,
                group=protocol.reaction_type or "other",
                counts=dict(
                    zip(
                        COUNTS,
                        (len(protocol.reagents), len(protocol.instruments), len(protocol.steps), protocol.moves),
                        strict=True,
                    )
                ),
            )
            for protocol in published_protocols().values()
        ),
    )


def count_assets() -> ShardOutput:
    """Return a row for each entry of the catalog."""
    return rows_output(
        "assets",
        (
            CountRow(
                of="asset",
                name=asset.name,
                group=asset.kind,
                category=asset.category,
                counts={name: 1 for name, value in asset.hazards if value},
                core=asset.core,
                variant=asset.variant_of is not None,
            )
            for asset in Catalog.load().assets
        ),
    )


def _table_1() -> FigureTable:
    columns = tuple(
        FigureColumn(key=key, heading=heading, digits=digits)
        for key, heading, digits in (("mean", "Mean", 2), ("min", "Min", 0), ("max", "Max", 0), ("std", "Std", 2))
    )
    ours = statistics(published_protocols().values())
    printed = {row["count"]: row for row in paper().protocol_statistics.rows}
    lines = []
    for name in COUNTS:
        lines.append(FigureLine(name=name.capitalize(), cells=_summary_cells(getattr(ours, name))))
        line = paper_line(printed[name], columns, "count")
        lines.append(line.model_copy(update={"name": name.capitalize()}))
    return FigureTable(
        key="protocols",
        title=f"Counts per protocol over {ours.count} protocols",
        first="Count",
        columns=columns,
        lines=tuple(lines),
        notes=("Std: sample standard deviation. A move is a change of location between two steps.",),
    )


def _corrected() -> str:
    """Return a sentence with the means of the library, whose protocols were corrected since."""
    ours = statistics(protocols().values())
    means = ", ".join(f"{getattr(ours, name).mean:.2f} {name}" for name in COUNTS)
    return f"Counted are the protocols as published with the rooms; since then the library was corrected: {means}."


def _summary_cells(summary: Summary) -> dict[str, FigureCell]:
    return plain_cells({"mean": summary.mean, "min": summary.minimum, "max": summary.maximum, "std": summary.deviation})


def _entries(rows: Sequence[CountRow]) -> FigureTable:
    columns = (
        FigureColumn(key="all", heading="Entries", digits=0),
        FigureColumn(key="variants", heading="of these, variants", digits=0),
        FigureColumn(key="core", heading="of these, core", digits=0),
    )
    lines = [_entry_line(title, [row for row in rows if row.group == kind]) for kind, title in KINDS.items()]
    return FigureTable(
        key="entries",
        title="Entries of the knowledge base",
        first="Kind",
        columns=columns,
        lines=(
            *lines,
            _entry_line("all", rows),
            FigureLine(name="all", origin="paper", cells={"all": FigureCell(value=PAPER_ENTRIES)}),
        ),
        notes=("The paper does not print counts by kind.",),
    )


def _entry_line(name: str, rows: Sequence[CountRow]) -> FigureLine:
    counts = {"all": len(rows), "variants": sum(r.variant for r in rows), "core": sum(r.core for r in rows)}
    return FigureLine(name=name, cells=plain_cells(counts))


def _categories(rows: Sequence[CountRow]) -> FigureTable:
    counts = Counter((row.group, row.category) for row in rows)
    ordered = sorted(counts.items(), key=lambda item: (list(KINDS).index(item[0][0]), -item[1], item[0][1]))
    return FigureTable(
        key="categories",
        title="Entries by category, without variants",
        first="Category",
        second="Kind",
        columns=(FigureColumn(key="all", heading="Entries", digits=0),),
        lines=tuple(
            FigureLine(name=category.replace("_", " "), detail=kind, cells=plain_cells({"all": count}))
            for (kind, category), count in ordered
        ),
    )


def _hazards(rows: Sequence[CountRow]) -> FigureTable:
    counts = Counter(flag for row in rows for flag in row.counts)
    return FigureTable(
        key="flags",
        title="Hazard flags",
        first="Flag",
        columns=(FigureColumn(key="all", heading="Entries", digits=0),),
        lines=_ranked(counts),
        notes=("An entry may have several flags.",),
    )


def _ranked(counts: Counter[str]) -> tuple[FigureLine, ...]:
    """Return a line for each name, the most frequent first."""
    ranked = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return tuple(FigureLine(name=name.replace("_", " "), cells=plain_cells({"all": count})) for name, count in ranked)


def _types(rows: Sequence[CountRow]) -> FigureTable:
    counts = Counter(row.group for row in rows if row.of == "protocol")
    return FigureTable(
        key="types",
        title="Protocols by reaction type",
        first="Reaction type",
        columns=(FigureColumn(key="all", heading="Protocols", digits=0),),
        lines=_ranked(counts),
        notes=("The paper names the same seven types without counts.",),
    )


def _chart(rows: Sequence[CountRow]) -> bytes:
    """Draw horizontal bars: entries by category, in the color of their kind."""
    from matplotlib.figure import Figure

    counts = Counter((row.group, row.category) for row in rows)
    ordered = sorted(counts.items(), key=lambda item: (list(KINDS).index(item[0][0]), -item[1], item[0][1]))
    colors = palette.policy_colors(list(KINDS))
    figure = Figure(figsize=(8.0, 0.24 * len(ordered) + 1.0), facecolor="#ffffff")
    axes = figure.add_subplot()
    places = np.arange(len(ordered))
    values = [count for _, count in ordered]
    axes.barh(places, values, color=[colors[kind] for (kind, _), _ in ordered], height=0.72)
    axes.set_yticks(places, [category.replace("_", " ") for (_, category), _ in ordered], fontsize=8)
    axes.invert_yaxis()
    for place, value in enumerate(values):
        axes.text(value + 0.6, place, str(value), va="center", fontsize=8, color=palette.INK)
    for kind, title in KINDS.items():
        axes.barh([0], [0], color=colors[kind], label=title)
    axes.legend(loc="lower right", frameon=False, fontsize=9)
    axes.set_xlabel("entries")
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    return picture_bytes(figure)


def _histograms(rows: Sequence[CountRow]) -> bytes:
    """Draw the distribution of each count over the protocols."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.6), facecolor="#ffffff")
    color = next(iter(palette.policy_colors(["all"]).values()))
    for axes, name in zip(figure.subplots(2, 2).ravel(), COUNTS, strict=True):
        counts = Counter(row.counts[name] for row in rows)
        axes.bar(list(counts), list(counts.values()), color=color, width=0.8)
        axes.set_title(f"{name} per protocol", fontsize=10, color=palette.INK)
        axes.set_xticks(range(min(counts), max(counts) + 1))
        axes.set_ylabel("protocols", fontsize=9)
        axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    return picture_bytes(figure)
