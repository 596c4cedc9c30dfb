"""Maps of many layouts in one tensor, sampled at points of a batch, and the frames of robots on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from labgym.policies.data.maps import Maps


def rotated(points: Tensor, angle: Tensor) -> Tensor:
    """Return points (b, n, 2) rotated about the origin by angles (b,), radians."""
    cosine, sine = angle.cos()[:, None], angle.sin()[:, None]
    x, y = points[..., 0], points[..., 1]
    return torch.stack([cosine * x - sine * y, sine * x + cosine * y], dim=2)


def to_world(points: Tensor, pose: Tensor) -> Tensor:
    """Transform points of local frames to the outer frame.

    Args:
        points: (b, n, 2) in the local frames.
        pose: (b, 3), (x, y, yaw) of each local frame in the outer frame.

    Returns:
        (b, n, 2) in the outer frame.
    """
    cosine, sine = pose[:, 2:].cos(), pose[:, 2:].sin()
    x, y = points[..., 0], points[..., 1]
    return torch.stack([pose[:, :1] + cosine * x - sine * y, pose[:, 1:2] + sine * x + cosine * y], dim=2)


class MapStack:
    """One field per layout, sampled differentiably.

    Args:
        maps: one per layout, all of one resolution; they give origin and resolution.
        fields: (ny, nx) float32, the field of each layout.
        interpolation: "bilinear" or "bicubic".
        outside: "edge" continues each field by its edge; "zero" makes it 0 outside.
    """

    def __init__(
        self,
        maps: Sequence[Maps],
        fields: Sequence[NDArray[np.float32]],
        interpolation: Literal["bilinear", "bicubic"],
        outside: Literal["edge", "zero"],
    ) -> None:
        rows, columns = (max(field.shape[axis] for field in fields) for axis in range(2))
        padded = [_padded(field, rows, columns, outside) for field in fields]
        self._fields = torch.from_numpy(np.stack(padded))[:, None]
        self._origins = torch.tensor([each.origin for each in maps], dtype=torch.float32)
        self._size = torch.tensor([columns, rows]) * maps[0].resolution
        self._interpolation, self._padding = interpolation, "border" if outside == "edge" else "zeros"

    def at(self, points: Tensor, place: Tensor) -> Tensor:
        """Return the fields' values at points.

        Args:
            points: (b, n, 2) in the room frame, meters.
            place: (b,) index of the layout of each row of points.

        Returns:
            (b, n).
        """
        grid = 2.0 * (points - self._origins[place][:, None]) / self._size - 1.0
        values = functional.grid_sample(
            self._fields[place],
            grid[:, None],
            mode=self._interpolation,
            padding_mode=self._padding,
            align_corners=False,
        )
        return values[:, 0, 0]


def _padded(
    field: NDArray[np.float32], rows: int, columns: int, outside: Literal["edge", "zero"]
) -> NDArray[np.float32]:
    widths = ((0, rows - field.shape[0]), (0, columns - field.shape[1]))
    return np.pad(field, widths, mode="edge") if outside == "edge" else np.pad(field, widths)
