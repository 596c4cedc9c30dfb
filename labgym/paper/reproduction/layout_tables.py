"""Tables of layout metrics: a line for each variant, next to the paper's lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from labgym.eval.reports.paper import PaperTable
from labgym.eval.scoring.layout_report import COLUMNS
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    Scale,
    mean_cell,
    paper_line,
)
from labgym.paper.reproduction.ranking import can_rank
from labgym.paper.sampler.rates import calibration


@dataclass(frozen=True)
class Metric:
    """A column of layout metrics.

    Attributes:
        field: name in the rows. key: name in the paper's table; the same by default.
        heading, digits, scale: how it is shown and averaged.
    """

    field: str
    heading: str
    digits: int
    scale: Scale
    key: str = ""

    @property
    def column(self) -> FigureColumn:
        """The column of a table."""
        return FigureColumn(key=self.key or self.field, heading=self.heading, digits=self.digits)


GEOMETRY = (
    Metric("obj", "Obj", 1, "amount"),
    Metric("ob", "OB ↓", 2, "amount"),
    Metric("cn", "CN ↓", 2, "amount"),
)
FEASIBILITY = (
    Metric("asset", "Asset ↑", 3, "share"),
    Metric("step_nav", "Step nav ↑", 3, "share"),
    Metric("prot_nav", "Prot nav ↑", 3, "share"),
)
GATED = tuple(
    Metric(f"gated_{name}", f"{name.capitalize()} ↑", 3, "share", name) for name in ("flam", "store", "incomp", "glass")
)
PLAIN = tuple(Metric(name, f"{name.capitalize()} ↑", 3, "share") for name in ("flam", "store", "incomp", "glass"))
SEMANTIC = (
    Metric("real", "Real ↑", 2, "points"),
    Metric("lay", "Lay ↑", 2, "points"),
    Metric("comp", "Comp ↑", 2, "points"),
)
PROXY = (
    Metric("proxy_realism", "Realism (proxy) ↑", 2, "points"),
    Metric("proxy_layout", "Layout (proxy) ↑", 2, "points"),
    Metric("proxy_completeness", "Completeness (proxy) ↑", 2, "points"),
)
OUTCOMES = (
    Metric("walk", "Walk, m ↓", 1, "amount"),
    Metric("reach", "Reach ↑", 3, "share"),
    Metric("facility", "Facility ↑", 3, "share"),
)
"""What a layout is good for, under the rule set `touchstone`: columns that can tell proposers apart."""
ORIGIN = (
    Metric("survives", "Survives", 3, "share"),
    Metric("placed", "Placed by phases", 1, "amount"),
    Metric("cpu", "CPU, s", 1, "amount"),
)
"""How a layout came about."""
PAPER_COLUMNS = (*GEOMETRY, *FEASIBILITY, *GATED, *OUTCOMES, *ORIGIN)
OWN_COLUMNS = (
    Metric("valid", "Valid ↑", 3, "share"),
    Metric("v", "v ↓", 2, "amount"),
    Metric("fitness", "F ↑", 3, "share"),
    *PLAIN,
    Metric("store_class", "Store class ↑", 3, "share"),
    *PROXY,
)
SECOND_COLUMNS = (
    Metric("valid", "Valid ↑", 3, "share"),
    *(
        Metric(name, column.heading, column.digits, "share" if column.digits == 3 else "amount")
        for name, column in COLUMNS.items()
        if column.heading and not column.judged and name != "obj"
    ),
)
POOLED = {name: column.pooled_by for name, column in COLUMNS.items() if column.pooled_by}
"""Shares of drives, by the number of drives: under `touchstone` the drives of all layouts are pooled."""
SAMPLER = "sampler"
"""Name of the proposer whose rates were fitted to the paper."""
NAVIGATION = frozenset({"step_nav"})
"""Figures that the ways on a floor decide."""
GATE_NOTE = (
    "Flam, Store, Incomp and Glass are weighted by asset availability, as in the paper: a layout that lacks a required "
    "asset scores 0."
)
FITTED_NOTE = (
    "Fitted: the rates of the sampler's errors were fitted to this figure of the paper, so that its agreement shows "
    "nothing (docs/layouts.md, calibration)."
)
OUTCOME_NOTE = (
    "Walk: walking distance of the protocol's workflow, of layouts in which nothing blocks it. Reach: share of the "
    "steps' items within the arm's envelope. Facility: mean of the facility rules. All three under touchstone."
)
ORIGIN_NOTE = (
    "Survives: share of the layout's objects within 0.1 m of their proposed place. Placed by phases: the other "
    "objects, which rules, search or the constraint solver added or moved. CPU differs from run to run."
)
THRESHOLD_NOTE = "The paper does not print the thresholds of its chemistry metrics, so its lines are not comparable."


def paper_table(
    rows: Sequence[LayoutRow], variants: Sequence[StudyVariant], printed: PaperTable, title: str
) -> FigureTable:
    """Return the table with the columns of the paper: our lines, then the printed ones.

    Real, Lay and Comp are among them if a judge has scored the layouts that can rank.
    """
    metrics = (*PAPER_COLUMNS, *(SEMANTIC if can_rank(rows) else ()))
    columns = tuple(metric.column for metric in metrics)
    lines = variant_lines(rows, variants, metrics)
    return FigureTable(
        key="paper",
        title=title,
        columns=columns,
        lines=(*lines, *(paper_line(row, columns) for row in printed.rows)),
        notes=(
            "Rule set paper. Brackets: 95% intervals clustered by protocol; the paper gives none.",
            GATE_NOTE,
            THRESHOLD_NOTE,
            OUTCOME_NOTE,
            ORIGIN_NOTE,
            *([FITTED_NOTE] if any(cell.fitted for line in lines for cell in line.cells.values()) else []),
            *_absent(rows, variants),
        ),
    )


def own_table(rows: Sequence[LayoutRow], variants: Sequence[StudyVariant]) -> FigureTable:
    """Return the table of labgym's further metrics."""
    return FigureTable(
        key="further",
        title="Success of the method, objective, chemistry without the weight, and the consistency proxy",
        columns=tuple(metric.column for metric in OWN_COLUMNS),
        lines=variant_lines(rows, variants, OWN_COLUMNS),
        notes=(
            "Valid: share of requests that end in a layout without violation, without facility error and with all "
            "required assets; a request without a layout counts as not valid.",
            "v: hard violations. F: fitness. The proxy is computed by rules; it does not replace a vision-language "
            "model and is not comparable with the paper's Real, Lay and Comp.",
        ),
    )


