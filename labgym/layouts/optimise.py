"""Phase 2 of LabGen: repair and adjust, room level then desktop level, keeping only what is better."""

from __future__ import annotations

from labgym.layouts.adjust import Adjuster, Level, RuleAdjuster
from labgym.layouts.model import Layout
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol

LEVELS: tuple[Level, ...] = ("room", "desktop")
ITERATIONS = 24
"""Updates at each level at the most."""


def optimise(
    layout: Layout,
    protocol: Protocol | None = None,
    profile: str | Profile = "default",
    adjuster: Adjuster | None = None,
) -> Layout:
    """Return a layout at least as good, by L' = Adjust(FastRepair(L)) until nothing is accepted any more.

    An update is accepted when the violations v fall, or stay and the fitness F rises (LabBuilder, algorithm 1);
    so v never rises. Deterministic.
    """
    adjuster = adjuster if adjuster is not None else RuleAdjuster()
    current = evaluate_layout(layout, protocol, profile)
    for level in LEVELS:
        for _ in range(ITERATIONS):
            if current.v == 0 and current.fitness > 1.0 - 1e-9:
                return layout
            repaired = fast_repair(layout)
            base = evaluate_layout(repaired, protocol, profile)
            candidate = adjuster.adjust(repaired, protocol, base, level)
            proposed = evaluate_layout(candidate, protocol, profile)
            if not proposed.better_than(current):
                break
            layout, current = candidate, proposed
    return layout
