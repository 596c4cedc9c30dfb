"""Expert drives in the environments of the Gym ids, each on a separate layout, with results by LabNav's rules."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.datasets.options import POINT, DriveOptions
from labgym.datasets.recording import RecordedEnv, Steps
from labgym.envs.config import PointNavConfig
from labgym.envs.labnav.task import LabNavTask, LegResult, Result, spl
from labgym.envs.parts.odometry import OdometrySensor, announced_goal
from labgym.envs.parts.protocols import Sensor
from labgym.envs.point_nav import Observation
from labgym.envs.presets import configured
from labgym.envs.state import Pose, State
from labgym.errors import LabgymError
from labgym.eval.labnav.drive import shortest_from
from labgym.eval.labnav.leg import LabNavDriver, LegDrive, LegRecorder
from labgym.eval.labnav.results import plain
from labgym.eval.labnav.rules import ending_of
from labgym.geometry import wrap_angle
from labgym.policies.policy import PolicyError

MOST_DRAWS = 200
"""Number of environment seeds that are tried for a drive of the task: not every floor has one."""
MOST_FAILURES = 20
"""Number of drives that may fail in a row where only successful ones are kept."""
POINT_TASK = LabNavTask(
    POINT,
    "drive to a point and rest there",
    {},
    lambda result, outcomes, conditions: spl(result.success, result.shortest, result.path_length),  # noqa: ARG005
)
"""The task "point" for the expert: it rests at the goal, and may say when."""


@dataclass(frozen=True)
class EpisodeFacts:
    """The facts about an episode besides its steps.

    Attributes:
        number: of the episode. seed: `reset(seed=seed)` of the environment begins it. attempt: number of drives of the
            task that were driven before it and dropped, because they failed.
        floor, floor_hash, protocol: of the layout.
        announced: (x, y, yaw) of the first goal as it is announced, in the frame of the start, meters and radians.
        radius: of the success disc, meters. goals: number of drives.
        success, score, ending: by LabNav's rules; of "point" the score is SPL.
        shortest: L*, meters; of several drives the sum. path_length: meters. time: seconds.
        outcomes: of the conditions by name: privileged.
    """

    number: int
    seed: int
    attempt: int
    floor: str
    floor_hash: str
    protocol: str
    announced: Pose
    radius: float
    goals: int
    success: bool
    score: float
    ending: str
    shortest: float
    path_length: float
    time: float
    outcomes: dict[str, Any]


@dataclass(frozen=True)
class RecordedEpisode:
    """A recorded episode, and the results of the drives that were dropped before it."""

    facts: EpisodeFacts
    steps: Steps
    dropped: tuple[EpisodeFacts, ...] = ()


class RecordedLeg(LegDrive):
    """A drive in a recorded environment, which may itself go on to the next drive."""

    def step(self, action: Any) -> Any:
        """Carry out an action, and note that the environment has ended the drive."""
        env = self._env
        assert isinstance(env, RecordedEnv)
        leg = env.state.leg
        observation = super().step(action)
        if env.over or env.state.leg != leg:
            self.rule = self.rule or env.ended or "time"
        return observation


class Drives:
    """Drives episodes of a dataset, one after the other.

    Args:
        options: of the dataset. driver: the expert.
    """

    def __init__(self, options: DriveOptions, driver: LabNavDriver) -> None:
        self._options, self._driver = options, driver
        self._task = options.labnav or POINT_TASK
        config = environment_config(options)
        expert: tuple[Sensor, ...]
        if options.labnav is None:
            usual = configured(config, {"observation": driver.observation}).observed
            expert = (OdometrySensor(), *usual)
        else:
            expert = self._task.level(options.level).sensors(driver.observation)
        self.env = RecordedEnv(config, expert, options.max_steps)

    @property
    def spaces(self) -> tuple[spaces.Dict, spaces.Box]:
        """The spaces of observation and action of the dataset, those of `gym.make(options.spec)`."""
        return self.env.recorded_space, self.env.action_box

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def episode(self, number: int) -> RecordedEpisode:
        """Drive an episode; it depends on the options and its number alone.

        Raises:
            LabgymError: no drive of the task was drawn, the expert failed too often, or raised an error.
        """
        dropped: list[EpisodeFacts] = []
        for draw in range(MOST_DRAWS):
            seed = int(np.random.default_rng([self._options.seed, number, draw]).integers(2**53))
            observation = self.env.reset(seed=seed)[0]
            if not self._is_of_task(self.env.state):
                continue
            facts = self._drive(observation, number, seed, len(dropped))
            if facts.ending == "success" or not self._options.successful:
                return RecordedEpisode(facts, self.env.steps, tuple(dropped))
            dropped.append(facts)
            if len(dropped) == MOST_FAILURES:
                raise LabgymError(
                    f"episode {number}: expert {self._options.policy!r} failed in {MOST_FAILURES} drives in a row; "
                    "choose another expert, or leave out --successful"
                )
        raise LabgymError(f"episode {number}: none of {MOST_DRAWS} layouts has a drive of {self._options.task_id}")

    def _is_of_task(self, state: State) -> bool:
        """Whether the drive has the properties of the task and level: the environment takes others where none fits."""
        if not 0.0 < state.shortest_path_length < math.inf:
            return False
        return self._options.labnav is None or bool(state.task.conditions)

    def _drive(self, observation: Observation, number: int, seed: int, attempt: int) -> EpisodeFacts:
        """Drive to the end of the episode that has begun."""
        state = self.env.state
        task = state.task
        start: dict[str, Any] = {
            "number": number,
            "seed": seed,
            "attempt": attempt,
            "floor": task.layout.id,
            "floor_hash": task.layout.hash,
            "protocol": "" if task.protocol is None else task.protocol.id,
            "announced": announced_goal(state),
            "radius": state.disc,
            "goals": 1 + len(task.following),
        }
        self._recorder = LegRecorder()
        self._recorder.note(observation, state)
        drive = self._chain if self._task.chain else self._single if self._options.labnav else self._point
        results = drive(observation)
        return EpisodeFacts(**start | self._driven() | results)

    def _driven(self) -> dict[str, Any]:
        """Return length, time and outcomes of the episode until now."""
        state = self.env.state
        outcomes = {name: one.outcome for name, one in state.presences.items() if name != "contacts"}
        return {"path_length": state.path_length, "time": round(state.time, 6), "outcomes": plain(outcomes)}

    def _leg(self) -> RecordedLeg:
        """Return the drive to the present goal."""
        options = self._options
        level = 0 if options.labnav is None else options.level
        return RecordedLeg(self.env, self._driver, self._task, level, self._recorder, options.seed, options.max_steps)

    def _point(self, observation: Observation) -> dict[str, Any]:
        """Drive to one goal, at which the environment ends the episode when the robot rests."""
        env, state = self.env, self.env.state
        leg = self._leg()
        leg.run(self._driver.reset, observation)
        _check(leg)
        if not env.over:  # The robot rests elsewhere, and the expert has given up.
            env.give_up()
        success, length = state.success, state.shortest_path_length
        score = self._score(success, length)
        ending = "success" if success else "wrong place" if leg.parked else "time"
        return {"success": success, "score": score, "ending": ending, "shortest": length}

    def _single(self, observation: Observation) -> dict[str, Any]:
        """Drive to one goal and send STOP; the results are those before STOP."""
        env, state = self.env, self.env.state
        leg = self._leg()
        leg.run(self._driver.reset, observation)
        _check(leg)
        finish = leg.finish(state)
        success = finish.parked and finish.inside
        length = state.shortest_path_length
        results = {"success": success, "score": self._score(success, length), "ending": ending_of(finish)}
        results |= self._driven()
        if finish.parked and not env.over:
            env.stop()
        return {**results, "shortest": length}

    def _chain(self, first: Observation) -> dict[str, Any]:
        """Drive to all goals, each with STOP; after a drive that fails, the environment goes on by itself."""
        env, state = self.env, self.env.state
        observation: Mapping[str, Any] = first
        count = 1 + len(state.task.following)
        legs: list[LegResult] = []
        endings: list[str] = []
        while not env.over:
            shortest = shortest_from(state, 0.0)
            leg = self._leg()
            observation = leg.run(self._driver.next_goal if legs else self._driver.reset, observation)
            _check(leg)
            finish, driven = leg.finish(state), state.path_length - leg.driven
            reached = finish.parked and finish.inside and not finish.spilt
            legs.append(LegResult(reached, reached and finish.docked, shortest, driven))
            endings.append(ending_of(finish))
            if leg.parked and not env.over:
                observation = env.stop()
                self._recorder.note(observation, state)
        success = len(legs) == count and all(leg.docked for leg in legs)
        failed = [each for each in endings if each != "success"]
        ending = "contact" if endings[-1] == "contact" else "success" if success else (*failed, "time")[0]
        length = math.fsum(leg.shortest for leg in legs)
        score = self._score(success, length, tuple(legs))
        return {"success": success, "score": score, "ending": ending, "shortest": length}

    def _score(self, success: bool, shortest: float, legs: tuple[LegResult, ...] = ()) -> float:
        """Return the score of the episode that is over."""
        state = self.env.state
        result = Result(
            success=success,
            shortest=shortest,
            path_length=state.path_length,
            time=state.time,
            final_distance=state.distance,
            final_heading=wrap_angle(state.pose[2] - state.pair.goal[2]),
            legs=legs,
            goals=1 + len(state.task.following),
        )
        outcomes = {name: presence.outcome for name, presence in state.presences.items()}
        return self._task.score(result, outcomes, state.conditions)


def environment_config(options: DriveOptions) -> PointNavConfig:
    """Return the configuration of the environment that `gym.make(options.spec)` makes."""
    kwargs = dict(options.spec.kwargs)
    return configured(kwargs.pop("config"), kwargs)


def _check(leg: LegDrive) -> None:
    """Raise PolicyError if the expert failed by an error."""
    if leg.error is not None:
        raise PolicyError(leg.error)
