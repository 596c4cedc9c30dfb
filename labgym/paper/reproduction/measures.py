"""The metrics of a layout's report by name."""

from __future__ import annotations

from collections.abc import Mapping

from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import GATED, METRICS, PROXY
from labgym.eval.scoring.version2 import HEADLINE

DIGITS = 9
"""Decimals of metrics in rows."""


def report_metrics(report: LayoutReport) -> dict[str, float | None]:
    """Return the metrics of a report by name, as `aggregate` names them."""
    values: Mapping[str, float | None] = {
        **{name: getattr(report, name) for name in METRICS},
        **{f"gated_{name}": getattr(report.gated, name) for name in GATED},
        **{f"proxy_{name}": getattr(report.consistency_proxy, name) for name in PROXY},
    }
    return _rounded(values)


def report_metrics_2(report: LayoutReport) -> dict[str, float | None]:
    """Return the headline metrics of a report under touchstone-v2 by name, and the numbers of drives."""
    names = (*HEADLINE, "transitions", "entries", "walk")
    return _rounded({name: getattr(report, name) for name in names})


def _rounded(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: None if value is None else round(value, DIGITS) for name, value in values.items()}
