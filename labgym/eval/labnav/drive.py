"""Drives episodes under the common rules of LabNav."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisode
from labgym.envs.labnav.tasks import config_of, task_of
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.state import State
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.leg import LabNavDriver, LegDrive, Recorder
from labgym.eval.labnav.results import DriveTerms, fields_of, finished, scored
from labgym.eval.labnav.rules import delay_of, ending_of
from labgym.eval.labnav.shift import drive_shift, shift_endings
from labgym.layouts import Layout


def drive_floor(
    driver: LabNavDriver,
    layout: Layout,
    episodes: Sequence[LabNavEpisode],
    terms: DriveTerms,
    watch: Callable[[State], None] | None = None,
) -> tuple[LabNavDrive, ...]:
    """Drive episodes of a task on one floor.

    Args:
        driver: the policy, in a separate process or in this one.
        layout: the floor, as published. episodes: on it. terms: of the drives.
        watch: receives the state at the start and after each control step.
    """
    latency = driver.latency if terms.latency is None else terms.latency
    task = task_of(terms.task)
    chained = {"endings": shift_endings(task)} if task.chain else {}
    config = config_of(
        terms.task,
        terms.level,
        driver.observation,
        stop=False,
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
        return tuple(drive(terms, episode, env, driver, Recorder(watch, latency)) for episode in episodes)
    finally:
        env.close()


def drive_once(
    terms: DriveTerms, episode: LabNavEpisode, env: LabPointNavEnv, driver: LabNavDriver, recorder: Recorder
) -> LabNavDrive:
    """Drive an episode of one drive to its end and return the results."""
    observation, _ = env.reset(seed=episode.seed, options={"episode": episode.number})
    recorder.note(observation, env.state)
    leg = LegDrive(env, driver, task_of(terms.task), recorder, terms.seed, terms.limit)
    leg.run(driver.reset, observation)
    finish = leg.finish(env.state)
    row = LabNavRow(
        **fields_of(terms, episode, env, driver, recorder),
        score=0.0,
        success=finish.parked and finish.inside and finish.error is None,
        ending=ending_of(finish),
        stopped=leg.stopped,
        error=finish.error,
    )
    return finished(scored(row, env.state), recorder)
