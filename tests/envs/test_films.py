"""Gymnasium's `RecordVideo` writes films of the environments that a player can read."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordVideo
from laboratories import island_laboratory

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.wrappers import MapInset

pytest.importorskip("moviepy")
imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")

SIZE, STEPS = (160, 120), 5


@pytest.mark.parametrize("inset", [False, True])
def test_a_recorded_film_shows_what_render_returned(inset, tmp_path):
    single = gym.make(
        "LabFloorNav-v0", layout=island_laboratory(), render_mode="rgb_array", width=SIZE[0], height=SIZE[1]
    )
    env = RecordVideo(MapInset(single) if inset else single, str(tmp_path / "films"))
    env.reset(seed=0)
    pictures = [env.env.render()]
    for _ in range(STEPS):
        env.step(np.array([1.0, 0.5], np.float32))
        pictures.append(env.env.render())
    env.close()
    (film,) = (tmp_path / "films").glob("*.mp4")
    frames = imageio_ffmpeg.read_frames(str(film))
    description = next(frames)
    assert (description["size"], description["fps"]) == (SIZE, 10.0), "a control step lasts 0.1 s"
    decoded = [np.frombuffer(frame, np.uint8).reshape(SIZE[1], SIZE[0], 3) for frame in frames]
    assert len(decoded) == len(pictures)
    for frame, picture in zip(decoded, pictures, strict=True):
        assert np.abs(frame.astype(int) - picture.astype(int)).mean() < 10.0, "the codec loses little"
