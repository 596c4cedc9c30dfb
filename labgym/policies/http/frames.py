"""Transforms between the start frame and the camera's ground frame, which the servers use.

The camera's ground frame has its origin on the floor below the lens, x ahead, y to the left.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import to_local, to_world
from labgym.navigation import Pose

Array = NDArray[np.float64]


REST = 0.02
"""Largest distance between the points of a trajectory that means "stand still", meters."""


def to_start_frame(trajectory: Array, pose: Pose, camera_forward: float) -> Array:
    """Return a trajectory as a path (n, 2) of the robot's axis in the start frame, meters, beginning at the robot.

    Points within `camera_forward` of the lens are dropped: a path through the lens would prevent a turn in place. The
    last point of a trajectory that has no others is kept, unless the trajectory means "stand still".

    Args:
        trajectory: (n, 2) in the camera's ground frame.
        pose: pose of the robot in the start frame.
        camera_forward: distance from the robot's axis to the lens, meters.
    """
    ahead = trajectory[np.linalg.norm(trajectory, axis=1) > camera_forward]
    if not len(ahead) and np.linalg.norm(trajectory - trajectory[-1], axis=1).max() > REST:
        ahead = trajectory[-1:]
    return np.concatenate([[pose[:2]], to_world(ahead + np.array([camera_forward, 0.0]), pose)])


def to_camera_frame(path: Array, pose: Pose, camera_forward: float) -> Array:
    """Return points (n, 2) of the start frame in the camera's ground frame of a robot at a pose, meters."""
    return to_local(path, pose) - (camera_forward, 0.0)


def state_of(pose: Pose, velocity: NDArray[Any]) -> dict[str, list[list[float]]]:
    """Return `state_data`: position and quaternion (x, y, z, w) as x-navdp sends them, and velocity (m/s, rad/s)."""
    half = pose[2] / 2.0
    return {
        "robot_pos": [[pose[0], pose[1], 0.0]],
        "robot_quat": [[0.0, 0.0, math.sin(half), math.cos(half)]],
        "velocity": [[float(velocity[0]), float(velocity[1])]],
    }
