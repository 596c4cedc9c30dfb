"""What every registered environment promises, whatever its parts."""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
import pickle
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from laboratories import hall_laboratory

import labgym  # noqa: F401  (registers the environments)
from labgym.errors import LabgymError
from labgym.layouts import Layout

IDS = sorted(name for name in gym.registry if name.startswith("Lab"))
LIDAR = [name for name in IDS if "Depth" not in name and "RGBD" not in name]
STEPS, STOPS = 24, 12
"""Steps of a drive, and from one possible STOP to the next."""
LONG = 100


@pytest.fixture(scope="module")
def path(layout: Layout, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The folder of the layouts: an island, and a hall, in which most tasks of LabNav soon find a drive."""
    folder = tmp_path_factory.mktemp("layouts")
    layout.save(folder / "island.json")
    hall_laboratory().save(folder / "hall.json")
    return str(folder)


def make(name: str, path: str, **arguments: Any) -> gym.Env:
    place = "hall" if name.startswith("LabNav") and name != "LabNavAisle-v0" else "island"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # v0 is not the newest version
        return gym.make(name, layout=str(Path(path) / f"{place}.json"), **arguments)


def digest(name: str, path: str, seed: int = 7, steps: int = STEPS) -> str:
    """The digest of all observations, rewards and flags of a drive with seeded actions."""
    env = make(name, path)
    env.action_space.seed(seed)
    result = hashlib.sha256()
    observation, info = env.reset(seed=seed)
    for step in range(steps):
        for key in sorted(observation):
            result.update(observation[key].tobytes())
        action = env.action_space.sample()
        if action.shape == (3,) and step % STOPS:
            action[2] = -1.0  # half of all random actions would be STOP, which ends the drive
        observation, *outcome, info = env.step(action)
        result.update(np.array(outcome, np.float64).tobytes())
        result.update(repr(sorted((key, str(value)) for key, value in info.items())).encode())
        if outcome[1] or outcome[2]:
            observation, info = env.reset()
    env.close()
    return result.hexdigest()


def digests_of_all(path: str) -> dict[str, str]:
    """The digests of all ids, and those of long drives of the ids whose steps are short."""
    long = {f"{name}, {LONG} steps": digest(name, path, steps=LONG) for name in LIDAR if not name.startswith("LabNav")}
    return {**{name: digest(name, path) for name in IDS}, **long}


@pytest.fixture(scope="module")
def expected(path: str) -> dict[str, str]:
    return digests_of_all(path)


def test_the_ids_are_those_of_the_documentation() -> None:
    assert IDS == [
        "LabFloorNav-v0",
        "LabFloorNavDepth-v0",
        "LabFloorNavDiscrete-v0",
        "LabFloorNavGoal-v0",
        "LabFloorNavRGBD-v0",
        "LabNavAisle-v0",
        "LabNavCarry-v0",
        "LabNavDock-v0",
        "LabNavGlass-v0",
        "LabNavMoved-v0",
        "LabNavMovedFixed-v0",
        "LabNavOdometry-v0",
        "LabNavPeople-v0",
        "LabNavShift-v0",
        "LabPointNav-v0",
        "LabProtocolNav-v0",
    ]


@pytest.mark.cases(8)
@pytest.mark.parametrize("name", IDS)
def test_both_checkers_are_silent(name: str, path: str, capsys: pytest.CaptureFixture[str]) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    env = make(name, path).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)
        checker.check_env(env)
    env.close()
    said = capsys.readouterr().out
    assert ("GoalEnv" in said) == ("Goal" in name)  # stable-baselines3 says what it takes the environment for


def test_a_caller_may_keep_and_change_the_data_in_an_info(path: str) -> None:
    arguments = {"conditions": ["wet_floor"], "randomizations": ["mass"], "measures": ["conditions", "randomization"]}
    env = make("LabFloorNav-v0", path, **arguments)
    _, first = env.reset(seed=0)
    drawn = json.dumps(first)
    first["conditions"]["wet_floor"]["zones"].clear()
    first["randomization"].clear()
    for _ in range(2):
        assert json.dumps(env.step(env.action_space.sample())[4]) == drawn


def test_the_same_seed_gives_the_same_bits_in_any_process(path: str, expected: dict[str, str]) -> None:
    code = f"import json, sys; from test_conformance import digests_of_all; print(json.dumps(digests_of_all({path!r})))"
    here = Path(__file__).parent
    other = "1" if os.environ.get("PYTHONHASHSEED") == "0" else "0"
    environment = {**os.environ, "PYTHONHASHSEED": other, "PYTHONPATH": os.pathsep.join([str(here), *sys.path])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert json.loads(done.stdout) == expected


@pytest.mark.parametrize("method", ["spawn", "fork", pytest.param("forkserver", marks=pytest.mark.slow)])
def test_workers_drive_as_this_process_does(path: str, expected: dict[str, str], method: str) -> None:
    names = ["LabFloorNav-v0", "LabFloorNavDiscrete-v0"]
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.starmap(digest, [(name, path) for name in names]) == [expected[name] for name in names]


def test_twenty_environments_in_threads_drive_as_one_alone(path: str, expected: dict[str, str]) -> None:
    names = (LIDAR * 20)[:20]
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(lambda name: digest(name, path), names)) == [expected[name] for name in names]


@pytest.mark.parametrize("name", IDS)
def test_the_specification_survives_json(name: str, path: str) -> None:
    env = make(name, path)
    text = env.spec.to_json()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        again = gym.make(gym.envs.registration.EnvSpec.from_json(text))
    assert again.spec.to_json() == text
    assert again.observation_space == env.observation_space
    assert again.action_space == env.action_space
    for first, second in zip(env.reset(seed=3)[0].items(), again.reset(seed=3)[0].items(), strict=True):
        assert first[0] == second[0]
        np.testing.assert_array_equal(first[1], second[1])


@pytest.mark.cases(8)
@pytest.mark.parametrize("name", IDS)
def test_a_pickled_environment_goes_on_to_the_bit(name: str, path: str) -> None:
    env = make(name, path)
    env.action_space.seed(0)
    env.reset(seed=3)
    for _ in range(3):
        env.step(env.action_space.sample())
    other = pickle.loads(pickle.dumps(env))
    for action in [env.action_space.sample() for _ in range(3)]:
        (first, reward, *_), (second, same, *_) = env.step(action), other.step(action)
        assert reward == same
        for key in first:
            np.testing.assert_array_equal(first[key], second[key])
    assert env.reset()[1]["pair"] == other.reset()[1]["pair"]


@pytest.mark.parametrize("name", IDS)
def test_it_closes_twice_and_can_be_reset_afterwards(name: str, path: str) -> None:
    env = make(name, path)
    env.close()
    env.reset(seed=0)
    env.close()
    env.close()
    env.reset(seed=0)


@pytest.mark.cases(45)
@pytest.mark.parametrize("action", ["forward", None, [[0.0, 0.0]], [math.nan, 0.0], object(), 7, True, [0, 1, 2, 3]])
@pytest.mark.parametrize("name", IDS)
def test_an_action_that_is_none_is_refused_in_one_line(name: str, path: str, action: Any) -> None:
    env = make(name, path).unwrapped
    env.reset(seed=0)
    before = env.state.pose, env.state.steps
    with pytest.raises(LabgymError, match="must be") as caught:
        env.step(action)
    assert "\n" not in str(caught.value)
    assert (env.state.pose, env.state.steps) == before


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize(
    "argument", [{"profile": "x"}, {"width": -5}, {"split": "exam"}, {"episodes_per_layout": 0}, {"quality": 3}]
)
def test_a_bad_argument_is_refused_when_the_environment_is_made(name: str, argument: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        with pytest.raises(LabgymError) as caught:
            gym.make(name, **argument)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", IDS)
def test_steps_after_the_end_pay_nothing(name: str, path: str) -> None:
    env = make(name, path, endings=[{"kind": "stuck", "duration": 0.1}], onward=()).unwrapped
    env.reset(seed=0)
    rest = np.zeros(env.action_space.shape, env.action_space.dtype)
    _, _, terminated, _, info = env.step(rest)
    assert terminated
    for _ in range(3):
        with pytest.warns(UserWarning, match="call reset"):
            _, reward, terminated, truncated, info = env.step(rest)
        assert (reward, terminated, truncated) == (0.0, True, False)
        assert set(info["reward_terms"].values()) == {0.0}


@pytest.mark.parametrize("name", [name for name in IDS if name.startswith(("LabFloor", "LabProtocol"))])
def test_info_has_what_training_libraries_read(name: str, path: str) -> None:
    env = make(name, path).unwrapped
    _, first = env.reset(seed=0)
    info = env.step(env.action_space.sample())[4]
    assert {key: type(value) for key, value in info.items()} == {key: type(value) for key, value in first.items()}
    assert info["is_success"] is False
    assert info["cost"] == float(info["contacts"])
    np.testing.assert_array_equal(info["achieved_goal"], info["pose"][:2])
    np.testing.assert_array_equal(info["desired_goal"], info["goal"][:2])
