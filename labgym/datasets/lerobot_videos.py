"""The videos of the format "lerobot", which the shards write."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.datasets.video import depth_picture, mp4
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE

RATE = round(1.0 / ROBOT.control_dt)
"""Steps per second."""
FILES_PER_CHUNK = 1000
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
VIDEOS = {"rgb": "observation.images.rgb", "depth": "observation.images.depth"}
"""Features of the camera's entries."""


def lerobot_videos(index: int, observations: Sequence[dict[str, NDArray[Any]]]) -> Iterator[tuple[str, bytes]]:
    """Yield the videos of a shard by path, all its episodes one after the other; none without a camera.

    Args:
        index: of the shard. observations: before each action.
    """
    for name, feature in VIDEOS.items():
        if observations and name in observations[0]:
            pictures = camera_pictures(name, np.stack([each[name] for each in observations]))
            path = VIDEO_PATH.format(video_key=feature, **file_place(index))
            yield path, mp4(pictures, IMAGE_SHAPE, RATE, lossless=name == "depth")


def camera_pictures(name: str, values: NDArray[Any]) -> NDArray[np.uint8]:
    """Return an entry of the camera, "rgb" or "depth" in meters, as images (n, rows, columns, 3)."""
    return depth_picture(values.reshape(-1, *IMAGE_SHAPE)) if name == "depth" else values


def file_place(shard: int) -> dict[str, int]:
    """Return chunk and file of a shard."""
    return {"chunk_index": shard // FILES_PER_CHUNK, "file_index": shard % FILES_PER_CHUNK}
