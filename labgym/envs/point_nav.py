"""LabPointNav-v0: drive from the location of one protocol step to that of the next."""

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
from labgym.envs.pool import LayoutPool, PoolAddress
from labgym.envs.rewards import RewardWeights
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE, Camera, Lidar
from labgym.envs.simulation import CHECK_STEPS
from labgym.envs.stage import Senses
from labgym.envs.tasks import TaskSource
from labgym.envs.training import LayoutSource
from labgym.envs.view import ChaseView
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.navigation import METHODS, Method
from labgym.protocols import Protocol
from labgym.scenes import RayScene
from labgym.scenes.opengl import QUALITIES, Quality

Observation = dict[str, Any]

GOAL_RANGE = 50.0
"""Largest distance in the goal observation, meters."""

OBSERVATIONS = ("lidar", "depth", "rgbd")
RENDER_MODES = ("rgb_array", "depth_array")


class LabPointNavEnv(gym.Env[Observation, NDArray[np.float32]]):
    """Drive a robot through a chemistry laboratory, from the location of one protocol step to that of the next.

    ## Description

    An episode is one goal pair, or a drive between any two points of the floor. For a goal pair, the robot starts at
    rest at the goal pose of one protocol step, facing the device, and must come within 0.5 m of the goal pose of the
    next step. The robot is a differential-drive base (chassis radius
    0.27 m, acceleration 1.5 m/s² and 4 rad/s²) simulated in MuJoCo. Obstacles stop the robot but do not end the
    episode. An environment step lasts 0.1 s.

    ## Observation space

    A `Dict` of `goal`, `velocity` and the sensors chosen by the argument `observation`. Angles are counter-clockwise.

    - `goal`, float32 (3,): distance to the goal in meters, clipped to 50; cosine and sine of its bearing relative to
      the heading.
    - `velocity`, float32 (2,): forward velocity in [-0.3, 1.0] m/s; turn rate in [-1.5, 1.5] rad/s.
    - `lidar` (for "lidar"), float32 (180,): ranges from the robot's axis in meters, clipped to 10, in the plane 0.25 m
      above the floor. Ray i points -180 + 2 i degrees from the heading: ray 0 points backwards, ray 90 straight ahead.
      The lidar sees the solid boxes that stop the robot; the camera sees the visual shapes.
    - `depth` (for "depth" and "rgbd"), float32 (9216,): planar depth in meters, clipped to 10, of a level camera 0.2 m
      ahead of the axis and 0.5 m above the floor, with a horizontal field of view of 68 degrees. `reshape(72, 128)`
      gives the image, first row at the top. It is flat because learning libraries treat every three-dimensional box as
      an 8-bit image.
    - `rgb` (for "rgbd"), uint8 (72, 128, 3): the color image of the same camera.

    ## Action space

    `Box(-1, 1, (2,), float32)`: target velocities of the servos; values outside the box are clipped.

    - forward: [0, 1] maps to 0 to 1.0 m/s, [-1, 0] to -0.3 to 0 m/s.
    - turn: [-1, 1] maps to -1.5 to 1.5 rad/s, counter-clockwise positive.

    ## Reward

    The sum of `info["reward_terms"]`, weighted by the argument `weights`. With the default weights:

    - `progress`: +1 per meter by which the shortest path to the goal became shorter, measured on a 5 cm grid for a disc
      of radius 0.30 m (argument `distance_to_go`);
    - `success`: +10 when the goal is reached, once an episode;
    - `collision`: -0.1 per step in which the robot touched something;
    - `time`: -0.01 per step.

    ## Episode end

    `terminated` when the robot's center is within 0.5 m of the goal. `truncated` by Gymnasium's `TimeLimit` after 600
    steps (60 s); `gym.make(..., max_episode_steps=n)` changes the limit. After termination, call `reset`: further steps
    warn once, give no reward and stay terminated.

    ## Arguments

    - `split` ("test"): the split from which layouts are drawn. "val" and "test" hold the published layouts; "train"
      generates new ones.
    - `layout` (None): a fixed layout: a `labgym.layouts.Layout`, the path of a `.json` file, or a published id.
    - `protocol` (None): a fixed protocol: a `labgym.protocols.Protocol`, an id of the library, or the path of a `.json`
      file. By default the first protocol that the layout embeds.
    - `observation` ("lidar"): "lidar", "depth" or "rgbd".
    - `render_mode` (None): "rgb_array", an image from behind and above the robot; "depth_array", the image of the depth
      camera, float32 (72, 128), meters.
    - `profile` ("default"): thresholds that generated layouts satisfy: "default", "strict" or "paper".
    - `weights` (`RewardWeights()`): weights of the reward terms.
    - `episodes_per_layout` (8): for "train", number of episodes in a layout before the next one. Which layouts come
      after each other depends on the seed alone.
    - `control_dt` (0.1): duration of an action in seconds; a multiple of 0.025, at most 1.
    - `width`, `height` (480, 360): size of the "rgb_array" image in pixels.
    - `quality` ("fast"): "fine" renders the "rgb_array" image with shadows and reflections, which takes ten times as
      long without a GPU. Observations do not depend on it.
    - `exact` (False): readings of lidar and camera that are equal on every processor; otherwise the last bit of ranges
      depends on the instruction set. Evaluations use exact readings.

    - `distance_to_go` ("grid"): how the reward measures the way to the goal. "grid" is the shortest path on a 5 cm
      grid, which leaves out passages up to 0.15 m wider than the disc; "exact" is the shortest any-angle path, through
      every passage that the disc fits.
    - `training` ("rooms"): the layouts of "train": "rooms", one-room laboratories of the presets; "floors", those of
      the split floors-train; or a function of a module that returns
      training layout `number`, 0 to 10^7 - 1.
    - `pool` (None): a `labgym.envs.LayoutPool`, whose processes prepare the layouts of "train" in advance. It changes
      the time that `reset` takes and nothing else.

    `reset(seed=None, options=None)` accepts the options below; everything else is drawn from the seeded generator. If a
    seed is given, the episode depends only on the seed, the options and the arguments: equal seeds and actions give
    bit-identical observations.

    - "layout", "protocol": as the arguments.
    - "pair": an index into `labgym.navigation.goal_pairs(layout, protocol)`.
    - "start", (x, y, yaw), and "goal", (x, y) or (x, y, yaw): poses in the room frame, meters and radians, that replace
      the ends of the goal pair. If both are passed, no pair and no protocol is needed. At the start the robot must
      touch nothing in the simulation, and a path to the goal must exist for a disc of radius 0.30 m.

    ## Info

    `reset` and `step` return the same keys.

    - `pose`, `goal`: float64 (3,), x and y in meters, yaw in radians, room frame.
    - `distance`: distance from the robot's center to the goal, meters. `success`: whether it is at most 0.5 m.
    - `collision`: whether the robot touched something in this step. `contacts`: number of such steps in this episode.
    - `clearance`: distance from the chassis to the nearest footprint or wall, meters. Privileged.
    - `path_length`: length driven so far, meters.
    - `shortest_path_length`: length of the shortest any-angle path of the goal pair for a disc of radius 0.30 m,
      meters; inf if no path exists. Privileged.
    - `layout`, `protocol`: ids; the protocol's is empty if the layout has none. `pair`: index of the goal pair; -1 if
      the start and the goal were passed without a pair.
    - `time`: seconds since the start of the episode.
    - `reward_terms`: the weighted reward terms by name; zeros at reset.

    ## Errors

    An unknown split, layout, protocol, observation, render mode, quality, profile, method, option or pair raises
    `UnknownNameError`, which lists the valid names. An action that is not two finite numbers, a width or height
    below 1, and a start or goal that is outside the room, blocked or not a pose, raise `OptionError`. A broken file
    raises `DocumentError`.

    ## Versions

    - v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        split: str = "test",
        layout: Layout | str | Path | None = None,
        protocol: Protocol | str | Path | None = None,
        observation: str = "lidar",
        render_mode: str | None = None,
        profile: str = "default",
        weights: RewardWeights | None = None,
        episodes_per_layout: int = 8,
        control_dt: float = ROBOT.control_dt,
        width: int = 480,
        height: int = 360,
        quality: Quality = "fast",
        exact: bool = False,
        distance_to_go: Method = "grid",
        training: str | LayoutSource = "rooms",
        pool: LayoutPool | PoolAddress | None = None,
    ) -> None:
        if observation not in OBSERVATIONS:
            raise UnknownNameError("observation", observation, OBSERVATIONS)
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise UnknownNameError("render_mode", render_mode, RENDER_MODES)
        if quality not in QUALITIES:
            raise UnknownNameError("quality", quality, QUALITIES)
        if distance_to_go not in METHODS:
            raise UnknownNameError("distance_to_go", distance_to_go, METHODS)
        if min(width, height) < 1:
            raise OptionError(f"width and height must be at least 1 pixel, got {width} x {height}")
        self._robot = _robot_at(control_dt)
        self.render_mode = render_mode
        self.observation_space = _observation_space(observation)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._observation, self._exact, self._distance_to_go = observation, exact, distance_to_go
        senses = Senses("solid" if observation == "lidar" else "visual", distance_to_go)
        self._tasks = TaskSource(split, layout, protocol, profile, episodes_per_layout, training, pool, senses)
        self._weights = weights or RewardWeights()
        self._lidar, self._camera = Lidar(), Camera()
        self._view = ChaseView(width, height, quality)
        self._episode: Episode | None = None
        self._terminated = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the class describes options, observation and info."""
        super().reset(seed=seed)
        task = self._tasks.draw(self.np_random, options or {}, fresh=seed is not None)
        self._episode, self._terminated = Episode(task, self._robot, self._distance_to_go), False
        return self._observe(self._episode), self._episode.info(self._weights.terms(0.0, False, False, steps=0))

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one control step; the class describes action, observation, reward and info."""
        episode = self._running()
        episode.drive(*ROBOT.twist(*_checked(action)))
        if self._terminated:
            gym.logger.warn("step() after the end of the episode gives no reward; call reset()")
            terms = self._weights.terms(0.0, False, False, steps=0)
        else:
            terms = self._weights.terms(episode.progress, episode.success, episode.collision)
            self._terminated = episode.success
        return self._observe(episode), sum(terms.values()), self._terminated, False, episode.info(terms)

    def render(self) -> NDArray[Any] | None:
        """Return the image of the render mode, or None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn('render() needs a render mode: gym.make("LabPointNav-v0", render_mode="rgb_array")')
            return None
        episode = self._running()
        if self.render_mode == "depth_array":
            return self._camera.depth(episode.world.visible, episode.simulation.pose)
        return self._view.picture(episode.task.layout, episode.world.visible, episode.simulation.pose)

    def close(self) -> None:
        """Release the renderer; it is safe to call this more than once."""
        self._view.close()
        self._tasks.close()
        self._episode = None

    def _running(self) -> Episode:
        if self._episode is None:
            raise gym.error.ResetNeeded("call reset() before step() or render()")
        return self._episode

    def _visible(self, episode: Episode) -> RayScene:
        return episode.world.visible_exact if self._exact else episode.world.visible

    def _observe(self, episode: Episode) -> Observation:
        x, y, yaw = pose = episode.simulation.pose
        dx, dy = episode.task.pair.goal[0] - x, episode.task.pair.goal[1] - y
        bearing = math.atan2(dy, dx) - yaw
        v, w = episode.simulation.velocity
        observation: Observation = {
            "goal": np.array([min(math.hypot(dx, dy), GOAL_RANGE), math.cos(bearing), math.sin(bearing)], np.float32),
            "velocity": np.array(
                [min(max(v, ROBOT.v_min), ROBOT.v_max), min(max(w, -ROBOT.w_max), ROBOT.w_max)], np.float32
            ),
        }
        if self._observation == "lidar":
            solid = episode.world.solid_exact if self._exact else episode.world.solid
            observation["lidar"] = self._lidar.scan(solid, pose)
        elif self._observation == "depth":
            observation["depth"] = self._camera.depth(self._visible(episode), pose).ravel()
        else:
            observation["rgb"], depth = self._camera.colour_and_depth(self._visible(episode), pose)
            observation["depth"] = depth.ravel()
        return observation


