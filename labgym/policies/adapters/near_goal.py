"""The goal up close, as an input of trained networks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

NEAR = 1.0
"""Distance from which on the input stays the same, meters."""
SCALE = 5.0
"""The input at that distance. A network that must stop within 0.36 m has to tell decimeters near the goal, which the
normalized distance of a whole drive shrinks to hundredths."""


def near_goal(goal: NDArray[Any]) -> NDArray[np.float32]:
    """Return distance, x and y of the goal in the robot frame, (..., 3): at most 5, which stands for a meter.

    Args:
        goal: distance, cosine and sine of the bearing, as of `GoalSensor`, shape (..., 3).
    """
    distance = SCALE / NEAR * np.minimum(goal[..., :1], NEAR)
    near: NDArray[np.float32] = np.concatenate([distance, distance * goal[..., 1:]], axis=-1).astype(np.float32)
    return near
