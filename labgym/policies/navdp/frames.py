"""Camera frames as the network sees them: small, color and depth in bytes."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import IMAGE_SHAPE

HALVED = 2
"""Default factor by which frames are smaller than the camera's images."""

NEAREST, FARTHEST = 0.1, 5.0
"""Range of valid depths, meters; nearer and farther ones become 0, as published."""

Bytes = NDArray[np.uint8]


def frame_shape(shrink: int = HALVED) -> tuple[int, int]:
    """Return rows and columns of frames that are smaller than the camera's images by a factor."""
    return IMAGE_SHAPE[0] // shrink, IMAGE_SHAPE[1] // shrink


def frame(rgb: Bytes, depth: NDArray[np.floating], shrink: int = HALVED) -> Bytes:
    """Return a frame (h, w, 4): red, green, blue, and depth in steps of 2 cm, 0 for none.

    Args:
        rgb: (72, 128, 3). depth: (72, 128), planar, meters. shrink: factor of `frame_shape`.
    """
    size = frame_shape(shrink)[::-1]
    color = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    distance = cv2.resize(np.asarray(depth, dtype=np.float32), size, interpolation=cv2.INTER_AREA)
    valid = (distance >= NEAREST) & (distance <= FARTHEST)
    coded = np.where(valid, np.rint(distance / FARTHEST * 255.0), 0.0).astype(np.uint8)
    return np.dstack([color, coded])
