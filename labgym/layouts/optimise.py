"""Phase 2 of LabGen: repair and adjust, room level then desktop level, accepting only improvements."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

from labgym.layouts.adjust import Adjuster, Level, RuleAdjuster, way_commands
from labgym.layouts.interiors.rearranging import rearrangements
from labgym.layouts.model import Layout
from labgym.layouts.moves import apply
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
    adjuster = adjuster if adjuster is not None else RuleAdjuster()
    original, start = layout, evaluate_layout(layout, protocol, rules)
    if trace is not None:
        trace.begin(layout, protocol, start.rules)
    current = start
    for level in LEVELS:
        for _ in range(ITERATIONS):
            if current.perfect:
                break
            update = _update(layout, current, start.v, protocol, adjuster, level, trace)
            if trace is not None:
                trace.update("optimise", level, layout if update is None else update[0])
            if update is None:
                break
            layout, current = update
        if solver and level == "room" and (current.errors or current.collisions):
            layout, current = _rearrange(layout, current, start.v, protocol, trace)
    if not ways or not start.rules.facility_in_cost:
        return layout, current.with_navigation()
    return _with_ways(original, start, layout, current, protocol, trace, solver)


def _with_ways(
    original: Layout,
    start: Assessment,
    layout: Layout,
    current: Assessment,
    protocol: Protocol | None,
    trace: Recorder | None,
    solver: bool,
) -> tuple[Layout, Assessment]:
    """The optimised layout after its ways were cleared too, the original if that has fewer violations."""
    current = current.with_navigation()
    if current.cost == 0:
        return layout, current
    start = start.with_navigation()
    if solver:
        layout, current = _rearrange(layout, current, start.v, protocol, trace)
    layout, current = _clear_ways(layout, current, start.v, protocol, trace)
    if current.v <= start.v:
        return layout, current
    if trace is not None:
        trace.update("optimise", "undo", original)
    return original, start


def _update(
    layout: Layout,
    current: Assessment,
    most: int,
    protocol: Protocol | None,
    adjuster: Adjuster,
    level: Level,
    trace: Recorder | None,
) -> tuple[Layout, Assessment] | None:
    """The first accepted update: repaired and adjusted, or, if pushing things apart does not help, adjusted alone."""
    bases = (
        (fast_repair(layout, current.profile), layout) if level == "room" else (fast_repair(layout, current.profile),)
    )
    for base in bases:
        assessment = current if base is layout else evaluate_layout(base, protocol, current.rules)
        if trace is not None and (base is layout or base.placements != layout.placements):
            trace.trial("as_is" if base is layout else "fast_repair", (), current, assessment, False, "start")
        candidate = adjuster.adjust(base, protocol, assessment, level, trace)
        proposed = assessment if candidate is base else evaluate_layout(candidate, protocol, current.rules)
        accepted = proposed.better_than(current) and proposed.v <= most
        if trace is not None and candidate.placements != layout.placements and (candidate is base or not accepted):
            trace.trial("update", (), current, proposed, accepted)
        if accepted:
            return candidate, proposed
        if base.placements == layout.placements:
            return None
    return None


def _rearrange(
    layout: Layout, current: Assessment, most: int, protocol: Protocol | None, trace: Recorder | None
) -> tuple[Layout, Assessment]:
    """The best layout with accessories put out of the way and furniture rearranged by the solver."""
    best_layout, best = layout, current
    involved = {layout.root(item).id for item in _involved(layout, current)}
    for number, candidate in enumerate(chain((tidied(layout, protocol),), rearrangements(layout, protocol, involved))):
        candidate = fast_repair(candidate, current.profile)
        proposed = evaluate_layout(candidate, protocol, current.rules, navigation=current.navigation)
        accepted = proposed.better_than(best) and proposed.v <= most
        if trace is not None:
            trace.trial("rearrange" if number else "tidy", (), best, proposed, accepted)
        if accepted:
            best_layout, best = candidate, proposed
        if not best.errors and not best.faulty and all(move.feasible for move in best.transitions or ()):
            break
    if trace is not None:
        trace.update("optimise", "rearrange", best_layout)
    return best_layout, best


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


def _clear_ways(
    layout: Layout, current: Assessment, most: int, protocol: Protocol | None, trace: Recorder | None
) -> tuple[Layout, Assessment]:
    """Relocate furniture until a way out leads from every place of work, as far as the space allows."""
    for _ in range(WAY_ITERATIONS):
        narrow = [issue for issue in current.errors if issue.rule == "egress"]
        if not narrow:
            break
        best, best_layout = current, layout
        for command in way_commands(layout, WAY_BUDGET):
            candidate = apply(layout, command)
            proposed = evaluate_layout(candidate, protocol, current.rules, navigation=True)
            accepted = proposed.better_than(best) and proposed.v <= most
            if trace is not None:
                trace.trial("clear_way", (command,), best, proposed, accepted)
            if accepted:
                best, best_layout = proposed, candidate
                if not any(issue.rule == "egress" for issue in proposed.errors):
                    break
        if trace is not None:
            trace.update("optimise", "ways", best_layout)
        if best is current:
            break
        layout, current = best_layout, best
    return layout, current
