"""The navigation-aware refinement operator (LabBuilder, algorithm 2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from labgym.layouts.adjust import Adjuster, LimitedAdjuster, RepairBudget, RuleAdjuster, WorkLimitError
from labgym.layouts.model import Layout
from labgym.layouts.moves import Assign, Command, applied, apply, may_move
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement.blockages import (
    RouteBlockage,
    blockages,
    deduplicated,
    responsible,
    rotation_fixes,
    translations,
)
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.objective import Assessment, evaluate_layout, judged_drives
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet
from labgym.layouts.rules.site import Site
from labgym.layouts.trace import Recorder
from labgym.navigation import Transition
from labgym.protocols import Protocol

ITERATIONS = 8
UNITS = 10_000_000
"""Limit of work, as `labgym.layouts.adjust` counts it: no layout of a generator comes near it."""
PATIENCE = 3
"""Number of iterations without a drop of the unreachable rate after which the refinement stops."""
MOST_SINGLES = 200
"""Maximum number of single commands whose effect on the transitions is determined in one iteration."""
SINGLES = 6
"""Maximum number of single commands that are repaired and verified in one iteration."""
PLACES = 4
"""Maximum number of free places tried for a piece of furniture that no command frees."""

Update = tuple[Command, ...]
Judge = Callable[[Layout], tuple[Layout, Assessment]]


def refine(layout: Layout, protocol: Protocol, rules: str | RuleSet = TOUCHSTONE) -> Layout:
    """Return a layout in which more transitions are feasible, all of them if the space allows it.

    Each iteration judges the transitions, locates what blocks the infeasible ones, and derives updates from it: turns
    of pieces that face a wall, and for each object and axis the largest translation that frees the robot. All updates
    together and the best single ones are applied with what stands on the furniture, **repaired by `optimise`, and only
    then judged**. If none is accepted, what is in the way is placed anew. The iterations end if every transition is
    feasible, no update is accepted, the unreachable rate has not dropped `PATIENCE` times, or the limit of work is
    reached. Fixed objects never move. Deterministic.
    """
    return refine_assessed(layout, evaluate_layout(layout, protocol, rules, navigation=True), protocol)[0]


def refine_assessed(
    layout: Layout,
    current: Assessment,
    protocol: Protocol,
    adjuster: Adjuster | None = None,
    repair: bool = True,
    trace: Recorder | None = None,
    solver: bool = True,
) -> tuple[Layout, Assessment]:
    """Return the layout of `refine` and its assessment.

    Args:
        layout: the layout.
        current: its assessment with navigation.
        protocol: decides the transitions.
        adjuster: adjusts the layout after each update; by default rules and search.
        repair: whether `optimise` repairs updates before they are judged; if not, the commands alone must help.
        trace: records every update that is tried and every accepted state.
        solver: whether the repair of an update may place furniture anew with the constraint solver.
    """
    if trace is not None:
        trace.begin(layout, protocol, current.rules)
    limited = LimitedAdjuster(adjuster if adjuster is not None else RuleAdjuster(), RepairBudget(UNITS))
    judge = partial(_repaired, protocol=protocol, rules=current.rules, adjuster=limited, repair=repair, solver=solver)
    least, stalled = len(current.unreached), 0
    for _ in range(ITERATIONS):
        if least == 0 or stalled >= PATIENCE:
            break
        try:
            update = _update(layout, current, protocol, judge, trace)
        except WorkLimitError:
            break
        if trace is not None:
            trace.update("refine", None, layout if update is None else update[0])
        if update is None:
            break
        layout, current = update
        unreachable = len(current.unreached)
        stalled = 0 if unreachable < least else stalled + 1
        least = min(least, unreachable)
    return layout, current


def _repaired(
    layout: Layout, protocol: Protocol, rules: RuleSet, adjuster: Adjuster | None, repair: bool, solver: bool
) -> tuple[Layout, Assessment]:
    """Return an updated layout after its repair, and its assessment with navigation."""
    if repair:
        return optimise_assessed(layout, protocol, rules, adjuster, solver=solver)
    return layout, evaluate_layout(layout, protocol, rules, navigation=True)


def _update(
    layout: Layout, current: Assessment, protocol: Protocol, judge: Judge, trace: Recorder | None
) -> tuple[Layout, Assessment] | None:
    """Return the best accepted update, or None if none improves the layout."""
    failures = current.unreached
    on_grid = current.rules.paths == "grid"
    places = [place for failure in failures for place in blockages(layout, failure, on_grid)]
    unreachable = partial(_unreachable, rules=current.rules, protocol=protocol)
    for proposals in (_commands(layout, failures, places, unreachable), _new_places(layout, places)):
        best: tuple[Layout, Assessment] | None = None
        for commands in proposals:
            candidate, assessment = judge(applied(layout, commands))
            accepted = assessment.better_than(current if best is None else best[1])
            if trace is not None:
                trace.trial("refine", commands, current, assessment, accepted)
            if accepted:
                best = candidate, assessment
                if assessment.cost == 0:
                    break
        if best is not None:
            return best
    return None


def turns_and_pushes(layout: Layout, places: Sequence[RouteBlockage]) -> tuple[Update, Update]:
    """Return the turns that failures suggest, and the translations of pieces that do not turn, deduplicated."""
    turns = tuple(dict.fromkeys(turn for place in places for turn in rotation_fixes(layout, place)))
    turned = {turn.id for turn in turns}
    pushes = deduplicated(push for place in places for push in responsible(layout, place))
    return turns, tuple(push.command for push in pushes if push.id not in turned)


def _commands(
    layout: Layout,
    failures: Sequence[Transition],
    places: Sequence[RouteBlockage],
    unreachable: Callable[[Layout], int],
) -> Iterator[Update]:
    """Yield all updates together, then the single commands that free the most transitions before any repair."""
    turns, pushes = turns_and_pushes(layout, places)
    if len(turns) + len(pushes) > 1:
        yield (*turns, *pushes)
    pushed = (push.command for place in places for push in translations(layout, place))
    every: list[Command] = [*_reassignments(layout, failures), *turns, *pushed]
    singles = list(dict.fromkeys(every))[:MOST_SINGLES]
    counts = {command: unreachable(apply(layout, command)) for command in singles}
    for command in sorted(singles, key=counts.__getitem__)[:SINGLES]:
        yield (command,)


def _reassignments(layout: Layout, failures: Sequence[Transition]) -> Iterator[Assign]:
    """Yield the other zones in which the steps at the ends of infeasible transitions can be carried out."""
    if not layout.zones:
        return
    for location in dict.fromkeys(end for move in failures for end in (move.start_location, move.goal_location)):
        current = layout.find(location)
        roots = {layout.root(item.id).id for item in layout.all_of(location) if item is not current}
        for zone in layout.zones:
            if roots.intersection(zone.furniture):
                yield Assign(location, zone.name)


def _new_places(layout: Layout, places: Sequence[RouteBlockage]) -> Iterator[Update]:
    """Yield free places for what is in the way, and for the pieces at which the robot works."""
    movers: dict[str, None] = {}
    for place in places:
        movers |= dict.fromkeys(place.objects)
    for place in places:
        target = layout.find(place.location)
        if target is not None:
            movers.setdefault(layout.root(target.id).id)
    for mover in movers:
        if may_move(layout, mover):
            for target_place in free_places(layout, mover, PLACES):
                yield (target_place,)


def _unreachable(layout: Layout, rules: RuleSet, protocol: Protocol) -> int:
    drives = judged_drives(rules, Site(Arrangement.of(layout), protocol)) or {}
    return sum(not drive.feasible for drive in drives.get("transitions", ()))
