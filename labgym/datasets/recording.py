"""The environment of the drives: as `gym.make` returns it, with the sensors of the expert added, and recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs.config import PointNavConfig
from labgym.envs.episode import RunningEpisode
from labgym.envs.parts.actions import VelocityActions
from labgym.envs.parts.protocols import Sensor
from labgym.envs.point_nav import LabPointNavEnv, Observation
from labgym.envs.presets import configured

GO_ACTION, STOP_ACTION = -1.0, 1.0
"""The third component of an action."""


@dataclass
class Steps:
    """The steps of an episode.

    Attributes:
        observations: of the dataset's sensors, one more than actions: the last is that after the last action.
        poses, goals, legs: true pose of the robot and of the goal, room frame, and number of the drive in progress,
            each with its observation.
        actions, rewards, terminated, truncated, contacts: of each action; `contacts` is whether the robot touched
            something during it.
    """

    observations: list[Observation] = field(default_factory=list)
    poses: list[tuple[float, float, float]] = field(default_factory=list)
    goals: list[tuple[float, float, float]] = field(default_factory=list)
    legs: list[int] = field(default_factory=list)
    actions: list[NDArray[np.float32]] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    terminated: list[bool] = field(default_factory=list)
    truncated: list[bool] = field(default_factory=list)
    contacts: list[bool] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.actions)


class RecordedEnv(LabPointNavEnv):
    """An environment that records its steps.

    `step` takes forward and turn; the component STOP_ACTION is added. The sensors of the expert come after those of the
    dataset, so that the readings of the latter are those of the environment without the former.

    Args:
        config: of the environment. sensors: of the expert.
        limit: number of actions after which an episode is truncated.

    Attributes:
        steps: of the episode in progress.
        ended: name of the ending of the latest drive that ended, "" before.
    """

    def __init__(self, config: PointNavConfig, sensors: Sequence[Sensor], limit: int) -> None:
        self._recorded = tuple(sensor.name for sensor in config.observed)
        added = tuple(each for each in sensors if each.name not in self._recorded)
        super().__init__(config=configured(config, {"sensors": (*config.observed, *added)}))
        self._limit = limit
        self._has_stop = isinstance(self._actions, VelocityActions) and self._actions.stop
        self.steps, self.ended = Steps(), ""

    @property
    def recorded_space(self) -> spaces.Dict:
        """The space of the recorded observations."""
        assert isinstance(self.observation_space, spaces.Dict)
        return spaces.Dict({name: self.observation_space[name] for name in self._recorded})

    @property
    def action_box(self) -> spaces.Box:
        """The space of the recorded actions."""
        assert isinstance(self.action_space, spaces.Box)
        return self.action_space

    @property
    def over(self) -> bool:
        """Whether the episode has ended."""
        steps = self.steps
        return bool(steps.actions) and (steps.terminated[-1] or steps.truncated[-1])

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode and its record."""
        observation, info = super().reset(seed=seed, options=options)
        self.steps, self.ended = Steps(), ""
        self._note(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Carry out forward and turn, clipped to [-1, 1], and record the step."""
        return self._act([*action, *([GO_ACTION] if self._has_stop else [])])

    def stop(self) -> Observation:
        """Carry out STOP_ACTION until it counts, record the steps and return the observation, in a chain the next's."""
        leg, observation = self.state.leg, self._act([0.0, 0.0, STOP_ACTION])[0]
        while not self.over and self.state.leg == leg:
            observation = self._act([0.0, 0.0, STOP_ACTION])[0]
        return observation

    def give_up(self) -> None:
        """Truncate the episode where the robot is, after a step at rest if it has not moved at all."""
        if not self.steps.actions:
            self.step([0.0, 0.0])
        self.steps.truncated[-1] = True

    def _act(self, components: list[float]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        action = np.clip(np.asarray(components, np.float32), -1.0, 1.0)
        observation, reward, terminated, truncated, info = super().step(action)
        steps = self.steps
        steps.actions.append(action)
        steps.rewards.append(float(reward))
        steps.terminated.append(terminated)
        steps.truncated.append(truncated or len(steps) >= self._limit)
        steps.contacts.append(self.state.collision)
        self._note(observation)
        return observation, reward, terminated, truncated, info

    def _note(self, observation: Observation) -> None:
        steps, state = self.steps, self.state
        steps.observations.append({name: np.asarray(observation[name]) for name in self._recorded})
        steps.poses.append(state.pose)
        steps.goals.append(state.goal)
        steps.legs.append(state.leg)

    def _end_drive(self, episode: RunningEpisode) -> None:
        self.ended = episode.state.ending
        super()._end_drive(episode)
