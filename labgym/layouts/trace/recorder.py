"""Records what the phases try and accept; the phases take one as their argument `trace`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from labgym.errors import OptionError
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.trace.document import (
    MOST_ITERATIONS,
    MOST_TRIALS,
    Figures,
    Iteration,
    Phase,
    StateChange,
    Trace,
    Trial,
    Verdict,
    tried_commands,
)
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from labgym.layouts.moves import Command


class Recorder:
    """Collects the trace of one layout.

    `begin` takes the first state, `trial` and `refuse` what is tried, and `update` the state after an iteration.
    Assessments are made with navigation, so that recording takes longer than the phases alone; it changes no result.
    """

    def __init__(self) -> None:
        self._start: Layout | None = None
        self._current: Layout | None = None
        self._assessment: Assessment | None = None
        self._protocol: Protocol | None = None
        self._rules: RuleSet | None = None
        self._iterations: list[Iteration] = []
        self._trials: list[Trial] = []
        self._tried = 0

    def begin(self, layout: Layout, protocol: Protocol | None, rules: RuleSet, phase: Phase = "propose") -> None:
        """Take the first state; another call changes nothing, so that each phase may begin the trace.

        Args:
            protocol: decides which assets are required and which transitions are judged.
            phase: the phase that made the layout.
        """
        if self._start is not None:
            return
        self._start = self._current = layout
        self._protocol, self._rules = protocol, rules
        self._assessment = evaluate_layout(layout, protocol, rules, navigation=True)
        self._iterations.append(Iteration(phase=phase, hash=layout.hash, figures=_figures(self._assessment)))

    def trial(
        self,
        operator: str,
        commands: Iterable[Command],
        before: Assessment,
        after: Assessment,
        accepted: bool,
        verdict: Verdict | None = None,
        note: str = "",
    ) -> None:
        """Record a candidate that was judged.

        Args:
            operator: what made the candidate.
            commands: what leads to it; empty for an operator that changes the layout as a whole.
            before, after: assessments of the state before and of the candidate.
            accepted: whether it is the best state so far.
            verdict: in place of the one that follows from the other arguments.
        """
        self._tried += 1
        if len(self._trials) >= MOST_TRIALS:
            if not accepted:
                return
            del self._trials[-1]  # the accepted trial is always listed
        unreachable = None if after.transitions is None else len(after.unreached)
        self._trials.append(
            Trial(
                operator=operator,
                commands=tried_commands(commands),
                verdict=verdict if verdict is not None else _verdict(before, after, accepted),
                v=after.v,
                errors=len(after.errors),
                fitness=after.fitness,
                unreachable=unreachable,
                worse=_increase(_faults(before), _faults(after)),
                note=note[:500],
            )
        )

    def refuse(self, operator: str, note: str, commands: Iterable[Command] = ()) -> None:
        """Record a command that cannot be applied, such as one that names an unknown object."""
        self._tried += 1
        if len(self._trials) < MOST_TRIALS:
            trial = Trial(operator=operator, commands=tried_commands(commands), verdict="invalid", note=note[:500])
            self._trials.append(trial)

    def update(self, phase: Phase, level: str | None, layout: Layout) -> None:
        """End an iteration: record the trials since the last one, and the state after it.

        An iteration without trials and without a change is not recorded.

        Raises:
            OptionError: the trace has not begun.
        """
        if self._current is None or self._assessment is None:
            raise OptionError("the trace has no first state: call begin")
        change = StateChange.between(self._current, layout)
        trials, tried = tuple(self._trials), self._tried
        self._trials, self._tried = [], 0
        if (change.empty and not tried) or len(self._iterations) >= MOST_ITERATIONS:
            return
        if not change.empty:
            before = self._assessment
            self._assessment = evaluate_layout(layout, self._protocol, before.rules, navigation=True, earlier=before)
            self._current = layout
        self._iterations.append(
            Iteration(
                phase=phase,
                level=level,
                trials=trials,
                tried=tried,
                change=change,
                hash=self._current.hash,
                figures=_figures(self._assessment),
            )
        )

    def trace(self) -> Trace:
        """Return the document.

        Raises:
            OptionError: the trace has not begun.
        """
        if self._start is None or self._rules is None:
            raise OptionError("the trace has no first state: call begin")
        return Trace(
            profile=self._rules.profile.name,
            rules=self._rules.name,
            protocol=None if self._protocol is None else self._protocol.id,
            start=self._start,
            iterations=tuple(self._iterations),
        )


def _verdict(before: Assessment, after: Assessment, accepted: bool) -> Verdict:
    if accepted:
        return "accepted"
    if after.cost != before.cost:
        return "cost_rose" if after.cost > before.cost else "beaten"
    if after.better_than(before):
        return "beaten"
    return "fitness_fell" if before.better_than(after) else "no_gain"


def _figures(assessment: Assessment) -> Figures:
    return Figures(
        v=assessment.v,
        errors=len(assessment.errors),
        missing=len(assessment.missing or ()),
        fitness=assessment.fitness,
        unreachable=len(assessment.unreached),
        transitions=len(assessment.transitions or ()),
        faults={kind: count for kind, count in _faults(assessment).items() if count},
    )


def _faults(assessment: Assessment) -> dict[str, int]:
    """Return the number of hard violations by kind; facility errors are added to those of facility rules."""
    counts = Counter(violation.kind for violation in assessment.violations.items)
    counts["facility"] += len(assessment.errors)
    return counts


def _increase(before: Mapping[str, int], after: Mapping[str, int]) -> dict[str, int]:
    return {kind: count - before.get(kind, 0) for kind, count in after.items() if count > before.get(kind, 0)}
