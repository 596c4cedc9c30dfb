"""MP4 files of camera images, and the videos of the format "lerobot"; bytes depend on images and ffmpeg alone."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import LabgymError, optional_package

CODEC, PIXELS = "h264", "yuv420p"

QUALITY = "18"
"""Constant rate factor of color: hardly visible losses."""

LOSSLESS = "0"

KEY_FRAMES = "2"
"""Every second image can be decoded alone or with one other, as in LeRobot's own videos: training reads at random."""

DEPTH_REACH_M = 10.0
"""Depth that is white, meters."""


def mp4(frames: Iterable[NDArray[np.uint8]], shape: tuple[int, int], rate: int, lossless: bool = False) -> bytes:
    """Return images as an MP4 video in H.264.

    Args:
        frames: (rows, columns, 3) RGB. shape: rows and columns. rate: images per second.
        lossless: whether the encoder keeps the values of brightness, for which 8 bits hold 220 steps.

    Raises:
        MissingDependencyError: imageio-ffmpeg is not installed.
        LabgymError: ffmpeg failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "video.mp4"
        command = [
            *(_ffmpeg(), "-v", "error", "-y"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{shape[1]}x{shape[0]}", "-r", str(rate), "-i", "-"),
            *("-an", "-c:v", "libx264", "-preset", "medium", "-crf", LOSSLESS if lossless else QUALITY),
            *("-g", KEY_FRAMES, "-bf", "0", "-pix_fmt", PIXELS, "-threads", "1"),
            *("-sws_flags", "bicubic+bitexact+accurate_rnd+full_chroma_int"),
            *("-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart"),
            str(target),
        ]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            content = b"".join(np.ascontiguousarray(frame).tobytes() for frame in frames)
            _, errors = process.communicate(content)
        if process.returncode or not target.is_file():
            reason = " ".join(errors.decode(errors="replace").split())[-200:]
            raise LabgymError(f"ffmpeg could not write a video ({reason or process.returncode})")
        return target.read_bytes()


def depth_picture(depth: NDArray[Any]) -> NDArray[np.uint8]:
    """Return depth images (..., rows, columns), meters, as gray images (..., rows, columns, 3): white is 10 m."""
    gray = np.rint(np.clip(depth / DEPTH_REACH_M, 0.0, 1.0) * 255.0).astype(np.uint8)
    return np.repeat(gray[..., None], 3, axis=-1)


def _ffmpeg() -> str:
    """Return the path of the program that imageio-ffmpeg ships."""
    with optional_package("imageio-ffmpeg", "videos of the format lerobot", "data"):
        import imageio_ffmpeg
    return str(imageio_ffmpeg.get_ffmpeg_exe())


STEPS_PER_SECOND = round(1.0 / ROBOT.control_dt)
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
            yield path, mp4(pictures, IMAGE_SHAPE, STEPS_PER_SECOND, lossless=name == "depth")


def camera_pictures(name: str, values: NDArray[Any]) -> NDArray[np.uint8]:
    """Return an entry of the camera, "rgb" or "depth" in meters, as images (n, rows, columns, 3)."""
    return depth_picture(values.reshape(-1, *IMAGE_SHAPE)) if name == "depth" else values


def file_place(shard: int) -> dict[str, int]:
    """Return chunk and file of a shard."""
    return {"chunk_index": shard // FILES_PER_CHUNK, "file_index": shard % FILES_PER_CHUNK}
