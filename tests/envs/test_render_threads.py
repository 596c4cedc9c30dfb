"""Pictures from any thread are those of one thread."""

from __future__ import annotations

import gc
import threading

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs import LabPointNavEnv
from labgym.scenes import MissingRendererError


def picture(env):
    try:
        return env.render()
    except MissingRendererError as error:
        pytest.skip(str(error))


def in_thread(function, *arguments):
    results = []
    thread = threading.Thread(target=lambda: results.append(function(*arguments)))
    thread.start()
    thread.join()
    return results[0]


def test_threads_in_turn_and_at_once_draw_the_same_picture():
    env = LabPointNavEnv(layout=island_laboratory(), render_mode="rgb_array", width=64, height=48)
    env.reset(seed=1)
    expected = picture(env)
    for _ in range(2):
        np.testing.assert_array_equal(in_thread(env.render), expected)
        np.testing.assert_array_equal(env.render(), expected)
    other = LabPointNavEnv(layout=island_laboratory(), render_mode="rgb_array", width=64, height=48)
    other.reset(seed=1)
    pictures: list[np.ndarray] = []
    threads = [threading.Thread(target=lambda one=one: pictures.append(one.render())) for one in (env, other) * 3]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pictures) == 6
    for each in pictures:
        np.testing.assert_array_equal(each, expected)
    in_thread(other.close)
    del other
    gc.collect()
    np.testing.assert_array_equal(env.render(), expected)
    env.close()
    env.reset(seed=1)
    np.testing.assert_array_equal(in_thread(env.render), expected)
    env.close()
