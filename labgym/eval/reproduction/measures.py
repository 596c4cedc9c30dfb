"""The metrics of a layout's report by name."""

from __future__ import annotations

from collections.abc import Mapping

from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import GATED, METRICS, PROXY

DIGITS = 9
"""Decimals of metrics in rows."""


def report_metrics(report: LayoutReport) -> dict[str, float | None]:
    """Return the metrics of a report by name, as `aggregate` names them."""
    values: Mapping[str, float | None] = {
        **{name: getattr(report, name) for name in METRICS},
        **{f"gated_{name}": getattr(report.gated, name) for name in GATED},
        **{f"proxy_{name}": getattr(report.consistency_proxy, name) for name in PROXY},
    }
    return {name: None if value is None else round(value, DIGITS) for name, value in values.items()}
