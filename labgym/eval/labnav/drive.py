"""Drives episodes under the common rules of LabNav."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from labgym.envs.conditions.payload import carried
from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisode
from labgym.envs.labnav.task import LabNavTask
from labgym.envs.labnav.tasks import config_of, task_of
from labgym.envs.parts.endings import LimitEnding, TouchedEnding
from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.parts.protocols import Ending
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.state import State
from labgym.envs.world import World
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.driving.episode_row import Ending as Outcome
from labgym.eval.driving.episode_row import LabNavLegRow, LabNavRow
from labgym.eval.driving.loop import Observation
from labgym.eval.labnav.leg import LabNavDriver, LegDrive, LegRecorder
from labgym.eval.labnav.results import DriveTerms, fields_of, finished, scored
from labgym.eval.labnav.rules import delay_of, ending_of
from labgym.geometry import wrap_angle
from labgym.layouts import Layout
from labgym.navigation import GoalPair

ASIDE, FARTHEST, DIRECTIONS = 0.01, 1.0, 32
"""Spacing of the rings around the robot on which a place for the disc of 0.30 m is sought, their greatest radius,
meters, and the number of points on each."""


def shift_endings(task: LabNavTask) -> tuple[Ending, ...]:
    """Return the endings of a whole shift: the others end one of its drives."""
    return tuple(each for each in task.endings(stop=False) if isinstance(each, TouchedEnding))


def leg_endings(task: LabNavTask) -> tuple[Ending, ...]:
    """Return the endings of a drive of a shift, besides its time, which the evaluator limits."""
    return tuple(each for each in task.endings(stop=False) if not isinstance(each, TouchedEnding | LimitEnding))


def drive_shift(
    terms: DriveTerms, episode: LabNavEpisode, env: LabPointNavEnv, driver: LabNavDriver, recorder: LegRecorder
) -> LabNavDrive:
    """Drive a shift to its end and return the results.

    A drive that ends elsewhere than at its goal ends with the robot braked to rest; the next one begins there. A touch
    that counts ends the shift, and so does an error of the policy.
    """
    observation: Observation = env.reset(seed=episode.seed, options={"episode": episode.number})[0]
    task, state = task_of(terms.task), env.state
    recorder.note(observation, state)
    legs: list[LabNavLegRow] = []
    last: LegDrive | None = None
    for length in episode.lengths:
        if last is not None:
            observation = env.next_drive()
        shortest = shortest_from(state, length)
        rules = leg_endings(task)
        last = LegDrive(env, driver, task, terms.level, recorder, terms.seed, terms.limit, rules=rules)
        observation = last.run(driver.reset if not legs else driver.next_goal, observation)
        if not last.parked:
            observation = last.brake(observation)
        legs.append(_leg_row(last, state, shortest))
        if legs[-1].ending in ("contact", "error"):
            break
    assert last is not None
    count = len(episode.lengths)
    perfect = len(legs) == count and all(leg.ending == "success" for leg in legs)
    stopped = {leg.stopped for leg in legs} - {""}
    row = LabNavRow(
        **fields_of(terms, episode, env, recorder),
        score=0.0,
        success=perfect,
        ending=_ending(legs),
        stopped="evaluator" if "evaluator" in stopped else "policy" if stopped else "",
        error=last.error,
        legs=tuple(legs),
        goals=count,
    )
    return finished(scored(row, state), driver, recorder)


def shortest_from(state: State, otherwise: float) -> float:
    """Return L* of the drive in progress from where the robot stands, meters.

    Args:
        state: at the begin of the drive. otherwise: L* if the disc of 0.30 m fits nowhere near.
    """
    pair = replace(state.pair, start=state.pose)
    return shortest_at(state.fixtures, pair, state.disc, otherwise, state.shortest_path_length)


def shortest_at(world: World, pair: GoalPair, disc: float, otherwise: float, length: float = math.inf) -> float:
    """Return L* of a drive, meters.

    Where the disc of 0.30 m does not fit, the way to the nearest place where it fits is added.

    Args:
        world: the true floor without what the robot can push. pair: the drive.
        disc: radius of the success disc, meters.
        otherwise: L* if there is no such place. length: L* from the start, if it is finite and known.
    """
    length = world.length_to_disc(pair, disc) if math.isinf(length) else length
    for ring in range(1, round(FARTHEST / ASIDE) + 1):
        if math.isfinite(length):
            return length
        x, y, yaw = pair.start
        radius = ring * ASIDE
        angles = (2.0 * math.pi * k / DIRECTIONS for k in range(DIRECTIONS))
        places = [(x + radius * math.cos(angle), y + radius * math.sin(angle), yaw) for angle in angles]
        free = [place for place in places if world.paths.free(*place[:2])]
        to_disc = (world.length_to_disc(replace(pair, start=place), disc) for place in free)
        length = radius + min(to_disc, default=math.inf)
    return length if math.isfinite(length) else otherwise


def _leg_row(leg: LegDrive, state: State, shortest: float) -> LabNavLegRow:
    """Return the results of a drive that is over."""
    finish, beaker = leg.finish(state), carried(state)
    reached = finish.parked and finish.inside and not finish.spilt and finish.error is None
    driven = state.path_length - leg.driven
    payload = state.presences.get("payload")
    return LabNavLegRow(
        success=reached,
        docked=reached and finish.docked,
        ending=ending_of(finish),
        stopped=leg.stopped,
        shortest=round(shortest, 9),
        path_length=driven,
        time=round(state.time - leg.begun, 6),
        final_distance=state.distance,
        final_heading=wrap_angle(state.pose[2] - state.pair.goal[2]),
        beaker=beaker is not None,
        rise=0.0 if payload is None else float(payload.outcome["highest"]),
    )


def _ending(legs: Sequence[LabNavLegRow]) -> Outcome:
    """Return how a shift ended: by what ended it early, or as its first drive that was not perfect."""
    if legs[-1].ending in ("contact", "error"):
        return legs[-1].ending
    return next((leg.ending for leg in legs if leg.ending != "success"), "success")


def drive_floor(
    driver: LabNavDriver,
    layout: Layout,
    episodes: Sequence[LabNavEpisode],
    terms: DriveTerms,
    watch: Callable[[State], None] | None = None,
    blind: bool = False,
) -> tuple[LabNavDrive, ...]:
    """Drive episodes of a task on one floor.

    Args:
        driver: the policy, in a separate process or in this one.
        layout: the floor, as published. episodes: on it. terms: of the drives.
        watch: receives the state at the start and after each control step.
        blind: read no sensor but the odometry, for a policy that looks at nothing.
    """
    latency = driver.latency if terms.latency is None else terms.latency
    task = task_of(terms.task)
    chained: dict[str, Any] = {"endings": shift_endings(task)} if task.chain else {}
    if blind:
        level = task.level(terms.level) if terms.properties is None else terms.properties
        chained |= {"sensors": (OdometrySensor(**level.odometry),), "randomizations": ()}
    config = config_of(
        terms.task,
        terms.level,
        driver.observation,
        stop=None,
        delay=delay_of(latency),
        properties=terms.properties,
        tasks=EpisodeTasks(layout, tuple(episodes)),
        exact=True,
        rewards=("time",),
        measures=("touched",),
        **chained,
    )
    drive = drive_shift if task.chain else drive_once
    env = LabPointNavEnv(config=config)
    try:
        return tuple(drive(terms, episode, env, driver, LegRecorder(watch, latency)) for episode in episodes)
    finally:
        env.close()


def drive_once(
    terms: DriveTerms, episode: LabNavEpisode, env: LabPointNavEnv, driver: LabNavDriver, recorder: LegRecorder
) -> LabNavDrive:
    """Drive an episode of one drive to its end and return the results."""
    observation, _ = env.reset(seed=episode.seed, options={"episode": episode.number})
    recorder.note(observation, env.state)
    leg = LegDrive(env, driver, task_of(terms.task), terms.level, recorder, terms.seed, terms.limit)
    leg.run(driver.reset, observation)
    finish = leg.finish(env.state)
    row = LabNavRow(
        **fields_of(terms, episode, env, recorder),
        score=0.0,
        success=finish.parked and finish.inside and finish.error is None,
        ending=ending_of(finish),
        stopped=leg.stopped,
        error=finish.error,
    )
    return finished(scored(row, env.state), driver, recorder)
