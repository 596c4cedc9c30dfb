"""LabPointNav-v0: drive from one step of a protocol to the next."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs.episode import Episode
from labgym.envs.rewards import RewardWeights
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE, Camera, Lidar
from labgym.envs.simulation import CHECK_STEPS
from labgym.envs.tasks import TaskSource
from labgym.envs.view import ChaseView
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.protocols import Protocol
from labgym.scenes.opengl import QUALITIES, Quality

Observation = dict[str, Any]

GOAL_RANGE = 50.0
"""Farthest distance that the goal observation tells, metres."""

OBSERVATIONS = ("lidar", "depth", "rgbd")
RENDER_MODES = ("rgb_array", "depth_array")


class LabPointNavEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Drive a robot through a chemistry laboratory, from the place of one protocol step to that of the next.

    ## Description

    An episode is one goal pair: the robot starts where one step of the protocol is done, at rest and facing its
    bench, and has to come within 0.5 m of where the next step is done. The robot is a differential-drive base
    (chassis radius 0.27 m, acceleration 1.5 m/s2 and 4 rad/s2) in MuJoCo; obstacles stop it and do not end the
    episode. An environment step is 0.1 s.

    ## Observation space

    A `Dict` of `goal`, `velocity`, and what the argument `observation` asks for. Angles count counter-clockwise.

    - `goal`, float32 (3,): distance to the goal in metres, at most 50; cosine and sine of its bearing from the heading.
    - `velocity`, float32 (2,): forward velocity in m/s, in [-0.3, 1.0]; turn rate in rad/s, in [-1.5, 1.5].
    - `lidar` with "lidar", float32 (180,): ranges in metres from the robot's axis, at most 10, in the plane 0.25 m
      above the floor. Ray i looks along -180 + 2 i degrees from the heading: ray 0 straight behind, 90 straight ahead.
      It sees the solid outlines that stop the robot, the camera the shapes as they look.
    - `depth` with "depth" and "rgbd", float32 (9216,): planar depth in metres, at most 10, of a level camera 0.2 m
      ahead of the axis and 0.5 m above the floor, 68 degrees wide. `reshape(72, 128)` is the picture, rows from
      the top; it comes flat because learning libraries take any box of three dimensions for a picture of bytes.
    - `rgb` with "rgbd", uint8 (72, 128, 3): the same camera's picture.

    ## Action space

    `Box(-1, 1, (2,), float32)`: the velocities that the servos track from now on, values beyond clipped.

    - forward: [0, 1] asks for 0 to 1.0 m/s, [-1, 0] for -0.3 to 0 m/s.
    - turn: [-1, 1] asks for -1.5 to 1.5 rad/s, counter-clockwise positive.

    ## Reward

    The sum of `info["reward_terms"]`, weighted by the argument `weights`; with the default weights

    - `progress`: +1 a metre by which the shortest way to the goal became shorter, on a 5 cm grid, for a disc of 0.30 m;
    - `success`: +10 when the goal is reached;
    - `collision`: -0.1 in a step in which the robot touched something;
    - `time`: -0.01 a step.

    ## Episode end

    `terminated` when the robot's centre is within 0.5 m of the goal. `truncated` by Gymnasium's `TimeLimit` after
    600 steps (60 s); `gym.make(..., max_episode_steps=n)` changes that.

    ## Arguments

    - `split` ("test"): where layouts are drawn from. "val" and "test" are published; "train" generates new ones without
      end.
    - `layout` (None): stay in one layout: a `labgym.layouts.Layout`, the path of a `.json` file, or a published id.
    - `protocol` (None): stay with one protocol: a `labgym.protocols.Protocol` or its id.
    - `observation` ("lidar"): "lidar", "depth" or "rgbd".
    - `render_mode` (None): "rgb_array", a picture from behind and above; "depth_array", the depth camera's, float32
      (72, 128), metres.
    - `profile` ("default"): thresholds that generated layouts meet.
    - `weights` (`RewardWeights()`): the reward's weights.
    - `episodes_per_layout` (8): with "train", episodes in a layout before the next one is generated.
    - `control_dt` (0.1): seconds that an action holds; a multiple of 0.025, at most 1.
    - `width`, `height` (480, 360): size of the "rgb_array" picture.
    - `quality` ("fast"): "fine" renders the "rgb_array" picture with shadows and reflections; without a GPU it takes
      ten times as long. Observations do not depend on it.

    `reset(seed=None, options=None)` takes the options "layout", "protocol" and "pair", an index into
    `labgym.navigation.goal_pairs(layout, protocol)`. What they leave open is drawn from the seeded generator. With a
    seed, the episode depends on seed, options and arguments alone; equal seeds and actions give equal observations
    to the last bit.

    ## Info

    `reset` and `step` return the same keys.

    - `pose`, `goal`: float64 (3,), x and y in metres, yaw in radians, room frame.
    - `distance`: from the robot's centre to the goal, metres. `success`: whether that is within 0.5 m.
    - `collision`: whether the robot touched something in this step. `contacts`: steps of this episode in which it did.
    - `clearance`: from the chassis to the nearest footprint or wall, metres. Privileged.
    - `path_length`: driven so far, metres.
    - `shortest_path_length`: of the goal pair, for a disc of 0.30 m, at any angle, metres; inf where there is no path.
      Privileged.
    - `layout`, `protocol`: ids. `pair`: index of the goal pair.
    - `time`: since the episode's start, seconds.
    - `reward_terms`: the reward's terms by name; zeros at reset.

    ## Errors

    An unknown split, layout, protocol, observation, render mode, quality, option or pair raises an `UnknownNameError`
    that lists what exists. An action that is not two finite numbers raises an `OptionError`, a broken layout file a
    `DocumentError`.

    ## Versions

    - v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        split: str = "test",
        layout: Layout | str | Path | None = None,
        protocol: Protocol | str | None = None,
        observation: str = "lidar",
        render_mode: str | None = None,
        profile: str = "default",
        weights: RewardWeights | None = None,
        episodes_per_layout: int = 8,
        control_dt: float = ROBOT.control_dt,
        width: int = 480,
        height: int = 360,
        quality: Quality = "fast",
    ) -> None:
        if observation not in OBSERVATIONS:
            raise UnknownNameError("observation", observation, OBSERVATIONS)
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise UnknownNameError("render_mode", render_mode, RENDER_MODES)
        if quality not in QUALITIES:
            raise UnknownNameError("quality", quality, QUALITIES)
        self._robot = _controlled(control_dt)
        self.render_mode = render_mode
        self.observation_space = _observation_space(observation)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._observation = observation
        self._tasks = TaskSource(split, layout, protocol, profile, episodes_per_layout)
        self._weights = weights or RewardWeights()
        self._lidar, self._camera = Lidar(), Camera()
        self._view = ChaseView(width, height, quality)
        self._episode: Episode | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; see the class."""
        super().reset(seed=seed)
        task = self._tasks.draw(self.np_random, options or {}, fresh=seed is not None)
        self._episode = Episode(task, self._robot)
        return self._observe(self._episode), self._episode.info(self._weights.terms(0.0, False, False, steps=0))

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one control step; see the class."""
        episode = self._running()
        episode.drive(*ROBOT.twist(*_checked(action)))
        terms = self._weights.terms(episode.progress, episode.success, episode.collision)
        return self._observe(episode), sum(terms.values()), episode.success, False, episode.info(terms)

    def render(self) -> NDArray[Any] | None:
        """Return what `render_mode` asks for, None where it asks for nothing."""
        if self.render_mode is None:
            gym.logger.warn('render() needs a render mode: gym.make("LabPointNav-v0", render_mode="rgb_array")')
            return None
        episode = self._running()
        if self.render_mode == "depth_array":
            return self._camera.depth(episode.stage.visible, episode.simulation.pose)
        return self._view.picture(episode.task.layout, episode.stage.visible, episode.simulation.pose)

    def close(self) -> None:
        """Free the renderer; may be called more than once."""
        self._view.close()
        self._episode = None

    def _running(self) -> Episode:
        if self._episode is None:
            raise gym.error.ResetNeeded("call reset() before step() or render()")
        return self._episode

    def _observe(self, episode: Episode) -> Observation:
        x, y, yaw = pose = episode.simulation.pose
        dx, dy = episode.task.pair.goal[0] - x, episode.task.pair.goal[1] - y
        bearing = math.atan2(dy, dx) - yaw
        v, w = episode.simulation.velocity
        seen: Observation = {
            "goal": np.array([min(math.hypot(dx, dy), GOAL_RANGE), math.cos(bearing), math.sin(bearing)], np.float32),
            "velocity": np.array(
                [min(max(v, ROBOT.v_min), ROBOT.v_max), min(max(w, -ROBOT.w_max), ROBOT.w_max)], np.float32
            ),
        }
        if self._observation == "lidar":
            seen["lidar"] = self._lidar.scan(episode.stage.solid, pose)
        elif self._observation == "depth":
            seen["depth"] = self._camera.depth(episode.stage.visible, pose).ravel()
        else:
            seen["rgb"], depth = self._camera.colour_and_depth(episode.stage.visible, pose)
            seen["depth"] = depth.ravel()
        return seen


def _observation_space(observation: str) -> spaces.Dict:
    rows, columns = IMAGE_SHAPE
    found: dict[str, spaces.Space[Any]] = {
        "goal": spaces.Box(np.array([0, -1, -1], np.float32), np.array([GOAL_RANGE, 1, 1], np.float32)),
        "velocity": spaces.Box(
            np.array([ROBOT.v_min, -ROBOT.w_max], np.float32), np.array([ROBOT.v_max, ROBOT.w_max], np.float32)
        ),
    }
    if observation == "lidar":
        found["lidar"] = spaces.Box(0.0, RANGE, (LIDAR_RAYS,), np.float32)
    else:
        found["depth"] = spaces.Box(0.0, RANGE, (rows * columns,), np.float32)
    if observation == "rgbd":
        found["rgb"] = spaces.Box(0, 255, (rows, columns, 3), np.uint8)
    return spaces.Dict(found)


def _controlled(control_dt: float) -> RobotSpec:
    looks = control_dt / (CHECK_STEPS * ROBOT.timestep)
    if not (math.isfinite(looks) and 1 <= round(looks) <= 40 and abs(looks - round(looks)) < 1e-6):
        raise OptionError(f"control_dt is {control_dt} s, expected a multiple of 0.025 s, at most 1 s")
    return replace(ROBOT, control_dt=control_dt)


def _checked(action: NDArray[np.float32]) -> tuple[float, float]:
    values = np.asarray(action, dtype=np.float64)
    if values.shape != (2,) or not np.isfinite(values).all():
        raise OptionError(f"action {str(action)[:80]} must be two finite numbers in [-1, 1]: forward, turn")
    return float(values[0]), float(values[1])
