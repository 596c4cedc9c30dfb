"""Work: a limit of what a repair takes in all, so that no input keeps it busy for hours. Counts, not seconds."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.errors import LabgymError
from labgym.layouts.adjust import Adjuster, Level
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

UNITS = 2_000_000
"""Units of a repair. The repair of a damaged layout usually takes some thousands."""
TRIALS = 30
"""Assessments for which an adjustment is charged: it verifies at most twice as many commands."""


class WorkLimitError(LabgymError):
    """A repair has reached its limit of work; `repair_layout` and `refine` return the best layout until then."""


@dataclass
class Work:
    """The units that are left: an assessment takes one for each object and one for each violation of the layout."""

    units: int = UNITS

    def spend(self, assessment: Assessment, times: int = 1) -> None:
        """Charge for one or more assessments.

        Raises:
            WorkLimitError: no units are left.
        """
        if self.units <= 0:
            raise WorkLimitError("the repair has reached its limit of work: repair fewer faults at a time")
        self.units -= times * (len(assessment.arrangement) + assessment.v)


@dataclass(frozen=True)
class LimitedAdjuster:
    """An adjuster that charges for each adjustment."""

    adjuster: Adjuster
    work: Work

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return what the adjuster returns.

        Raises:
            WorkLimitError: no units are left.
        """
        self.work.spend(assessment, TRIALS)
        return self.adjuster.adjust(layout, protocol, assessment, level, trace)
