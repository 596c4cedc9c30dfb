"""What the network sees, as one vector: goal, velocity, where the robot was before, and what its sensor shows."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS
from labgym.navigation import Pose
from labgym.policies.policy import Observation
from labgym.policies.ppo.surroundings import Surroundings

Sensor = Literal["lidar", "depth"]
Vector = NDArray[np.float32]

TRAIL = (5, 10, 20, 40, 80, 160)
"""How many control steps ago the remembered positions were."""

GOAL, VELOCITY = 3, 2
KNOWN = GOAL + VELOCITY + 2 * len(TRAIL)
"""Length of what the vector begins with, whatever the sensor."""
SPEED = GOAL
"""Where the vector holds the forward velocity, m/s."""

POOL = 4
"""A picture is taken down to the nearest of squares of this many pixels."""
SMALL_IMAGE = (IMAGE_SHAPE[0] // POOL, IMAGE_SHAPE[1] // POOL)

SIZES: dict[Sensor, int] = {
    "lidar": KNOWN + LIDAR_RAYS,
    "depth": KNOWN + LIDAR_RAYS + SMALL_IMAGE[0] * SMALL_IMAGE[1],
}
"""Length of the vector."""


class DriveMemory:
    """Turns the observations of one drive into the network's vectors; remembers where the robot was and what it saw.

    A vector is float32 (SIZES[sensor],): `goal` (3,) and `velocity` (2,) as the environment gives them; the robot's
    positions 0.5, 1, 2, 4, 8 and 16 s ago in its present frame, x ahead and y to the left, metres, which tell that it
    has been going back and forth (before the drive began it stood where it began); then ranges (180,). With the lidar
    these are its own. With the depth camera they are those of `Surroundings`, and the picture follows, taken down to
    18 x 32 by the nearest of each square.

    Args:
        sensor: whose observations it is shown.
    """

    def __init__(self, sensor: Sensor) -> None:
        self._sensor = sensor
        self.reset()

    def reset(self) -> None:
        """Forget the drive."""
        self._first: Pose | None = None
        self._places: list[tuple[float, float]] = []
        self._surroundings = Surroundings() if self._sensor == "depth" else None

    def vector(self, observation: Observation, pose: ArrayLike) -> Vector:
        """Return the vector of the next control step.

        Args:
            observation: with `goal`, `velocity` and the sensor's.
            pose: (x, y, yaw) in any frame that stays the same during the drive.
        """
        x, y, yaw = np.asarray(pose, dtype=np.float64).tolist()
        self._first = self._first or (x, y, yaw)
        self._places.append((x, y))
        last = len(self._places) - 1
        trail = np.array([self._places[max(last - steps, 0)] for steps in TRAIL])
        parts = [observation["goal"], observation["velocity"], in_frame(trail, (x, y, yaw)).ravel()]
        if self._surroundings is None:
            parts.append(observation["lidar"])
        else:
            picture = np.asarray(observation["depth"]).reshape(IMAGE_SHAPE)
            here = in_frame(np.array([(x, y)]), self._first)[0].tolist()
            parts.append(self._surroundings.ranges(picture, (here[0], here[1], yaw - self._first[2])))
            parts.append(picture.reshape(SMALL_IMAGE[0], POOL, SMALL_IMAGE[1], POOL).min(axis=(1, 3)).ravel())
        return np.concatenate(parts).astype(np.float32)


def in_frame(points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Return points (n, 2) as they are seen from a pose of the same frame."""
    x, y = (points - pose[:2]).T
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    return np.column_stack([cosine * x + sine * y, cosine * y - sine * x])
