"""The environments of a training: vectorization, the measures of the logs, training layouts and the start frame."""

from __future__ import annotations

import io
import math
import sys

import gymnasium as gym
import numpy as np
import pytest
from laboratories import island_laboratory

pytest.importorskip("stable_baselines3")

from stable_baselines3.common.vec_env import DummyVecEnv

import labgym  # noqa: F401 -- registers the ids
from labgym.errors import MissingDependencyError, OptionError, UnknownNameError
from labgym.training import environments as layouts_module
from labgym.training import environments as module
from labgym.training import make_environments
from labgym.training.environments import FirstLayouts, NearGoal, StartFrame

LAYOUT = island_laboratory()


def inner(environments):
    return environments.unwrapped if hasattr(environments, "unwrapped") else environments.venv


def test_auto_takes_the_kernel_if_numba_is_installed_and_one_process_otherwise(monkeypatch):
    pytest.importorskip("numba")
    from labgym.envs.vector.stable_baselines import LabVecEnv

    made = make_environments(count=2, layout=LAYOUT)
    assert isinstance(inner(made), LabVecEnv)
    made.close()
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    made = make_environments(count=2, layout=LAYOUT)
    assert isinstance(inner(made), DummyVecEnv)
    made.close()
    with pytest.raises(MissingDependencyError, match="fast"):
        make_environments(vectorization="kernel", layout=LAYOUT)


def test_processes_take_parts_that_the_kernel_lacks(monkeypatch):
    pytest.importorskip("numba")
    from labgym.envs.vector.processes import ProcessPointNavEnv

    made = make_environments("LabFloorNavDiscrete-v0", 2, layout=LAYOUT)
    assert isinstance(inner(made), DummyVecEnv)
    made.close()
    monkeypatch.setattr(module, "processors", lambda: 2)
    options = {"layout": LAYOUT, "max_episode_steps": 3, "physics": "planar"}
    made = make_environments("LabFloorNavDiscrete-v0", 2, "processes", **options)
    assert isinstance(inner(made).envs, ProcessPointNavEnv)
    made.seed(0)
    made.reset()
    for _ in range(3):
        _, _, dones, infos = made.step(np.zeros(2, np.int64))
    made.close()
    assert dones.all()
    assert all({*module.MEASURES, "episode", "terminal_observation"} <= info.keys() for info in infos)


def test_goal_environments_run_one_after_the_other():
    pytest.importorskip("numba")
    made = make_environments("LabFloorNavGoal-v0", 2, layout=LAYOUT)
    assert isinstance(inner(made), DummyVecEnv)
    made.close()
    for vectorization in ("kernel", "processes"):
        with pytest.raises(OptionError):
            make_environments("LabFloorNavGoal-v0", 2, vectorization, layout=LAYOUT)


@pytest.mark.parametrize("vectorization", ["kernel", "dummy"])
def test_the_info_at_the_end_of_an_episode_has_what_the_logs_need(vectorization):
    pytest.importorskip("numba")
    made = make_environments("LabPointNav-v0", 2, vectorization, layout=LAYOUT, max_episode_steps=3)
    made.seed(0)
    made.reset()
    for _ in range(3):
        _, _, dones, infos = made.step(np.zeros((2, 2), np.float32))
    made.close()
    assert dones.all()
    for info in infos:
        assert {*module.MEASURES, "episode", "terminal_observation", "TimeLimit.truncated"} <= info.keys()
        assert info["episode"]["l"] == 3


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"environment": "LabPointNav-v9"}, UnknownNameError),
        ({"vectorization": "threads"}, UnknownNameError),
        ({"count": 0}, OptionError),
        ({"split": "tests"}, UnknownNameError),
    ],
)
def test_unknown_names_and_counts_are_refused(arguments, error):
    with pytest.raises(error):
        make_environments(**arguments)


def test_first_layouts_are_generated_once_each(monkeypatch):
    calls = []

    def source(number):
        calls.append(number)
        return LAYOUT

    layouts_module._layout.cache_clear()
    monkeypatch.setitem(layouts_module.SOURCES, "train", source)
    training = FirstLayouts(3)
    assert all(training(number) is LAYOUT for number in range(12))
    assert sorted(calls) == [0, 1, 2]
    layouts_module._layout.cache_clear()


@pytest.mark.parametrize(
    ("arguments", "error"), [((0,), OptionError), ((True,), OptionError), ((3, "houses"), UnknownNameError)]
)
def test_first_layouts_check_count_and_source(arguments, error):
    with pytest.raises(error):
        FirstLayouts(*arguments)


