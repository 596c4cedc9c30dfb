"""The phases of the paper as it prints them: FastRepair, Adjust and Upsilon, and nothing in addition.

`labgym.layouts.phases` also adds missing assets, lets a constraint solver place furniture anew, follows facility rules
and repairs what still fails. These phases do none of that: a proposal that lacks an asset ends without it. Adjust is
labgym's search in place of the language model.
"""

from __future__ import annotations

from dataclasses import replace

from labgym.layouts.adjust import RuleAdjuster
from labgym.layouts.model import Layout
from labgym.layouts.moves import applied
from labgym.layouts.optimise import ITERATIONS, LEVELS
from labgym.layouts.refinement import blockages
from labgym.layouts.refinement.operator import ITERATIONS as REFINEMENTS
from labgym.layouts.refinement.operator import PATIENCE, turns_and_pushes
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.protocols import Protocol


def optimized(layout: Layout, protocol: Protocol, rules: RuleSet) -> Layout:
    """Return a layout after phase 2 of algorithm 1: L' = Adjust(FastRepair(L)), at room level, then desktop level.

    L' is accepted if v falls, or stays and F rises. Facility rules do not count.
    """
    rules = replace(rules, facility_in_cost=False)
    adjuster, current = RuleAdjuster(), evaluate_layout(layout, protocol, rules)
    for level in LEVELS:
        for _ in range(ITERATIONS):
            pushed = fast_repair(layout, rules.profile)
            assessment = evaluate_layout(pushed, protocol, rules, earlier=current)
            candidate = adjuster.adjust(pushed, protocol, assessment, level)
            proposed = evaluate_layout(candidate, protocol, rules, earlier=assessment)
            if not proposed.better_than(current):
                break
            layout, current = candidate, proposed
    return layout


def refined(layout: Layout, protocol: Protocol, rules: RuleSet, repair: bool = True) -> Layout:
    """Return a layout after phase 3: L = Upsilon(L) until every transition is feasible.

    Upsilon (algorithm 2) applies all turns and deduplicated translations of the infeasible transitions. It also stops
    if it has no update, after `REFINEMENTS` updates, or if `PATIENCE` of them have freed no transition.

    Args:
        repair: whether each update is followed by phase 2.
    """
    on_grid = rules.paths == "grid"
    fewest, stalled = None, 0
    for _ in range(REFINEMENTS):
        failures = evaluate_layout(layout, protocol, rules, navigation=True).unreached
        stalled = 0 if fewest is None or len(failures) < fewest else stalled + 1
        fewest = len(failures) if fewest is None else min(fewest, len(failures))
        places = [place for failure in failures for place in blockages(layout, failure, on_grid)]
        turns, pushes = turns_and_pushes(layout, places)
        if not (turns or pushes) or stalled >= PATIENCE:
            break
        layout = applied(layout, (*turns, *pushes))
        if repair:
            layout = optimized(layout, protocol, rules)
    return layout
