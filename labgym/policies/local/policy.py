"""The learned local planner as a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.counts import check_switch
from labgym.errors import DocumentError
from labgym.navigation import Pose
from labgym.policies.adapters.actor_file import Perceptron
from labgym.policies.local.inputs import SIZE, SIZES, LatestMotion, StackState, TaskKnowledge, Vector, network_input
from labgym.policies.policy import EpisodeStart, Observation
from labgym.policies.stack.mapless import MaplessStackPolicy
from labgym.policies.stack.old_map import OldMap
from labgym.policies.stack.planner import PlannedPath
from labgym.policies.stack.policy import CREEP_SPEED, StackPolicy
from labgym.policies.tracking import approach_speed

FILE = "policy.safetensors"


class LocalPolicy(StackPolicy):
    """Drives along the path of the navigation stack by a network. Privileged: it knows the old map.

    Localization, costmap, global planner, tracks of people, recovery, the last half meter at a dock and the end at the
    goal are those of `stack`. The network takes the place of its controller: it decides all velocities in between. The
    stack's rules that make the robot rest for people are a safety layer over it.

    Args:
        weights: file of the network; None uses the published one.
        actor: a network to use in place of a file.
        safety: whether the robot rests for people by the rules of `stack`; else the network alone decides.

    Raises:
        DocumentError: the file is damaged, or its network has another input.
        OptionError: `safety` is neither true nor false.
    """

    weights: ClassVar[str] = ""

    def __init__(self, weights: str | Path | None = None, actor: Perceptron | None = None, safety: bool = True) -> None:
        check_switch(f"policy {self.name!r}: safety", safety)
        super().__init__()
        self._safety = safety
        self._file = None if actor else Path(weights) if weights else artefacts("policies") / self.weights / FILE
        if actor is None:
            assert self._file is not None
            actor = checked_actor(self._file)
        self._network = actor.network()

    def files(self) -> tuple[Path, ...]:
        """Return the file of the weights."""
        return () if self._file is None else (self._file,)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Localize, update the costmap, and drive."""
        action = super().act(observation)
        self._motion.commanded((float(action[0]), float(action[1])))
        return action

    def _begin(self, episode: EpisodeStart, goal: Pose, old: OldMap) -> None:
        super()._begin(episode, goal, old)
        self._motion = LatestMotion(episode.robot)
        self._knowledge = TaskKnowledge(
            drifts=episode.task.drift,
            docks=self._docking,
            glass=episode.task.glass,
            peopled=episode.task.people,
            mismounted=episode.task.mounting,
            freeboard=0.0 if episode.beaker is None else episode.beaker.freeboard,
            acceleration=self._controller.limits.acceleration,
            stops=self._arrival.active,
        )

    def _drive(self, pose: Pose, velocity: tuple[float, float]) -> tuple[float, float]:
        self._motion.moved(pose)
        return super()._drive(pose, velocity)

    def _follow(self, plan: PlannedPath, pose: Pose, velocity: tuple[float, float], left: float) -> tuple[float, float]:
        rest = self._rest_for_people(plan, pose, velocity) if self._safety else None
        if rest is not None:
            return rest
        if self._arrives(plan, pose, left):
            return 0.0, 0.0
        state = StackState(plan, left, pose, velocity, self._costmap, self._people)
        action = self._decided(network_input(state, self._motion, self._knowledge, self._robot))
        v, w = self._robot.twist(float(action[0]), float(action[1]))
        if self._arrival.active:
            v = min(v, approach_speed(left, 0.7))
        if self._safety and abs(v) < CREEP_SPEED and self._alongside(pose):
            # Nobody walks into a robot at rest, and a network never commands exactly 0.
            return self._rest_at_goal(pose) or (0.0, w)
        return v, w

    def _decided(self, vector: Vector) -> Vector:
        """Return the action of the network, (2,)."""
        with torch.inference_mode():
            return np.asarray(self._network(torch.from_numpy(vector)[None])[0].numpy())


class ImitationPolicy(LocalPolicy):
    """The local planner trained by imitation of `stack`, without a reward."""

    name: ClassVar[str] = "local-imitation"
    weights: ClassVar[str] = "local-imitation"


class ReinforcementPolicy(LocalPolicy):
    """The local planner trained by PPO, from the weights of the imitation."""

    name: ClassVar[str] = "local-ppo"
    weights: ClassVar[str] = "local-ppo"


class MaplessLocalPolicy(LocalPolicy, MaplessStackPolicy):
    """The network of `local-ppo` in place of the controller of `mapless-stack`. Not privileged."""

    name: ClassVar[str] = "mapless-local"
    privileged: ClassVar[bool] = False
    weights: ClassVar[str] = "local-ppo"


def checked_actor(path: Path) -> Perceptron:
    """Return the actor of a file.

    Raises:
        DocumentError: the file is damaged, or its network has another input.
    """
    actor = Perceptron.load(path)
    ends = actor.layers[0][0].shape[1], actor.layers[-1][0].shape[0]
    if actor.header.inputs != tuple(SIZES) or ends != (SIZE, 2):
        raise DocumentError(path, "layers", f"lead from {ends[0]} to {ends[1]} numbers, expected {SIZE} to 2")
    return actor
