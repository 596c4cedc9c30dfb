"""Drives episodes under the common rules of LabNav."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from labgym.envs.conditions.payload import beaker_of
from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisode
from labgym.envs.labnav.tasks import SECONDS, Level, config_of, task_of
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.errors import UnknownNameError
from labgym.eval.driving.navigation_metrics import spl
from labgym.eval.labnav import scores
from labgym.eval.labnav.leg import LabNavDriver, LegDrive, Recorder
from labgym.eval.labnav.results import Evaluated, LabNavDrive, fields_of
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.rules import delay_of, ending_of
from labgym.eval.labnav.shift import drive_shift, shift_endings
from labgym.layouts import Layout

__all__ = ["Finished", "LabNavDrive", "LabNavDriver", "drive_floor", "score_from", "score_of"]


@dataclass(frozen=True)
class Finished:
    """The facts about an episode of one drive on which its score depends, as in `LabNavRow`.

    Attributes:
        task: name. success: S. shortest, path_length: L* and P, meters. time: T, seconds.
        final_distance, final_heading: from the goal pose, meters and radians.
    """

    task: str
    success: bool
    shortest: float
    path_length: float
    time: float
    final_distance: float
    final_heading: float


def drive_floor(
    driver: LabNavDriver,
    layout: Layout,
    episodes: Sequence[LabNavEpisode],
    task: str,
    level: int,
    label: str,
    suite: str,
    seed: int,
    seconds: float = SECONDS,
    watch: Callable[[State], None] | None = None,
    properties: Level | None = None,
    latency: float | None = None,
) -> tuple[LabNavDrive, ...]:
    """Drive episodes of a task on one floor.

    Args:
        driver: the policy, in a separate process or in this one.
        layout: the floor, as published.
        episodes: on it. task, level: of LabNav.
        label: name of the policy in the rows. suite: name and version of the suite.
        seed: random seed of the policy.
        seconds: time limit of a drive; in `shift` of each of its drives.
        watch: receives the state at the start and after each control step.
        properties: of the drives, by default those of the level (`labgym.envs.labnav.nuisances`).
        latency: by which actions come late, seconds; by default what the policy declares.
    """
    latency = driver.latency if latency is None else latency
    tasks = EpisodeTasks(layout, tuple(episodes))
    evaluated = Evaluated(task_of(task), level, label, suite, seed, round(seconds / ROBOT.control_dt))
    chained = {"endings": shift_endings(evaluated.task)} if evaluated.task.chain else {}
    config = config_of(
        task,
        level,
        driver.observation,
        stop=False,
        delay=delay_of(latency),
        properties=properties,
        tasks=tasks,
        exact=True,
        rewards=("time",),
        measures=("touched",),
        **chained,
    )
    drive = drive_shift if evaluated.task.chain else drive_once
    env = LabPointNavEnv(config=config)
    try:
        return tuple(drive(evaluated, episode, env, driver, Recorder(watch, latency)) for episode in episodes)
    finally:
        env.close()


def drive_once(
    evaluated: Evaluated, episode: LabNavEpisode, env: LabPointNavEnv, driver: LabNavDriver, recorder: Recorder
) -> LabNavDrive:
    """Drive an episode of one drive to its end and return the results."""
    observation, _ = env.reset(seed=episode.seed, options={"episode": episode.number})
    recorder.note(observation, env.state)
    leg = LegDrive(env, driver, evaluated.task, recorder, evaluated.seed, evaluated.limit)
    leg.run(driver.reset, observation)
    finish = leg.finish(env.state)
    row = LabNavRow(
        **fields_of(evaluated, episode, env, driver, recorder),
        score=0.0,
        success=finish.parked and finish.inside and finish.error is None,
        ending=ending_of(finish),
        stopped=leg.stopped,
        error=finish.error,
    )
    row = row.model_copy(update={"score": score_of(row, env.state)})
    return LabNavDrive.of(row, recorder)


def score_of(row: LabNavRow | Finished, state: State) -> float:
    """Return the score of an episode at its end.

    Args:
        row: the results, or those on which the score depends. state: at the end.
    """
    return score_from(row, {name: one.outcome for name, one in state.presences.items()}, state.conditions)


def score_from(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:
    """Return the score of an episode of one drive; one of `carry` without a beaker counts as one of `aisle`.

    Args:
        row: the results, or those on which the score depends. outcomes, conditions: outcome and data of each
            condition by its name.

    Raises:
        UnknownNameError: there is no such task, or it has several drives (`score_of_legs`).
        KeyError, TypeError, ValueError, AttributeError: the outcomes of the conditions are not those of the task.
    """
    if row.task not in SCORES:
        raise UnknownNameError("LabNav task of one drive", row.task, SCORES)
    return SCORES[row.task](row, outcomes, conditions)


def _timed(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    return scores.timed(row.success, row.shortest, row.time)


def _moved(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    pushed = outcomes["changes"]["pushed"].values()
    pushes = [(float(thing["mass"]), float(thing["way"])) for thing in pushed]
    return scores.moved(row.success, row.shortest, row.path_length, pushes)


def _people(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    return scores.people(row.success, row.shortest, row.time, float(outcomes["people"]["close_seconds"]))


def _spl(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    return spl(row.success, row.shortest, row.path_length)


def _dock(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    return scores.dock(row.success, row.final_distance, row.final_heading)


def _carry(row: LabNavRow | Finished, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:
    if "payload" not in conditions:
        return _timed(row, outcomes, conditions)
    freeboard, rise = beaker_of(conditions["payload"]).freeboard, float(outcomes["payload"]["highest"])
    return scores.carry(row.success, row.shortest, row.time, rise, freeboard)


SCORES: dict[str, Callable[[LabNavRow | Finished, Mapping[str, Any], Mapping[str, Any]], float]] = {
    "aisle": _timed,
    "moved": _moved,
    "people": _people,
    "odometry": _spl,
    "dock": _dock,
    "glass": _spl,
    "carry": _carry,
}
"""Scores of the tasks of one drive, by the task's name."""
