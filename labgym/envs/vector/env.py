"""Many point navigation environments that step together on the planar kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from labgym.envs.config import PointNavConfig
from labgym.envs.distance_to_go import GridDistanceToGo
from labgym.envs.drive_source import task_source
from labgym.envs.parts.actions import VelocityActions
from labgym.envs.parts.endings import RestEnding
from labgym.envs.parts.protocols import Tasks
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.parts.rewards import ProgressTerm
from labgym.envs.parts.robots import DifferentialDrive
from labgym.envs.parts.vectors import GoalSensor, VelocitySensor
from labgym.envs.planar.batch import PlanarBatch
from labgym.envs.planar.routes import CompiledDistanceToGo, compiled_to_go
from labgym.envs.presets import configured
from labgym.envs.vector.arguments import PointNavVectorEnv
from labgym.envs.vector.columns import (
    ENDINGS,
    GOES_ON,
    MEASURES,
    REMEDY,
    TERMS,
    VERDICTS,
    Columns,
    ProgressColumn,
    RestColumn,
    check_measures,
    check_parts,
    reading,
)
from labgym.envs.world import world_of
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.gpu.batch import DeviceBatch

Observations = dict[str, NDArray[np.float32]]


class VectorPointNavEnv(PointNavVectorEnv):
    """Many `LabPointNavEnv` with physics="planar", stepped together on threads, outside of the interpreter lock.

        envs = gym.make_vec("labgym:LabPointNav-v0", num_envs=64, vectorization_mode="vector_entry_point")

    makes one where all parts are supported (`labgym.envs.vector`). Observations, rewards, ends of episodes and
    infos equal those of single environments with the same arguments and seeds to the bit. Each environment draws its
    own layouts.

    The standard parts are supported: goal, velocity, one lidar and one depth camera without noise, the terms of
    `RewardWeights` with failure and clearance, the endings touch, rest and contact, velocity actions, the differential
    drive, and the measures. Any other part is refused when the environment is made; `ProcessPointNavEnv` has them.

    Attributes:
        autoreset_mode: when an environment whose episode ended is reset.

    Args:
        num_envs: number of environments.
        autoreset_mode: NEXT_STEP (default), SAME_STEP or DISABLED, as in Gymnasium.
        max_episode_steps: number of steps after which an episode is truncated; None for no limit.
        threads: number of threads; None for one per processor that this process may use. It changes the speed alone.
        device: None (default) for threads of the processor. The name of a device of Warp (extra `warp`), "cuda",
            "cuda:1" or "cpu", steps the robots there; it also has several lidars and cameras. Its results
            are not those of single environments to the bit: docs/performance.md states how far they agree.
        config, options: as of `LabPointNavEnv`.

    Raises:
        OptionError: a value is out of range, or a part is not supported.
        LabgymError: as `LabPointNavEnv`.
        MissingDependencyError: numba is not installed (extra `fast`).
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        threads: int | None = None,
        device: str | None = None,
        config: Any = None,
        **options: Any,
    ) -> None:
        config = configured(config, {"physics": "planar", **options})
        check_kernel(config, device)
        if device is not None and threads is not None:
            raise OptionError(f"threads is {threads!r} with device {device!r}: pass one of the two")
        super().__init__(num_envs, config, autoreset_mode, max_episode_steps)
        self._disc = config.disc
        self._sensors, self._measures, self._size = config.observed, config.measures, config.robot.size
        self._terms = [
            (each.name, each.weight, ProgressColumn(each, self.num_envs) if isinstance(each, ProgressTerm) else each)
            for each in config.reward_terms
        ]
        self._methods = {each.name: each.method for each in config.reward_terms if isinstance(each, ProgressTerm)}
        self._endings = [
            (each.name, RestColumn(each, self.num_envs) if isinstance(each, RestEnding) else each)
            for each in config.endings
        ]
        self._tasks: list[Tasks] = [task_source(config) for _ in range(self.num_envs)]
        self._rngs: list[np.random.Generator | None] = [None] * self.num_envs
        self._columns = Columns.zeros(self.num_envs, config.control_dt)
        self._columns.terms = {name: np.zeros(self.num_envs) for name, _, _ in self._terms}
        self._batch = self._batch_of(config, threads, device)
        self._age = np.zeros(self.num_envs, dtype=np.int64)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin the episodes of all environments.

        Args:
            seed: of the first environment, and those of the others follow; or one for each.
            options: as of `LabPointNavEnv.reset`, for all; and "reset_mask", a truth value for each environment, which
                chooses those whose episodes begin anew.

        Raises:
            OptionError: before a first reset, the mask leaves out an environment.
        """
        seeds, renewed, options = self._renewed(seed, options)
        self._begun = True
        for row in np.flatnonzero(renewed).tolist():
            self._begin(row, seeds[row], options)
        self._ended[renewed] = False
        self._columns.measure()
        self._judge()
        return self._observations(), self._infos(renewed)

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Carry out one action in each environment; those that ended are reset by the rules of the autoreset mode."""
        self._check_running()
        columns, robots = self._columns, self._batch.robots
        robots.targets[:] = self._targets(actions)
        self._batch.step()
        columns.pose, columns.velocity = robots.poses.copy(), robots.velocities.copy()
        columns.collision, columns.clearance = robots.touched.copy(), robots.clearances.copy()
        columns.to_go, columns.exact_to_go = robots.to_go.copy(), self._batch.routes.to_go.copy()
        columns.path_length = columns.path_length + robots.driven
        columns.contacts = columns.contacts + columns.collision
        columns.steps = columns.steps + 1
        self._age += 1
        columns.measure()
        self._judge()
        reward = np.zeros(self.num_envs)
        for name, weight, term in self._terms:
            columns.terms[name] = np.full(self.num_envs, weight * term.value(columns))
            reward = reward + columns.terms[name]
        terminated = columns.verdict != GOES_ON
        truncated = np.zeros_like(terminated) if self._limit is None else self._age >= self._limit
        every, infos = np.ones(self.num_envs, dtype=np.bool_), {}
        if self.autoreset_mode == AutoresetMode.NEXT_STEP:
            renewed = self._ended
            terminated, truncated, reward = terminated & ~renewed, truncated & ~renewed, np.where(renewed, 0.0, reward)
            self._ended = terminated | truncated
        elif self.autoreset_mode == AutoresetMode.SAME_STEP:
            renewed = terminated | truncated
            if renewed.any():
                infos = self._final(renewed)
        else:
            renewed, self._ended = np.zeros_like(terminated), terminated | truncated
        if renewed.any():
            for row in np.flatnonzero(renewed).tolist():
                self._begin(row, None, {})
            columns.measure()
            self._judge()
        return self._observations(), reward, terminated, truncated, {**infos, **self._infos(every)}

    def close_extras(self, **_: Any) -> None:
        """End the threads and release what the task sources hold."""
        self._batch.close()
        for tasks in self._tasks:
            tasks.close()

    def _batch_of(self, config: PointNavConfig, threads: int | None, device: str | None) -> PlanarBatch | DeviceBatch:
        """Return the robots, on threads of the processor or on a device."""
        rays = [sensor for sensor in self._sensors if isinstance(sensor, LidarSensor | DepthSensor)]
        if device is not None:
            from labgym.envs.gpu.batch import DeviceBatch

            return DeviceBatch(self.num_envs, config.control_dt, rays, device)
        lidar = next((sensor for sensor in rays if isinstance(sensor, LidarSensor)), None)
        camera = next((sensor for sensor in rays if isinstance(sensor, DepthSensor)), None)
        return PlanarBatch(self.num_envs, config.control_dt, lidar, camera, threads)

    def _begin(self, row: int, seed: int | None, options: dict[str, Any]) -> None:
        """Begin an episode of one environment."""
        rng = self._rngs[row]
        if seed is not None or rng is None:
            rng = self._rngs[row] = seeding.np_random(seed)[0]
        task = self._tasks[row].draw(rng, options, fresh=seed is not None)
        if task.following:
            raise OptionError(f"the vector environment has episodes of one drive only: {REMEDY}")
        world, pair, columns, robots = world_of(task.layout), task.pair, self._columns, self._batch.robots
        field, exact = None, None
        to_go = {name: compiled_to_go(world, world.to_go(pair.goal, way)) for name, way in self._methods.items()}
        for distances in to_go.values():
            if isinstance(distances, GridDistanceToGo):
                field = distances.field
            if isinstance(distances, CompiledDistanceToGo):
                exact = distances
        self._batch.place(row, pair.start, world, field, exact)
        columns.pose[row], columns.velocity[row] = robots.poses[row], robots.velocities[row]
        columns.goal[row], columns.clearance[row] = pair.goal, robots.clearances[row]
        columns.collision[row], columns.contacts[row], columns.steps[row] = False, 0, 0
        columns.path_length[row], columns.to_go[row] = 0.0, robots.to_go[row]
        columns.exact_to_go[row] = self._batch.routes.to_go[row]
        columns.shortest_path_length[row] = (
            world.length_to_disc(pair, self._disc) if self._disc else world.shortest_length(pair)
        )
        columns.layout[row], columns.pair[row] = task.layout.id, pair.index
        columns.protocol[row] = "" if task.protocol is None else task.protocol.id
        self._age[row] = 0
        for name, weight, term in self._terms:
            columns.terms[name][row] = weight * 0.0
            if isinstance(term, ProgressColumn):
                term.begin(row, columns, to_go[name])
        for _, ending in self._endings:
            if isinstance(ending, RestColumn):
                ending.begin(row)

    def _judge(self) -> None:
        """Set the verdict of the endings: the first that gives one decides."""
        columns = self._columns
        columns.verdict = np.full(self.num_envs, GOES_ON)
        columns.ending = np.full(self.num_envs, "", dtype=object)
        for name, ending in self._endings:
            first = (columns.verdict == GOES_ON) & ending.holds(columns)
            columns.verdict[first], columns.ending[first] = VERDICTS[ending.outcome], name

    def _targets(self, actions: Any) -> NDArray[np.float64]:
        """Return the target velocities of actions, as `RobotSpec.twist`."""
        try:
            values = np.asarray(actions, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            values = np.empty(0)
        if values.shape != (self.num_envs, 2) or not np.isfinite(values).all():
            shown = " ".join(repr(actions).split())[:80]
            raise OptionError(f"actions {shown} must be {self.num_envs} x 2 finite numbers in [-1, 1]: forward, turn")
        values = np.minimum(np.maximum(values, -1.0), 1.0)
        forward, turn = values[:, 0], values[:, 1]
        v = forward * np.where(forward >= 0.0, self._size.v_max, -self._size.v_min)
        return np.column_stack([v, turn * self._size.w_max])

    def _observations(self) -> Observations:
        return {
            sensor.name: self._batch.readings(sensor.name)
            if isinstance(sensor, LidarSensor | DepthSensor)
            else reading(sensor, self._columns)
            for sensor in self._sensors
        }

    def _infos(self, rows: NDArray[np.bool_]) -> dict[str, Any]:
        """Return the infos of some environments in Gymnasium's form: each column with the mask of its rows."""
        return _masked({each.name: MEASURES[each.name](self._columns) for each in self._measures}, rows)

    def _final(self, rows: NDArray[np.bool_]) -> dict[str, Any]:
        """Return the last observations and infos of episodes that ended."""
        observations = self._observations()
        last = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(rows).tolist():
            last[row] = {name: values[row] for name, values in observations.items()}
        return {
            "final_obs": last,
            "_final_obs": rows.copy(),
            "final_info": self._infos(rows),
            "_final_info": rows.copy(),
        }


def _masked(columns: dict[str, Any], rows: NDArray[np.bool_]) -> dict[str, Any]:
    """Return columns with masks; the other rows are zeros, or None of objects."""
    masked: dict[str, Any] = {}
    for name, column in columns.items():
        if isinstance(column, dict):
            masked[name] = _masked(column, rows)
        else:
            if not rows.all():
                column[~rows] = None if column.dtype == object else 0
            masked[name] = column
        masked[f"_{name}"] = rows.copy()
    return masked


def check_kernel(config: PointNavConfig, device: str | None = None) -> None:
    """Check that the planar kernel has all parts of a configuration.

    Args:
        device: name of a device of Warp; None for the processor.

    Raises:
        OptionError: it lacks one.
    """
    if config.physics != "planar":
        raise OptionError(f"the vector environment has physics='planar' only, not {config.physics!r}: {REMEDY}")
    if config.exact:
        raise OptionError(f"the vector environment has no exact readings: {REMEDY}")
    if config.render_mode is not None:
        raise OptionError("the vector environment does not render: use gym.make for pictures")
    if config.drives != "pair":
        raise OptionError(f"the vector environment has episodes of one drive only, not {config.drives!r}: {REMEDY}")
    check_parts("sensor", config.observed, (GoalSensor, VelocitySensor, LidarSensor, DepthSensor))
    for kind, name in ((LidarSensor, "lidar"), (DepthSensor, "depth camera")):
        if device is None and sum(isinstance(sensor, kind) for sensor in config.observed) > 1:
            raise OptionError(f"the vector environment has one {name} only: {REMEDY}")
    check_parts("reward term", config.reward_terms, TERMS)
    check_parts("ending", config.endings, ENDINGS)
    check_parts("actions", (config.actions,), (VelocityActions,))
    if config.actions.stop or config.actions.delay:
        raise OptionError(f"the vector environment has no actions with STOP or a delay: {REMEDY}")
    check_parts("robot", (config.robot,), (DifferentialDrive,))
    for name in ("conditions", "randomizations", "curriculum"):
        if getattr(config, name):
            raise OptionError(f"the vector environment has no {name}: {REMEDY}")
    lidars = [sensor for sensor in config.observed if isinstance(sensor, LidarSensor)]
    if any((each.forward, each.left, each.yaw) != (0.0, 0.0, 0.0) for each in lidars):
        raise OptionError(f"the vector environment has its lidar on the robot's axis only: {REMEDY}")
    if any(isinstance(sensor, DepthSensor) and not sensor.camera.level for sensor in config.observed):
        raise OptionError(f"the vector environment has its camera on the robot's axis only, level: {REMEDY}")
    check_measures(config.measures)
