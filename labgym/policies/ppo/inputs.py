"""What the network sees: the scan, the goal, the velocity, and where the robot was before, as one vector."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.sensors import LIDAR_RAYS
from labgym.policies.policy import Observation

TRAIL = (5, 10, 20, 40, 80, 160)
"""How many control steps ago the remembered positions were."""

GOAL, VELOCITY = 3, 2
SIZE = LIDAR_RAYS + GOAL + VELOCITY + 2 * len(TRAIL)
"""Length of the vector."""
SPEED = LIDAR_RAYS + GOAL
"""Where the vector holds the forward velocity, m/s."""


class DriveMemory:
    """Turns the observations of one drive into the network's vectors; remembers the poses that it was shown.

    A vector is float32 (SIZE,): `lidar` (180,), `goal` (3,) and `velocity` (2,) as the environment gives them, then
    the robot's positions 0.5, 1, 2, 4, 8 and 16 s ago in its present frame, x ahead and y to the left, metres: they
    tell that it has been going back and forth. Before the drive began it stood where it began.
    """

    def __init__(self) -> None:
        self._poses: list[tuple[float, float]] = []

    def reset(self) -> None:
        """Forget the drive."""
        self._poses.clear()

    def vector(self, observation: Observation, pose: ArrayLike) -> NDArray[np.float32]:
        """Return the vector of the next control step.

        Args:
            observation: with `lidar`, `goal` and `velocity`.
            pose: (x, y, yaw) in any frame that stays the same during the drive.
        """
        x, y, yaw = np.asarray(pose, dtype=np.float64).tolist()
        self._poses.append((x, y))
        last = len(self._poses) - 1
        back = np.array([self._poses[max(last - steps, 0)] for steps in TRAIL]) - (x, y)
        cosine, sine = np.cos(yaw), np.sin(yaw)
        trail = np.column_stack([cosine * back[:, 0] + sine * back[:, 1], cosine * back[:, 1] - sine * back[:, 0]])
        parts: list[NDArray[Any]] = [observation["lidar"], observation["goal"], observation["velocity"], trail.ravel()]
        return np.concatenate(parts).astype(np.float32)
