"""The metrics of a layout's report by name."""

from __future__ import annotations

from collections.abc import Mapping

from labgym.eval.scoring.layout_report import COLUMNS, LayoutReport
from labgym.eval.scoring.score import GATED, PROXY

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


def report_metrics_2(report: LayoutReport) -> dict[str, float | None]:
    """Return the headline metrics of a report under the rule set `touchstone` by name, and the numbers of drives."""
    names = (*HEADLINE, "transitions", "entries")
    return _rounded({name: getattr(report, name) for name in names})


def _rounded(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: None if value is None else round(value, DIGITS) for name, value in values.items()}