def second_table(rows: Sequence[LayoutRow], variants: Sequence[StudyVariant]) -> FigureTable:
    """Return the table under the rule set `touchstone`, which a bad layout cannot pass."""
    return FigureTable(
        key="touchstone",
        title="The same layouts under the rule set `touchstone`",
        columns=tuple(metric.column for metric in SECOND_COLUMNS),
        lines=variant_lines(rows, variants, SECOND_COLUMNS, second=True),
        notes=(
            "docs/metrics.md defines the metrics; steps and doors are pooled over layouts. The paper has no such row.",
        ),
    )


def variant_lines(
    rows: Sequence[LayoutRow], variants: Sequence[StudyVariant], metrics: Sequence[Metric], second: bool = False
) -> tuple[FigureLine, ...]:
    """Return a line of means for each variant.

    Args:
        rows, variants: the layouts, and what made them.
        metrics: the columns.
        second: whether the metrics are those of the rule set `touchstone`.
    """
    lines = []
    for variant in variants:
        own = [row for row in rows if row.variant == variant.key]
        cells = {metric.column.key: (_cell_2 if second else _cell)(own, metric) for metric in metrics}
        if not second:
            for name in fitted_figures(variant) & cells.keys():
                cells[name] = cells[name].model_copy(update={"fitted": True})
        lines.append(FigureLine(name=variant.title, detail=made_by(own), cells=cells))
    return tuple(lines)


def fitted_figures(variant: StudyVariant) -> frozenset[str]:
    """Return the figures of a variant to which the rates of the sampler were fitted, under the rule set `paper`.

    They are those of its proposals: objects out of bounds and collisions until they are optimized, step navigation
    until facility rules or the refinement clear the ways.
    """
    method = variant.method
    if method.proposer != SAMPLER:
        return frozenset()
    fitted = {figure.name for figure in calibration().figures if figure.fitted}
    blocked = not method.refine and (variant.pure or not (method.optimise and method.facility))
    kept = (NAVIGATION if blocked else frozenset()) | (frozenset() if method.optimise else fitted - NAVIGATION)
    return frozenset(fitted & kept)


def _cell(rows: Sequence[LayoutRow], metric: Metric) -> FigureCell:
    if metric.field == "valid":
        return mean_cell([float(row.valid) for row in rows], [row.protocol for row in rows], "share")
    present = [row for row in rows if row.file is not None]
    values = [row.metrics.get(metric.field) for row in present]
    return mean_cell(values, [row.protocol for row in present], metric.scale)


def _cell_2(rows: Sequence[LayoutRow], metric: Metric) -> FigureCell:
    if metric.field == "valid":
        return mean_cell([float(row.valid_2) for row in rows], [row.protocol for row in rows], "share")
    values: list[float | None] = []
    clusters: list[str] = []
    for row in rows:
        if row.file is not None:
            weight = int(row.metrics_2.get(POOLED.get(metric.field, "")) or 0) if metric.field in POOLED else 1
            values += [row.metrics_2.get(metric.field)] * weight
            clusters += [row.protocol] * weight
    return mean_cell(values, clusters, metric.scale)


def made_by(rows: Iterable[LayoutRow]) -> str:
    """Return what proposed the layouts of some rows, with the model or the table that it asked."""
    names = {f"{row.generator}, {row.made_by}" if row.made_by else row.generator for row in rows if row.generator}
    return "; ".join(sorted(names))


def _absent(rows: Sequence[LayoutRow], variants: Sequence[StudyVariant]) -> tuple[str, ...]:
    counts: Mapping[str, int] = {
        variant.title: sum(row.variant == variant.key and row.file is None for row in rows) for variant in variants
    }
    missing = ", ".join(f"{title} {count}" for title, count in counts.items() if count)
    return (f"Requests without a layout, left out of the means: {missing}.",) if missing else ()
