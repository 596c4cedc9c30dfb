"""The navigation-aware refinement operator (LabBuilder, algorithm 2)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, apply, may_move
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement.blockages import Blockage, blockages
from labgym.layouts.refinement.fixes import deduplicated, responsible, rotation_fixes, translations
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.objective import Assessment, evaluate_layout, judged_transitions
from labgym.layouts.rules.thresholds import Profile
from labgym.navigation import Transition
from labgym.protocols import Protocol

ITERATIONS = 8
PATIENCE = 3
"""Number of iterations without a drop of the unreachable rate after which the refinement stops."""
SINGLES = 6
"""Maximum number of single commands that are repaired and verified in one iteration."""
PLACES = 4
"""Maximum number of free places tried for a piece of furniture that no command frees."""

Update = tuple[Command, ...]


def refine(layout: Layout, protocol: Protocol, profile: str | Profile = "default") -> Layout:
    """Return a layout in which more transitions are feasible, all of them if the space allows it.

    Each iteration judges the transitions, locates what blocks the infeasible ones, and derives updates from it: turns
    of pieces that face a wall, and for each object and axis the largest translation that frees the robot. All updates
    together and the best single ones are applied with what stands on the furniture, **repaired by `optimise`, and only
    then judged**. If none is accepted, what is in the way is placed anew. The iterations end if every transition is
    feasible, no update is accepted, or the unreachable rate has not dropped `PATIENCE` times. Fixed objects never move.
    Deterministic.
    """
    return refine_assessed(layout, evaluate_layout(layout, protocol, profile, navigation=True), protocol)[0]


def refine_assessed(layout: Layout, current: Assessment, protocol: Protocol) -> tuple[Layout, Assessment]:
    """Return the layout of `refine` and its assessment, given the assessment of a layout with navigation."""
    least, stalled = len(_failures(current)), 0
    for _ in range(ITERATIONS):
        if least == 0 or stalled >= PATIENCE:
            break
        update = _update(layout, current, protocol)
        if update is None:
            break
        layout, current = update
        unreachable = len(_failures(current))
        stalled = 0 if unreachable < least else stalled + 1
        least = min(least, unreachable)
    return layout, current


def _update(layout: Layout, current: Assessment, protocol: Protocol) -> tuple[Layout, Assessment] | None:
    """Return the best accepted update, or None if none improves the layout."""
    places = [place for failure in _failures(current) for place in blockages(layout, failure)]
    for proposals in (_commands(layout, places, protocol), _new_places(layout, places)):
        best: tuple[Layout, Assessment] | None = None
        for commands in proposals:
            candidate, assessment = optimise_assessed(_applied(layout, commands), protocol, current.profile)
            if assessment.better_than(current if best is None else best[1]):
                best = candidate, assessment
                if assessment.cost == 0:
                    break
        if best is not None:
            return best
    return None


def _commands(layout: Layout, places: Sequence[Blockage], protocol: Protocol) -> Iterator[Update]:
    """Yield all updates together, then the single commands that free the most transitions before any repair."""
    turns = tuple(dict.fromkeys(turn for place in places for turn in rotation_fixes(layout, place)))
    pushes = deduplicated(push for place in places for push in responsible(layout, place))
    turned = {turn.id for turn in turns}
    together: Update = (*turns, *(push.command for push in pushes if push.id not in turned))
    if len(together) > 1:
        yield together
    every: list[Command] = [*turns, *(push.command for place in places for push in translations(layout, place))]
    singles = list(dict.fromkeys(every))
    unreachable = {command: _unreachable(apply(layout, command), protocol) for command in singles}
    for command in sorted(singles, key=unreachable.__getitem__)[:SINGLES]:
        yield (command,)


def _new_places(layout: Layout, places: Sequence[Blockage]) -> Iterator[Update]:
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


def _applied(layout: Layout, commands: Update) -> Layout:
    for command in commands:
        layout = apply(layout, command)
    return layout


def _failures(assessment: Assessment) -> list[Transition]:
    return [transition for transition in assessment.transitions or () if not transition.feasible]


def _unreachable(layout: Layout, protocol: Protocol) -> int:
    return sum(not transition.feasible for transition in judged_transitions(layout, protocol))
