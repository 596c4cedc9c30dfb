"""An episode in progress: the state of the robot and the quantities that are measured."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.simulation import Simulation
from labgym.envs.tasks import Task
from labgym.envs.world import World, world_of
from labgym.navigation import Method

SUCCESS_DISTANCE = 0.5
"""The goal is reached within this distance, meters."""


class Episode:
    """An episode, from its start pose.

    Attributes:
        task: layout, protocol and goal pair. world: the layout prepared for simulation. simulation: the robot in it.
        distance: distance from the robot's center to the goal, meters.
        progress: decrease of the distance to go in the last step, meters.
        collision: whether the robot touched something in the last step.
        contacts: number of steps with a collision. steps: number of control steps. path_length: length driven, meters.
    """

    def __init__(self, task: Task, robot: RobotSpec = ROBOT, distance_to_go: Method = "grid") -> None:
        self.task = task
        self.robot = robot
        self.world: World = world_of(task.layout)
        self.simulation = Simulation(self.world.model, robot, self.world.out_of_reach)
        self.simulation.place(task.pair.start)
        self._to_go = self.world.to_go(task.pair.goal, distance_to_go)
        self._remaining = self._to_go.at(*task.pair.start[:2])
        self.distance = self._distance()
        self.progress = 0.0
        self.collision = False
        self.contacts = 0
        self.steps = 0
        self.path_length = 0.0

    def drive(self, v: float, w: float) -> None:
        """Apply a target twist in m/s and rad/s for one control step."""
        driven, self.collision = self.simulation.drive(v, w)
        self.path_length += driven
        self.contacts += self.collision
        self.steps += 1
        self.distance = self._distance()
        remaining = self._to_go.at(*self.simulation.pose[:2])
        self.progress, self._remaining = self._remaining - remaining, remaining

    @property
    def success(self) -> bool:
        """Whether the robot is within `SUCCESS_DISTANCE` of the goal."""
        return self.distance <= SUCCESS_DISTANCE

    def info(self, terms: dict[str, float]) -> dict[str, Any]:
        """Return the info of a step with these weighted reward terms; `LabPointNavEnv` documents the keys."""
        pose, pair = self.simulation.pose, self.task.pair
        return {
            "pose": np.array(pose),
            "goal": np.array(pair.goal),
            "distance": self.distance,
            "success": self.success,
            "collision": self.collision,
            "contacts": self.contacts,
            "clearance": self.world.clearance(pose[0], pose[1]),
            "path_length": self.path_length,
            "shortest_path_length": self.world.shortest_length(pair),
            "layout": self.task.layout.id,
            "protocol": "" if self.task.protocol is None else self.task.protocol.id,
            "pair": pair.index,
            "time": self.steps * self.robot.control_dt,
            "reward_terms": terms,
        }

    def _distance(self) -> float:
        return math.dist(self.simulation.pose[:2], self.task.pair.goal[:2])
