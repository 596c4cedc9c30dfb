"""Checks of a LabNav row against its episode, its own figures and its route."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.assembly import without
from labgym.envs.conditions.cast import RADIUS as PERSON_RADIUS
from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.change_list import Added, changes_of, masses
from labgym.envs.conditions.payload import beaker_of, leg_payload_of
from labgym.envs.conditions.walking import BESIDE, CLOSE
from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, straight
from labgym.envs.labnav.nuisances import prepared
from labgym.envs.labnav.task import docking_error
from labgym.envs.labnav.tasks import condition_names, task_of
from labgym.envs.parts.endings import PERSON
from labgym.envs.robot import ROBOT
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import LabgymError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.drive import shortest_at
from labgym.eval.labnav.results import score_of
from labgym.eval.labnav.rules import delay_of
from labgym.eval.submission.outcome_checks import LiquidClaim, PeopleClaims, liquid_problems
from labgym.eval.submission.route_checks import (
    POSITION_ERROR,
    RESOLUTION,
    RESTING_M,
    RouteClaims,
    route_problems,
    shortest_drive,
)
from labgym.geometry import wrap_angle
from labgym.layouts import Layout

EXACT = 1e-9
"""Differences of recomputed figures up to this are rounding."""
BRAKING = 5.0
"""Longest time that a drive takes beyond its limit, until the robot rests, seconds."""
SHORTEST_ERROR_M = 0.05
"""Accuracy of L* from a rounded pose, at which the disc of 0.30 m may not fit, meters."""


@dataclass(frozen=True)
class LabNavTerms:
    """The terms under which the rows of a submission were driven.

    Attributes:
        policy, seed, track: label, random seed and track of the policy. seconds: time limit of a drive.
        latency: that the policy declares, seconds.
    """

    policy: str
    seed: int
    track: str
    seconds: float
    latency: float


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
        "delay": (row.delay, delay_of(terms.latency)),
        "goals": (row.goals, len(episode.lengths)),
        "shortest": (row.shortest, round(math.fsum(episode.lengths), 9)),
        "straight": (row.straight, round(straight(episode), 9)),
    }
    for name, (value, expected) in stated.items():
        if value != expected:
            yield f"{name} is {repr(value)[:80]}, expected {expected!r}"
    yield from _ending_problems(row, terms.seconds, task_of(part.task).radius)
    try:
        yield from _outcome_problems(row, part, episode)
        expected_score = score_of(row, row.outcomes, episode.conditions)
    except (KeyError, TypeError, ValueError, AttributeError, LabgymError) as error:
        yield f"outcomes do not have what the score of {row.task} needs ({type(error).__name__}: {str(error)[:80]})"
        return
    if abs(row.score - expected_score) > EXACT:
        yield f"score is {row.score:.9g}, recomputed {expected_score:.9g}"


def labnav_route_problems(
    row: LabNavRow, route: ArrayLike, part: LabNavEpisodes, episode: LabNavEpisode, layout: Layout
) -> Iterator[str]:
    """Yield a sentence for each figure of a row that its route contradicts, and for a motion that is impossible.

    Args:
        row: the row. route: poses at the start and after each control step. part: the episodes of the task.
        episode: the published one. layout: its floor.
    """
    poses = np.array(route, dtype=np.float64).reshape(-1, 3)
    labnav, task = task_of(part.task), prepared(part.task, part.level, episode, layout)
    pairs = (task.pair, *task.following)
    goal = pairs[min(max(len(row.legs), 1), len(pairs)) - 1].goal
    pushed = _pushed(row)
    claims = RouteClaims(
        start=task.pair.start,
        goal=goal,
        steps=row.steps,
        path_length=row.path_length,
        final_distance=row.final_distance,
        contacts=row.contacts,
        contact_ends=labnav.touched == (),
        touched_people=int(row.contact.startswith(PERSON)),
        pushed=bool(pushed),
        waited=row.waited,
        people=_people(row, episode),
        liquid=_liquid(row, episode),
    )
    yield from route_problems(claims, poses, world_of(_fixed(task, episode, pushed)))
    if len(poses) != row.steps + 1:
        return
    turned = abs(wrap_angle(poses[-1, 2] - goal[2] - row.final_heading))
    if turned > RESOLUTION:
        yield f"final_heading is {row.final_heading:.3f} rad, but its route ends {turned:.3f} rad off that"
    if row.success and row.steps and math.dist(poses[-1, :2], poses[-2, :2]) > RESTING_M:
        yield "success is True, but its route does not come to rest"
    if labnav.chain:
        yield from _leg_problems(row, poses, task, episode, labnav.radius)


def _people(row: LabNavRow, episode: LabNavEpisode) -> PeopleClaims | None:
    """Return what the row of an episode with people says about them; None without people, or if it says nothing."""
    outcome = row.outcomes.get("people")
    if "people" not in episode.conditions or not isinstance(outcome, Mapping):
        return None
    cast = cast_of(episode.conditions["people"])
    near, least = outcome.get("close_seconds"), outcome.get("least_distance")
    if not isinstance(near, int | float) or not isinstance(least, int | float | None):
        return None
    return PeopleClaims(
        starts=[role.start for role in cast.people],
        speed=cast.speed,
        touch=ROBOT.chassis_radius + PERSON_RADIUS,
        close=CLOSE,
        close_seconds=near,
        least=least,
        touched=row.contact.startswith(PERSON) or any(name.startswith(PERSON) for name in row.touched),
    )


def _liquid(row: LabNavRow, episode: LabNavEpisode) -> LiquidClaim | None:
    """Return what the row of an episode with a beaker in its only drive says about it; None if it says nothing."""
    outcome = row.outcomes.get("payload")
    if row.goals > 1 or "payload" not in episode.conditions or not isinstance(outcome, Mapping):
        return None
    rise = outcome.get("highest")
    return LiquidClaim(beaker_of(episode.conditions["payload"]), rise) if isinstance(rise, int | float) else None


def _pushed(row: LabNavRow) -> frozenset[str]:
    """Return the things that were moved in an episode, by its outcomes."""
    things = (row.outcomes.get("changes") or {}).get("pushed") or {}
    return frozenset(name for name, thing in things.items() if thing.get("touched") or thing.get("way"))


def _fixed(task: Task, episode: LabNavEpisode, pushed: Collection[str]) -> Layout:
    """Return the true floor of an episode without people, things that were pushed, and things that come later."""
    changes = changes_of(episode.conditions.get("changes") or [])
    late = {change.id for change in changes if isinstance(change, Added) and change.after is not None}
    return without(task.layout, late | (set(pushed) & set(task.pushable)))


def _leg_problems(
    row: LabNavRow, poses: NDArray[np.float64], task: Task, episode: LabNavEpisode, radius: float
) -> Iterator[str]:
    """Yield whether the drives of a shift contradict its route.

    Args:
        poses: the whole route. task: the episode after its conditions. episode: the published one.
        radius: of the success disc, meters.
    """
    world, begin = world_of(task.layout), 0
    for number, (leg, pair) in enumerate(zip(row.legs, (task.pair, *task.following), strict=False)):
        end = begin + round(leg.time / ROBOT.control_dt)
        if end > row.steps or abs(leg.time - (end - begin) * ROBOT.control_dt) > EXACT:
            yield f"drive {number} takes {leg.time:g} s, which is no part of its {row.steps} steps"
            return
        way = poses[begin : end + 1]
        away = math.dist(way[-1, :2], pair.goal[:2])
        turned = abs(wrap_angle(way[-1, 2] - pair.goal[2] - leg.final_heading))
        if abs(away - leg.final_distance) > POSITION_ERROR or turned > RESOLUTION:
            yield f"drive {number} ends {leg.final_distance:.3f} m from its goal, but its route {away:.3f} m from it"
        if leg.path_length < shortest_drive(way) - EXACT:
            yield f"path_length of drive {number} is {leg.path_length:.3f} m, less than that of its route"
        if leg.success and (leg.final_distance > radius or math.dist(way[-1, :2], way[-2, :2]) > RESTING_M):
            yield f"success of drive {number} is True, but its route does not come to rest at its goal"
        if leg.beaker and not row.contacts and "payload" in episode.conditions:
            beaker, _ = leg_payload_of(episode.conditions["payload"])
            yield from liquid_problems(LiquidClaim(beaker, leg.rise), way, ROBOT.control_dt)
        if number:
            x, y, yaw = way[0].tolist()
            shortest = shortest_at(world, replace(pair, start=(x, y, yaw)), radius, leg.shortest)
            if abs(leg.shortest - shortest) > SHORTEST_ERROR_M:
                yield f"shortest of drive {number} is {leg.shortest:.3f} m, recomputed {shortest:.3f} m"
        begin = end
    if begin != row.steps:
        yield f"its drives take {begin} steps, and the shift {row.steps}"


def _outcome_problems(row: LabNavRow, part: LabNavEpisodes, episode: LabNavEpisode) -> Iterator[str]:
    """Yield whether the outcomes are not those of the conditions, or the drives of a shift contradict themselves."""
    names = set(condition_names(part.task, part.level))
    if set(row.outcomes) != names:
        yield f"outcomes are of {sorted(row.outcomes)[:9]}, expected {sorted(names)}"
    if "changes" in names:
        things = {name: thing["mass"] for name, thing in row.outcomes["changes"]["pushed"].items()}
        expected = masses(changes_of(episode.conditions["changes"]))
        if things != expected:
            yield f"outcomes say that {str(things)[:80]} can be pushed, kg by name, expected {str(expected)[:80]}"
    if "people" in episode.conditions:
        yield from _crowd_problems(row, len(cast_of(episode.conditions["people"]).people))
    if row.goals == 1 and "payload" in episode.conditions:
        highest, spilt = row.outcomes["payload"]["highest"], row.outcomes["payload"]["spilt"]
        freeboard = beaker_of(episode.conditions["payload"]).freeboard
        if (
            spilt != (highest > freeboard)
            or (row.ending == "spilt" and not spilt)
            or (row.ending == "success" and spilt)
        ):
            yield f"ending is {row.ending!r} and spilt {spilt}, at {highest:g} m, rim {freeboard:g} m"
    for number, leg in enumerate(row.legs):
        if leg.success != (leg.ending in ("success", "undocked")) or leg.docked != (leg.ending == "success"):
            yield f"drive {number} ended by {leg.ending!r}, but success is {leg.success} and docked is {leg.docked}"
        if leg.docked and docking_error(leg.final_distance, leg.final_heading) > 1.0:
            yield f"drive {number} is docked, {leg.final_distance:.3f} m from its pose"
    driven = math.fsum(leg.path_length for leg in row.legs)
    if row.legs and abs(driven - row.path_length) > 1e-6:
        yield f"path_length is {row.path_length:.3f} m, but that of its drives is {driven:.3f} m"


def _crowd_problems(row: LabNavRow, count: int) -> Iterator[str]:
    """Yield whether the outcome of people, of whom there are `count`, contradicts itself."""
    crowd = row.outcomes["people"]
    least, nearest, beside = crowd["least_distance"], crowd["nearest"], crowd.get("beside_seconds", 0.0)
    if crowd["people"] != count or not 0 <= crowd["met"] <= count:
        yield f"outcomes say that {crowd['met']} of {crowd['people']} people were met, expected of {count}"
    if least is not None and nearest is not None and not 0.0 <= least <= nearest + EXACT:
        yield f"least_distance is {least:g} m, but somebody ends {nearest:g} m away"
    if not 0.0 <= beside <= row.time + EXACT or (nearest is not None and beside > 0.0 and nearest >= BESIDE):
        yield f"beside_seconds is {beside:g} at the end of {row.time:g} s, with somebody {nearest} m away"


def _ending_problems(row: LabNavRow, seconds: float, radius: float) -> Iterator[str]:
    """Yield whether how a drive ended contradicts its other fields."""
    arrived = ("success", "undocked", "spilt")
    if (row.ending == "success" and not row.success) or (row.success and row.ending not in arrived):
        yield f"success is {row.success}, but the drive ended by {row.ending!r}"
    if row.success and row.final_distance > radius:
        yield f"success is True, but it ended {row.final_distance:.3f} m from the goal (success distance {radius:g} m)"
    if row.success and row.ending == "undocked" and row.goals > 1:
        yield "success is True, but a drive ended undocked"
    if (row.ending == "contact") != bool(row.contact) or (row.contact and not row.contacts):
        yield f"ending is {row.ending!r}, but contact is {row.contact[:80]!r}, in {row.contacts} steps"
    if (row.ending == "error") != (row.error is not None):
        yield f"ending is {row.ending!r}, but error is {str(row.error)[:80]!r}"
    if row.success and row.contacts and task_of(row.task).touched == ():
        yield f"success is True, but its robot had {row.contacts} contacts"
    if row.contacts > row.steps:
        yield f"contacts is {row.contacts}, more than the {row.steps} steps"
    limit = (seconds + BRAKING) * row.goals
    if row.time > limit or row.steps * ROBOT.control_dt > limit:
        yield f"time is {row.time:g} s in {row.steps} steps, above the limit of {limit:g} s"
    if abs(row.time - row.steps * ROBOT.control_dt) > 1e-6:
        yield f"time is {row.time:g} s, but {row.steps} steps take {row.steps * ROBOT.control_dt:g} s"
    if len(row.legs) > row.goals:
        yield f"legs has {len(row.legs)} drives, but the shift has {row.goals}"
