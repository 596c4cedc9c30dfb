"""The rules of LabTouchstone for layouts, which the generator optimises and the score reports."""

from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.thresholds import VERSION, Profile, profile
from labgym.layouts.rules.violations import Violation, Violations

__all__ = ["VERSION", "Assessment", "Profile", "Violation", "Violations", "evaluate_layout", "profile"]
