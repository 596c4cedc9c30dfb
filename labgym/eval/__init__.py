"""LabTouchstone: layout metrics, navigation metrics, the runner and reports."""

from labgym.eval.report_model import LayoutReport, LayoutSummary
from labgym.eval.runner import NavigationReport, evaluate
from labgym.eval.score import aggregate, score
from labgym.eval.suites import Suite, load_suite, suite_names

__all__ = [
    "LayoutReport",
    "LayoutSummary",
    "NavigationReport",
    "Suite",
    "aggregate",
    "evaluate",
    "load_suite",
    "score",
    "suite_names",
]
