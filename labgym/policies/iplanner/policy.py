"""The iPlanner-style policy: look, plan a path, follow it; stop and turn where the network fears a collision."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.policies.blockage import Blockage
from labgym.policies.iplanner.network import PlannerNetwork, load_planner
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import PathTracker, turn_towards

Array = NDArray[np.float64]

MOVING = 0.1
"""Forward velocity from which on the robot heads for what it sees, m/s; slower it may be turning on the spot."""


@dataclass(frozen=True)
class PlannerRules:
    """How plans become motion.

    Attributes:
        facing: an episode begins by turning in place until the goal's bearing is within this, radians: the camera is 68
            degrees wide, and the goal may be behind.
        look: control steps between two looks, each of which gives a path and the fear that it collides.
        commit: a path is followed for this distance before a new one is taken, metres. While it turns to follow a path
            the robot keeps it: another view would give another path, and it would turn to and fro for ever.
        patience: control steps after which a new path is taken in any case.
        fear: probability over which a frame counts as fearful.
        fearful_frames: the robot stops and turns after more than this many fearful frames in a row.
        near: the robot heads at an obstacle that is nearer than this straight ahead, metres.
        turned_enough: a turn away ends in a fearless view, but not before this angle, radians.
        glance, glance_bearing: having driven this far, metres, without the goal's bearing being within this angle, the
            robot turns to the goal and looks; it takes the path planned there where that is fearless and leads on
            rather than back, and goes on as before where not. None leaves it out.
        stuck_steps, stuck_distance: as when fearful, where the robot has moved less than that in so many steps.
    """

    facing: float = 0.5
    look: int = 2
    commit: float = 0.6
    patience: int = 25
    fear: float = 0.5
    fearful_frames: int = 3
    near: float = 0.9
    turned_enough: float = 0.6
    glance: float | None = 1.0
    glance_bearing: float = 0.6
    stuck_steps: int = 30
    stuck_distance: float = 0.10


class IPlannerPolicy(Policy):
    """Plans on one depth image, by a network trained without labels on cost maps. It has no memory but the last path.

    Args:
        weights: folder of `config.json` and `weights.safetensors`; None takes the published ones.
        rules: how plans become motion; a mapping changes some of the usual ones.
    """

    name: ClassVar[str] = "iplanner"
    observation: ClassVar[Sensors] = "depth"

    def __init__(
        self, weights: str | Path | None = None, rules: PlannerRules | Mapping[str, float | None] | None = None
    ) -> None:
        self._network: PlannerNetwork = load_planner(artefacts("policies") / "iplanner" if weights is None else weights)
        self._rules = rules if isinstance(rules, PlannerRules) else PlannerRules(**(rules or {}))  # type: ignore[arg-type]
        self._robot: RobotSpec = ROBOT
        self._begin()

    def reset(self, episode: EpisodeStart) -> None:
        """Forget the path."""
        self._robot = episode.robot
        self._begin()

    def _begin(self) -> None:
        self._tracker: PathTracker | None = None
        self._planned: tuple[int, Array] = (0, np.zeros(2))
        self._step = 0
        self._fearful = 0
        self._faced = False
        self._avoiding: _Turn | None = None
        self._places: list[Array] = []
        self._blockage = Blockage(self._robot)
        self._seen_goal: Array | None = None
        self._glanced_from: float | None = None

    def act(self, observation: Observation) -> Array:
        """Turn to the goal first; then plan and follow, or turn away; back off from what stops it unseen."""
        if self._blockage.blocked(float(observation["velocity"][0])):
            self._tracker = None
            self._places.clear()
        if self._blockage.backing:
            return np.asarray(self._blockage.back_off(), dtype=np.float64)
        action = self._drive(observation)
        self._blockage.note(float(action[0]) * self._robot.v_max)
        return action

    def _drive(self, observation: Observation) -> Array:
        odometry = np.asarray(observation["odometry"], dtype=np.float64)
        distance, cosine, sine = (float(value) for value in observation["goal"])
        bearing = math.atan2(sine, cosine)
        if not self._faced:
            self._faced = abs(bearing) <= self._rules.facing
            if not self._faced:
                return turn_towards(bearing, self._robot)
        depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
        speed = float(observation["velocity"][0])
        self._step += 1
        if self._glancing(odometry, bearing):
            if abs(bearing) > self._rules.facing:
                return turn_towards(bearing, self._robot)
            self._look_at_goal(depth, (distance * cosine, distance * sine), odometry)
        self._places.append(odometry[:2])
        if self._tracker is None or self._avoiding or self._step % self._rules.look == 0:
            path, fear = self.plan(depth, (distance * cosine, distance * sine))
            heading_on = self._avoiding is not None or speed > MOVING
            self._fearful = self._fearful + 1 if heading_on and fear > self._rules.fear else 0
            if self._avoiding is not None:
                if not self._avoiding.over(float(odometry[2]), self._fearful == 0):
                    return self._avoiding.action(self._robot)
                self._avoiding, self._tracker = None, None
            if self._must_turn(depth):
                self._avoiding = _Turn(self._side(depth, bearing), float(odometry[2]), self._rules.turned_enough)
                self._fearful = 0
                self._places.clear()
                return self._avoiding.action(self._robot)
            if self._tracker is None or self._worn(odometry):
                self._tracker = PathTracker(moved(path, odometry), self._robot)
                self._planned = self._step, odometry[:2]
        x, y, yaw = (float(value) for value in odometry)
        return self._tracker.action((x, y, yaw), speed)

    def planned_path(self) -> Array | None:
        """Return the path that is followed; None while it turns in place."""
        return None if self._tracker is None or self._avoiding is not None else self._tracker.path

    def plan(self, depth: NDArray[np.float32], goal: tuple[float, float]) -> tuple[Array, float]:
        """Return the network's path (n, 2) in the robot frame, metres, and the probability that it collides.

        Args:
            depth: (72, 128) planar metres. goal: (x, y) in the robot frame, metres.
        """
        with torch.inference_mode():
            path, fear = self._network(torch.from_numpy(depth)[None], torch.tensor([goal], dtype=torch.float32))
        return path[0].numpy().astype(np.float64), float(torch.sigmoid(fear[0]))

    def _glancing(self, odometry: Array, bearing: float) -> bool:
        """Whether the robot is turning to look at a goal that it has not seen for a while."""
        if self._glanced_from is None:
            if self._seen_goal is None or self._avoiding or abs(bearing) <= self._rules.glance_bearing:
                self._seen_goal = odometry[:2]
            driven = float(np.linalg.norm(odometry[:2] - self._seen_goal))
            if self._rules.glance is not None and driven > self._rules.glance:
                self._glanced_from = float(odometry[2])
        return self._glanced_from is not None

    def _look_at_goal(self, depth: NDArray[np.float32], goal: tuple[float, float], odometry: Array) -> None:
        """Take the path planned while facing the goal, or go on with the one before."""
        path, fear = self.plan(depth, goal)
        before = (self._glanced_from or 0.0) - float(odometry[2])
        onward = float(path[len(path) // 2] @ (math.cos(before), math.sin(before))) >= 0.0
        if self._tracker is None or (onward and fear <= self._rules.fear):
            self._tracker = PathTracker(moved(path, odometry), self._robot)
        self._planned = self._step, odometry[:2]
        self._seen_goal, self._glanced_from = odometry[:2], None
        self._places.clear()

    def _worn(self, odometry: Array) -> bool:
        """Whether the path in use has been followed for long enough."""
        step, place = self._planned
        driven = float(np.linalg.norm(odometry[:2] - place))
        return driven >= self._rules.commit or self._step - step >= self._rules.patience

    def _must_turn(self, depth: NDArray[np.float32]) -> bool:
        ahead = depth[:, IMAGE_SHAPE[1] // 3 : -(IMAGE_SHAPE[1] // 3)]
        afraid = self._fearful > self._rules.fearful_frames and float(ahead.min()) < self._rules.near
        return afraid or self._stuck()

    def _stuck(self) -> bool:
        steps = self._rules.stuck_steps
        if len(self._places) < steps:
            return False
        return float(np.linalg.norm(self._places[-1] - self._places[-steps])) < self._rules.stuck_distance

    def _side(self, depth: NDArray[np.float32], bearing: float) -> float:
        """Return +1 to turn left, -1 to turn right: to the side that is freer, or to the goal's where it is abeam."""
        if abs(bearing) > 1.0:
            return math.copysign(1.0, bearing)
        half = IMAGE_SHAPE[1] // 2
        return 1.0 if depth[:, :half].mean() >= depth[:, half:].mean() else -1.0


class _Turn:
    """A turn in place away from an obstacle, to one side until the view is fearless or all round."""

    def __init__(self, side: float, yaw: float, enough: float) -> None:
        self._side, self._enough = side, enough
        self._last, self._turned = yaw, 0.0

    def over(self, yaw: float, fearless: bool) -> bool:
        """Note the heading and return whether the turn is done."""
        self._turned += abs(math.remainder(yaw - self._last, math.tau))
        self._last = yaw
        return (fearless and self._turned >= self._enough) or self._turned >= math.tau

    def action(self, robot: RobotSpec) -> Array:
        """Return the action that turns on."""
        return turn_towards(self._side, robot)


def moved(path: Array, pose: Array) -> Array:
    """Return a path (n, 2) of the robot frame in the frame that the robot's pose (3,) is given in."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    x, y = path[:, 0], path[:, 1]
    return np.column_stack([pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y])
