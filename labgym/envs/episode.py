"""One drive under way: where the robot is, what it achieved, and what is counted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.simulation import Simulation
from labgym.envs.stage import Stage, stage_of
from labgym.envs.tasks import Task

SUCCESS_DISTANCE = 0.5
"""The goal is reached within this distance, metres."""


class Episode:
    """A drive from its start pose on.

    Attributes:
        task: the drive. robot: who drives. stage: its layout, made ready. simulation: the robot in it.
        distance: from the robot's centre to the goal, metres.
        progress: by how much the last step shortened the way to go, metres.
        collision: whether the robot touched something in the last step.
        contacts: steps in which it did. steps: control steps taken. path_length: metres driven.
    """

    def __init__(self, task: Task, robot: RobotSpec = ROBOT) -> None:
        self.task = task
        self.robot = robot
        self.stage: Stage = stage_of(task.layout)
        self.simulation = Simulation(self.stage.model, robot)
        self.simulation.place(task.pair.start)
        self._to_go = self.stage.to_go(task.pair.goal)
        self._left = self._to_go.at(*task.pair.start[:2])
        self.distance = self._distance()
        self.progress = 0.0
        self.collision = False
        self.contacts = 0
        self.steps = 0
        self.path_length = 0.0

    def drive(self, v: float, w: float) -> None:
        """Ask for a twist in m/s and rad/s for one control step."""
        driven, self.collision = self.simulation.drive(v, w)
        self.path_length += driven
        self.contacts += self.collision
        self.steps += 1
        self.distance = self._distance()
        left = self._to_go.at(*self.simulation.pose[:2])
        self.progress, self._left = self._left - left, left

    @property
    def success(self) -> bool:
        """Whether the goal is reached."""
        return self.distance <= SUCCESS_DISTANCE

    def info(self, terms: dict[str, float]) -> dict[str, Any]:
        """Return the info of a step whose weighted reward terms are these; keys as `LabPointNavEnv` says."""
        pose, pair = self.simulation.pose, self.task.pair
        return {
            "pose": np.array(pose),
            "goal": np.array(pair.goal),
            "distance": self.distance,
            "success": self.success,
            "collision": self.collision,
            "contacts": self.contacts,
            "clearance": self.stage.clearance(pose[0], pose[1]),
            "path_length": self.path_length,
            "shortest_path_length": self.stage.shortest_length(pair),
            "layout": self.task.layout.id,
            "protocol": self.task.protocol.id,
            "pair": pair.index,
            "time": self.steps * self.robot.control_dt,
            "reward_terms": terms,
        }

    def _distance(self) -> float:
        return math.dist(self.simulation.pose[:2], self.task.pair.goal[:2])
