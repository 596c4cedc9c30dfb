"""The NavDP-style policy: draw trajectories, follow the best that is clear of the obstacles seen, or turn."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field

from labgym.artefacts import artefacts
from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.geometry import Array, to_world
from labgym.navigation import Pose
from labgym.policies.arrival import planar_pose
from labgym.policies.data.situations import FRAME_PERIOD_S
from labgym.policies.distance_field import DistanceField
from labgym.policies.learned.maneuvers import (
    CameraPlanner,
    ManeuverOptions,
    Steps,
    TurnInPlace,
    free_side,
    goal_bearing,
    goal_point,
)
from labgym.policies.navdp.diffusion import DrawnTrajectories, Guidance, TrajectorySampler
from labgym.policies.navdp.network import Bytes, frame, load_navdp
from labgym.policies.navdp.seen_obstacles import SeenObstacles, checked_velocities, clear_ways
from labgym.policies.options import NonNegative, PolicyOptions
from labgym.policies.policy import EpisodeStart, GoalKind, Observation, Sensors
from labgym.policies.tracking import PathTracker, velocities_to_action

TRAJECTORY_RANGE_M = 4.5
"""Distance up to which obstacles count for trajectories, meters: more than the longest one."""

CHECK_RANGE_M = 1.5
"""Distance up to which they count for the next control steps, meters: more than the robot needs to brake."""


class NavDPOptions(ManeuverOptions):
    """How drawn trajectories become motion.

    Attributes:
        samples: number of trajectories drawn at a time.
        choose: "critic" follows the trajectory with the highest value, "first" the first one drawn.
        commit_after_turn: the distance for the first trajectory after a turn, which leads away from the goal.
        shortest: shorter trajectories mean "stop", meters.
        stop: value below which no trajectory is safe and the robot turns in place; None never turns for that reason.
        turn_angle: angle of a turn before trajectories are drawn again, radians.
        turn_steps: control steps after which a turn ends in any case, because something may block it.
        remembers: whether the network sees earlier frames. False shows the present frame in their place.
        veto: distances that a trajectory has to keep from all obstacles seen so far, meters, in order: the next one
            counts if no trajectory keeps the previous one. Empty follows trajectories by the critic's value alone.
        veto_ahead: length over which it has to keep that distance, meters.
        redraws: further draws if no trajectory is clear.
        guided: number of denoising steps, from the end, in which trajectories are pushed away from the obstacles seen.
        margin: distance from which they push, meters.
        check: distances that the robot has to keep from the obstacles seen in the next control steps, braking included,
            meters, in order: it slows down to do so, and draws other trajectories if only a later distance can be kept.
            It stops if none can. Empty follows the trajectory unchecked.
        settled: turn rate below which the robot sets off after a turn in place, rad/s: faster, it would leave its path.
            None sets off at once.
    """

    samples: Steps = 12
    choose: Literal["critic", "first"] = "critic"
    commit: NonNegative = 0.5
    commit_after_turn: NonNegative = 1.2
    patience: Steps = 20
    shortest: NonNegative = 0.5
    stop: float | None = -1.5
    turn_angle: NonNegative = 0.5
    turn_steps: Steps = 12
    remembers: bool = True
    veto: tuple[NonNegative, ...] = (0.42, 0.36, 0.30)
    veto_ahead: NonNegative = 1.2
    redraws: Annotated[int, Field(ge=0)] = 2
    guided: Annotated[int, Field(ge=0)] = 4
    margin: NonNegative = 0.45
    check: tuple[NonNegative, ...] = (0.36, 0.28)
    settled: NonNegative | None = 0.5

    @property
    def maps(self) -> bool:
        """Whether any part looks at the obstacles seen so far."""
        return bool(self.veto) or bool(self.check) or self.guided > 0


class NavDPPolicy(CameraPlanner):
    """Sees color and depth of the present and up to a second ago, and draws trajectories to the goal by diffusion.

    A map of the obstacles that the depth camera has shown, in the frame of the odometry, vetoes trajectories, guides
    the denoising and checks the next control steps. It assumes that obstacles stay: one that has left remains on it.

    Without a goal (`EpisodeStart.goal_kind` "none") it explores: the network was trained with and without goals.

    Args:
        weights: folder of `config.json` and `weights.safetensors`; None uses the published ones.
        options: how trajectories become motion, a `NavDPOptions` or a mapping of those that differ from the defaults.

    Raises:
        DocumentError: the weights cannot be read.
        UnknownNameError: an option does not exist.
        OptionError: an option is outside its limits.
        MissingDependencyError: diffusers is not installed.
    """

    name: ClassVar[str] = "navdp"
    observation: ClassVar[Sensors] = "rgbd"
    goal_kinds: ClassVar[tuple[GoalKind, ...]] = ("point", "none")
    options_type: ClassVar[type[PolicyOptions]] = NavDPOptions

    def __init__(
        self, weights: str | Path | None = None, options: NavDPOptions | Mapping[str, Any] | None = None
    ) -> None:
        self._folder = artefacts("policies") / "navdp" if weights is None else Path(weights)
        self._sampler = TrajectorySampler(load_navdp(self._folder))
        self._config = self._sampler.network.config
        self._options = NavDPOptions.of(options)
        self._begin(ROBOT, 0)

    def reset(self, episode: EpisodeStart) -> None:
        """Forget all frames, trajectories and obstacles."""
        self._begin(episode.robot, int(episode.rng.integers(2**62)), episode.goal_kind == "point", episode.task.noise)

    def planned_path(self) -> Array | None:
        """Return the path that is followed; None during a turn in place."""
        return None if self._tracker is None else self._tracker.path

    def _begin(self, robot: RobotSpec, seed: int, with_goal: bool = True, noisy: bool = False) -> None:
        self._begin_maneuvers(robot, self._options)
        self._with_goal = with_goal
        self._generator = torch.Generator().manual_seed(seed)
        self._stride = max(1, round(FRAME_PERIOD_S / robot.control_dt))
        memory = self._config.network.memory
        self._frames: deque[Bytes] = deque(maxlen=(memory - 1) * self._stride + 1)
        self._blocked = False
        self._seen = SeenObstacles(robot, noisy)

    def act(self, observation: Observation) -> Array:
        """Face the goal first, then draw, choose and follow or turn in place; back off from unseen obstacles."""
        depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
        self._remember(np.asarray(observation["rgb"], dtype=np.uint8), depth)
        pose = planar_pose(observation["odometry"])
        speed, turning = (float(value) for value in observation["velocity"])
        if self._options.maps:
            self._seen.add(depth, pose)
        if self._blockage.blocked(speed):
            self._tracker = None
            self._stuck.clear()
            self._blocked = True
        if self._blockage.backing:
            return np.asarray(self._blockage.back_off(), dtype=np.float64)
        action = self._checked(self._drive(observation, depth), pose, (speed, turning))
        self._blockage.note(float(action[0]) * self._robot.v_max)
        return action

    def _drive(self, observation: Observation, depth: NDArray[np.float32]) -> Array:
        odometry = np.asarray(observation["odometry"], dtype=np.float64)
        pose = planar_pose(odometry)
        bearing = goal_bearing(observation) if self._with_goal else 0.0
        self._stuck.add(odometry[:2])
        self._step += 1
        if self._facing.turning(bearing):
            return turn_towards(bearing, self._robot)
        if self._turn is not None and not self._turn.over(pose[2]):
            return self._turn.action(self._robot)
        if self._blocked or self._stuck.stuck:
            self._blocked = False
            return self._turn_away(depth, bearing, pose)
        turning, settled = abs(float(observation["velocity"][1])), self._options.settled
        if self._tracker is None and settled is not None and turning > settled:
            return velocities_to_action(0.0, 0.0, self._robot)
        if self._tracker is None or self._turn is not None or self._commitment.over(self._step, odometry[:2]):
            path = self._chosen(goal_point(observation) if self._with_goal else None, pose)
            if path is None:
                return self._turn_away(depth, bearing, pose)
            self._tracker = PathTracker(path, self._robot, turning=self._tracker is None)
            distance = self._options.commit_after_turn if self._turn else self._options.commit
            self._commitment.begin(self._step, odometry[:2], distance)
            self._turn = None
        return self._tracker.action(pose, float(observation["velocity"][0]))

    def _chosen(self, goal: tuple[float, float] | None, pose: Pose) -> Array | None:
        """Return the path to follow, (25, 2) in the start frame, meters; None if no trajectory is safe.

        If the map vetoes all trajectories that the critic holds safe, others are drawn.
        """
        options = self._options
        clearance = self._seen.around(pose[:2], TRAJECTORY_RANGE_M) if options.maps else None
        guidance = None
        if clearance is not None and options.guided:
            scale = self._config.diffusion.scale
            guidance = Guidance(clearance, pose, options.margin, scale, options.guided)
        for _ in range(1 + options.redraws if options.veto else 1):
            drawn = self.draw(goal, guidance)
            ways = np.stack([to_world(np.vstack([np.zeros((1, 2)), each]), pose) for each in drawn.trajectories])
            for clear in self._allowed(ways, clearance):
                best = self._best(drawn, clear)
                if best is not None:
                    return np.asarray(ways[best])
        return None

    def _allowed(self, ways: Array, clearance: DistanceField | None) -> Iterator[NDArray[np.bool_]]:
        """Yield the ways (n, 25, 2) that the map does not veto, (n,), for each distance of the option; else all."""
        if clearance is None or not self._options.veto:
            yield np.ones(len(ways), dtype=bool)
            return
        for radius in self._options.veto:
            yield clear_ways(ways, clearance, radius, self._options.veto_ahead)

    def _checked(self, action: Array, pose: Pose, velocity: tuple[float, float]) -> Array:
        """Return the action, slower if the next control steps would come too near to an obstacle."""
        v, w = self._robot.twist(float(action[0]), float(action[1]))
        if not self._options.check or v <= 0.0:
            return action
        clearance = self._seen.around(pose[:2], CHECK_RANGE_M)
        slow, turn = 0.0, w
        for radius in self._options.check:
            slow, turn = checked_velocities((v, w), velocity, pose, clearance, radius, self._robot)
            if slow > 0.0:
                break
            self._commitment.end()
        if slow == v:
            return action
        if slow == 0.0:
            self._tracker = None
        return velocities_to_action(slow, turn, self._robot)

    def drawn_from(
        self, rgb: Bytes, depth: NDArray[np.floating[Any]], goal: tuple[float, float], seed: int = 0
    ) -> DrawnTrajectories:
        """Draw trajectories from one frame, as at the start of an episode.

        Args:
            rgb: (72, 128, 3).
            depth: (72, 128), planar, meters.
            goal: (x, y) in the robot frame, meters.
            seed: random seed of the noise.
        """
        self._begin(self._robot, seed)
        self._remember(rgb, depth)
        return self.draw(goal)

    def _remember(self, rgb: Bytes, depth: NDArray[np.floating[Any]]) -> None:
        self._frames.append(frame(rgb, depth, self._config.network.shrink))

    def draw(self, goal: tuple[float, float] | None, guidance: Guidance | None = None) -> DrawnTrajectories:
        """Draw trajectories from the latest frames and value them.

        Args:
            goal, guidance: as for `TrajectorySampler.draw`.
        """
        options, memory = self._options, self._config.network.memory
        ages = [self._stride * age if options.remembers else 0 for age in range(memory - 1, -1, -1)]
        frames = [self._frames[max(0, len(self._frames) - 1 - age)] for age in ages]
        return self._sampler.draw(frames, goal, options.samples, options.shortest, self._generator, guidance)

    def _best(self, drawn: DrawnTrajectories, clear: NDArray[np.bool_]) -> int | None:
        """Return the index of the trajectory to follow; None if none is safe or all mean "stop".

        Args:
            drawn: trajectories and their values. clear: (n,), those that the map does not veto.
        """
        moves = (np.abs(drawn.trajectories[:, -1]).sum(axis=1) > 0.0) & clear
        if self._options.choose == "first":
            return int(np.argmax(moves)) if moves.any() else None
        values = np.where(moves, drawn.values, -np.inf)
        best = int(np.argmax(values))
        if not moves.any() or (self._options.stop is not None and values[best] < self._options.stop):
            return None
        return best

    def _turn_away(self, depth: NDArray[np.float32], bearing: float, pose: Pose) -> Array:
        """Begin to turn in place, or continue to turn, to the freer side or to a goal that is abeam."""
        if self._turn is None:
            side, options = free_side(depth, bearing), self._options
            self._turn = TurnInPlace(side, pose[2], options.turn_angle, patience=options.turn_steps)
        self._turn.begin(pose[2])
        self._tracker = None
        self._stuck.clear()
        return self._turn.action(self._robot)
