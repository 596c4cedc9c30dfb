"""Condition "station": the furniture at the goal stands a little off its place on the map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from labgym.envs.checks import count, positive
from labgym.envs.conditions.station_move import Shift, docking_pose, free, moved, shift_of, station_of
from labgym.envs.parts.protocols import Condition, Motion, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import Pose, State
from labgym.envs.tasks import Task
from labgym.errors import OptionError
from labgym.geometry import wrap_angle

RESTING_SPEED, RESTING_TURN = 0.05, 0.1
"""A robot below this speed, m/s, and this turn rate, rad/s, is at rest."""


@registered("condition")
@dataclass(frozen=True)
class Station(Condition):
    """A docking station off its mapped pose.

    The piece of furniture at the goal, with all that stands on it, is moved and turned about its middle. The move is
    drawn evenly from a disc of radius `distance` and from turns up to `angle`; a pose that overlaps anything or where
    the robot cannot dock is drawn again. Furniture that fits tightly between others moves straight out of its row.
    `Task.pair` leads to the true docking pose, `Task.announced` to that of the map. The data has `station`, the id of
    the placement, and `shift`, [dx, dy, turn] in the room frame, meters and radians.

    The outcome has `position`, the distance to the true docking pose in meters, and `heading`, the absolute error of
    the heading in radians, both now; and `docked`, the same two after the robot has been at rest for `rest` seconds,
    None while it moves.

    Attributes:
        distance: greatest displacement, meters. angle: greatest turn, radians. rest: seconds.
        tries: poses drawn before the station moves straight out of its row.
    """

    distance: float = 0.10
    angle: float = math.radians(6.0)
    rest: float = 1.0
    tries: int = 200
    name: str = "station"
    kind: str = field(default="station", init=False)

    def __post_init__(self) -> None:
        positive(self, "distance", "angle", "rest", zero=True)
        count(self, "tries")

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return a station and its move.

        Raises:
            OptionError: the goal is at no piece of furniture, or this cannot move.
        """
        name = station_of(task)
        for out in (False, True):
            for _ in range(self.tries):
                shift = self._shift(task, name, rng, out)
                if free(task, name, shift):
                    return {"station": name, "shift": list(shift)}
        raise OptionError(f"station {name!r} has no room to move by up to {self.distance:g} m: choose another goal")

    def _shift(self, task: Task, name: str, rng: np.random.Generator, out: bool) -> Shift:
        """Return a random move, in any direction or straight out of the row."""
        far, angle, turn = math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi), rng.uniform(-1.0, 1.0)
        if out:
            front = task.layout.box(name).front
            dx, dy, turn = front[0] * far, front[1] * far, 0.0
        else:
            dx, dy = far * math.cos(angle), far * math.sin(angle)
        return round(self.distance * dx, 4), round(self.distance * dy, 4), round(self.angle * float(turn), 4)

    def prepare(self, task: Task, data: Any) -> Task:
        """Return the task with the station at its true pose.

        Raises:
            OptionError: the data is no move of a placement of the layout, or the robot cannot dock there.
        """
        name, shift = shift_of(task, data)
        layout = moved(task.layout, name, shift)
        goal = docking_pose(task, name, shift)
        pair = replace(task.pair, goal=goal)
        return replace(
            task,
            layout=layout,
            pair=pair,
            old_map=task.layout if task.old_map is None else task.old_map,
            announced=task.pair if task.announced is None else task.announced,
        )

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Docking:  # noqa: ARG002
        """Return the docking of an episode."""
        return Docking(state.task.pair.goal, self.rest, state.pose)


class Docking(Presence):
    """How near the robot is to the true docking pose, and whether it rests there."""

    visible = False

    def __init__(self, goal: Pose, rest: float, pose: Pose) -> None:
        self._goal, self._rest = goal, rest
        self._pose, self._resting = pose, 0.0

    def substep(self, motion: Motion) -> str:
        """Follow the robot by one physics step."""
        self._pose = motion.pose
        speed = math.hypot(motion.velocity[0], motion.sideways)
        still = speed < RESTING_SPEED and abs(motion.velocity[1]) < RESTING_TURN
        self._resting = self._resting + motion.dt if still else 0.0
        return ""

    @property
    def outcome(self) -> dict[str, Any]:
        """The errors now, and those at rest."""
        now = errors(self._pose, self._goal)
        # Sums of physics steps are rounded.
        return {**now, "docked": now if self._resting >= self._rest - 1e-9 else None}


def errors(pose: Sequence[float], goal: Sequence[float]) -> dict[str, float]:
    """Return the distance of two poses, meters, and the absolute difference of their headings, radians."""
    return {"position": math.dist(pose[:2], goal[:2]), "heading": abs(wrap_angle(pose[2] - goal[2]))}
