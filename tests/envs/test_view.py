"""Pictures of the robot; they need OpenGL."""

from __future__ import annotations

import copy
import warnings

import furnished_floors
import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from labgym.envs import LabPointNavEnv, view
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.scenes import MissingRendererError, Quality, RayScene

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


def test_the_floor_is_darker_where_the_robot_stands_on_it(env: LabPointNavEnv, monkeypatch: pytest.MonkeyPatch) -> None:
    shaded = picture(env).astype(int).sum(axis=2)
    monkeypatch.setattr(view, "SHADOW_RADII_M", ())
    bright = picture(env).astype(int).sum(axis=2)
    rows, columns = np.nonzero(shaded != bright)
    assert len(rows) > 100
    assert (shaded[rows, columns] < bright[rows, columns]).mean() > 0.98
    assert np.abs(np.median(rows) - 130) < 60
    assert np.abs(np.median(columns) - 160) < 60


@pytest.mark.parametrize("pair", [0, 1, 2])
def test_furniture_does_not_hide_the_robot_wherever_it_stands(env: LabPointNavEnv, pair: int) -> None:
    env.reset(options={"pair": pair})
    assert accent(picture(env)) > 10


def test_an_open_door_does_not_hide_the_robot() -> None:
    """The leaf stands between the robot and the first place of the camera: behind it on the right."""
    layout = Layout(id="door", floor=furnished_floors.suite(), placements=())
    camera = view.ChaseView(320, 240)
    try:
        image = camera.picture(layout, RayScene(layout, "visual"), (2.1, 3.4, 0.0))
    except MissingRendererError as error:
        pytest.skip(str(error))
    camera.close()
    assert accent(image) > 60


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


def test_gymnasiums_checker_accepts_every_render_mode(
    env: LabPointNavEnv, layout: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # the mode "human" needs a screen
    picture(env)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # v1 is registered, too; v0 is the environment that is checked here.
        warnings.filterwarnings("ignore", message=".*LabPointNav-v0 is out of date")
        wrapped = gym.make("LabPointNav-v0", layout=layout, render_mode="rgb_array", width=160, height=120)
        check_env(wrapped.unwrapped)
        wrapped.close()


def test_without_a_render_mode_there_is_a_warning_and_no_picture(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render mode"):
        assert env.render() is None


def drawn(env: LabPointNavEnv, layout: Layout, quality: Quality) -> tuple[np.ndarray, np.ndarray]:
    """Camera image of the first observation, and the picture of the same moment."""
    env = LabPointNavEnv(
        layout=layout, observation="rgbd", render_mode="rgb_array", width=320, height=240, quality=quality
    )
    observation, _ = env.reset(seed=0, options={"pair": 0})
    image = picture(env).astype(float).mean(axis=2)
    env.close()
    return observation["rgb"], image


def test_a_fast_picture_shows_the_same_view_and_observations_do_not_depend_on_quality(
    env: LabPointNavEnv, layout: Layout
) -> None:
    (image, fast), (image_fine, fine) = drawn(env, layout, "fast"), drawn(env, layout, "fine")
    np.testing.assert_array_equal(image, image_fine)
    assert np.corrcoef(fast.ravel(), fine.ravel())[0, 1] > 0.8
    # Shadows darken the fine picture by tens of grey levels over a part of it.
    assert np.mean(fast - fine > 20.0) > 0.02


def test_an_unknown_quality_lists_those_that_exist(layout: Layout) -> None:
    with pytest.raises(UnknownNameError, match=r"best.*fast, fine"):
        LabPointNavEnv(layout=layout, quality="best")  # type: ignore[arg-type]


def test_an_environment_that_has_rendered_can_be_copied(env: LabPointNavEnv) -> None:
    env.reset(seed=0)
    picture = env.render()
    other = copy.deepcopy(env)
    np.testing.assert_array_equal(other.render(), picture)
    other.close()
