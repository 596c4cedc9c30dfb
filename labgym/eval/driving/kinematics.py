"""Whether a route can have been driven: no pose is farther from the last one than the robot can move in a step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.robot import ROBOT, RobotSpec

SLACK = 1.02
"""Tolerance of the servos' limits: factor."""
KICK = 10.0
"""Limit of the speed after a contact, m/s; the largest in 774 published drives is 5.8 m/s."""

Array = NDArray[np.float64]


def first_jump(
    poses: ArrayLike,
    touched: ArrayLike,
    control_dt: float,
    robot: RobotSpec = ROBOT,
    resolution: float = 0.0,
) -> int | None:
    """Return the index of the first pose that the robot cannot have reached from the one before; None if all can be.

    The robot starts at rest. Without contact, its speed and its turn rate change by no more than their accelerations
    allow (drive and grip of the wheels together), and rise no further than their limits. Contacts with obstacles cause
    impulses, so that a step with a contact, and the step after it, are only checked against `KICK`. A robot that turns
    faster than its servo can turn it still spins from a contact. Its wheels then slip, and its speed is that of the
    drive and of the slip together.

    Args:
        poses: (n, 3) x, y and yaw after each control step, the start first; meters and radians.
        touched: (n - 1,) whether the robot may have touched something in each step.
        control_dt: duration of a step, seconds.
        robot: limits of the robot.
        resolution: step of the grid to which the poses are rounded, meters and radians.
    """
    poses, touched = np.asarray(poses, dtype=np.float64).reshape(-1, 3), np.asarray(touched, dtype=bool)
    if not np.isfinite(poses).all():
        return int(np.argmin(np.isfinite(poses).all(axis=1)))
    moved = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
    turned = np.abs((np.diff(poses[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)
    top = max(robot.v_max, -robot.v_min)
    free = ~(touched | np.concatenate([[False], touched[:-1]]))
    acceleration = math.hypot(robot.acceleration, robot.grip)
    spins = turned > robot.w_max * control_dt * SLACK + resolution
    slips = spins | np.concatenate([[False], spins[:-1]])
    too_far = _too_fast(moved, top, acceleration, control_dt, math.sqrt(2.0) * resolution, slips)
    too_far |= _too_fast(turned, robot.w_max, robot.turn_acceleration, control_dt, resolution)
    jumps = np.flatnonzero((free & too_far) | (moved > KICK * control_dt + math.sqrt(2.0) * resolution))
    return int(jumps[0]) + 1 if len(jumps) else None


def possible_contacts(
    poses: ArrayLike, clearances: ArrayLike, control_dt: float, robot: RobotSpec = ROBOT, resolution: float = 0.0
) -> NDArray[np.bool_]:
    """Return whether the robot can have touched something in each step: in the time, it could get there and on.

    Args:
        poses: (n, 3), as in `first_jump`.
        clearances: (n,) distance from the chassis to the nearest obstacle at each pose, meters; 0 if they overlap.
        control_dt, robot, resolution: as in `first_jump`.

    Returns:
        (n - 1,).
    """
    poses, clearances = np.asarray(poses, dtype=np.float64), np.asarray(clearances, dtype=np.float64)
    moved = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
    before = np.concatenate([[0.0], moved[:-1]])
    reach = np.maximum(robot.v_max * control_dt * SLACK, np.maximum(before, moved)) + 3.0 * resolution
    return np.asarray(clearances[:-1] + clearances[1:] <= reach)


def _too_fast(
    steps: Array,
    limit: float,
    acceleration: float,
    dt: float,
    rounding: float,
    slips: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Whether each displacement exceeds the limit of the speed or that of the acceleration; the first is from rest.

    Where the wheels slip, the speed along the heading is limited, and the one across it is at most the speed before.
    """
    before = np.concatenate([[0.0], steps[:-1]])
    driven = limit * dt * SLACK
    fastest = np.maximum(driven, before + rounding)
    if slips is not None:
        fastest = np.where(slips, np.maximum(fastest, np.hypot(driven, np.minimum(before, driven))), fastest)
    faster = before + rounding + acceleration * dt**2 * SLACK
    return np.asarray(steps > np.minimum(fastest, faster) + rounding)