def _observation_space(observation: str) -> spaces.Dict:
    rows, columns = IMAGE_SHAPE
    boxes: dict[str, spaces.Space[Any]] = {
        "goal": spaces.Box(np.array([0, -1, -1], np.float32), np.array([GOAL_RANGE, 1, 1], np.float32)),
        "velocity": spaces.Box(
            np.array([ROBOT.v_min, -ROBOT.w_max], np.float32), np.array([ROBOT.v_max, ROBOT.w_max], np.float32)
        ),
    }
    if observation == "lidar":
        boxes["lidar"] = spaces.Box(0.0, RANGE, (LIDAR_RAYS,), np.float32)
    else:
        boxes["depth"] = spaces.Box(0.0, RANGE, (rows * columns,), np.float32)
    if observation == "rgbd":
        boxes["rgb"] = spaces.Box(0, 255, (rows, columns, 3), np.uint8)
    return spaces.Dict(boxes)


def _robot_at(control_dt: float) -> RobotSpec:
    checks = control_dt / (CHECK_STEPS * ROBOT.timestep)
    if not (math.isfinite(checks) and 1 <= round(checks) <= 40 and abs(checks - round(checks)) < 1e-6):
        raise OptionError(f"control_dt is {control_dt} s, expected a multiple of 0.025 s, at most 1 s")
    return replace(ROBOT, control_dt=control_dt)


def _checked(action: NDArray[np.float32]) -> tuple[float, float]:
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    if values.shape != (2,) or not np.isfinite(values).all():
        shown = " ".join(repr(action).split())[:80]
        raise OptionError(f"action {shown} must be two finite numbers in [-1, 1]: forward, turn")
    return float(values[0]), float(values[1])
