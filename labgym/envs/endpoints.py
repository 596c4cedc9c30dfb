"""Starts and goals passed as reset options: reading them, and checking that the robot can drive between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.envs.world import World
from labgym.errors import OptionError
from labgym.geometry import wrap_angle
from labgym.layouts.floor import Floor
from labgym.navigation import PLANNING_RADIUS, GoalPair, Pose
from labgym.navigation.goals import ANYWHERE, SAME_PLACE, same_place

NO_PAIR = -1
"""Index of a drive whose start and goal are both passed."""
LEAST_DRIVE_M = 1.5
"""Least distance between start and goal of a drive between free poses, meters."""
TRIES = 200
"""Number of drives that are drawn to find one between free poses."""
FORMS = {3: "(x, y, yaw)", 2: "(x, y)"}


def passed_ends(options: Mapping[str, Any], floor: Floor) -> tuple[Pose | None, Pose | None]:
    """Return the options "start" and "goal" as poses; None for one that is not passed. A goal's default yaw is 0.

    Raises:
        OptionError: one of them is not a sequence of finite numbers of the right length, or is in no room.
    """
    start, goal = options.get("start"), options.get("goal")
    return (
        None if start is None else _pose("start", start, (3,), floor),
        None if goal is None else _pose("goal", goal, (3, 2), floor),
    )


def pair_between(start: Pose | None, goal: Pose | None, pair: GoalPair | None) -> GoalPair:
    """Return a goal pair with its start, its goal or both replaced; without a pair, both must be passed."""
    if pair is None:
        if start is None or goal is None:
            raise OptionError("a drive without a goal pair needs both start and goal")
        return GoalPair(NO_PAIR, start, goal, ANYWHERE, ANYWHERE)
    if start is not None:
        pair = replace(pair, start=start, start_location=ANYWHERE)
    return pair if goal is None else replace(pair, goal=goal, goal_location=ANYWHERE)


def check_drivable(world: World, pair: GoalPair) -> None:
    """Check that the robot stands free at the start of a pair and that a path leads to the goal.

    Raises:
        OptionError: start and goal coincide, the robot would touch something at the start, or no path exists for a
            disc of the planning radius.
    """
    start, goal = _shown(pair.start), _shown(pair.goal[:2])
    if same_place(pair.start, pair.goal):
        raise OptionError(f"start {start} and goal {goal} coincide; they must be more than {SAME_PLACE:g} m apart")
    if not world.clear_at(pair.start):
        raise OptionError(
            f"start {start}: the robot would touch an obstacle or a wall there; choose a position at least "
            f"{ROBOT.chassis_radius:.2f} m from everything"
        )
    if math.isfinite(world.shortest_length(pair)):
        return
    for name, pose, shown in (("start", pair.start, start), ("goal", pair.goal, goal)):
        if not world.plannable_at(pose):
            raise OptionError(
                f"{name} {shown}: a disc of {PLANNING_RADIUS:.2f} m, for which paths are planned, does not fit there; "
                f"choose a position at least {PLANNING_RADIUS:.2f} m from everything"
            )
    raise OptionError(
        f"no path from start {start} to goal {goal} for a disc of {PLANNING_RADIUS:.2f} m: choose two positions in "
        "the same free region"
    )


def free_pair(rng: np.random.Generator, world: World) -> GoalPair:
    """Return a drive between two random poses at which the robot fits, more than `LEAST_DRIVE_M` apart.

    Raises:
        OptionError: none of the poses drawn fit.
    """
    low_x, low_y, high_x, high_y = world.layout.floor.bounds
    for _ in range(TRIES):
        ends = rng.uniform((low_x, low_y, -math.pi), (high_x, high_y, math.pi), size=(2, 3)).round(3).tolist()
        start, goal = ((x, y, yaw) for x, y, yaw in ends)
        pair = GoalPair(0, start, goal, ANYWHERE, ANYWHERE)
        fits = math.dist(start[:2], goal[:2]) > LEAST_DRIVE_M and all(map(world.plannable_at, (start, goal)))
        if fits and math.isfinite(world.shortest_length(pair)):
            return pair
    raise OptionError(f"layout {world.layout.id!r}: no two free poses more than {LEAST_DRIVE_M:g} m apart were drawn")


def _pose(name: str, value: Any, lengths: tuple[int, ...], floor: Floor) -> Pose:
    numbers = _numbers(value)
    if numbers is None or len(numbers) not in lengths:
        forms = " or ".join(FORMS[length] for length in reversed(lengths))
        shown = " ".join(repr(value)[:200].split())[:60]
        raise OptionError(f"{name} is {shown}, expected {forms} of finite numbers: meters and radians, room frame")
    x, y, yaw = (*numbers, 0.0)[:3]
    _check_inside(name, x, y, floor)
    return x, y, yaw if -math.pi < yaw <= math.pi else wrap_angle(yaw)


def _check_inside(name: str, x: float, y: float, floor: Floor) -> None:
    if not floor.inside(np.array([[x, y]]))[0]:
        ids = ", ".join(space.id for space in floor.spaces[:8])
        more = ", ..." if len(floor.spaces) > 8 else ""
        raise OptionError(
            f"{name} {_shown((x, y))} is in none of the floor's spaces ({ids}{more}): choose a point in one"
        )


def _numbers(value: Any) -> tuple[float, ...] | None:
    """Return a short sequence of finite real numbers as floats, or None if it is something else."""
    if isinstance(value, np.ndarray):
        value = value.tolist() if value.ndim == 1 and value.size <= len(FORMS) + 1 else None
    if not isinstance(value, tuple | list) or len(value) > len(FORMS) + 1:
        return None
    if not all(isinstance(number, Real) and not isinstance(number, bool | np.bool_) for number in value):
        return None
    try:
        numbers = tuple(float(number) for number in value)
    except (OverflowError, ValueError):
        return None
    return numbers if all(math.isfinite(number) for number in numbers) else None


def _shown(numbers: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{number:.5g}" for number in numbers) + ")"