def test_the_goal_up_close_is_in_every_observation():
    """The last observation of an episode has it, too; goals that are a meter away or farther look alike."""
    pytest.importorskip("numba")
    made = NearGoal(make_environments("LabPointNav-v0", 2, "kernel", layout=LAYOUT, max_episode_steps=2))
    made.seed(0)
    assert made.reset()["near_goal"].shape == (2, 3)
    for _ in range(2):
        observations, _, _, infos = made.step(np.ones((2, 2), np.float32))
    for each in (*infos, {"terminal_observation": {name: rows[0] for name, rows in observations.items()}}):
        goal, near = (each["terminal_observation"][name] for name in ("goal", "near_goal"))
        assert made.observation_space["near_goal"].contains(near)
        np.testing.assert_allclose(near, 5.0 * min(goal[0], 1.0) * np.array([1.0, *goal[1:]]), atol=1e-5)
    made.close()
    with pytest.raises(OptionError, match="goal"):
        NearGoal(DummyVecEnv([lambda: gym.make("CartPole-v1")]))


def test_generated_layouts_are_counted_on_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    written = Terminal()
    monkeypatch.setattr(sys, "stderr", written)
    monkeypatch.setitem(layouts_module.SOURCES, "train", lambda number: LAYOUT)
    layouts_module._layout.cache_clear()
    with layouts_module.layout_progress(3):
        for number in (0, 1, 0, 1, 2):
            FirstLayouts(3)(number)
    layouts_module._layout.cache_clear()
    assert "training layouts" in written.getvalue()
    assert layouts_module._bars == []


def test_the_start_frame_has_its_origin_and_its_axis_at_the_start():
    pytest.importorskip("numba")
    single = gym.make("LabFloorNavGoal-v0", layout=LAYOUT, physics="planar", disable_env_checker=True)
    env = StartFrame(single)
    observation, info = env.reset(seed=4)
    x, y, yaw = start = info["pose"]
    np.testing.assert_allclose(observation["observation"][:4], [0.0, 0.0, 1.0, 0.0], atol=1e-6)
    rng = np.random.default_rng(0)
    for _ in range(15):
        observation, _, _, _, info = env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32))
        for name, place in (("achieved_goal", info["pose"]), ("desired_goal", info["goal"])):
            distance, bearing = math.dist(place[:2], (x, y)), math.atan2(place[1] - y, place[0] - x) - yaw
            expected = [distance * math.cos(bearing), distance * math.sin(bearing)]
            np.testing.assert_allclose(observation[name], expected, atol=1e-5)
        turned = info["pose"][2] - start[2]
        np.testing.assert_allclose(observation["observation"][2:4], [math.cos(turned), math.sin(turned)], atol=1e-5)
        np.testing.assert_array_equal(observation["observation"][:2], observation["achieved_goal"])
    env.close()


@pytest.mark.parametrize(("name", "split"), [("LabNavAisle-v0", "floors-train"), ("LabPointNav-v0", "train")])
def test_layouts_count_for_the_training_split_of_an_id(name, split):
    environments = make_environments(name, 2, "dummy", layouts=3)
    tasks = inner(environments).envs[0].unwrapped.tasks
    training = getattr(tasks, "_source", tasks)._training._training
    environments.close()
    assert training == FirstLayouts(3, split)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("LabPointNav-v0", {"split": "test"}),
        ("LabFloorNav-v0", {"split": "floors-test"}),
        ("LabPointNav-v0", {"split": "val"}),
        ("LabNavAisle-v0", {"split": "floors-val"}),
        ("LabPointNav-v0", {"layout": LAYOUT}),
        ("LabPointNav-v0", {"split": "train", "training": FirstLayouts(2)}),
        ("LabPointNav-v0", {"split": "train", "episodes_per_layout": 4}),
    ],
)
def test_layouts_without_effect_are_refused(name, options):
    with pytest.raises(OptionError, match=r"^layouts=3 has no effect"):
        make_environments(name, 2, "dummy", layouts=3, **options)


@pytest.mark.parametrize("vectorization", ["auto", "kernel", "dummy", "subproc", "processes"])
def test_more_environments_than_memory_holds_are_refused_before_any_is_made(vectorization):
    pytest.importorskip("numba")
    with pytest.raises(OptionError, match=r"environments|num_envs") as problem:
        make_environments("LabPointNav-v0", 10**9, vectorization, split="val")
    assert "1000000000" in str(problem.value)
