"""Phase 2 of LabGen: repair and adjust, room level then desktop level, accepting only improvements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

from labgym.layouts.adjust import Adjuster, Level, RuleAdjuster, way_commands
from labgym.layouts.interiors.rearranging import rearrangements
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, apply
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet
from labgym.layouts.tidying import tidied
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

LEVELS: tuple[Level, ...] = ("room", "desktop")
ITERATIONS = 60
"""Maximum number of updates at each level."""
WAY_ITERATIONS = 4
WAY_BUDGET = 32
"""Maximum number of updates that clear a way out, and of commands verified for each."""


def optimise(
    layout: Layout,
    protocol: Protocol | None = None,
    rules: str | RuleSet = TOUCHSTONE,
    adjuster: Adjuster | None = None,
) -> Layout:
    """Return a layout at least as good, by L' = Adjust(FastRepair(L)) until no update is accepted.

    Arguments and rules as `optimise_assessed`.
    """
    return optimise_assessed(layout, protocol, rules, adjuster)[0]


def optimise_assessed(
    layout: Layout,
    protocol: Protocol | None = None,
    rules: str | RuleSet = TOUCHSTONE,
    adjuster: Adjuster | None = None,
    trace: Recorder | None = None,
    ways: bool = True,
    solver: bool = True,
) -> tuple[Layout, Assessment]:
    """Return a layout at least as good, and its assessment with navigation.

    An update is accepted if the cost falls, or stays and the fitness F rises (LabBuilder, algorithm 1). The cost is
    v(L) plus the facility errors, unless the rule set leaves them out: furniture away from its wall, a blocked front or
    door area, a crowded emergency shower, and no way 0.90 m wide to a door. v never exceeds that of the given layout.
    Fixed objects never move. Deterministic.

    Args:
        layout: the layout.
        protocol: decides which assets are required and which transitions are judged.
        rules: rule set, with its thresholds.
        adjuster: proposes the adjustments; by default rules and search.
        trace: records every trial and every accepted state.
        ways: whether to clear ways, too: infeasible transitions and ways out. None are cleared if facility
            errors are not in the cost: then only the refinement considers navigation.
        solver: whether the constraint solver may place furniture anew; it takes most of the time.
    """
    start = evaluate_layout(layout, protocol, rules)
    if trace is not None:
        trace.begin(layout, protocol, start.rules)
    run = _Optimization(layout, start, protocol, adjuster or RuleAdjuster(), trace, start.v)
    for level in LEVELS:
        for _ in range(ITERATIONS):
            if run.current.perfect:
                break
            updated = run.update(level)
            run.record(level)
            if not updated:
                break
        if solver and level == "room" and (run.current.errors or run.current.collisions):
            run.rearrange()
    run.current = run.current.with_navigation()
    if not ways or not start.rules.facility_in_cost or run.current.cost == 0:
        return run.layout, run.current
    start = start.with_navigation()
    run.most = start.v
    if solver:
        run.rearrange()
    run.clear_ways()
    if run.current.v > start.v:
        run.layout, run.current = layout, start
        run.record("undo")
    return run.layout, run.current


@dataclass
class _Optimization:
    """The best layout so far and its assessment.

    Attributes:
        most: greatest v of an accepted layout.
    """

    layout: Layout
    current: Assessment
    protocol: Protocol | None
    adjuster: Adjuster
    trace: Recorder | None
    most: int

    def record(self, level: str) -> None:
        """End an iteration in the trace."""
        if self.trace is not None:
            self.trace.update("optimise", level, self.layout)

    def update(self, level: Level) -> bool:
        """Take the first accepted update: repaired and adjusted, or, if pushing apart does not help, adjusted alone."""
        layout, current, trace = self.layout, self.current, self.trace
        pushed = fast_repair(layout, current.profile)
        for base in (pushed, layout) if level == "room" else (pushed,):
            assessment = current
            if base is not layout:
                assessment = evaluate_layout(base, self.protocol, current.rules, earlier=current)
            if trace is not None and (base is layout or base.placements != layout.placements):
                trace.trial("as_is" if base is layout else "fast_repair", (), current, assessment, False, "start")
            candidate = self.adjuster.adjust(base, self.protocol, assessment, level, trace)
            proposed = assessment
            if candidate is not base:
                proposed = evaluate_layout(candidate, self.protocol, current.rules, earlier=assessment)
            accepted = self._accepts(proposed)
            if trace is not None and candidate.placements != layout.placements and (candidate is base or not accepted):
                trace.trial("update", (), current, proposed, accepted)
            if accepted:
                self.layout, self.current = candidate, proposed
                return True
            if base.placements == layout.placements:
                break
        return False

    def rearrange(self) -> None:
        """Put accessories out of the way and let the solver rearrange furniture; take the best layout."""
        layout, protocol = self.layout, self.protocol
        involved = {layout.root(item).id for item in _involved(layout, self.current)}
        candidates = chain((tidied(layout, protocol),), rearrangements(layout, protocol, involved))
        for number, candidate in enumerate(candidates):
            self._judge("rearrange" if number else "tidy", (), fast_repair(candidate, self.current.profile))
            best = self.current
            if not best.errors and not best.faulty and not best.unreached:
                break
        self.record("rearrange")

    def clear_ways(self) -> None:
        """Relocate furniture until a way out leads from every place of work, as far as the space allows."""
        for _ in range(WAY_ITERATIONS):
            before, layout = self.current, self.layout
            if not _is_narrow(before):
                break
            for command in way_commands(layout, WAY_BUDGET):
                if self._judge("clear_way", (command,), apply(layout, command)) and not _is_narrow(self.current):
                    break
            self.record("ways")
            if self.current is before:
                break

    def _judge(self, operator: str, commands: tuple[Command, ...], candidate: Layout) -> bool:
        """Take a candidate if it is better than the best one, and return whether it is."""
        best = self.current
        proposed = evaluate_layout(candidate, self.protocol, best.rules, best.navigation, earlier=best)
        accepted = self._accepts(proposed)
        if self.trace is not None:
            self.trace.trial(operator, commands, best, proposed, accepted)
        if accepted:
            self.layout, self.current = candidate, proposed
        return accepted

    def _accepts(self, proposed: Assessment) -> bool:
        return proposed.better_than(self.current) and proposed.v <= self.most


def _is_narrow(assessment: Assessment) -> bool:
    return any(issue.rule == "egress" for issue in assessment.errors)


def _involved(layout: Layout, assessment: Assessment) -> Iterator[str]:
    """Placements that take part in a facility error, a collision, a fault of bounds or an infeasible transition."""
    yield from assessment.faulty
    for issue in assessment.errors:
        yield from issue.ids
    for transition in assessment.transitions or ():
        if not transition.feasible:
            for location in (transition.start_location, transition.goal_location):
                placement = layout.find(location)
                if placement is not None:
                    yield placement.id
