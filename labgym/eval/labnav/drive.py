"""Drives episodes under the common rules of LabNav."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisode
from labgym.envs.labnav.task import SECONDS, Level
from labgym.envs.labnav.tasks import config_of, task_of
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.eval.labnav.leg import LabNavDriver, LegDrive, Recorder
from labgym.eval.labnav.results import Evaluated, LabNavDrive, fields_of, scored
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.rules import delay_of, ending_of
from labgym.eval.labnav.shift import drive_shift, shift_endings
from labgym.layouts import Layout


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
    return LabNavDrive.of(scored(row, env.state), recorder)
