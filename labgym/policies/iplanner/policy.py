"""The iPlanner-style policy: look, plan a path, follow it; turn in place when stuck."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.geometry import Array, to_world
from labgym.policies.iplanner.network import load_iplanner
from labgym.policies.learned.maneuvers import (
    CameraPlanner,
    ManeuverOptions,
    Steps,
    TurnInPlace,
    free_side,
    goal_bearing,
    goal_point,
)
from labgym.policies.options import NonNegative, PolicyOptions
from labgym.policies.policy import EpisodeStart, Observation, Sensors
from labgym.policies.tracking import PathTracker


class IPlannerOptions(ManeuverOptions):
    """How the network's paths become motion.

    Attributes:
        look: control steps between two looks; each look plans a path.
        turn_angle: angle of a turn in place away from an obstacle, radians.
        glance, glance_bearing: after driving `glance` meters with the goal's bearing beyond `glance_bearing` radians,
            the robot turns to the goal and plans there. It takes that path if it leads on rather than back, and else
            continues on the previous path. None never glances.
    """

    look: Steps = 2
    commit: NonNegative = 0.6
    patience: Steps = 25
    turn_angle: NonNegative = 0.6
    glance: NonNegative | None = 1.0
    glance_bearing: NonNegative = 0.6


class IPlannerPolicy(CameraPlanner):
    """Plans a path on one depth image. Its only memory is the path that it follows and where it last faced the goal.

    Args:
        weights: folder of `config.json` and `weights.safetensors`; None uses the published ones.
        options: how paths become motion, an `IPlannerOptions` or a mapping of those that differ from the defaults.

    Raises:
        DocumentError: the weights cannot be read.
        UnknownNameError: an option does not exist.
        OptionError: an option is outside its limits.
    """

    name: ClassVar[str] = "iplanner"
    observation: ClassVar[Sensors] = "depth"
    options_type: ClassVar[type[PolicyOptions]] = IPlannerOptions

    def __init__(
        self, weights: str | Path | None = None, options: IPlannerOptions | Mapping[str, Any] | None = None
    ) -> None:
        self._folder = artefacts("policies") / "iplanner" if weights is None else Path(weights)
        self._network = load_iplanner(self._folder)
        self._options = IPlannerOptions.of(options)
        self._begin(ROBOT)

    def reset(self, episode: EpisodeStart) -> None:
        """Forget the path."""
        self._begin(episode.robot)

    def planned_path(self) -> Array | None:
        """Return the path that is followed; None during a turn in place."""
        return None if self._tracker is None or self._turn is not None else self._tracker.path

    def _begin(self, robot: RobotSpec) -> None:
        self._begin_maneuvers(robot, self._options)
        self._goal_last_ahead: Array | None = None
        self._glance_from: float | None = None

    def act(self, observation: Observation) -> Array:
        """Face the goal first, then plan and follow or turn away; back off from unseen obstacles."""
        if self._blockage.blocked(float(observation["velocity"][0])):
            self._tracker = None
            self._stuck.clear()
        if self._blockage.backing:
            return np.asarray(self._blockage.back_off(), dtype=np.float64)
        action = self._drive(observation)
        self._blockage.note(float(action[0]) * self._robot.v_max)
        return action

    def plan(self, depth: NDArray[np.float32], goal: tuple[float, float]) -> Array:
        """Return the network's path (n, 2) in the robot frame, meters.

        Args:
            depth: (72, 128) planar meters.
            goal: (x, y) in the robot frame, meters.
        """
        with torch.inference_mode():
            path = self._network(torch.from_numpy(depth)[None], torch.tensor([goal], dtype=torch.float32))
        return np.asarray(path[0].numpy(), dtype=np.float64)

    def _drive(self, observation: Observation) -> Array:
        odometry = np.asarray(observation["odometry"], dtype=np.float64)
        bearing, goal = goal_bearing(observation), goal_point(observation)
        if self._facing.turning(bearing):
            return turn_towards(bearing, self._robot)
        depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
        self._step += 1
        if self._glancing(odometry, bearing):
            if abs(bearing) > self._options.facing:
                return turn_towards(bearing, self._robot)
            self._look_at_goal(depth, goal, odometry)
        self._stuck.add(odometry[:2])
        if self._tracker is None or self._turn or self._step % self._options.look == 0:
            if self._turn is not None:
                if not self._turn.over(float(odometry[2])):
                    return self._turn.action(self._robot)
                self._turn, self._tracker = None, None
            if self._stuck.stuck:
                side, yaw = free_side(depth, bearing), float(odometry[2])
                self._turn = TurnInPlace(side, yaw, self._options.turn_angle, measure="swept")
                self._stuck.clear()
                return self._turn.action(self._robot)
            if self._tracker is None or self._commitment.over(self._step, odometry[:2]):
                self._tracker = PathTracker(to_world(self.plan(depth, goal), odometry), self._robot)
                self._commitment.begin(self._step, odometry[:2])
        x, y, yaw = (float(value) for value in odometry)
        return self._tracker.action((x, y, yaw), float(observation["velocity"][0]))

    def _glancing(self, odometry: Array, bearing: float) -> bool:
        """Return whether the robot is turning to look at a goal that it has not seen for a while."""
        if self._glance_from is None:
            if self._goal_last_ahead is None or self._turn or abs(bearing) <= self._options.glance_bearing:
                self._goal_last_ahead = odometry[:2]
            driven = float(np.linalg.norm(odometry[:2] - self._goal_last_ahead))
            if self._options.glance is not None and driven > self._options.glance:
                self._glance_from = float(odometry[2])
        return self._glance_from is not None

    def _look_at_goal(self, depth: NDArray[np.float32], goal: tuple[float, float], odometry: Array) -> None:
        """Take the path planned while facing the goal if it leads on, else continue on the previous one."""
        path = self.plan(depth, goal)
        before = (self._glance_from or 0.0) - float(odometry[2])
        onward = float(path[len(path) // 2] @ (math.cos(before), math.sin(before))) >= 0.0
        if self._tracker is None or onward:
            self._tracker = PathTracker(to_world(path, odometry), self._robot)
        self._commitment.begin(self._step, odometry[:2])
        self._goal_last_ahead, self._glance_from = odometry[:2], None
        self._stuck.clear()
