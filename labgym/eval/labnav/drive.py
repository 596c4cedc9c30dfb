"""One drive under the common rules of LabNav."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.payload import beaker_of
from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisode, straight
from labgym.envs.labnav.tasks import PERSON_NEAR, SECONDS, LabNavTask, config_of, task_of
from labgym.envs.parts.announced import announced_goal
from labgym.envs.parts.endings import TouchedEnding, nearest_person
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose, State
from labgym.eval.driving.drive import Route, episode_rng, policy_errors
from labgym.eval.driving.navigation_metrics import spl
from labgym.eval.labnav import scores
from labgym.eval.labnav.foresight import TrueWorld, track_of
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.rules import (
    STAY,
    Finish,
    Parking,
    braking_distance,
    delay_of,
    ending_of,
    is_slow,
)
from labgym.geometry import compose, wrap_angle
from labgym.layouts import Layout
from labgym.policies import EpisodeStart, GroundTruth, Policy
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess
from labgym.policies.process.episode import decision

LabNavDriver = PolicyProcess | Policy
AT_REST = 0.05
"""Speed below which a robot waits, m/s."""
MOST_TOUCHED = 20
MOST_OUTCOME = 100
"""Greatest number of entries of a list in the outcomes of a row."""


@dataclass(frozen=True)
class LabNavDrive:
    """A finished episode.

    Attributes:
        row: the results. route: poses at the start and after each control step, rounded to 0.001.
        planning_ms: mean wall-clock milliseconds of the policy per action; None without an action.
        slow: whether that is longer than it declares.
    """

    row: LabNavRow
    route: Route
    planning_ms: float | None
    slow: bool


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
) -> tuple[LabNavDrive, ...]:
    """Drive episodes of a task on one floor.

    Args:
        driver: the policy, in a separate process or in this one.
        layout: the floor, as published.
        episodes: on it. task, level: of LabNav.
        label: name of the policy in the rows. suite: name and version of the suite.
        seed: random seed of the policy.
        seconds: time limit of a drive.
        watch: receives the state at the start and after each control step.
    """
    tasks = EpisodeTasks(layout, tuple(episodes))
    delay = delay_of(driver.latency)
    config = config_of(
        task,
        level,
        driver.observation,
        stop=False,
        delay=delay,
        tasks=tasks,
        exact=True,
        rewards=("time",),
        measures=("touched",),
    )
    env = LabPointNavEnv(config=config)
    try:
        drives = []
        for episode in episodes:
            one = _Drive(env, driver, task_of(task), episode, seed, round(seconds / ROBOT.control_dt), watch)
            drives.append(one.run(label, suite, level))
        return tuple(drives)
    finally:
        env.close()


class _Drive:
    """An episode in progress."""

    def __init__(
        self,
        env: LabPointNavEnv,
        driver: LabNavDriver,
        task: LabNavTask,
        episode: LabNavEpisode,
        seed: int,
        limit: int,
        watch: Callable[[State], None] | None,
    ) -> None:
        self._env, self._driver, self._task, self._episode = env, driver, task, episode
        self._seed, self._limit, self._watch = seed, limit, watch
        self._poses: list[Pose] = []
        self._reckoned: Pose = (0.0, 0.0, 0.0)
        self._parking: Parking | None = None
        self._stopped = ""
        self._seconds, self._actions, self._waited = 0.0, 0, 0.0
        self._touched: dict[str, None] = {}

    def run(self, label: str, suite: str, level: int) -> LabNavDrive:
        """Drive to the end and return the results."""
        observation, _ = self._env.reset(seed=self._episode.seed, options={"episode": self._episode.number})
        state = self._env.state
        self._goal = announced_goal(state)
        self._note(observation, state)
        error, parked = None, False
        try:
            self._timed(self._driver.reset, self._start(state))
            while state.verdict is None and state.steps < self._limit:
                action = self._action(observation, state)
                if action is None:
                    parked = True
                    break
                observation = self._env.step(action)[0]
                self._note(observation, state)
        except PolicyError as failure:
            error = str(failure)
        row = self._row(state, label, suite, level, parked, error)
        mean = self._seconds / self._actions if self._actions else None
        route = tuple((round(x, 3), round(y, 3), round(yaw, 3)) for x, y, yaw in self._poses)
        slow = mean is not None and is_slow(mean, self._driver.latency)
        return LabNavDrive(row, route, None if mean is None else 1e3 * mean, slow)

    def _action(self, observation: Mapping[str, Any], state: State) -> NDArray[np.floating] | None:
        """Return the next action, None once the robot has been parked."""
        if self._parking is None and not self._driver.stops:
            if math.dist(self._reckoned[:2], self._goal[:2]) <= braking_distance(self._task):
                heading = self._goal[2] if self._task.docks else None
                self._parking, self._stopped = Parking(heading, self._stay), "evaluator"
        if self._parking is None:
            action: NDArray[np.floating] | None = self._timed(self._decide, self._seen(observation))
            if action is not None:
                return action
            self._parking, self._stopped = Parking(None, self._stay), "policy"
        return self._parking.action(self._reckoned, state.velocity)

    @property
    def _stay(self) -> int:
        return STAY if self._task.docks else 0

    def _seen(self, observation: Mapping[str, Any]) -> dict[str, Any]:
        """Return the observation as policies receive it: with the odometry as a pose."""
        return {**observation, "odometry": np.array(self._reckoned)}

    def _decide(self, observation: dict[str, Any]) -> NDArray[np.float32] | None:
        self._actions += 1
        if isinstance(self._driver, PolicyProcess):
            return self._driver.decide(observation)
        return decision(self._driver, observation)

    def _timed(self, call: Callable[[Any], Any], argument: object) -> Any:
        """Call the policy and add the elapsed time of its actions."""
        begin = time.perf_counter()
        try:
            with policy_errors():
                return call(argument)
        finally:
            if self._actions:
                self._seconds += time.perf_counter() - begin

    def _start(self, state: State) -> EpisodeStart:
        goal = (self._goal[0], self._goal[1])
        payload = state.conditions.get("payload")
        truth = None
        if self._driver.privileged:
            task = state.task
            truth = GroundTruth(task.old_map or task.layout, task.announced or task.pair, state.pose)
        return EpisodeStart(
            goal=goal,
            rng=episode_rng(self._seed, goal),
            truth=truth,
            task=self._task.name,
            heading=self._goal[2] if self._task.docks else None,
            beaker=None if payload is None else beaker_of(payload),
            world=TrueWorld(state, self._task.radius) if self._driver.foresees else None,
        )

    def _note(self, observation: Mapping[str, Any], state: State) -> None:
        """Record a state, and the pose by odometry."""
        x, y, cosine, sine = (float(each) for each in observation["odometry"])
        self._reckoned = (x, y, math.atan2(sine, cosine))
        self._poses.append(state.pose)
        self._touched |= dict.fromkeys(state.touched)
        if state.presences and math.hypot(state.velocity[0], state.sideways) < AT_REST and state.steps:
            self._waited += state.control_dt if nearest_person(state) < PERSON_NEAR else 0.0
        if self._watch is not None:
            self._watch(state)

    def _row(self, state: State, label: str, suite: str, level: int, parked: bool, error: str | None) -> LabNavRow:
        task, episode = self._task, self._episode
        heading = wrap_angle(state.pose[2] - state.pair.goal[2])
        outcomes = {name: one.outcome for name, one in state.presences.items() if name != "contacts"}
        inside = state.distance <= task.radius
        finish = Finish(
            rule=state.ending,
            parked=parked,
            inside=inside,
            believed=math.dist(self._reckoned[:2], self._goal[:2]) <= task.radius,
            docked=not task.docks or scores.docking_error(state.distance, heading) <= 1.0,
            spilt=bool((outcomes.get("payload") or {}).get("spilt", False)),
            waited=self._waited,
            error=error,
        )
        success = parked and inside and error is None
        ended = next((each for each in self._env.config.endings if isinstance(each, TouchedEnding)), None)
        contact = ended.counted(state)[:1] if ended is not None and finish.rule == "contact" else ()
        true = compose(self._poses[0], self._reckoned)
        length = round(episode.length, 9)
        row = LabNavRow(
            suite=suite,
            task=task.name,
            level=level,
            floor=episode.floor,
            floor_hash=episode.floor_hash,
            number=episode.number,
            policy=label,
            track=track_of(self._driver),
            seed=self._seed,
            score=0.0,
            success=success,
            ending=ending_of(finish),
            contact="".join(contact)[:100],
            touched=tuple(name[:100] for name in self._touched)[:MOST_TOUCHED],
            stopped=self._stopped,
            shortest=length,
            straight=round(straight(episode), 9),
            path_length=state.path_length,
            time=round(state.time, 6),
            final_distance=state.distance,
            final_heading=heading,
            odometry_error=math.dist(true[:2], state.pose[:2]),
            steps=state.steps,
            contacts=state.contacts,
            waited=round(self._waited, 6),
            delay=delay_of(self._driver.latency),
            outcomes=_plain(outcomes),
            error=error,
        )
        return row.model_copy(update={"score": score_of(row, state)})


def score_of(row: LabNavRow, state: State) -> float:
    """Return the score of an episode at its end.

    Args:
        row: the results. state: at the end.
    """
    outcomes = {name: one.outcome for name, one in state.presences.items()}
    if row.task == "aisle":
        return scores.timed(row.success, row.shortest, row.time)
    if row.task == "carry":
        freeboard = beaker_of(state.conditions["payload"]).freeboard
        rise = float(outcomes["payload"]["highest"])
        return scores.carry(row.success, row.shortest, row.time, rise, freeboard)
    if row.task == "people":
        return scores.people(row.success, row.shortest, row.time, float(outcomes["people"]["close_seconds"]))
    if row.task == "moved":
        pushed = outcomes["changes"]["pushed"].values()
        pushes = [(float(each["mass"]), float(each["way"])) for each in pushed]
        return scores.moved(row.success, row.shortest, row.path_length, pushes)
    if row.task == "dock":
        return scores.dock(row.success, row.final_distance, row.final_heading)
    return spl(row.success, row.shortest, row.path_length)


def _plain(value: Any) -> Any:
    """Return outcomes as bounded JSON data."""
    if isinstance(value, Mapping):
        return {str(key)[:100]: _plain(each) for key, each in list(value.items())[:MOST_OUTCOME]}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(each) for each in list(value)[:MOST_OUTCOME]]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return None if value is None else str(value)[:200]
