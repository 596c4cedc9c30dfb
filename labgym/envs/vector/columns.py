"""The state of many episodes as columns, and the parts of an environment that read columns.

Row i of a column belongs to environment i. The values equal those of a single environment to the bit, so arithmetic is
the same, operation by operation; lengths and bearings are computed by the functions of `math`, because those of NumPy
round differently.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.distance_to_go import DistanceToGo
from labgym.envs.parts.endings import ContactEnding, RestEnding, TouchEnding
from labgym.envs.parts.measures import NamedMeasure
from labgym.envs.parts.rewards import (
    ClearanceTerm,
    CollisionTerm,
    FailureTerm,
    ProgressTerm,
    SuccessTerm,
    TimeTerm,
)
from labgym.envs.parts.vectors import GoalSensor, VelocitySensor
from labgym.envs.planar.batch import polar

Column = NDArray[Any]
GOES_ON, SUCCESS, FAILURE, TRUNCATION = 0, 1, 2, 3
"""Verdicts of the endings."""
VERDICTS = {"success": SUCCESS, "failure": FAILURE, "truncation": TRUNCATION}
"""Verdicts by the outcomes of endings."""
REMEDY = "pass processes=2 or another number: worker processes take any part"


@dataclass
class Columns:
    """The state of the episodes after the latest action, as `labgym.envs.state.State`.

    Attributes:
        pose, goal: (n, 3). velocity: (n, 2). The others: (n,).
        verdict: `GOES_ON`, `SUCCESS`, `FAILURE` or `TRUNCATION`.
        to_go, exact_to_go: remaining distances by the grid and by exact paths, meters; NaN if they are not computed.
        terms: weighted reward terms by name, each (n,).
    """

    pose: Column
    goal: Column
    velocity: Column
    distance: Column
    collision: Column
    contacts: Column
    steps: Column
    control_dt: float
    path_length: Column
    clearance: Column
    to_go: Column
    exact_to_go: Column
    shortest_path_length: Column
    layout: Column
    protocol: Column
    pair: Column
    verdict: Column
    ending: Column
    terms: dict[str, Column]

    @classmethod
    def zeros(cls, count: int, control_dt: float) -> Columns:
        """Return columns of `count` rows."""
        return cls(
            pose=np.zeros((count, 3)),
            goal=np.zeros((count, 3)),
            velocity=np.zeros((count, 2)),
            distance=np.zeros(count),
            collision=np.zeros(count, dtype=np.bool_),
            contacts=np.zeros(count, dtype=np.int64),
            steps=np.zeros(count, dtype=np.int64),
            control_dt=control_dt,
            path_length=np.zeros(count),
            clearance=np.zeros(count),
            to_go=np.zeros(count),
            exact_to_go=np.zeros(count),
            shortest_path_length=np.zeros(count),
            layout=np.full(count, None, dtype=object),
            protocol=np.full(count, None, dtype=object),
            pair=np.zeros(count, dtype=np.int64),
            verdict=np.zeros(count, dtype=np.int64),
            ending=np.full(count, "", dtype=object),
            terms={},
        )

    @property
    def success(self) -> Column:
        """Whether each robot has reached its goal."""
        return np.asarray(self.verdict == SUCCESS)

    @property
    def failed(self) -> Column:
        """Whether each episode has failed."""
        return np.asarray(self.verdict == FAILURE)

    def measure(self) -> None:
        """Measure the distances to the goals."""
        ends = zip(self.pose[:, :2].tolist(), self.goal[:, :2].tolist(), strict=True)
        self.distance = np.array([math.dist(pose, goal) for pose, goal in ends])


MEASURES: dict[str, Callable[[Columns], Any]] = {
    "pose": lambda columns: columns.pose.copy(),
    "goal": lambda columns: columns.goal.copy(),
    "distance": lambda columns: columns.distance.copy(),
    "success": lambda columns: columns.success,
    "collision": lambda columns: columns.collision.copy(),
    "contacts": lambda columns: columns.contacts.copy(),
    "clearance": lambda columns: columns.clearance.copy(),
    "path_length": lambda columns: columns.path_length.copy(),
    "shortest_path_length": lambda columns: columns.shortest_path_length.copy(),
    "layout": lambda columns: columns.layout.copy(),
    "protocol": lambda columns: columns.protocol.copy(),
    "pair": lambda columns: columns.pair.copy(),
    "time": lambda columns: columns.steps * columns.control_dt,
    "reward_terms": lambda columns: {name: term.copy() for name, term in columns.terms.items()},
    "is_success": lambda columns: columns.success,
    "cost": lambda columns: columns.collision.astype(np.float64),
    "ending": lambda columns: columns.ending.copy(),
    "achieved_goal": lambda columns: columns.pose[:, :2].copy(),
    "desired_goal": lambda columns: columns.goal[:, :2].copy(),
}
"""The measures by name, as `labgym.envs.parts.measures.VALUES`."""


def reading(sensor: GoalSensor | VelocitySensor, columns: Columns) -> NDArray[np.float32]:
    """Return the readings of a sensor, (n, 3) or (n, 2)."""
    if isinstance(sensor, VelocitySensor):
        return np.minimum(np.maximum(columns.velocity, sensor.low), sensor.high).astype(np.float32)
    readings = np.empty((len(columns.pose), 3), np.float32)
    polar(columns.pose, columns.goal, columns.distance, sensor.reach, readings)
    return readings


class ProgressColumn:
    """A `ProgressTerm`: it remembers the remaining distances."""

    def __init__(self, term: ProgressTerm, count: int) -> None:
        self._grid = term.method == "grid"
        self._remaining = np.zeros(count)
        self._to_go: list[DistanceToGo | None] = [None] * count

    def begin(self, row: int, columns: Columns, to_go: DistanceToGo) -> None:
        """Begin the drive of an environment."""
        self._to_go[row] = to_go
        self._remaining[row] = to_go.at(*columns.pose[row, :2].tolist())

    def value(self, columns: Columns) -> Column:
        """Return the progress of all, meters."""
        remaining = columns.to_go if self._grid else columns.exact_to_go
        for row in np.flatnonzero(np.isnan(remaining)).tolist():
            to_go = self._to_go[row]
            remaining[row] = 0.0 if to_go is None else to_go.at(*columns.pose[row, :2].tolist())
        progress, self._remaining = self._remaining - remaining, remaining.copy()
        return progress


class RestColumn:
    """A `RestEnding`: it remembers since when the robots rest."""

    outcome = RestEnding.outcome

    def __init__(self, ending: RestEnding, count: int) -> None:
        self._ending = ending
        self._since = np.full(count, np.nan)

    def begin(self, row: int) -> None:
        """Begin the drive of an environment."""
        self._since[row] = np.nan

    def holds(self, columns: Columns) -> Column:
        """Whether each robot has rested long enough."""
        ending, speed, turn_rate = self._ending, columns.velocity[:, 0], columns.velocity[:, 1]
        rests = (columns.distance <= ending.radius) & (speed * speed <= ending.speed * ending.speed)
        rests &= np.abs(turn_rate) <= ending.turn_rate
        time = columns.steps * columns.control_dt
        self._since = np.where(rests, np.where(np.isnan(self._since), time, self._since), np.nan)
        with np.errstate(invalid="ignore"):
            return np.asarray(rests & (time - self._since >= ending.duration - 1e-9))


TERMS = (ProgressTerm, SuccessTerm, FailureTerm, CollisionTerm, TimeTerm, ClearanceTerm)
ENDINGS = (TouchEnding, RestEnding, ContactEnding)
SENSORS = (GoalSensor, VelocitySensor)
"""Parts that read columns; others read the states of the episodes one by one."""


def reads_columns(part: Any, kinds: tuple[type[Any], ...]) -> bool:
    """Whether a part is of one of these kinds, and has no noise."""
    return type(part) in kinds and not getattr(part, "noise", ())


def measures_columns(measure: Any) -> bool:
    """Whether a measure can be read from columns."""
    return type(measure) is NamedMeasure and measure.name in MEASURES
