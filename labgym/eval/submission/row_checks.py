"""Checks of a row against the suite, the layout and its own figures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from labgym.envs.labnav.task import spl
from labgym.envs.world import World
from labgym.eval.driving.assignments import Assignment
from labgym.eval.driving.episode_row import EpisodeRow
from labgym.eval.driving.navigation_metrics import soft_spl
from labgym.layouts import Layout
from labgym.suites import Suite

EXACT = 1e-9
"""Differences of recomputed figures up to this are rounding, relative or absolute."""
LENGTH_ERROR = 1e-6
"""Accuracy of shortest lengths, meters."""


@dataclass(frozen=True)
class Terms:
    """The terms under which the rows of a submission were driven.

    Attributes:
        suite: the published suite.
        policy: label of the policy.
        seed: random seed of the evaluation.
    """

    suite: Suite
    policy: str
    seed: int


def row_problems(row: EpisodeRow, episode: Assignment, layout: Layout, world: World, terms: Terms) -> Iterator[str]:
    """Yield a sentence for each field of a row that does not agree with the episode or with other fields.

    Args:
        row: the row.
        episode: the episode, with its start and goal.
        layout, world: the published layout, and the same prepared for simulation.
        terms: suite, policy and seed of the submission.
    """
    suite = terms.suite
    stated = {
        "suite": (row.suite, suite.label),
        "split": (row.split, suite.split),
        "policy": (row.policy, terms.policy),
        "seed": (row.seed, terms.seed),
        "layout_hash": (row.layout_hash, layout.hash),
        "protocol": (row.protocol, layout.protocol_id),
    }
    for name, (value, expected) in stated.items():
        if value != expected:
            yield f"{name} is {str(value)[:80]!r}, expected {expected!r}"
    for name, pose, published in (("start", row.start, episode.pair.start), ("goal", row.goal, episode.pair.goal)):
        if not all(map(_equal, pose, published)):
            yield f"{name} is {_shown(pose)}, expected {_shown(published)}"
    yield from _length_problems(row, world.shortest_length(episode.pair))
    yield from _outcome_problems(row, suite)
    yield from _score_problems(row, episode, suite)


def _length_problems(row: EpisodeRow, shortest: float) -> Iterator[str]:
    length = row.shortest_path_length
    if (length is None) != math.isinf(shortest) or (length is not None and abs(length - shortest) > LENGTH_ERROR):
        yield f"shortest_path_length is {length}, recomputed {shortest:.6f} m"


def _outcome_problems(row: EpisodeRow, suite: Suite) -> Iterator[str]:
    arrived = row.error is None and row.final_distance <= suite.success_distance
    if row.success != arrived:
        reason = "the policy failed" if row.error is not None else f"it ended {row.final_distance:.3f} m from the goal"
        yield f"success is {row.success}, but {reason} (success distance {suite.success_distance:g} m)"
    if row.steps > suite.max_steps:
        yield f"steps is {row.steps}, above the suite's limit of {suite.max_steps}"
    if not _equal(row.time, row.steps * suite.control_dt):
        yield f"time is {row.time:g} s, but {row.steps} steps take {row.steps * suite.control_dt:g} s"
    if row.contacts > row.steps:
        yield f"contacts is {row.contacts}, more than the {row.steps} steps"


def _score_problems(row: EpisodeRow, episode: Assignment, suite: Suite) -> Iterator[str]:
    initial = math.dist(episode.pair.start[:2], episode.pair.goal[:2])
    length, driven = row.shortest_path_length, row.path_length
    navdp = suite.metrics == "navdp"
    scores: dict[str, tuple[float | None, float | None]] = {
        "spl": (row.spl, None if navdp or length is None else spl(row.success, length, driven)),
        "soft_spl": (
            row.soft_spl,
            None if navdp or length is None else soft_spl(initial, row.final_distance, length, driven),
        ),
        "navdp_spl": (row.navdp_spl, spl(row.success, initial, driven) if navdp else None),
    }
    for name, (value, expected) in scores.items():
        if (value is None) != (expected is None) or (
            value is not None and expected is not None and not _equal(value, expected)
        ):
            yield f"{name} is {value}, recomputed {expected}"


def _equal(one: float, other: float) -> bool:
    return abs(one - other) <= EXACT * max(1.0, abs(other))


def _shown(pose: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{number:.6g}" for number in pose) + ")"
