"""Between the start frame, the robot's and the camera's ground frame, in which servers think.

The camera's ground frame has its origin on the floor below the lens, x ahead, y to the left.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import rotate, wrap_angle
from labgym.navigation import Pose

Array = NDArray[np.float64]


def to_start_frame(trajectory: Array, pose: Pose, camera_forward: float) -> Array:
    """Return the path (n, 2) for the robot's axis that a trajectory asks for, in the start frame.

    It begins at the robot. Points as near to the lens as the robot's axis is are left out: to drive by way of the lens
    would keep it from turning where it stands.

    Args:
        trajectory: (n, 2) in the camera's ground frame.
        pose: of the robot in the start frame.
        camera_forward: from the robot's axis to the lens, metres.
    """
    kept = trajectory[np.linalg.norm(trajectory, axis=1) > camera_forward] + (camera_forward, 0.0)
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    turned = np.column_stack([cosine * kept[:, 0] - sine * kept[:, 1], sine * kept[:, 0] + cosine * kept[:, 1]])
    return np.concatenate([[pose[:2]], turned + pose[:2]])


def to_camera_frame(path: Array, pose: Pose, camera_forward: float) -> Array:
    """Return points (n, 2) of the start frame in the camera's ground frame of a robot at a pose."""
    offset = path - np.asarray(pose[:2])
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return np.column_stack(
        [cosine * offset[:, 0] + sine * offset[:, 1] - camera_forward, cosine * offset[:, 1] - sine * offset[:, 0]]
    )


def relative(frame: Pose, pose: Pose) -> Pose:
    """Return a pose as it is in the frame of another."""
    x, y = rotate(pose[0] - frame[0], pose[1] - frame[1], -frame[2])
    return x, y, wrap_angle(pose[2] - frame[2])


def state_of(pose: Pose, velocity: NDArray[Any]) -> dict[str, list[list[float]]]:
    """Return `state_data`: position, quaternion (x, y, z, w), as x-navdp has it, and velocity (m/s, rad/s)."""
    half = pose[2] / 2.0
    return {
        "robot_pos": [[pose[0], pose[1], 0.0]],
        "robot_quat": [[0.0, 0.0, math.sin(half), math.cos(half)]],
        "velocity": [[float(velocity[0]), float(velocity[1])]],
    }
