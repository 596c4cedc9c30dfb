"""What a path is worth to somebody who knows the map: the critic's labels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from labgym.policies.data.maps import Maps
from labgym.policies.navdp.config import LossOptions


class DistanceMaps:
    """Distances to the nearest obstacle in many layouts, in one tensor, sampled bilinearly.

    Args:
        maps: one a layout, all of one resolution; beyond their edge there is an obstacle.
    """

    def __init__(self, maps: Sequence[Maps]) -> None:
        rows, columns = (max(each.distance.shape[axis] for each in maps) for axis in range(2))
        padded = [
            np.pad(each.distance, ((0, rows - each.distance.shape[0]), (0, columns - each.distance.shape[1])))
            for each in maps
        ]
        self._distances = torch.from_numpy(np.stack(padded))[:, None]
        self._origins = torch.tensor([each.origin for each in maps], dtype=torch.float32)
        self._size = torch.tensor([columns, rows]) * maps[0].resolution

    def at(self, points: Tensor, place: Tensor) -> Tensor:
        """Return distances (b, n), metres, at points (b, n, 2) of the room frame in the maps of index `place` (b,)."""
        grid = 2.0 * (points - self._origins[place][:, None]) / self._size - 1.0
        found = functional.grid_sample(
            self._distances[place], grid[:, None], mode="bilinear", padding_mode="zeros", align_corners=False
        )
        return found[:, 0, 0]


def path_value(distance: Tensor, options: LossOptions) -> Tensor:
    """Return the value (b,) of paths from the distances (b, n) of their points to the nearest obstacle, metres."""
    unsafe = (distance < options.margin).float().mean(dim=1)
    return options.unsafe * unsafe + options.opening * (distance[:, -1] - distance[:, 0])


def in_room(points: Tensor, pose: Tensor) -> Tensor:
    """Return points (b, n, 2) of the robot frame in the room frame, for poses (b, 3)."""
    cosine, sine = pose[:, 2:].cos(), pose[:, 2:].sin()
    x, y = points[..., 0], points[..., 1]
    return torch.stack([pose[:, :1] + cosine * x - sine * y, pose[:, 1:2] + sine * x + cosine * y], dim=2)
