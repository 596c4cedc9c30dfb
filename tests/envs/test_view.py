"""Pictures of the robot; they need OpenGL."""

from __future__ import annotations

import copy
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from labgym.envs import LabPointNavEnv
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.scenes import MissingRendererError, Quality

BACK = np.array([-1.0, 0.0], np.float32)


def picture(env: gym.Env) -> np.ndarray:
    try:
        return env.render()
    except MissingRendererError as error:
        pytest.skip(str(error))


@pytest.fixture
def env(layout: Layout) -> LabPointNavEnv:
    env = LabPointNavEnv(layout=layout, render_mode="rgb_array", width=320, height=240)
    env.reset(seed=0, options={"pair": 0})
    yield env
    env.close()


def accent(image: np.ndarray) -> int:
    """Number of pixels of the robot's teal."""
    red, green, blue = (image[..., k].astype(int) for k in range(3))
    return int(((green - red > 60) & (blue - red > 60)).sum())


def test_the_picture_shows_the_robot_in_the_requested_size(env: LabPointNavEnv) -> None:
    image = picture(env)
    assert image.shape == (240, 320, 3)
    assert image.dtype == np.uint8
    assert accent(image[60:180, 80:240]) > 10


@pytest.mark.parametrize("pair", [0, 1, 2])
def test_furniture_does_not_hide_the_robot_wherever_it_stands(env: LabPointNavEnv, pair: int) -> None:
    env.reset(options={"pair": pair})
    assert accent(picture(env)) > 10


def test_the_picture_changes_as_the_robot_drives_and_not_before(env: LabPointNavEnv) -> None:
    first = picture(env)
    assert np.array_equal(first, picture(env))
    for _ in range(10):
        env.step(BACK)
    assert not np.array_equal(first, picture(env))


def test_a_picture_can_be_taken_again_after_close_and_reset(env: LabPointNavEnv) -> None:
    first = picture(env)
    env.close()
    env.reset(seed=0, options={"pair": 0})
    assert np.array_equal(first, picture(env))


def test_a_picture_beyond_the_buffer_is_refused(layout: Layout) -> None:
    with pytest.raises(OptionError, match="width in pixels is 100000"):
        LabPointNavEnv(layout=layout, render_mode="rgb_array", width=100_000)


