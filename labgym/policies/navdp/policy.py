"""The NavDP-style policy: draw trajectories, follow the one that the critic thinks best; turn where none is safe."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.policies.blockage import Blockage
from labgym.policies.data.situations import PERIOD
from labgym.policies.navdp.diffusion import make_schedule, sampled
from labgym.policies.navdp.frames import Bytes, frame
from labgym.policies.navdp.network import CONFIG, WEIGHTS, load_navdp
from labgym.policies.navdp.trajectory import points_of
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import PathTracker, turn_towards

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NavDPRules:
    """How trajectories become motion.

    Attributes:
        samples: trajectories drawn at a time. choose: "critic" follows the best valued one; "first" the first drawn.
        facing: an episode begins by turning in place until the goal's bearing is within this, radians: the camera is
            68 degrees wide, and the goal may be behind.
        commit: a trajectory is followed for this distance before others are drawn, metres.
        commit_after_turn: the same for the first trajectory after a turn, which led the robot away from its goal.
        patience: control steps after which others are drawn in any case.
        shortest: a trajectory that ends nearer than this is one to stay, metres.
        stop: value below which no trajectory is safe enough and the robot turns in place; None never turns.
        enough: a turn goes on for this angle before trajectories are drawn again, radians; for `turn_steps` control
            steps at most, since something may hold the robot.
        stuck_steps, stuck_distance: the robot also turns where it has moved less than that in so many steps.
        remembers: whether the network is shown the frames before the present one, or the present one in their place.
    """

    samples: int = 12
    choose: str = "critic"
    facing: float = 0.5
    commit: float = 0.5
    commit_after_turn: float = 1.2
    patience: int = 20
    shortest: float = 0.5
    stop: float | None = -1.5
    enough: float = 0.5
    turn_steps: int = 12
    stuck_steps: int = 30
    stuck_distance: float = 0.10
    remembers: bool = True


class Drawn(NamedTuple):
    """What was planned at one place.

    Attributes:
        trajectories: (n, 24, 2) in the robot frame, metres; all zeros where one says to stay.
        values: (n,) what the critic thinks of each.
    """

    trajectories: Array
    values: Array


class NavDPPolicy(Policy):
    """Sees colour and depth, now and up to a second ago, and draws trajectories to the goal by diffusion.

    Args:
        weights: folder of `config.json` and `weights.safetensors`; None takes the published ones.
        rules: how trajectories become motion; a mapping changes some of the usual ones.
    """

    name: ClassVar[str] = "navdp"
    observation: ClassVar[Sensors] = "rgbd"

    def __init__(
        self,
        weights: str | Path | None = None,
        rules: NavDPRules | Mapping[str, float | int | str | bool | None] | None = None,
    ) -> None:
        self._folder = artefacts("policies") / "navdp" if weights is None else Path(weights)
        self._network = load_navdp(self._folder)
        self._schedule = make_schedule(self._network.config.diffusion)
        self._rules = rules if isinstance(rules, NavDPRules) else NavDPRules(**(rules or {}))  # type: ignore[arg-type]
        self._begin(ROBOT, 0)

    def reset(self, episode: EpisodeStart) -> None:
        """Forget what was seen and planned."""
        self._begin(episode.robot, int(episode.rng.integers(2**62)))

    def files(self) -> tuple[Path, ...]:
        """Return the weights and their configuration."""
        return self._folder / CONFIG, self._folder / WEIGHTS

    def planned_path(self) -> Array | None:
        """Return the path that is followed; None while it turns in place."""
        return None if self._tracker is None else self._tracker.path

    def _begin(self, robot: RobotSpec, seed: int) -> None:
        self._robot = robot
        self._generator = torch.Generator().manual_seed(seed)
        self._stride = max(1, round(PERIOD / robot.control_dt))
        memory = self._network.config.network.memory
        self._frames: deque[Bytes] = deque(maxlen=(memory - 1) * self._stride + 1)
        self._places: list[Array] = []
        self._tracker: PathTracker | None = None
        self._planned_at = (0, np.zeros(2))
        self._step = 0
        self._blockage = Blockage(robot)
        self._blocked = False
        self._commit = self._rules.commit
        self._turn: _Turn | None = None
        self._faced = False

    def act(self, observation: Observation) -> Array:
        """Face the goal first; then draw, choose and follow, or turn in place; back off from what stops it unseen."""
        depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
        self._frames.append(frame(np.asarray(observation["rgb"], dtype=np.uint8), depth))
        if self._blockage.blocked(float(observation["velocity"][0])):
            self._tracker = None
            self._places.clear()
            self._blocked = True
        if self._blockage.backing:
            return np.asarray(self._blockage.back_off(), dtype=np.float64)
        action = self._drive(observation, depth)
        self._blockage.note(float(action[0]) * self._robot.v_max)
        return action

    def _drive(self, observation: Observation, depth: NDArray[np.float32]) -> Array:
        odometry = np.asarray(observation["odometry"], dtype=np.float64)
        distance, cosine, sine = (float(value) for value in observation["goal"])
        bearing = math.atan2(sine, cosine)
        self._places.append(odometry[:2])
        self._step += 1
        if not self._faced:
            self._faced = abs(bearing) <= self._rules.facing
            if not self._faced:
                return turn_towards(bearing, self._robot)
        if self._turn is not None and not self._turn.over(float(odometry[2])):
            return self._turn.action(self._robot)
        if self._blocked or self._stuck():
            self._blocked = False
            return self._turn_away(depth, bearing, odometry)
        if self._tracker is None or self._turn is not None or self._worn(odometry):
            drawn = self.draw((distance * cosine, distance * sine))
            best = self._best(drawn)
            if best is None:
                return self._turn_away(depth, bearing, odometry)
            path = moved(np.vstack([np.zeros((1, 2)), drawn.trajectories[best]]), odometry)
            self._tracker = PathTracker(path, self._robot, turning=self._tracker is None)
            self._commit = self._rules.commit_after_turn if self._turn else self._rules.commit
            self._turn, self._planned_at = None, (self._step, odometry[:2])
        x, y, yaw = (float(value) for value in odometry)
        return self._tracker.action((x, y, yaw), float(observation["velocity"][0]))

    def drawn_from(self, rgb: Bytes, depth: NDArray[np.floating], goal: tuple[float, float], seed: int = 0) -> Drawn:
        """Draw trajectories from one frame, as at the start of an episode; `seed` is of the noise.

        Args:
            rgb: (72, 128, 3). depth: (72, 128), planar, metres. goal: (x, y) in the robot frame, metres.
        """
        self._begin(self._robot, seed)
        self._frames.append(frame(rgb, depth))
        return self.draw(goal)

    @torch.inference_mode()
    def draw(self, goal: tuple[float, float]) -> Drawn:
        """Draw trajectories from the frames seen last, and value them.

        Args:
            goal: (x, y) in the robot frame, metres.
        """
        network, rules = self._network, self._rules
        memory = network.config.network.memory
        ages = [self._stride * age if rules.remembers else 0 for age in range(memory - 1, -1, -1)]
        frames = [self._frames[max(0, len(self._frames) - 1 - age)] for age in ages]
        seen = network.encode(torch.from_numpy(np.stack(frames))[None])
        steps = sampled(network, self._schedule, seen, torch.tensor(goal), rules.samples, self._generator)
        points = points_of(steps, network.config.diffusion.scale)
        stays = points[:, -1].norm(dim=1) < rules.shortest
        values = network.value(seen.expand(len(steps), -1, -1), steps)
        points[stays] = 0.0
        return Drawn(points.numpy().astype(np.float64), values.numpy().astype(np.float64))

    def _best(self, drawn: Drawn) -> int | None:
        """Return which trajectory to follow; None where none is safe or all are to stay."""
        goes = np.abs(drawn.trajectories[:, -1]).sum(axis=1) > 0.0
        if self._rules.choose == "first":
            return int(np.argmax(goes)) if goes.any() else None
        values = np.where(goes, drawn.values, -np.inf)
        best = int(np.argmax(values))
        if not goes.any() or (self._rules.stop is not None and values[best] < self._rules.stop):
            return None
        return best

    def _turn_away(self, depth: NDArray[np.float32], bearing: float, odometry: Array) -> Array:
        """Begin to turn in place, or go on turning, towards the freer side or a goal that is abeam."""
        if self._turn is None:
            half = IMAGE_SHAPE[1] // 2
            side = 1.0 if depth[:, :half].mean() >= depth[:, half:].mean() else -1.0
            side = math.copysign(1.0, bearing) if abs(bearing) > 1.0 else side
            self._turn = _Turn(side, self._rules.enough, self._rules.turn_steps)
        self._turn.begin(float(odometry[2]))
        self._tracker = None
        self._places.clear()
        return self._turn.action(self._robot)

    def _worn(self, odometry: Array) -> bool:
        """Whether the trajectory in use has been followed for long enough."""
        step, place = self._planned_at
        driven = float(np.linalg.norm(odometry[:2] - place))
        return driven >= self._commit or self._step - step >= self._rules.patience

    def _stuck(self) -> bool:
        steps = self._rules.stuck_steps
        if len(self._places) < steps:
            return False
        return float(np.linalg.norm(self._places[-1] - self._places[-steps])) < self._rules.stuck_distance


class _Turn:
    """A turn in place to one side, by an angle at a time."""

    def __init__(self, side: float, enough: float, most: int) -> None:
        self._side, self._enough, self._most = side, enough, most
        self._from, self._steps = 0.0, 0

    def begin(self, yaw: float) -> None:
        """Turn on from this heading."""
        self._from, self._steps = yaw, 0

    def over(self, yaw: float) -> bool:
        """Whether the robot has turned far enough, or tried for long enough, to look again."""
        self._steps += 1
        return abs(math.remainder(yaw - self._from, math.tau)) >= self._enough or self._steps >= self._most

    def action(self, robot: RobotSpec) -> Array:
        """Return the action that turns on."""
        return turn_towards(self._side, robot)


def moved(path: Array, pose: Array) -> Array:
    """Return a path (n, 2) of the robot frame in the frame that the robot's pose (3,) is given in."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    x, y = path[:, 0], path[:, 1]
    return np.column_stack([pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y])
