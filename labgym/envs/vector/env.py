"""Many point navigation environments that step together on the planar kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from labgym.envs.config import PointNavConfig
from labgym.envs.distance_to_go import GridDistanceToGo
from labgym.envs.drive_source import ladder
from labgym.envs.labnav.curriculum import Climb
from labgym.envs.parts.actions import VelocityActions
from labgym.envs.parts.endings import RestEnding
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.parts.rewards import ProgressTerm
from labgym.envs.parts.robots import DifferentialDrive
from labgym.envs.planar.batch import PlanarBatch
from labgym.envs.planar.routes import CompiledDistanceToGo, compiled_to_go
from labgym.envs.presets import configured
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.envs.vector.arguments import PointNavVectorEnv
from labgym.envs.vector.columns import (
    ENDINGS,
    FAILURE,
    GOES_ON,
    MEASURES,
    REMEDY,
    SENSORS,
    SUCCESS,
    TERMS,
    TRUNCATION,
    VERDICTS,
    Columns,
    ProgressColumn,
    RestColumn,
    measures_columns,
    reading,
    reads_columns,
)
from labgym.envs.vector.rows import EnvironmentRow, KnownTasks, OwnParts, check_conditions
from labgym.envs.world import keep, world_of
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.gpu.batch import DeviceBatch
    from labgym.envs.parts.protocols import Presence

Observations = dict[str, NDArray[np.float32]]


class Underway(NamedTuple):
    """An episode in progress: its task, pose and velocity of the robot, and conditions, as in `State`."""

    task: Task
    pose: Pose
    velocity: tuple[float, float]
    presences: Mapping[str, Presence]


class VectorPointNavEnv(PointNavVectorEnv):
    """Many `LabPointNavEnv` with physics="planar", stepped together on threads, outside of the interpreter lock.

        envs = gym.make_vec("labgym:LabPointNav-v0", num_envs=64, vectorization_mode="vector_entry_point")

    makes one where all parts are supported (`labgym.envs.vector`). Observations, rewards, ends of episodes and
    infos equal those of single environments with the same arguments and seeds to the bit. Each environment draws its
    own layouts.

    Motion, contacts, people's distances, lidar, depth and remaining distances of all robots are computed in one call.
    The usual parts read columns: goal, velocity, one lidar and one depth camera without noise, the terms of
    `RewardWeights` with failure and clearance, the endings touch, rest and contact, velocity actions, and the measures.
    Other parts that are no cameras read the state of each episode in turn, which takes some microseconds for each:
    odometry, noise, STOP, a delay, errors of the wheels, all endings and terms. Of the conditions it carries
    "contacts", "parked", "people", "station", "glass", "wet_floor", and "changes" with `pushable=False`; each
    environment climbs its own ladder of a curriculum. With any other part it cannot be made; `ProcessPointNavEnv` has
    all parts.

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
        self._disc, self._resident_mb = config.disc, config.resident_mb
        self._sensors, self._measures, self._size = config.observed, config.measures, config.robot.size
        curriculum = config.curriculum
        rungs = config.rungs
        own = {each.name for rung in rungs for each in rung.reward_terms if not reads_columns(each, TERMS)}
        self._terms = [
            (each.name, each.weight, _column_term(each, self.num_envs) if each.name not in own else None)
            for each in config.reward_terms
        ]
        self._methods = {each.name: each.method for each in config.reward_terms if isinstance(each, ProgressTerm)}
        rules = {
            number for rung in rungs for number, each in enumerate(rung.endings) if not reads_columns(each, ENDINGS)
        }
        self._endings = [
            (each.name, None if number in rules else _column_ending(each, self.num_envs))
            for number, each in enumerate(config.endings)
        ]
        self._tasks = [[tasks for _, tasks in ladder(config)] for _ in range(self.num_envs)]
        self._climbs = [] if curriculum is None else [Climb(curriculum) for _ in range(self.num_envs)]
        self._rngs: list[np.random.Generator | None] = [None] * self.num_envs
        self._present: list[Any] = [None] * self.num_envs
        self._columns = Columns.zeros(self.num_envs, config.control_dt)
        self._columns.terms = {name: np.zeros(self.num_envs) for name, _, _ in self._terms}
        self._rays = _batched(config, device)
        self._batch: Any = self._batch_of(config, threads, device)
        self._by_rung = self._rows_of(rungs, own, rules)
        self._rows = [episodes[-1] for episodes in self._by_rung]
        self._readings: Observations = {}
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
        self._judge(renewed)
        self._read(renewed)
        return self._observations(), self._infos(renewed)

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Carry out one action in each environment; those that ended are reset by the rules of the autoreset mode."""
        self._check_running()
        columns, robots = self._columns, self._batch.robots
        waits = self._ended if self.autoreset_mode == AutoresetMode.NEXT_STEP else np.zeros_like(self._ended)
        self._drive(actions, ~waits)
        columns.pose, columns.velocity = robots.poses.copy(), robots.velocities.copy()
        columns.collision, columns.clearance = robots.touched.copy(), robots.clearances.copy()
        columns.to_go, columns.exact_to_go = robots.to_go.copy(), self._batch.routes.to_go.copy()
        columns.path_length = columns.path_length + robots.driven
        columns.contacts = columns.contacts + columns.collision
        columns.steps = columns.steps + 1
        self._age += 1
        columns.measure()
        self._judge(~waits)
        reward = self._reward(~waits)
        terminated = (columns.verdict == SUCCESS) | (columns.verdict == FAILURE)
        truncated = columns.verdict == TRUNCATION
        if self._limit is not None:
            truncated |= self._age >= self._limit
        self._read(~waits)
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
            self._judge(renewed)
            self._read(renewed)
        return self._observations(), reward, terminated, truncated, {**infos, **self._infos(every)}

    def close_extras(self, **_: Any) -> None:
        """End the threads and release what the task sources hold."""
        self._batch.close()
        for tasks in self._tasks:
            for one in tasks:
                one.close()

    @property
    def states(self) -> list[Underway]:
        """The episodes in progress."""
        poses, velocities = self._columns.pose.tolist(), self._columns.velocity.tolist()
        presences = [each.state.presences for each in self._rows] or [{}] * self.num_envs
        return [
            Underway(*each)
            for each in zip(self._present, map(tuple, poses), map(tuple, velocities), presences, strict=True)
        ]

    @property
    def climb(self) -> list[list[int]]:
        """The states of all ladders, each as `LabPointNavEnv.climb`."""
        return [each.state for each in self._climbs] or [[] for _ in range(self.num_envs)]

    def resume_climb(self, row: int, state: Sequence[int]) -> None:
        """Let an environment go on from a former value of its `climb`.

        Raises:
            OptionError: it is not one of its ladder.
        """
        if self._climbs:
            self._climbs[row].restore(state)

    def _batch_of(self, config: PointNavConfig, threads: int | None, device: str | None) -> PlanarBatch | DeviceBatch:
        """Return the robots, on threads of the processor or on a device."""
        if device is not None:
            from labgym.envs.gpu.batch import DeviceBatch

            return DeviceBatch(self.num_envs, config.control_dt, self._rays, device)
        lidar = next((sensor for sensor in self._sensors if type(sensor) is LidarSensor), None)
        camera = next((sensor for sensor in self._rays if isinstance(sensor, DepthSensor)), None)
        return PlanarBatch(self.num_envs, config.control_dt, lidar, camera, threads)

    def _rows_of(self, rungs: Sequence[PointNavConfig], terms: set[str], rules: set[int]) -> list[list[EnvironmentRow]]:
        """Return episodes on each rung for each environment; none if all parts read columns."""
        batched = {sensor.name for sensor in self._rays}
        own_sensors = {each.name for rung in rungs for each in rung.observed if not reads_columns(each, SENSORS)}
        sensors = [each.name for each in self._sensors if each.name in own_sensors - batched]
        measures = [each.name for each in self._measures if not measures_columns(each)]
        self._own_measures, self._own_sensors = frozenset(measures), frozenset(sensors)
        plain = all(
            type(rung.actions) is VelocityActions
            and not (rung.actions.stop or rung.actions.delay or rung.conditions or rung.randomizations)
            for rung in rungs
        )
        if plain and not (terms or rules or sensors or measures):
            return []
        prepared: list[KnownTasks] = [{} for _ in rungs]
        own = OwnParts(sensors, sorted(terms), sorted(rules), measures)
        return [
            [EnvironmentRow(rung, self._batch, row, own, tasks) for rung, tasks in zip(rungs, prepared, strict=True)]
            for row in range(self.num_envs)
        ]

    def _drive(self, actions: Any, active: NDArray[np.bool_]) -> None:
        """Carry out the actions of some environments."""
        robots = self._batch.robots
        if not self._rows:
            robots.targets[:] = self._targets(actions)
            self._batch.step()
            return
        values, driven = self._numbers(actions), np.flatnonzero(active).tolist()
        for row in driven:
            robots.targets[row] = self._rows[row].command(values[row])
        self._batch.step(look=False)
        for row in driven:
            self._rows[row].follow()
        self._batch.scan()

    def _reward(self, active: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Set the terms of the reward, and return it."""
        columns, reward = self._columns, np.zeros(self.num_envs)
        for name, weight, term in self._terms:
            if term is None:
                columns.terms[name] = np.zeros(self.num_envs)
                for row in np.flatnonzero(active).tolist():
                    episode = self._rows[row]
                    columns.terms[name][row] = weight * episode.terms[name].value(episode.state)
            else:
                columns.terms[name] = np.full(self.num_envs, weight * term.value(columns))
            reward = reward + columns.terms[name]
        for row in np.flatnonzero(active).tolist() if self._rows else ():
            self._rows[row].state.terms = {name: float(columns.terms[name][row]) for name, _, _ in self._terms}
        return reward

    def _read(self, rows: NDArray[np.bool_]) -> None:
        """Read the sensors of some environments that read their states."""
        if not self._own_sensors:
            return
        if not self._readings:
            shapes = {each.name: each.space for each in self._sensors if each.name in self._own_sensors}
            self._readings = {
                name: np.zeros((self.num_envs, *(space.shape or ())), space.dtype) for name, space in shapes.items()
            }
        for row in np.flatnonzero(rows).tolist():
            for name, values in self._rows[row].read().items():
                self._readings[name][row] = values

    def _begin(self, row: int, seed: int | None, options: dict[str, Any]) -> None:
        """Begin an episode of one environment."""
        rng = self._rngs[row]
        if seed is not None or rng is None:
            rng = self._rngs[row] = seeding.np_random(seed)[0]
        task = self._tasks[row][self._climbed(row, rng)].draw(rng, options, fresh=seed is not None)
        if task.following:
            raise OptionError(f"the vector environment has episodes of one drive only: {REMEDY}")
        if self._rows:
            task = self._rows[row].prepared(task, rng)
        self._present[row] = task
        world, pair, columns, robots = world_of(task.layout), task.pair, self._columns, self._batch.robots
        field, exact = None, None
        to_go = {name: compiled_to_go(world, world.to_go(pair.goal, way)) for name, way in self._methods.items()}
        for distances in to_go.values():
            if isinstance(distances, GridDistanceToGo):
                field = distances.field
            if isinstance(distances, CompiledDistanceToGo):
                exact = distances
        self._batch.place(row, pair.start, world, field, exact)
        if self._rows:
            self._rows[row].begin(task)
            self._batch.scan(row, row + 1)
            keep(task.layout, self._resident_mb)
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

    def _climbed(self, row: int, rng: np.random.Generator) -> int:
        """Return the rung of the next episode of an environment, and take its parts."""
        if not self._climbs:
            return 0
        verdict = int(self._columns.verdict[row])
        if verdict in (SUCCESS, FAILURE):
            self._climbs[row].record(verdict == SUCCESS)
        rung = self._climbs[row].next(rng)
        if self._by_rung:
            self._rows[row] = self._by_rung[row][rung]
        return rung

    def _judge(self, rows: NDArray[np.bool_]) -> None:
        """Set the verdicts of the endings on some environments: the first ending that gives one decides."""
        columns = self._columns
        verdict, endings = np.full(self.num_envs, GOES_ON), np.full(self.num_envs, "", dtype=object)
        for number, (name, ending) in enumerate(self._endings):
            undecided = rows & (verdict == GOES_ON)
            if ending is None:
                first = np.zeros_like(undecided)
                for row in np.flatnonzero(undecided).tolist():
                    given = self._rows[row].endings[number].verdict(self._rows[row].state)
                    first[row] = given is not None
                    verdict[row] = GOES_ON if given is None else VERDICTS[given]
            else:
                first = undecided & ending.holds(columns)
                verdict[first] = VERDICTS[ending.outcome]
            endings[first] = name
        columns.verdict = np.where(rows, verdict, columns.verdict)
        columns.ending = np.where(rows, endings, columns.ending)
        for row in np.flatnonzero(rows).tolist() if self._rows else ():
            state, number = self._rows[row].state, int(verdict[row])
            state.verdict, state.ending = OUTCOMES[number], endings[row]

    def _numbers(self, actions: Any) -> NDArray[np.float64]:
        """Return actions as an array (n, k).

        Raises:
            OptionError: not k finite numbers for each environment.
        """
        width = math.prod(self.single_action_space.shape or ())
        try:
            values = np.asarray(actions, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            values = np.empty(0)
        if values.shape != (self.num_envs, width) or not np.isfinite(values).all():
            shown = " ".join(repr(actions).split())[:80]
            names = ", ".join(("forward", "turn", "stop")[:width])
            raise OptionError(f"actions {shown} must be {self.num_envs} x {width} finite numbers in [-1, 1]: {names}")
        return values

    def _targets(self, actions: Any) -> NDArray[np.float64]:
        """Return the target velocities of actions, as `RobotSpec.twist`."""
        values = self._numbers(actions)
        values = np.minimum(np.maximum(values, -1.0), 1.0)
        forward, turn = values[:, 0], values[:, 1]
        v = forward * np.where(forward >= 0.0, self._size.v_max, -self._size.v_min)
        return np.column_stack([v, turn * self._size.w_max])

    def _observations(self) -> Observations:
        return {sensor.name: self._observation(sensor) for sensor in self._sensors}

    def _observation(self, sensor: Any) -> NDArray[Any]:
        if sensor.name in self._own_sensors:
            return self._readings[sensor.name].copy()
        if isinstance(sensor, LidarSensor | DepthSensor):
            return np.asarray(self._batch.readings(sensor.name))
        return reading(sensor, self._columns)

    def _infos(self, rows: NDArray[np.bool_]) -> dict[str, Any]:
        """Return the infos of some environments in Gymnasium's form: each column with the mask of its rows."""
        columns = [each.name for each in self._measures if each.name not in self._own_measures]
        infos = _masked({name: MEASURES[name](self._columns) for name in columns}, rows)
        chosen = np.flatnonzero(rows).tolist() if self._own_measures else []
        for name in self._own_measures if chosen else ():
            values = [self._rows[row].measures[name].value(self._rows[row].state) for row in chosen]
            if isinstance(values[0], str | tuple):
                infos[name] = np.full(self.num_envs, None, dtype=object)
                for row, value in zip(chosen, values, strict=True):
                    infos[name][row] = value
                infos[f"_{name}"] = rows.copy()
            else:
                for row, value in zip(chosen, values, strict=True):
                    infos = self._add_info(infos, {name: value}, row)
        return infos

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
    if config.drives == "protocol" or config.onward:
        raise OptionError(f"the vector environment has episodes of one drive only: {REMEDY}")
    if config.curriculum:
        if device is not None:
            raise OptionError(f"on a device the vector environment has no curriculum: {REMEDY}")
        for rung in config.rungs:
            check_kernel(rung)
    _check_sensors(config)
    if not isinstance(config.actions, VelocityActions):
        raise OptionError(
            f"the vector environment has no actions {type(config.actions).__name__}, only VelocityActions: {REMEDY}"
        )
    if type(config.robot) is not DifferentialDrive:
        raise OptionError(f"the vector environment has no robot {type(config.robot).__name__}: {REMEDY}")
    check_conditions(config, REMEDY)
    if device is not None:
        _check_device(config)


def _check_sensors(config: PointNavConfig) -> None:
    """Check that the kernel has all sensors of a configuration.

    Raises:
        OptionError: it lacks one.
    """
    visible = any(condition.name in ("people", "glass") for condition in config.conditions)
    for sensor in config.observed:
        if sensor.sees is not None and type(sensor) not in (LidarSensor, DepthSensor):
            raise OptionError(f"the vector environment has no sensor {type(sensor).__name__}: {REMEDY}")
        if isinstance(sensor, DepthSensor) and (visible or config.randomizations or not sensor.camera.level):
            raise OptionError(
                f"the vector environment has level depth cameras only, on the robot's axis, without people, glass and "
                f"randomizations: {REMEDY}"
            )


def _check_device(config: PointNavConfig) -> None:
    """Check that all parts of a configuration read columns, as those of a device must.

    Raises:
        OptionError: one does not.
    """
    sensors = (*SENSORS, LidarSensor, DepthSensor)
    for role, parts, kinds in (
        ("sensor", config.observed, sensors),
        ("reward term", config.reward_terms, TERMS),
        ("ending", config.endings, ENDINGS),
        ("actions", (config.actions,), (VelocityActions,)),
    ):
        for part in parts:
            if not reads_columns(part, kinds):
                names = ", ".join(kind.__name__ for kind in kinds)
                raise OptionError(
                    f"on a device the vector environment has no {role} {type(part).__name__} or its noise, only "
                    f"{names}: {REMEDY}"
                )
    for measure in config.measures:
        if not measures_columns(measure):
            raise OptionError(f"on a device the vector environment has no measure {measure.name!r}: {REMEDY}")
    if config.actions.stop or config.actions.delay or config.conditions or config.randomizations:
        raise OptionError(
            f"on a device the vector environment has no STOP, delay, conditions and randomizations: {REMEDY}"
        )
    if any(isinstance(each, LidarSensor) and (each.forward, each.left, each.yaw) != AXIS for each in config.observed):
        raise OptionError(f"on a device the vector environment has its lidar on the robot's axis only: {REMEDY}")


AXIS = (0.0, 0.0, 0.0)
"""Place of a sensor on the robot's axis: forward and left, meters, and yaw, radians."""
OUTCOMES: dict[int, Any] = {GOES_ON: None} | {number: name for name, number in VERDICTS.items()}
"""Verdicts of `State` by those of columns."""


def _batched(config: PointNavConfig, device: str | None) -> list[LidarSensor | DepthSensor]:
    """Return the sensors whose readings the batch gives: one lidar and one camera, on a device all of them."""
    rays = [each for each in config.observed if isinstance(each, LidarSensor | DepthSensor)]
    if device is not None:
        return rays
    kinds = LidarSensor, DepthSensor
    own = {each.name for rung in config.rungs for each in rung.observed if not reads_columns(each, kinds)}
    plain = [each for each in rays if each.name not in own and not config.randomizations]
    lidars = [each for each in rays if isinstance(each, LidarSensor)][:1]
    cameras = [each for each in plain if isinstance(each, DepthSensor)][:1]
    return [*(each for each in lidars if each in plain and (each.forward, each.left, each.yaw) == AXIS), *cameras]


def _column_term(term: Any, count: int) -> Any:
    return ProgressColumn(term, count) if isinstance(term, ProgressTerm) else term


def _column_ending(ending: Any, count: int) -> Any:
    return RestColumn(ending, count) if isinstance(ending, RestEnding) else ending
