"""render_mode="human" shows the pictures of "rgb_array" in a window, or says in one line what is missing."""

from __future__ import annotations

import copy
import pickle
import sys

import gymnasium as gym
import numpy as np
import pytest

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.window import DISPLAYS, MissingDisplayError, PictureWindow
from labgym.errors import MissingDependencyError, OptionError
from labgym.layouts import Layout

ID = "LabFloorNav-v0"
SIZE = {"width": 160, "height": 120}


@pytest.fixture
def pygame(monkeypatch: pytest.MonkeyPatch):
    """Pygame without a screen."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    module = pytest.importorskip("pygame")
    yield module
    module.display.quit()


def shown(pygame) -> np.ndarray:
    """The pixels of the window."""
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


def test_the_window_shows_every_picture_and_goes_with_close(pygame, layout: Layout) -> None:
    env = gym.make(ID, layout=layout, render_mode="human", control_dt=0.025, **SIZE)
    other = gym.make(ID, layout=layout, render_mode="rgb_array", control_dt=0.025, **SIZE)
    assert env.render_mode == "human"
    for each in (env, other):
        each.reset(seed=0, options={"pair": 0})
    np.testing.assert_array_equal(shown(pygame), other.render())
    for _ in range(4):
        for each in (env, other):
            each.step(np.array([-1.0, 1.0], np.float32))
    np.testing.assert_array_equal(shown(pygame), other.render())
    assert env.render() is None
    np.testing.assert_array_equal(shown(pygame), other.render())
    copy.deepcopy(env).close()
    pickle.loads(pickle.dumps(env)).close()
    env.close()
    env.close()
    assert pygame.display.get_surface() is None
    other.close()


def test_without_a_display_one_line_says_what_to_use(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("elsewhere the system itself has the screen")
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(MissingDisplayError, match="rgb_array") as caught:
        gym.make(ID, layout=layout, render_mode="human")
    assert "\n" not in str(caught.value)


def test_a_display_that_cannot_be_opened_is_one_line(pygame, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "nosuchdriver")
    with pytest.raises(MissingDisplayError, match="display") as caught:
        PictureWindow(10.0).show(np.zeros((8, 8, 3), np.uint8))
    assert "\n" not in str(caught.value)


def test_without_pygame_one_line_names_the_extra(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[train\]"):
        gym.make(ID, layout=layout, render_mode="human")


def test_a_vector_environment_has_no_window(layout: Layout) -> None:
    pytest.importorskip("numba")
    with pytest.raises(OptionError, match="human"):
        gym.make_vec(ID, num_envs=2, vectorization_mode="vector_entry_point", layout=layout, render_mode="human")
