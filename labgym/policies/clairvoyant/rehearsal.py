"""A rehearsal: the motion of the robot that follows a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.navigation import Pose
from labgym.policies.clairvoyant.reference import GAIN_ACROSS, GAIN_ALONG, GAIN_YAW, Reference
from labgym.policies.clairvoyant.rehearsal_kernel import Base, follow

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """The motion at even times.

    Attributes:
        start: time of the first pose, seconds. dt: time between them, seconds.
        poses: (k, 3) meters and radians. velocities: (k, 2) m/s and rad/s.
    """

    start: float
    dt: float
    poses: Array
    velocities: Array

    def at(self, time: float) -> tuple[float, float, float, float, float]:
        """Return x, y, vx, vy (m and m/s) and the turn rate (rad/s) at a time; at rest at the end after it."""
        index = round((time - self.start) / self.dt)
        last = len(self.poses) - 1
        x, y, yaw = self.poses[min(max(index, 0), last)].tolist()
        v, w = self.velocities[max(index, 0)].tolist() if index <= last else (0.0, 0.0)
        return x, y, v * math.cos(yaw), v * math.sin(yaw), w


def rehearsed(
    reference: Reference,
    pose: Pose,
    velocity: tuple[float, float],
    time: float,
    robot: RobotSpec = ROBOT,
) -> Rehearsal:
    """Return the motion that follows a reference from a pose and a velocity at a time until its end.

    Args:
        reference: the motion to follow. pose, velocity, time: of the robot now.
        robot: its limits.
    """
    motion = follow(
        reference.poses,
        reference.velocities,
        (reference.start, reference.dt, time),
        (float(pose[0]), float(pose[1]), float(pose[2]), float(velocity[0]), float(velocity[1])),
        max(0, round((reference.end - time) / reference.dt)),
        (GAIN_ALONG, GAIN_ACROSS, GAIN_YAW),
        Base(
            robot.v_min,
            robot.v_max,
            robot.w_max,
            robot.acceleration,
            robot.turn_acceleration,
            robot.lag,
            robot.timestep,
            robot.substeps,
        ),
    )
    return Rehearsal(time, reference.dt, motion[:, :3], motion[:, 3:])
