"""The environment of all ids: drive from the location of one protocol step to that of the next."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.envs.config import RENDER_MODES, PointNavConfig
from labgym.envs.drive_source import ladder
from labgym.envs.episode import RunningEpisode, conditioned, randomized, stream
from labgym.envs.labnav.curriculum import Climb
from labgym.envs.parts.protocols import Actions, Sensor, Tasks
from labgym.envs.presets import configured
from labgym.envs.sensors import Camera
from labgym.envs.state import State
from labgym.envs.view import ChaseView
from labgym.envs.window import PictureWindow
from labgym.errors import OptionError

Observation = dict[str, Any]


class LabPointNavEnv(gym.Env[Observation, Any]):
    """Drive a robot through a chemistry laboratory, from the location of one protocol step to that of the next.

    ## Description

    An episode is one goal pair, or a drive between any two points of the floor. For a goal pair, the robot starts at
    rest at the goal pose of one protocol step, facing the device, and must come within 0.5 m of the goal pose of the
    next step. The robot is a differential-drive base (chassis radius 0.27 m, acceleration 1.5 m/s² and 4 rad/s²)
    simulated in MuJoCo. Obstacles stop the robot but do not end the episode. An environment step lasts 0.1 s.

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
    - `time`: -0.01 per step;
    - `failure`: 0, and then no term; in the ids of LabNav -5 when a rule ends the drive without success.

    ## Episode end

    `terminated` when the robot's center is within 0.5 m of the goal. `truncated` by Gymnasium's `TimeLimit` after 600
    steps (60 s); `gym.make(..., max_episode_steps=n)` changes the limit. After termination, call `reset`: further steps
    warn once, give no reward and stay terminated.

    ## Arguments

    - `split` ("train"): the split from which layouts are drawn. "train" generates new rooms, "floors-train" new
      floors; "val" and "test" hold published rooms, "floors-val", "floors-seen" and "floors-test" published floors and
      the drives of their suites. Drives on floors are long: pass `max_episode_steps=1500` to `gym.make`.
    - `layout` (None): a fixed layout: a `labgym.layouts.Layout`, the path of a `.json` file, or a published id.
    - `protocol` (None): a fixed protocol: a `labgym.protocols.Protocol`, an id of the library, or the path of a `.json`
      file. By default the first protocol that the layout embeds.
    - `observation` ("lidar"): "lidar", "depth" or "rgbd".
    - `render_mode` (None): "rgb_array", an image from behind and above the robot; "depth_array", the image of the depth
      camera, float32 (72, 128), meters; "human", the former image in a window at every `reset` and `step`, in real
      time (needs a display and pygame, extra `train`). `render` may be called in any thread: one thread of the
      process draws for all. A process that was forked after the first image cannot draw; start it by "spawn".
    - `profile` ("default"): thresholds that generated layouts satisfy: "default", "strict", "paper" or "code".
    - `weights` (`RewardWeights()`): weights of the reward terms.
    - `episodes_per_layout` (64): number of episodes that a training layout serves before a new one takes its place. An
      environment stays in a layout for up to 8 episodes in a row. Its first 32 layouts are new and stay resident; then
      it returns to one of them, drawn at random, every 8 episodes. With 8 or fewer, every layout is new. The order of
      the layouts depends on the seed alone: it is the same in any process and at any number of workers.
    - `control_dt` (0.1): duration of an action in seconds; a multiple of 0.025, at most 1.
    - `width`, `height` (480, 360): size of the image of "rgb_array" and "human" in pixels.
    - `quality` ("fast"): "fine" renders the "rgb_array" image with shadows and reflections, which takes ten times as
      long without a GPU. Observations do not depend on it.
    - `exact` (False): readings of lidar and camera that are equal on every processor; otherwise the last bit of ranges
      depends on the instruction set. Evaluations use exact readings.
    - `distance_to_go` ("grid"): how the reward measures the way to the goal. "grid" is the shortest path on a 5 cm
      grid, which leaves out passages up to 0.15 m wider than the disc; "exact" is the shortest any-angle path, through
      every passage that the disc fits.
    - `training` ("rooms"): the layouts of "train": "rooms", one-room laboratories of the presets; "empty", rooms
      without furniture and with drives between free poses; or a function of a module that returns training layout
      `number`, 0 to 10^7 - 1.
    - `pool` (None): a `labgym.envs.LayoutPool`, whose processes prepare training layouts in advance. It changes the
      time that `reset` takes and nothing else.
    - `resident_mb` (512): prepared layouts of a split stay in memory up to this size for each process, and a reset in
      them is fast. With the lidar, a room takes 2 MB and a floor of several rooms 3 MB; with a camera 20 MB and 30 MB.
      A resident training layout beyond this size is prepared again, in 0.1 to 0.3 s. Of other layouts, the last 16
      stay.

    The parts of the environment can be replaced. A part is an object with the members of an interface of
    `labgym.envs.parts.protocols`, the name of a kind such as "lidar", or a mapping with "kind" and the arguments of its
    class, such as `{"kind": "lidar", "rays": 90, "noise": [{"kind": "gaussian", "sigma": 0.03}]}`; the kind
    "module:Class" is a class of the user's own, which a configuration file may not name. The environment works on
    copies of its parts.

    Kinds of sensors: "goal", "velocity", "lidar", "depth", "rgb", "odometry" (dead reckoning with drift),
    "announced_goal" and "odometry_velocity" (goal and velocity with the errors of that odometry), "bumper", "joint"
    (several as one vector); privileged: "pose", "place", "occupancy" (the map around the robot), "segmentation" (the
    asset of each pixel). Noise: "gaussian", "dropout", "quantization", "rim" (losses at rims), "redwood" (a PrimeSense
    camera). Reward terms: "progress", "success", "failure", "collision", "time", "clearance", "goal", "function".
    Endings: "touch", "rest", "stop", "contact", "touched" (contacts by name), "stuck", "limit" (a time), "spill",
    "goal". Actions: "velocity" (with a third component STOP, and a delay, on request), "slipping" (the same with errors
    of the wheels), "braking" (the same until a brake parks the robot near the goal), "discrete" (with the errors
    "locobot" or "robothor" on request). Their classes in `labgym.envs.parts` describe arguments and sources.

    - `config` (None): a `PointNavConfig`, a mapping of its fields, or the path of a .json or .yaml file of one; other
      arguments replace its fields.
    - `tasks` (None): an object that chooses the task of each episode (`Tasks`), instead of the arguments above.
    - `sensors` (None): the entries of the observation, instead of those of `observation`.
    - `rewards` (None): the terms of the reward, instead of those of `weights`.
    - `endings` (`[TouchEnding(0.5)]`): the rules that end an episode; the first that gives a verdict decides.
    - `onward` (()): names of endings after whose failure the next drive of the episode begins, if there is one.
    - `measures`: the entries of the info; by default those listed below.
    - `actions` ("velocity"): how an action becomes commands. `physics` ("mujoco"): "planar" is the compiled kernel
      (extra `fast`), which docs/performance.md compares with MuJoCo.
    - `robot` ("differential"): the robot; "holonomic" also moves sideways and has three components of action and
      velocity; "wheels" stands on driven wheels and casters; `{"kind": "mjcf", "path": "robot.xml"}` is read from a
      file. docs/robots.md describes them and their dimensions. Goals are planned for a disc of radius 0.30 m, into
      which every robot must fit; at a start it is the differential robot that must touch nothing.
    - `interactive` (False): drawers, doors, sashes, stools, trolleys and boxes move when they are pushed, and sensors
      see them where they are. `loose` (False): objects on surfaces, too. Progress, shortest paths and the sensor
      "occupancy" are those of the layout as it was. MuJoCo only, without exact readings.
    - `conditions` (()): what is in the episodes beyond their layouts: "payload" (a beaker of liquid on the deck),
      "leg_payload" (the same in some drives of several), "glass" (panes that are on no map, and what sensors see of
      glass and steel), "wet_floor" (puddles in which odometry errs more), "changes" (things that stand in the way, some
      of which can be pushed, and open drawers and shut doors that are not on the map), "station" (the furniture at the
      goal stands off its place on the map), "parked" (things that every map shows), "people" (who walk between
      workplaces), "contacts" (checked after every physics step); see docs/conditions.md.
    - `randomizations` (()): changes that are drawn anew for each episode: "mass", "friction", "sensor_pose", "noise",
      "appearance", or objects of the user's own (docs/robots.md). The measure "randomization" has the drawn values.

    `reset(seed=None, options=None)` accepts the options below; everything else is drawn from the seeded generator. If a
    seed is given, the episode depends only on the seed, the options and the arguments: equal seeds and actions give
    bit-identical observations.

    - "layout", "protocol": as the arguments.
    - "pair": an index into `labgym.navigation.goal_pairs(layout, protocol)`; in a published floor that the environment
      drew, with no protocol passed, into the drives of the suite of its split.
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

    An unknown argument, split, layout, protocol, observation, render mode, quality, profile, method, part, option or
    pair raises `UnknownNameError`, which lists the valid names. An action that is not two finite numbers, an argument
    out of range or of the wrong type, and a start or goal that is outside the room, blocked or not a pose, raise
    `OptionError`. A broken file raises `DocumentError`.

    ## Environments

    All ids are this class with another configuration (`labgym.envs.presets`), and take the same arguments and options.
    `LabPointNav-v0` is described above. `LabFloorNav-v0` differs in the following:

    - `split`: "floors-train", new floors.
    - The robot must arrive and stop: `terminated` when it is within 0.36 m of the goal, slower than 0.05 m/s and
      0.1 rad/s.
    - `distance_to_go`: "exact". `shortest_path_length`: to the disc of 0.36 m around the goal, on the side that is
      nearest by driving.
    - Further info: `is_success`, whether the episode has ended in success; `cost`, number of control steps with a
      contact during the action; `ending`, the name of the rule that ended the drive, or ""; `achieved_goal` and
      `desired_goal`, float64 (2,), positions of robot and goal.

    All ids draw training layouts by default; name another split, such as `split="test"` or `split="floors-test"`, to
    evaluate.

    | id | default split | limit, actions |
    |---|---|--:|
    | `LabPointNav-v0` | "train" | 600 |
    | `LabFloorNav-v0`, `LabFloorNavDepth-v0`, `LabFloorNavRGBD-v0`, `LabFloorNavGoal-v0` | "floors-train" | 1500 |
    | `LabFloorNavDiscrete-v0` | "floors-train" | 500 |
    | `LabProtocolNav-v0` | "floors-train" | 6000 |
    | `LabNavAisle-v0`, `LabNavMoved-v0`, `LabNavPeople-v0`, `LabNavOdometry-v0` | "floors-train" | 1200 |
    | `LabNavMovedFixed-v0`, `LabNavDock-v0`, `LabNavGlass-v0`, `LabNavCarry-v0` | "floors-train" | 1200 |
    | `LabNavShift-v0` | "floors-train" | 12000 |

    - `LabFloorNavDepth-v0`, `LabFloorNavRGBD-v0`: `LabFloorNav-v0` with depth or color images.
    - `LabFloorNavDiscrete-v0`: `LabFloorNav-v0` with the action space `Discrete(4)`: 0 STOP, 1 forward by 0.25 m,
      2 left and 3 right by 15 degrees. An action lasts until the robot rests, about 1 s. STOP ends the episode, with
      success within 0.36 m.
    - `LabFloorNavGoal-v0`: `LabFloorNav-v0` with goals that can be relabeled, for hindsight experience replay;
      described by `labgym.envs.goal_env.LabFloorNavGoalEnv`.
    - `LabProtocolNav-v0`: `LabFloorNav-v0` with all drives of a protocol in one episode: where a goal is reached, the
      next drive begins. Further info: `leg`, the drive in progress, from 0, and `legs`, their number; the other
      entries are those of the drive in progress. The options "start" and "goal" do not exist.
    - `LabNavAisle-v0` to `LabNavCarry-v0`: the tasks of LabNav; docs/labnav-tasks.md describes them, with the reward of
      each. `level` (2) is 0 to 3; level 0 is for learners, and no suite has it.
      `stop` ("brake"): once the robot is near the announced goal by its odometry, the evaluator's brake brings it to
      rest, and the drive ends there. With "action", the action has a third component instead, which is STOP above 0.5
      in 5 steps in a row.
      `curriculum` (None): "mixed" draws each episode from rooms and all levels up to `level`; "tasks" from those of
      aisle, people, odometry and glass, too; "rising" begins in rooms and climbs by the success rate of the last 10
      episodes, so that an episode also depends on those before. With `floors` there are no rooms: level 0 is first.
      `floors` (None): the folder of a pack of floors with their episodes (`labgym train floors`); the options of
      `reset` are then "floor" and "episode", numbers.
    - `LabNavMovedFixed-v0`: `LabNavMoved-v0` at levels 1 and 2 with things that stand fast, also those that the robot
      could push there: it drives round them. It is no task of the figure; the vector kernel has it.
    - `LabNavShift-v0`: likewise, with all drives of a shift in one episode, and the further info `leg` and
      `legs`. The next drive begins after STOP or the brake, after 30 s without progress, after a spill, and after
      120 s; touching a person ends the episode.

    ## Versions

    - v0: first version of all ids.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 10}  # noqa: RUF012

    def __init__(
        self,
        split: str | None = None,
        config: PointNavConfig | Mapping[str, Any] | str | Path | None = None,
        **options: Any,
    ) -> None:
        """Make an environment.

        Args:
            split: as an option.
            config: a configuration, a mapping of its fields, or the path of a .json or .yaml file of one.
            options: fields of `PointNavConfig`, which replace those of `config`.

        Raises:
            LabgymError: an argument does not exist, or its value is out of range or of the wrong type.
        """
        if split is not None:
            options["split"] = split
        config = configured(config, options)
        curriculum = config.curriculum
        self._climb = None if curriculum is None else Climb(curriculum)
        self._rungs = ladder(config)
        self._equip(*self._rungs[-1])
        self.render_mode = config.render_mode
        self.observation_space = spaces.Dict({sensor.name: sensor.space for sensor in self._sensors})
        self.action_space = self._actions.space(self._robot)
        self._camera = Camera()
        self._view = ChaseView(config.width, config.height, config.quality, self._robot, config.moving)
        self._window = PictureWindow(1.0 / config.control_dt) if config.render_mode == "human" else None
        self._streams: dict[str, np.random.Generator] = {}
        self._episode: RunningEpisode | None = None
        self._terminated = self._truncated = False

    def _equip(self, config: PointNavConfig, tasks: Tasks) -> None:
        """Take copies of the parts of a configuration."""
        self._config, self._tasks = config, tasks
        self._sensors, self._terms, self._endings, self._actions, self._robot, measures = copy.deepcopy(
            (config.observed, config.reward_terms, config.endings, config.actions, config.robot, config.measures)
        )
        self._randomizations, self._conditions = copy.deepcopy((config.randomizations, config.conditions))
        self._observed: tuple[Sensor, ...] = self._sensors
        self._entries = [(measure.name, measure.value) for measure in measures]

    @property
    def config(self) -> PointNavConfig:
        """The configuration; of a curriculum, that of the rung of the episode."""
        return self._config

    @property
    def climb(self) -> list[int]:
        """The rung of the episode on the ladder of the curriculum, from 0, and the results on it; [] without one.

        `resume_climb` goes on from it, so that a training that resumes does not begin on the first rung.
        """
        return [] if self._climb is None else self._climb.state

    def resume_climb(self, state: Sequence[int]) -> None:
        """Go on from a former value of `climb`.

        Raises:
            OptionError: it is not one of this ladder.
        """
        if self._climb is not None:
            self._climb.restore(state)

    @property
    def tasks(self) -> Tasks:
        """The source of the tasks."""
        return self._tasks

    @property
    def actions(self) -> Actions:
        """How actions become commands in the episode: privileged, and to be read only."""
        actions: Actions = self._actions
        return actions

    @property
    def state(self) -> State:
        """The state of the episode: privileged, and to be read only.

        Raises:
            ResetNeeded: before the first `reset`.
        """
        return self._running().state

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the class describes options, observation and info."""
        if not isinstance(options, Mapping | None):
            raise OptionError(f"reset options are a {type(options).__name__}, expected a dict")
        super().reset(seed=seed)
        if self._climb is not None:
            if self._terminated and self._episode is not None:
                self._climb.record(self._episode.state.success)
            self._equip(*self._rungs[self._climb.next(self.np_random)])
        task = self._tasks.draw(self.np_random, options or {}, fresh=seed is not None)
        (rng,) = self.np_random.spawn(1)
        task, conditions = conditioned(task, self._conditions, rng)
        setting, drawn, self._observed = randomized(
            task, self._config, self._robot, self._sensors, self._randomizations, rng
        )
        self._episode = episode = RunningEpisode(task, self._robot, self._config, setting, conditions)
        self._terminated = self._truncated = False
        episode.state.randomization = drawn
        names = (*(sensor.name for sensor in self._sensors), "actions")
        self._streams = {name: stream(rng, name) for name in names}
        for sensor in self._observed:
            sensor.reset(episode.state, self._streams[sensor.name])
        self._actions.reset(episode.state, self._streams["actions"])
        self._begin_drive(episode.state)
        episode.state.terms = {term.name: term.weight * 0.0 for term in self._terms}
        self._judge(episode.state)
        self._show(episode.state)
        return self._observation(episode.state), self._info(episode.state)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Carry out one action; the class describes action, observation, reward and info."""
        episode = self._running()
        state = episode.state
        commands = self._actions.commands(action, state, self._streams["actions"])
        state.stop = self._actions.is_stop(action)
        episode.drive(commands)
        self._judge(state)
        if self._terminated or self._truncated:
            gym.logger.warn("step() after the end of the episode gives no reward; call reset()")
            state.terms = {term.name: term.weight * 0.0 for term in self._terms}
        else:
            state.terms = {term.name: term.weight * term.value(state) for term in self._terms}
            if state.verdict is not None:
                self._end_drive(episode)
        reward = sum(state.terms.values())
        self._show(state)
        return self._observation(state), reward, self._terminated, self._truncated, self._info(state)

    def next_drive(self) -> Observation:
        """Begin the next drive of the episode from where the robot is, whatever became of this one.

        Returns:
            the observation, with the goal of the next drive.

        Raises:
            ResetNeeded: before the first `reset`.
            OptionError: this drive is the last one.
        """
        episode = self._running()
        if episode.last:
            raise OptionError("this drive is the last one of the episode: call reset()")
        self._terminated = self._truncated = False
        episode.go_on()
        self._begin_drive(episode.state)
        return self._observation(episode.state)

    def render(self) -> NDArray[Any] | None:
        """Return the image of the render mode; None without one, or if a window shows it."""
        if self.render_mode is None:
            gym.logger.warn('render() needs a render mode: gym.make("LabPointNav-v0", render_mode="rgb_array")')
            return None
        state = self._running().state
        if self.render_mode == "depth_array":
            return self._camera.depth(state.rays("visual"), state.pose)
        return self._picture(state) if self._window is None else None

    def close(self) -> None:
        """Release the renderer and the window; it is safe to call this more than once."""
        self._view.close()
        if self._window is not None:
            self._window.close()
        for _, tasks in self._rungs:
            tasks.close()
        self._episode = None

    def _running(self) -> RunningEpisode:
        if self._episode is None:
            raise gym.error.ResetNeeded("call reset() before step() or render()")
        return self._episode

    def _picture(self, state: State) -> NDArray[np.uint8]:
        layout = state.fixtures.layout if state.task.pushable else state.task.layout
        simulation = self._running().simulation
        return self._view.picture(layout, state.fixtures.visible, state.pose, simulation, state.bodies)

    def _show(self, state: State) -> None:
        if self._window is not None:
            self._window.show(self._picture(state))

    def _begin_drive(self, state: State) -> None:
        for part in (*self._terms, *self._endings):
            part.reset(state)

    def _judge(self, state: State) -> None:
        """Set the verdict of the endings."""
        for ending in self._endings:
            verdict = ending.verdict(state)
            if verdict is not None:
                state.verdict, state.ending = verdict, ending.name
                return
        state.verdict, state.ending = None, ""

    def _end_drive(self, episode: RunningEpisode) -> None:
        """End the episode, or begin the next drive of a task that has one."""
        onward = episode.state.success or episode.state.ending in self._config.onward
        if onward and not episode.last:
            episode.go_on()
            self._begin_drive(episode.state)
        else:
            self._truncated = episode.state.verdict == "truncation"
            self._terminated = not self._truncated

    def _observation(self, state: State) -> Observation:
        return {sensor.name: sensor.reading(state, self._streams[sensor.name]) for sensor in self._observed}

    def _info(self, state: State) -> dict[str, Any]:
        return {name: value(state) for name, value in self._entries}
