"""The end of a drive: come to rest at the goal, turn to its heading, and say so."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.parts.endings import REST_DISTANCE
from labgym.envs.robot import turn_towards
from labgym.geometry import Array, wrap_angle
from labgym.navigation import Pose
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.tracking import approach_speed, lengths_along, points_at, velocities_to_action

DOCK_DISTANCE_M = 0.10
"""Greatest distance from a goal with a heading, meters."""
DOCK_ANGLE_RAD = 0.10
"""Greatest deviation from that heading, radians."""
STOP_DISTANCE_M = 0.25
"""Distance from the center at which a robot stops in a goal's disc without a heading, meters."""
DOCK_STOP_DISTANCE_M = 0.02
"""Distance from a goal with a heading at which a robot stops, meters."""
ARRIVAL_DECELERATION = 0.8
"""Deceleration before the goal, m/s2."""
REST_VELOCITIES = (0.02, 0.05)
"""Forward velocity, m/s, and turn rate, rad/s, below which the robot is at rest."""
DOCK_REST_STEPS = 10
"""Control steps that the robot rests at a goal with a heading before it says that it has arrived."""


class GoalArrival:
    """Brings the robot to rest at its goal, by the policy's own estimate of the pose.

    Args:
        episode: the goal and its heading.

    Attributes:
        active: whether the robot has to come to rest at its goal.
        short: distance from the goal at which the robot stops, meters.
        radius: greatest distance from the goal at the end, meters.
    """

    def __init__(self, episode: EpisodeStart) -> None:
        self._goal, self._heading, self._robot = episode.goal, episode.heading, episode.robot
        self.active = episode.task.rests
        docking = episode.heading is not None
        self.short = DOCK_STOP_DISTANCE_M if docking else STOP_DISTANCE_M
        self.radius = DOCK_DISTANCE_M if docking else REST_DISTANCE
        self._stay = DOCK_REST_STEPS if docking else 1
        self._nearest = math.inf
        self._parked = False
        self._rested = 0

    def limited(self, action: NDArray[np.floating[Any]], pose: Pose) -> NDArray[np.floating[Any]]:
        """Return an action that is slowed down so that the robot ends at rest at the goal.

        Args:
            action: of the policy, (2,) in [-1, 1].
            pose: of the robot in the start frame.
        """
        if not self.active:
            return action
        away = math.dist(pose[:2], self._goal)
        receding = away < DOCK_DISTANCE_M and away > self._nearest + 1e-3
        self._nearest = min(self._nearest, away)
        self._parked = self._parked or away <= self.short + DOCK_STOP_DISTANCE_M / 2.0 or receding
        if self._parked:
            return self._turned(pose)
        v, w = self._robot.twist(float(action[0]), float(action[1]))
        slow = min(v, approach_speed(away - self.short, ARRIVAL_DECELERATION))
        return velocities_to_action(slow, w * slow / v if v > 0.0 else w, self._robot)

    def reached(self, pose: Pose, velocity: NDArray[np.floating[Any]]) -> bool:
        """Return whether the drive is over: the robot rests within the goal's disc and, if asked for, at its heading.

        Args:
            pose: of the robot in the start frame.
            velocity: (2,) m/s and rad/s.
        """
        resting = abs(float(velocity[0])) <= REST_VELOCITIES[0] and abs(float(velocity[1])) <= REST_VELOCITIES[1]
        inside = math.dist(pose[:2], self._goal) <= self.radius
        turned = self._heading is None or abs(wrap_angle(self._heading - pose[2])) <= DOCK_ANGLE_RAD
        self._rested = self._rested + 1 if self.active and resting and inside and turned else 0
        return self._rested >= self._stay

    def _turned(self, pose: Pose) -> Array:
        """Return the action of a robot at the goal: stay, or turn to the heading."""
        if self._heading is None:
            return np.zeros(2)
        return turn_towards(self._heading - pose[2], self._robot)


class ArrivingPolicy(Policy):
    """A policy that comes to rest at its goal by the odometry."""

    _arrival: GoalArrival | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Store the robot and the goal."""
        self._robot, self._arrival = episode.robot, GoalArrival(episode)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Return the action of `drive`, slowed down near the goal."""
        pose = planar_pose(observation["odometry"])
        action = self.drive(observation, pose)
        return action if self._arrival is None else self._arrival.limited(action, pose)

    def stop(self, observation: Observation) -> bool:
        """Whether the robot rests at the goal."""
        pose = planar_pose(observation["odometry"])
        return self._arrival is not None and self._arrival.reached(pose, observation["velocity"])

    @abstractmethod
    def drive(self, observation: Observation, pose: Pose) -> NDArray[np.floating[Any]]:
        """Return the action (2,) that leads to the goal, for a robot at a pose in the start frame."""


def shortened(path: Array, length: float) -> Array:
    """Return a polyline (n, 2) without its last `length` meters; its first point if it is shorter."""
    along = lengths_along(path)
    end = along[-1] - length
    if end <= 0.0:
        return path[:1]
    return np.vstack([path[along < end - 1e-9], points_at(path, np.array([end]))])


def planar_pose(odometry: NDArray[np.floating[Any]]) -> Pose:
    """Return an odometry reading as a pose (x, y, yaw)."""
    x, y, yaw = (float(value) for value in odometry)
    return x, y, yaw
