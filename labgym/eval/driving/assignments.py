"""The episodes of a layout: every drive `repeats` times, from a jittered start if the suite says so."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from labgym.envs.endpoints import NO_PAIR, pair_between, passed_ends
from labgym.envs.tasks import goal_pair
from labgym.envs.world import world_of
from labgym.eval.driving.episode_row import Pose
from labgym.geometry import wrap_angle
from labgym.layouts import Layout
from labgym.navigation import GoalPair
from labgym.suites import Jitter, Suite

DRAWS = 1000
"""Number of poses that are drawn before a jittered start falls back to the pair's own."""


@dataclass(frozen=True)
class Assignment:
    """An episode to drive.

    Attributes:
        pair: the drive; its start is the one of this repeat.
        repeat: number of the repeat, from 0.
        options: the environment's reset options that start this episode.
    """

    pair: GoalPair
    repeat: int = 0
    options: Mapping[str, Any] = field(default_factory=dict)


def episode_keys(layout: Layout, suite: Suite) -> tuple[str, ...]:
    """Return the keys of a layout's episodes in the order in which they are driven: by pair, then by repeat."""
    return tuple(
        f"{layout.id}/{pair.index}/{repeat}" for pair in suite.pairs(layout) for repeat in range(suite.repeats)
    )


def assignments(layout: Layout, suite: Suite) -> tuple[Assignment, ...]:
    """Return a layout's episodes, in the order of `episode_keys`."""
    return tuple(
        _assignment(layout, suite, pair, repeat) for pair in suite.pairs(layout) for repeat in range(suite.repeats)
    )


def assignment_between(
    layout: Layout, pair: int, start: Sequence[float] | None = None, goal: Sequence[float] | None = None
) -> Assignment:
    """Return a goal pair of a layout with its start, its goal or both replaced; the pair is not needed for both.

    Raises:
        OptionError: start or goal is not a pose in a room, or the layout has no goal pair.
        UnknownNameError: no goal pair has that index.
    """
    ends = passed_ends({"start": start, "goal": goal}, layout.floor)
    drive = pair_between(*ends, goal_pair(layout, pair) if None in ends else None)
    options = {name: end for name, end in zip(("start", "goal"), ends, strict=True) if end is not None}
    return Assignment(drive, options=options if drive.index == NO_PAIR else {"pair": pair, **options})


def jittered_start(layout: Layout, pair: GoalPair, repeat: int, jitter: Jitter) -> Pose:
    """Return the start of a repeat: uniform in a disc around the pair's start, and its heading in an interval.

    The draws depend on the jitter's seed, the layout's `draw_seed`, the pair and the repeat alone. Poses at which the
    robot would touch something, or from which no path leads to the goal, are drawn again. A pair without a path, or
    without such a pose in 1000 draws, keeps its start.
    """
    world = world_of(layout)
    if not math.isfinite(world.shortest_length(pair)):
        return pair.start
    rng = np.random.default_rng([jitter.seed, layout.draw_seed, pair.index, repeat])
    x, y, yaw = pair.start
    turn = math.radians(jitter.angle)
    for _ in range(DRAWS):
        dx, dy, dyaw = rng.uniform(
            (-jitter.distance, -jitter.distance, -turn), (jitter.distance, jitter.distance, turn)
        )
        if dx * dx + dy * dy > jitter.distance * jitter.distance:
            continue
        pose = (x + float(dx), y + float(dy), wrap_angle(yaw + float(dyaw)))
        if world.clear_at(pose) and math.isfinite(world.shortest_length(replace(pair, start=pose))):
            return pose
    return pair.start


def _assignment(layout: Layout, suite: Suite, pair: GoalPair, repeat: int) -> Assignment:
    start = pair.start if suite.jitter is None else jittered_start(layout, pair, repeat, suite.jitter)
    if suite.drives is not None:
        return Assignment(replace(pair, start=start), repeat, {"start": start, "goal": pair.goal})
    if start == pair.start:
        return Assignment(pair, repeat, {"pair": pair.index})
    return Assignment(replace(pair, start=start), repeat, {"pair": pair.index, "start": start})
