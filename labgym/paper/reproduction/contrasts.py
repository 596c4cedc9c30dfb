"""Whether a proposer makes a difference: outcomes of a variant minus those of another in the same laboratories."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from labgym.eval.driving.intervals import real_mean
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant
from labgym.paper.reproduction.figures import (
    DECIMALS,
    FEWEST_PROTOCOLS,
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    estimate_cell,
)
from labgym.paper.reproduction.layout_tables import OUTCOMES

LEVEL = 0.05
"""Probability of at least one false finding among the outcomes of a line, by Bonferroni's bound."""
SIGN = {"walk": -1.0}
"""Of outcomes that are better when they are smaller; of the others 1."""


def differences(rows: Sequence[LayoutRow], variant: str, base: str, field: str) -> tuple[list[float], list[str]]:
    """Return the differences of an outcome in the laboratories of which both variants have it, and their protocols."""
    first, second = (
        {
            (row.protocol, row.seed): value
            for row in rows
            if row.variant == key and (value := row.metrics.get(field)) is not None
        }
        for key in (variant, base)
    )
    shared = sorted(first.keys() & second.keys())
    return [first[key] - second[key] for key in shared], [protocol for protocol, _ in shared]


def probability(values: Sequence[float], protocols: Sequence[str]) -> float | None:
    """Return the two-sided p-value of Wilcoxon's signed-rank test on the mean difference of each protocol.

    Laboratories of one protocol are not independent. The result is None with fewer than `FEWEST_PROTOCOLS` protocols.
    """
    from scipy.stats import wilcoxon

    names = sorted(set(protocols))
    if len(names) < FEWEST_PROTOCOLS:
        return None
    means = np.array(
        [
            math.fsum(v for v, p in zip(values, protocols, strict=True) if p == name) / protocols.count(name)
            for name in names
        ]
    )
    return 1.0 if not means.any() else round(float(wilcoxon(means.round(DECIMALS)).pvalue), DECIMALS)


def contrast_table(
    rows: Sequence[LayoutRow], key: str, variants: Sequence[StudyVariant], base: StudyVariant
) -> FigureTable:
    """Return the outcomes of variants minus those of a base, with p-values, as the table of a key."""
    columns = tuple(
        column
        for metric in OUTCOMES
        for column in (metric.column, FigureColumn(key=f"{metric.field}_p", heading=f"p ({metric.field})"))
    )
    return FigureTable(
        key=f"contrasts-{key}",
        title=f"Outcomes minus those of {base.title}",
        columns=columns,
        lines=tuple(
            FigureLine(name=variant.title, cells=_cells(rows, variant, base)) for variant in variants if variant != base
        ),
        notes=(
            "Differences in the same laboratories (protocol and seed), where both have the outcome. Brackets: 95% "
            "intervals clustered by protocol. p: Wilcoxon's signed-rank test over protocols; a line has three tests, "
            f"so that a difference is significant below {LEVEL / len(OUTCOMES):.4f}.",
        ),
    )


def losses(rows: Sequence[LayoutRow], variant: StudyVariant, base: StudyVariant) -> tuple[str, ...]:
    """Return the outcomes in which a variant is significantly worse than a base."""
    lost = []
    for metric in OUTCOMES:
        values, protocols = differences(rows, variant.key, base.key, metric.field)
        p = probability(values, protocols)
        if p is not None and p < LEVEL / len(OUTCOMES) and SIGN.get(metric.field, 1.0) * math.fsum(values) < 0.0:
            lost.append(metric.field)
    return tuple(lost)


def _cells(rows: Sequence[LayoutRow], variant: StudyVariant, base: StudyVariant) -> dict[str, FigureCell]:
    cells = {}
    for metric in OUTCOMES:
        values, protocols = differences(rows, variant.key, base.key, metric.field)
        cells[metric.field] = estimate_cell(real_mean(values, protocols), protocols)
        cells[f"{metric.field}_p"] = FigureCell(value=probability(values, protocols))
    return cells
