"""Guidance of the denoising: the gradient of a collision cost pushes trajectories away from the obstacles seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.geometry import to_world
from labgym.navigation import Pose
from labgym.policies.navdp.seen_obstacles import Clearance

Array = NDArray[np.float64]

REPEATS = 4
"""Gradient steps in one denoising step."""
SMOOTH = 4
"""A point's push moves its neighbors too, by shares that fall to 0 over this many points."""


@dataclass(frozen=True, eq=False)
class Guidance:
    """Descends the cost C = 1/2 sum_k max(0, margin - d(p_k))^2 over the points p_k of a trajectory.

    d is the distance to the nearest obstacle seen. The gradient with respect to the points is smoothed along the
    trajectory, which keeps its shape, and fades out towards the robot, whose place is given.

    Attributes:
        clearance: distances to the obstacles.
        pose: of the robot, in the frame of the clearance.
        margin: distance beyond which an obstacle costs nothing, meters.
        scale: of the steps (`DiffusionOptions.scale`).
        last: number of denoising steps, from the end, that are guided.
    """

    clearance: Clearance
    pose: Pose
    margin: float
    scale: float
    last: int

    def guided(self, steps: Tensor) -> Tensor:
        """Return steps (n, points, 3) after some gradient steps, in [-1, 1]; the turns stay."""
        points = steps[..., :2].numpy().astype(np.float64).cumsum(axis=1) / self.scale
        smoothing = _smoothing(points.shape[1])
        for _ in range(REPEATS):
            points = points + smoothing @ self.push(points)
        moved = np.diff(points, axis=1, prepend=np.zeros((len(points), 1, 2))) * self.scale
        xy = torch.from_numpy(moved).to(steps.dtype).clamp(-1.0, 1.0)
        return torch.cat([xy, steps[..., 2:]], dim=2)

    def push(self, points: Array) -> Array:
        """Return the negative gradient of the cost at points (n, k, 2) of the robot frame, meters; same shape."""
        there = to_world(points.reshape(-1, 2), self.pose)
        lack = np.maximum(self.margin - self.clearance.at(there), 0.0)
        push = lack[:, None] * self.clearance.slope(there)
        cosine, sine = np.cos(self.pose[2]), np.sin(self.pose[2])
        ahead, left = cosine * push[:, 0] + sine * push[:, 1], cosine * push[:, 1] - sine * push[:, 0]
        return np.stack([ahead, left], axis=-1).reshape(points.shape)


def _smoothing(count: int) -> Array:
    """Return the matrix (count, count) that smooths pushes along a trajectory, weaker near the robot."""
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    kernel = np.maximum(1.0 - apart / SMOOTH, 0.0) / SMOOTH
    return np.asarray(np.minimum(np.arange(1, count + 1) / SMOOTH, 1.0)[:, None] * kernel)
