"""An actor's file as a policy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS
from labgym.errors import OptionError, check_name
from labgym.policies.adapters.actor_file import Perceptron, RunningActor
from labgym.policies.adapters.inputs import checked_action, near_goal, sensors_for
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors

Values = NDArray[Any]

SIZES = {
    "goal": 3,
    "near_goal": 3,
    "velocity": 2,
    "odometry": 4,
    "lidar": LIDAR_RAYS,
    "depth": IMAGE_SHAPE[0] * IMAGE_SHAPE[1],
    "observation": 6 + LIDAR_RAYS,
    "achieved_goal": 2,
    "desired_goal": 2,
}
"""Lengths of the possible inputs: those of `LabPointNav-v0`, the goal up close, the odometry, and those of
`LabFloorNavGoal-v0` in the start frame."""


class ActorPolicy(Policy):
    """Acts with the mean action of a model that `labgym train ppo|sac|her` or `labgym.training.save_policy` wrote.

    The file holds numbers and cannot run code. The statistics of `VecNormalize`, if the model was trained with it, are
    in the file and are applied here.

    Args:
        path: path of the .safetensors file.

    Raises:
        DocumentError: the file is damaged or of another kind.
        UnknownNameError: the model has an input that is not an observation.
        OptionError: the sizes of inputs and layers contradict each other, or the output is not an action.
    """

    name: ClassVar[str] = "actor"

    def __init__(self, path: str | Path) -> None:
        self._actor = Perceptron.load(path)
        self._path, self._running = Path(path), RunningActor(self._actor)
        self.observation = check_actor(self._actor, str(path))  # type: ignore[misc] # the file decides, not the class
        self._goal = (0.0, 0.0)

    def reset(self, episode: EpisodeStart) -> None:
        """Store the goal, and forget what was seen."""
        self._goal = episode.goal
        self._running.reset()

    def next_goal(self, episode: EpisodeStart) -> None:
        """Store the next goal of a chain; the memory goes on."""
        self._goal = episode.goal

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the network's mean action, clipped."""
        inputs = {name: self._input(name, observation) for name in self._actor.header.inputs}
        return checked_action(self._running.act(inputs), str(self._path))

    def files(self) -> tuple[Path, ...]:
        """Return the model's file."""
        return (self._path,)

    def parameters(self) -> Mapping[str, Any]:
        """Return no options; the file counts by its bytes."""
        return {}

    def _input(self, name: str, observation: Observation) -> Values:
        """Return an input, (SIZES[name],)."""
        return _GOALS[name](observation, self._goal) if name in _GOALS else np.ravel(observation[name])


def check_actor(actor: Perceptron, source: str) -> Sensors:
    """Return the sensors that an actor requires, after a check that `ActorPolicy` can act with it.

    Raises:
        UnknownNameError: it has an input that is not an observation.
        OptionError: the sizes of inputs and layers contradict each other, or the output is not an action.
    """
    inputs = actor.header.inputs
    for name in inputs:
        check_name(f"{source}: input of the model", name, SIZES)
        if name in actor.statistics and len(actor.statistics[name][0]) != SIZES[name] * actor.header.stack:
            raise OptionError(f"{source}: statistics of {name} have length {len(actor.statistics[name][0])}")
    ends = actor.width, actor.layers[-1][0].shape[0]
    expected = actor.header.stack * sum(SIZES[name] for name in inputs), 2
    if ends != expected:
        raise OptionError(f"{source}: the layers lead from {ends[0]} to {ends[1]} numbers, expected {expected}")
    return sensors_for([_SENSORS.get(name, name) for name in inputs], source)


def _planar(observation: Observation, goal: tuple[float, float]) -> Values:  # noqa: ARG001
    x, y, yaw = np.asarray(observation["odometry"], dtype=np.float64).tolist()
    return np.array([x, y, math.cos(yaw), math.sin(yaw)], np.float32)


def _joint(observation: Observation, goal: tuple[float, float]) -> Values:
    pose = _planar(observation, goal)
    return np.concatenate([pose, observation["velocity"], observation["lidar"]]).astype(np.float32)


_SENSORS = {"observation": "lidar", "near_goal": "goal"}
"""Sensors of inputs with other names."""
_GOALS: dict[str, Callable[[Observation, tuple[float, float]], Values]] = {
    "near_goal": lambda observation, goal: near_goal(np.asarray(observation["goal"])),  # noqa: ARG005
    "odometry": _planar,
    "observation": _joint,
    "achieved_goal": lambda observation, goal: np.asarray(observation["odometry"][:2], np.float32),  # noqa: ARG005
    "desired_goal": lambda observation, goal: np.array(goal, np.float32),  # noqa: ARG005
}
"""Inputs that are computed from the observation and the goal in the start frame."""
