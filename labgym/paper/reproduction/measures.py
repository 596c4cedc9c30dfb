"""The metrics of a layout's report by name."""

from __future__ import annotations

import math
from collections.abc import Mapping

from labgym.eval.scoring.layout_report import COLUMNS, LayoutReport
from labgym.eval.scoring.score import GATED, PROXY
from labgym.layouts.model import Layout

PAPER_METRICS = (
    "obj", "ob", "cn", "cn_sw", "cn_mj", "asset", "step_nav", "prot_nav", "flam", "store", "incomp", "glass",
    "incomp_contained", "store_class", "v", "fitness", "s_phys", "s_chem", "real", "lay", "comp", "s_consist",
    "total", "total_with_proxy",
)  # fmt: skip
"""Metrics under the rule set `paper`."""
HEADLINE = (
    *(name for name, column in COLUMNS.items() if column.heading and not column.judged),
    "fitness",
    "s_phys",
    "s_chem",
)
"""Metrics under the rule set `touchstone`; every way to spoil a layout worsens one of them."""
STAYED_M = 0.1
"""Greatest distance from its proposed position at which an object counts as kept, meters."""
DIGITS = 9
"""Decimals of metrics in rows."""


def report_metrics(report: LayoutReport) -> dict[str, float | None]:
    """Return the metrics of a report by name, as `aggregate` names them."""
    values: Mapping[str, float | None] = {
        **{name: getattr(report, name) for name in PAPER_METRICS},
        **{f"gated_{name}": getattr(report.gated, name) for name in GATED},
        **{f"proxy_{name}": getattr(report.consistency_proxy, name) for name in PROXY},
    }
    return _rounded(values)


def origin_metrics(layout: Layout, proposal: Layout) -> dict[str, float | None]:
    """Return the share of a layout's objects that stand where they were proposed, and the number of the others.

    An object stands there if it has the same asset and support, and is at most `STAYED_M` from its proposed position.
    The share is None without objects.
    """
    proposed = {placement.id: placement for placement in proposal.placements}
    kept = sum(
        (before := proposed.get(placement.id)) is not None
        and (before.asset, before.support) == (placement.asset, placement.support)
        and math.dist(before.position, placement.position) <= STAYED_M
        for placement in layout.placements
    )
    total = len(layout.placements)
    return _rounded({"survives": kept / total if total else None, "placed": total - kept})


def report_metrics_2(report: LayoutReport) -> dict[str, float | None]:
    """Return the headline metrics of a report under the rule set `touchstone` by name, and the numbers of drives."""
    names = (*HEADLINE, "transitions", "entries")
    return _rounded({name: getattr(report, name) for name in names})


def _rounded(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: None if value is None else round(value, DIGITS) for name, value in values.items()}
