"""LabTouchstone: layout metrics, navigation metrics, the evaluator and reports."""

from labgym.eval.driving.runner import NavigationReport, evaluate
from labgym.eval.scoring.layout_report import LayoutReport, LayoutSummary
from labgym.eval.scoring.score import aggregate, score
from labgym.suites import Suite, load_suite, suite_names

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
