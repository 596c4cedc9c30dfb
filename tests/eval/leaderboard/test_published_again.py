"""Drives of the published results, driven again: every default of a policy and of a task decides them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from labgym.eval import evaluate
from labgym.eval.labnav.suites import load_labnav
from labgym.eval.leaderboard.labnav import Outcome, agreement, published_results

DRIVES = {
    "stack": ("aisle", "moved", "people", "odometry", "dock", "glass", "carry"),
    "astar": ("aisle", "carry"),
    "online_map": ("aisle",),
    "dwa": ("moved",),
    "bug2": ("moved",),
    "clairvoyant": ("aisle", "people"),
    "iplanner": ("people",),
    "navdp": ("people",),
    "ppo-depth": ("moved",),
    "local-ppo": ("people",),
}
"""Tasks of each policy; of each, the shortest published success of at least `LEAST_S`."""
LEAST_S = 8.0


def chosen(outcomes: dict[str, Outcome], task: str) -> str:
    """Return the key of the shortest success of a task."""
    driven = [
        (one.time, key)
        for key, one in outcomes.items()
        if key.startswith(f"{task}-") and one.score > 0.0 and one.time >= LEAST_S
    ]
    return min(driven)[1]


RESULTS = {one.summary.policy: one for one in published_results()}


def test_a_planner_and_the_stack_are_driven_again() -> None:
    assert {"astar", "stack"} <= RESULTS.keys()


@pytest.mark.parametrize("policy", [policy for policy in DRIVES if policy in RESULTS])
def test_a_published_drive_is_driven_again(policy: str) -> None:
    result = RESULTS[policy]
    outcomes = {one.key: one for one in result.outcomes}
    suite = load_labnav("labnav")
    keys = {chosen(outcomes, task) for task in DRIVES[policy]}
    parts = tuple(part for whole in suite.parts if (part := whole.only(keys)) is not None)
    few = replace(suite, name="again", parts=parts)
    rows = evaluate(policy, few, progress=False).rows
    found = agreement(rows, outcomes, suite.seconds)
    assert found.differing == ()
    assert found.equal == found.compared == len(keys)
