"""The rules for layouts, which the generator optimizes and the score reports: one engine, rule sets as data."""

from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER, TOUCHSTONE, RuleSet, rule_set
from labgym.layouts.rules.violations import Violation, Violations

__all__ = [
    "PAPER",
    "TOUCHSTONE",
    "Assessment",
    "RuleSet",
    "Violation",
    "Violations",
    "evaluate_layout",
    "rule_set",
]
