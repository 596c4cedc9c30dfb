"""LabTouchstone: layout metrics, navigation metrics, the runner and reports."""

from labgym.eval.report_model import LayoutReport, LayoutSummary
from labgym.eval.score import aggregate, score

__all__ = ["LayoutReport", "LayoutSummary", "aggregate", "score"]
