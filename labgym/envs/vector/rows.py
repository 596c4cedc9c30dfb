"""One environment of the vector environment, as its own episode: the parts that do not read columns read its state."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.bodies import BodyContacts
from labgym.envs.conditions.changes import Changes
from labgym.envs.conditions.glass import Glass
from labgym.envs.conditions.parked import Parked
from labgym.envs.conditions.passing import nobody
from labgym.envs.conditions.people import People
from labgym.envs.conditions.station import Station
from labgym.envs.conditions.wet import WetFloor
from labgym.envs.config import PointNavConfig
from labgym.envs.episode import RunningEpisode, conditioned, randomized, stream
from labgym.envs.parts.rays import LidarSensor
from labgym.envs.planar.batch import BatchRobot, PlanarBatch
from labgym.envs.planar.scene import shown_at
from labgym.envs.planar.simulation import TICK_S
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.errors import OptionError

CONDITIONS = (BodyContacts, Parked, Glass, Station, People, WetFloor, Changes)
"""Conditions that the kernel carries; changes only if the robot can push none of them."""


KNOWN = 512
"""Number of prepared tasks that a vector environment remembers."""
KnownTasks = dict[tuple[Any, ...], tuple[Task, Task]]
"""The task before the conditions, whose objects must live as long as their numbers count, and after them."""


class OwnParts(NamedTuple):
    """Names of the sensors, terms and measures, and numbers of the endings, that read the state of an episode."""

    sensors: Sequence[str]
    terms: Sequence[str]
    endings: Sequence[int]
    measures: Sequence[str]


class EnvironmentRow:
    """The episode of one environment, its conditions, and its own copies of the parts that read its state.

    Args:
        config: of the environment. batch: the robots. row: number of the environment.
        own_parts: the parts that read the state.
        known: tasks that conditions have prepared, which all environments share.

    Attributes:
        sensors: those of the episode. terms, endings, measures: by name.
    """

    def __init__(
        self,
        config: PointNavConfig,
        batch: PlanarBatch,
        row: int,
        own_parts: OwnParts,
        known: KnownTasks,
    ) -> None:
        self._config, self._batch, self._row, self._known = config, batch, row, known
        observed, own, rules, entries, self._actions, self._robot = copy.deepcopy(
            (config.observed, config.reward_terms, config.endings, config.measures, config.actions, config.robot)
        )
        self._conditions, self._randomizations = copy.deepcopy((config.conditions, config.randomizations))
        sensors, terms, endings, measures = own_parts
        self._all, self._names = observed, tuple(sensors)
        self.sensors = tuple(each for each in observed if each.name in sensors)
        self.terms = {each.name: each for each in own if each.name in terms}
        self.endings = {number: each for number, each in enumerate(rules) if number in endings}
        self.measures = {each.name: each for each in entries if each.name in measures}
        self._lidar: LidarSensor | None = None
        self._streams: dict[str, np.random.Generator] = {}
        self._episode: RunningEpisode | None = None
        self._commands: Any = ()

    @property
    def state(self) -> State:
        """The state of the episode."""
        if self._episode is None:
            raise RuntimeError("begin an episode first")
        return self._episode.state

    def prepared(self, task: Task, rng: np.random.Generator) -> Task:
        """Return the task of an episode as its conditions change it; `begin` follows.

        Args:
            rng: the environment's generator.
        """
        (self._rng,) = rng.spawn(1)
        names = [condition.name for condition in self._conditions]
        stored = all(name in task.conditions for name in names if name != BodyContacts.name)
        own = (id(task.layout), id(task.protocol), id(task.old_map), task.pair, task.announced, repr(task.conditions))
        key = own if stored else None
        known = None if key is None else self._known.get(key)
        if known is None:
            changed, self._drawn = conditioned(task, self._conditions, self._rng)
            if key is not None and changed.layout is not task.layout:
                self._known[key] = task, changed
                if len(self._known) > KNOWN:
                    del self._known[next(iter(self._known))]
            return changed
        _, changed = known
        self._drawn = [
            (condition, task.conditions.get(condition.name), stream(self._rng, f"condition {condition.name}"))
            for condition in self._conditions
        ]
        return changed

    def begin(self, task: Task) -> None:
        """Begin the episode of a task, in whose world the batch has placed the robot."""
        rng, config = self._rng, self._config
        setting, drawn, observed = randomized(task, config, self._robot, self._all, self._randomizations, rng)
        robot: Any = BatchRobot(self._batch, self._row)
        self._episode = episode = RunningEpisode(task, self._robot, config, setting, self._drawn, robot)
        state = episode.state
        state.randomization = drawn
        self.sensors = tuple(each for each in observed if each.name in self._names)
        self._lidar = next((each for each in observed if type(each) is LidarSensor), None)
        lidar, self._visible, self._checked = self._lidar, False, episode.company is not None
        if episode.company is not None or setting is not None:
            height = self._robot.size.lidar_height if lidar is None else lidar.height
            shown = None if lidar is None else shown_at(state, height)
            self._visible = shown is not None and len(shown.places) > 0
            company = nobody() if episode.company is None else episode.company
            self._batch.accompany(self._row, company, shown, state.world, height)
        self._streams = {each.name: stream(rng, each.name) for each in self.sensors}
        self._streams["actions"] = stream(rng, "actions")
        for sensor in self.sensors:
            sensor.reset(state, self._streams[sensor.name])
        self._actions.reset(state, self._streams["actions"])
        for part in (*self.terms.values(), *self.endings.values()):
            part.reset(state)
        self.show()

    def command(self, action: NDArray[np.float64]) -> tuple[float, ...]:
        """Return the command of an action, which lasts one control step."""
        state = self.state
        self._commands = tuple(self._actions.commands(action, state, self._streams["actions"]))
        state.stop = self._actions.is_stop(action)
        self._batch.robots.times[self._row] = state.time if self._checked else np.nan
        command: tuple[float, ...]
        (command,) = self._commands
        return command

    def follow(self) -> None:
        """Follow the robot of the batch after a control step: the conditions, and the state."""
        if self._episode is not None:
            self._episode.drive(self._commands)
            self.show()

    def show(self) -> None:
        """Tell the batch where the lidar is, and where what moves is that it sees."""
        if self._lidar is None:
            return
        state, lidar = self.state, self._lidar
        shown = shown_at(state, lidar.height) if self._visible else None
        x, y, yaw = lidar._lidar.at(state.pose)
        self._batch.show(self._row, (x, y, yaw), shown)

    def read(self) -> dict[str, Any]:
        """Return the readings of the sensors by name; the batch has read the lidar."""
        state = self.state
        if self._lidar is not None:
            state.views[self._lidar._lidar] = self._batch.robots.ranges[self._row]
        return {each.name: each.reading(state, self._streams[each.name]) for each in self.sensors}


def check_conditions(config: PointNavConfig, remedy: str) -> None:
    """Check that the kernel carries all conditions of a configuration.

    Raises:
        OptionError: it lacks one.
    """
    for condition in config.conditions:
        if type(condition) not in CONDITIONS:
            names = ", ".join(repr(kind.name) for kind in CONDITIONS)
            raise OptionError(f"the vector environment has no condition {condition.name!r}, only {names}: {remedy}")
        if isinstance(condition, Changes) and condition.pushable:
            raise OptionError(f"the vector environment moves no things: pass changes with pushable=False, or {remedy}")
        if isinstance(condition, People) and abs(config.control_dt - TICK_S) > 1e-9:
            raise OptionError(f"the vector environment has people with control_dt=0.1 only: {remedy}")
