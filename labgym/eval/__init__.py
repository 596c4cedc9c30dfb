"""LabTouchstone: layout metrics, navigation metrics, the evaluator and reports."""

from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.evaluator import evaluate, read_evaluation
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.scoring.layout_report import LayoutReport, LayoutSummary
from labgym.eval.scoring.score import aggregate, score
from labgym.suites import Suite, load_suite

__all__ = [
    "LabNavEvaluation",
    "LayoutReport",
    "LayoutSummary",
    "Suite",
    "TransitionEvaluation",
    "aggregate",
    "evaluate",
    "load_suite",
    "read_evaluation",
    "score",
]
