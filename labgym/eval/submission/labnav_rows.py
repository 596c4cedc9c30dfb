"""Checks of a LabNav row against its episode, its own figures and its route."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, straight
from labgym.envs.labnav.worlds import prepared
from labgym.envs.robot import ROBOT
from labgym.eval.driving.drive import Route
from labgym.eval.driving.kinematics import first_jump
from labgym.eval.labnav.drive import score_from
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.shift import score_of_legs
from labgym.eval.submission.route_checks import POSITION_ERROR, RESOLUTION, shortest_drive
from labgym.layouts import Layout

EXACT = 1e-9
"""Differences of recomputed figures up to this are rounding."""
BRAKING = 5.0
"""Longest time that a drive takes beyond its limit, until the robot rests, seconds."""
WHEELS = 1.35
"""Factor on the robot's limits that errors of the wheels may take it beyond."""


@dataclass(frozen=True)
class LabNavTerms:
    """The terms under which the rows of a submission were driven: label, seed and track of the policy, time limit."""

    policy: str
    seed: int
    track: str
    seconds: float


def labnav_row_problems(
    row: LabNavRow, part: LabNavEpisodes, episode: LabNavEpisode, terms: LabNavTerms
) -> Iterator[str]:
    """Yield a sentence for each field of a row that does not agree with its episode or with other fields.

    Args:
        row: the row. part: the episodes of its task. episode: the published one of its key. terms: of the submission.
    """
    stated = {
        "suite": (row.suite, part.label),
        "floor_hash": (row.floor_hash, episode.floor_hash),
        "policy": (row.policy, terms.policy),
        "seed": (row.seed, terms.seed),
        "track": (row.track, terms.track),
        "goals": (row.goals, len(episode.lengths)),
        "shortest": (row.shortest, round(math.fsum(episode.lengths), 9)),
        "straight": (row.straight, round(straight(episode), 9)),
    }
    for name, (value, expected) in stated.items():
        if value != expected:
            yield f"{name} is {repr(value)[:80]}, expected {expected!r}"
    yield from _ending_problems(row, terms.seconds)
    try:
        expected_score = recomputed_score(row, episode)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        yield f"outcomes do not have what the score of {row.task} needs ({type(error).__name__}: {str(error)[:80]})"
        return
    if abs(row.score - expected_score) > EXACT:
        yield f"score is {row.score:.9g}, recomputed {expected_score:.9g}"


def recomputed_score(row: LabNavRow, episode: LabNavEpisode) -> float:
    """Return the score that follows from the other fields of a row.

    Raises:
        KeyError, TypeError, ValueError, AttributeError: the outcomes of the conditions are not those of the task.
    """
    if row.task == "shift":
        return score_of_legs(row.legs, row.goals)
    return score_from(row, row.outcomes, episode.conditions)


def labnav_route_problems(
    row: LabNavRow, route: Route, part: LabNavEpisodes, episode: LabNavEpisode, layout: Layout
) -> Iterator[str]:
    """Yield a sentence for each figure of a row that its route contradicts, and for a motion that is impossible.

    Args:
        row: the row. route: poses at the start and after each control step. part: the episodes of the task.
        episode: the published one. layout: its floor.
    """
    poses = np.array(route, dtype=np.float64).reshape(-1, 3)
    if len(poses) != row.steps + 1:
        yield f"its route has {len(poses)} poses, expected {row.steps + 1} for {row.steps} steps"
        return
    task = prepared(part.task, part.level, episode, layout)
    pairs = (task.pair, *task.following)
    if np.abs(poses[0, :2] - task.pair.start[:2]).max() > RESOLUTION:
        yield "its route does not begin at the start"
    goal = pairs[min(max(len(row.legs), 1), len(pairs)) - 1].goal
    away = math.dist(poses[-1, :2], goal[:2])
    if abs(away - row.final_distance) > POSITION_ERROR:
        yield f"final_distance is {row.final_distance:.3f} m, but its route ends {away:.3f} m from the goal"
    least = shortest_drive(poses)
    if row.path_length < least - EXACT:
        yield f"path_length is {row.path_length:.3f} m, but its route is at least {least:.3f} m long"
    robot = replace(
        ROBOT,
        v_max=WHEELS * ROBOT.v_max,
        w_max=WHEELS * ROBOT.w_max,
        acceleration=WHEELS * ROBOT.acceleration,
        turn_acceleration=WHEELS * ROBOT.turn_acceleration,
    )
    touched = np.full(len(poses) - 1, row.contacts > 0)
    jump = first_jump(poses, touched, ROBOT.control_dt, robot, RESOLUTION)
    if jump is not None:
        moved = math.dist(poses[jump, :2], poses[jump - 1, :2]) if jump else math.nan
        yield f"its route jumps {moved:.3f} m at step {jump}, which the robot cannot drive in {ROBOT.control_dt:g} s"


def _ending_problems(row: LabNavRow, seconds: float) -> Iterator[str]:
    """Yield whether how a drive ended contradicts its other fields."""
    arrived = ("success", "undocked", "spilt")
    if (row.ending == "success" and not row.success) or (row.success and row.ending not in arrived):
        yield f"success is {row.success}, but the drive ended by {row.ending!r}"
    if (row.ending == "contact") != bool(row.contact):
        yield f"ending is {row.ending!r}, but contact is {row.contact!r}"
    if (row.ending == "error") != (row.error is not None):
        yield f"ending is {row.ending!r}, but error is {str(row.error)[:80]!r}"
    if row.contacts > row.steps:
        yield f"contacts is {row.contacts}, more than the {row.steps} steps"
    limit = (seconds + BRAKING) * row.goals
    if row.time > limit or row.steps * ROBOT.control_dt > limit:
        yield f"time is {row.time:g} s in {row.steps} steps, above the limit of {limit:g} s"
    if abs(row.time - row.steps * ROBOT.control_dt) > ROBOT.control_dt + EXACT:
        yield f"time is {row.time:g} s, but {row.steps} steps take {row.steps * ROBOT.control_dt:g} s"
    if len(row.legs) > row.goals:
        yield f"legs has {len(row.legs)} drives, but the shift has {row.goals}"
