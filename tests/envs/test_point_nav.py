"""LabPointNav-v0: what its docstring promises."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import pickle
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import labgym  # noqa: F401  (registers the environment)
from labgym.envs import LabPointNavEnv, RewardWeights
from labgym.envs.robot import ROBOT
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS, goal_pairs, shortest_path

MODES = ("lidar", "depth", "rgbd")
KEYS = {
    "pose", "goal", "distance", "success", "collision", "contacts", "clearance", "path_length",
    "shortest_path_length", "layout", "protocol", "pair", "time", "reward_terms",
}  # fmt: skip
STOP, AHEAD, BACK = (np.array([v, 0.0], np.float32) for v in (0.0, 1.0, -1.0))


def make(layout: Layout, **arguments: Any) -> gym.Env:
    return gym.make("LabPointNav-v0", layout=layout, **arguments)


def steered(info: dict[str, Any], waypoint: np.ndarray) -> np.ndarray:
    """An action towards a waypoint: turn first, then drive."""
    x, y, yaw = info["pose"]
    bearing = math.atan2(waypoint[1] - y, waypoint[0] - x) - yaw
    bearing = math.atan2(math.sin(bearing), math.cos(bearing))
    return np.array([max(0.0, 1.0 - 3.0 * abs(bearing)), np.clip(2.0 * bearing, -1, 1)], np.float32)


def drive_along(env: gym.Env, info: dict[str, Any], waypoints: np.ndarray) -> list[tuple]:
    """Follow waypoints until the episode ends; return every step's outcome."""
    outcomes, left = [], list(waypoints)
    while True:
        while len(left) > 1 and math.dist(info["pose"][:2], left[0]) < 0.15:
            left.pop(0)
        outcomes.append(env.step(steered(info, left[0])))
        info = outcomes[-1][4]
        if outcomes[-1][2] or outcomes[-1][3]:
            return outcomes


@pytest.mark.parametrize("observation", MODES)
def test_gymnasiums_checker_has_nothing_to_say(layout: Layout, observation: str) -> None:
    env = make(layout, observation=observation)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
        env.close()


@pytest.mark.parametrize("observation", MODES)
def test_stable_baselines3s_checker_has_nothing_to_say(layout: Layout, observation: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = LabPointNavEnv(layout=layout, observation=observation)
        checker.check_env(env)
        env.close()


def test_stable_baselines3_learns_from_it_without_complaint(layout: Layout) -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    env = make(layout)
    model = sb3.PPO("MultiInputPolicy", env, n_steps=128, batch_size=64, n_epochs=1, seed=0, device="cpu")
    model.learn(256)
    assert model.num_timesteps == 256
    env.close()


def test_the_name_with_its_package_registers_itself(layout: Layout, tmp_path: Path) -> None:
    path = layout.save(tmp_path / "layout.json")
    code = (
        "import gymnasium, sys; env = gymnasium.make('labgym:LabPointNav-v0', layout=sys.argv[1]);"
        "print(env.spec.max_episode_steps)"
    )
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "600"


def test_importing_labgym_loads_nothing_heavy() -> None:
    code = (
        "import sys, labgym; heavy = {'mujoco', 'torch', 'stable_baselines3', 'pxr', 'ortools', 'matplotlib', 'cv2'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_an_episode_starts_and_ends_where_its_goal_pair_says(layout: Layout) -> None:
    env = make(layout)
    for pair in goal_pairs(layout):
        _, info = env.reset(options={"pair": pair.index})
        assert info["pose"] == pytest.approx(pair.start)
        assert info["goal"] == pytest.approx(pair.goal)
        assert info["pair"] == pair.index
        assert info["distance"] == pytest.approx(math.dist(pair.start[:2], pair.goal[:2]))
        assert info["shortest_path_length"] == pytest.approx(
            shortest_path(layout, pair.start[:2], pair.goal[:2]).length
        )


@pytest.mark.parametrize("options", [[], 5, "pair"])
def test_reset_options_are_a_mapping(options):
    env = LabPointNavEnv(split="val")
    with pytest.raises(OptionError, match=f"reset options are a {type(options).__name__}, expected a dict"):
        env.reset(options=options)


def test_the_goal_is_seen_in_polar_form_from_the_robot(layout: Layout) -> None:
    env = make(layout)
    observation, info = env.reset(options={"pair": 0})
    distance, cosine, sine = observation["goal"].astype(float)
    x, y, yaw = info["pose"]
    ahead, left = distance * cosine, distance * sine
    assert x + ahead * math.cos(yaw) - left * math.sin(yaw) == pytest.approx(info["goal"][0], abs=1e-5)
    assert y + ahead * math.sin(yaw) + left * math.cos(yaw) == pytest.approx(info["goal"][1], abs=1e-5)
    assert (observation["velocity"] == 0.0).all()


@pytest.mark.parametrize("pair", [0, 1, 2])
def test_following_the_shortest_path_succeeds_within_half_a_metre(layout: Layout, pair: int) -> None:
    env = make(layout)
    _, info = env.reset(options={"pair": pair})
    drive = goal_pairs(layout)[pair]
    outcomes = drive_along(env, info, shortest_path(layout, drive.start[:2], drive.goal[:2], radius=0.35).points)
    *before, last = outcomes
    assert last[2]
    assert not last[3]
    assert last[4]["success"]
    assert last[4]["distance"] <= 0.5
    assert all(not outcome[2] and outcome[4]["distance"] > 0.5 for outcome in before)
    assert last[4]["contacts"] == 0
    assert last[4]["clearance"] > 0.0
    assert last[4]["path_length"] >= info["shortest_path_length"] - 0.5
    assert last[4]["time"] == pytest.approx(0.1 * len(outcomes))


def test_the_reward_is_the_sum_of_its_terms_and_progress_adds_up_to_the_way(layout: Layout) -> None:
    env = make(layout, weights=RewardWeights(progress=2.0, success=5.0, collision=-1.0, time=-0.5))
    _, info = env.reset(options={"pair": 1})
    drive = goal_pairs(layout)[1]
    outcomes = drive_along(env, info, shortest_path(layout, drive.start[:2], drive.goal[:2], radius=0.35).points)
    for _, reward, *_, info in outcomes:
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        assert info["reward_terms"]["time"] == -0.5
    assert outcomes[-1][4]["reward_terms"]["success"] == 5.0
    progress = sum(outcome[4]["reward_terms"]["progress"] for outcome in outcomes) / 2.0
    driven = info["shortest_path_length"] - info["distance"]
    assert 0.95 * driven - 0.1 <= progress <= 1.09 * driven + 0.1


def test_steps_after_the_end_of_an_episode_give_no_reward_and_stay_terminated(layout: Layout) -> None:
    env = make(layout)
    _, info = env.reset(options={"pair": 0})
    drive = goal_pairs(layout)[0]
    *_, last = drive_along(env, info, shortest_path(layout, drive.start[:2], drive.goal[:2], radius=0.35).points)
    assert last[1] > 5.0
    for action in ([0.0, 0.0], [-1.0, 0.0], [1.0, 1.0]):
        with pytest.warns(UserWarning, match="call reset"):
            _, reward, terminated, truncated, info = env.unwrapped.step(np.array(action, np.float32))
        assert (reward, terminated, truncated) == (0.0, True, False)
        assert set(info["reward_terms"].values()) == {0.0}
    env.reset(options={"pair": 0})
    assert not env.step(np.zeros(2, np.float32))[2]


def test_info_has_the_same_keys_and_types_at_reset_and_at_every_step(layout: Layout) -> None:
    env = make(layout)
    _, first = env.reset(seed=0)
    assert set(first) == KEYS
    env.action_space.seed(0)
    for _ in range(30):
        info = env.step(env.action_space.sample())[4]
        assert {key: type(value) for key, value in info.items()} == {key: type(value) for key, value in first.items()}
        assert set(info["reward_terms"]) == set(first["reward_terms"])


def test_an_obstacle_stops_the_robot_and_is_counted(layout: Layout) -> None:
    env = make(layout)
    observation, info = env.reset(options={"pair": 0})
    assert not info["collision"]
    contacts = 0
    for _ in range(30):
        observation, _, _, _, info = env.step(AHEAD)
        contacts += info["collision"]
        assert info["contacts"] == contacts
    bench = layout.box("PreparationBench_1")
    gap = info["pose"][0] - (bench.x + bench.depth / 2)
    assert info["collision"]
    assert gap == pytest.approx(ROBOT.chassis_radius, abs=0.03)
    assert info["clearance"] == pytest.approx(gap - ROBOT.chassis_radius, abs=0.005)
    assert observation["velocity"][0] == pytest.approx(0.0, abs=0.01)
    assert info["reward_terms"]["collision"] < 0.0


def test_driving_back_and_turning_obey_the_velocity_limits(layout: Layout) -> None:
    env = make(layout)
    env.reset(options={"pair": 0})
    for _ in range(15):
        observation, _, _, _, info = env.step(np.array([-1.0, 0.0], np.float32))
    assert observation["velocity"] == pytest.approx([-0.3, 0.0], abs=0.01)
    assert info["path_length"] == pytest.approx(0.3 * 1.5 - 0.3**2 / 2 / ROBOT.acceleration, abs=0.01)
    for _ in range(20):
        observation, *_ = env.step(np.array([0.0, 1.0], np.float32))
    assert observation["velocity"] == pytest.approx([0.0, 1.5], abs=0.01)


def test_the_time_limit_truncates_after_600_steps(layout: Layout) -> None:
    env = make(layout)
    env.reset(options={"pair": 0})
    flags = [env.step(STOP)[2:4] for _ in range(600)]
    assert not any(terminated for terminated, _ in flags)
    assert [truncated for _, truncated in flags] == [False] * 599 + [True]


def test_equal_seeds_draw_equal_episodes_and_different_seeds_draw_all(layout: Layout) -> None:
    env = make(layout)
    drawn = [env.reset(seed=seed)[1]["pair"] for seed in range(20)]
    assert drawn == [env.reset(seed=seed)[1]["pair"] for seed in range(20)]
    assert set(drawn) == {pair.index for pair in goal_pairs(layout)}


ROLL_OUT = """
import hashlib, sys
import gymnasium as gym, numpy as np, labgym
env = gym.make("LabPointNav-v0", layout=sys.argv[1], observation=sys.argv[2])
digest = hashlib.sha256()
observation, info = env.reset(seed=7)
rng = np.random.default_rng(3)
for _ in range(60):
    for key in sorted(observation):
        digest.update(observation[key].tobytes())
    observation, reward, *_ = env.step(rng.uniform(-1, 1, 2).astype(np.float32))
    digest.update(np.float64(reward).tobytes())
print(digest.hexdigest())
"""


@pytest.mark.slow  # test_conformance.py compares all ids
@pytest.mark.parametrize("observation", ["lidar", "rgbd"])
def test_the_same_seed_and_actions_give_the_same_bits_in_any_process(
    layout: Layout, observation: str, tmp_path: Path
) -> None:
    path = str(layout.save(tmp_path / "layout.json"))
    digests = {
        subprocess.run(
            [sys.executable, "-c", ROLL_OUT, path, observation], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    }
    digest = hashlib.sha256()
    env = make(layout, observation=observation)
    env.reset(seed=1)
    env.step(AHEAD)
    state, _ = env.reset(seed=7)
    rng = np.random.default_rng(3)
    for _ in range(60):
        for key in sorted(state):
            digest.update(state[key].tobytes())
        state, reward, *_ = env.step(rng.uniform(-1, 1, 2).astype(np.float32))
        digest.update(np.float64(reward).tobytes())
    assert digests == {digest.hexdigest() + "\n"}


@pytest.mark.parametrize("mode", ["sync", pytest.param("async", marks=pytest.mark.slow)])
def test_vector_environments_run_it(layout: Layout, mode: str, tmp_path: Path) -> None:
    path = str(layout.save(tmp_path / "layout.json"))
    arguments = {"vector_kwargs": {"context": "spawn"}} if mode == "async" else {}
    envs = gym.make_vec("labgym:LabPointNav-v0", num_envs=2, vectorization_mode=mode, layout=path, **arguments)
    try:
        observation, info = envs.reset(seed=0)
        assert observation["lidar"].shape == (2, 180)
        assert info["pose"].shape == (2, 3)
        _, reward, *_, info = envs.step(np.zeros((2, 2), np.float32))
        assert reward.shape == (2,)
        assert info["time"] == pytest.approx([0.1, 0.1])
    finally:
        envs.close()


def test_a_layout_may_be_given_as_an_object_or_as_a_file(layout: Layout, tmp_path: Path) -> None:
    path = layout.save(tmp_path / "layout.json")
    env = make(layout)
    first = env.reset(seed=0)
    for given in (path, str(path), layout):
        again = env.reset(seed=0, options={"layout": given})
        assert all(np.array_equal(first[0][key], again[0][key]) for key in first[0])


@pytest.mark.parametrize(
    ("options", "named", "listed"),
    [
        ({"colour": "red"}, "colour", "protocol"),
        ({"protocol": "alchemy"}, "alchemy", "alk_03"),
        ({"pair": 99}, "99", "2"),
        ({"pair": -1}, "-1", "2"),
        ({"layout": "atlantis"}, "atlantis", "nearest: "),
    ],
)
def test_an_unknown_option_names_what_was_given_and_what_exists(
    layout: Layout, options: dict[str, Any], named: str, listed: str
) -> None:
    with pytest.raises(UnknownNameError) as caught:
        make(layout).reset(seed=0, options=options)
    assert named in str(caught.value)
    assert listed in str(caught.value)


@pytest.mark.parametrize("argument", ["split", "observation", "protocol", "render_mode", "layout"])
def test_an_unknown_argument_is_refused_at_once(layout: Layout, argument: str) -> None:
    fixed = {} if argument == "split" else {"layout": layout}
    with pytest.raises(UnknownNameError, match="nonsense"):
        LabPointNavEnv(**{**fixed, argument: "nonsense"})


@pytest.mark.parametrize("action", [[np.nan, 0.0], [np.inf, 0.0], [0.0], [0.0, 0.0, 0.0]])
def test_an_action_that_is_no_action_is_refused(layout: Layout, action: list[float]) -> None:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0)
    with pytest.raises(OptionError, match="two finite numbers"):
        env.step(np.array(action, np.float32))


def test_a_broken_layout_file_is_named(tmp_path: Path, layout: Layout) -> None:
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(layout.to_json())[:-40])
    with pytest.raises(DocumentError, match=r"broken\.json"):
        LabPointNavEnv(layout=path)


def test_a_layout_without_a_protocol_asks_for_one(empty_room: Layout) -> None:
    with pytest.raises(OptionError, match="has no protocol"):
        LabPointNavEnv(layout=empty_room).reset(seed=0)


def test_stepping_before_a_reset_is_refused(layout: Layout) -> None:
    with pytest.raises(gym.error.ResetNeeded):
        LabPointNavEnv(layout=layout).step(STOP)


def test_the_depth_picture_is_what_the_robot_sees(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout, observation="depth", render_mode="depth_array")
    observation, _ = env.reset(seed=0)
    assert np.array_equal(env.render(), observation["depth"].reshape(72, 128))


def test_closing_twice_is_fine(layout: Layout) -> None:
    env = make(layout)
    env.reset(seed=0)
    env.close()
    env.close()


@pytest.mark.parametrize("action", [np.zeros((2, 1)), "ab", None, [1j, 0], [10**400, 0], [0.0, math.nan]])
def test_an_action_that_is_not_two_numbers_is_refused_in_one_line(layout: Layout, action: object) -> None:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0)
    with pytest.raises(OptionError, match="must be two finite numbers") as caught:
        env.step(action)
    assert "\n" not in str(caught.value)


def test_arguments_out_of_range_are_refused_when_the_environment_is_made() -> None:
    with pytest.raises(UnknownNameError, match="profile 'x' not found"):
        LabPointNavEnv(split="train", profile="x")
    for size in ({"width": 0}, {"height": -5}):
        with pytest.raises(OptionError, match="from 1 to"):
            LabPointNavEnv(**size)


def test_objects_above_the_robot_s_head_are_the_only_ones_that_are_no_obstacles() -> None:
    assert ROBOT.height <= OBSTACLE_HEIGHT <= ROBOT.height + 0.1
    assert ROBOT.planning_radius == PLANNING_RADIUS


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("observation", ["lidar", "rgbd"])
def test_a_copy_of_a_running_environment_continues_the_same_episode(
    layout: Layout, observation: str, copied: Callable[[LabPointNavEnv], LabPointNavEnv]
) -> None:
    env = LabPointNavEnv(layout=layout, observation=observation)
    env.reset(seed=3)
    for _ in range(5):
        env.step(np.array([1.0, 0.2], np.float32))
    other = copied(env)
    for _ in range(5):
        action = np.array([0.7, -0.3], np.float32)
        (first, reward, *_), (second, same_reward, *_) = env.step(action), other.step(action)
        assert reward == same_reward
        for name in first:
            np.testing.assert_array_equal(first[name], second[name])


@pytest.mark.parametrize("arguments", [{}, {"observation": "depth", "distance_to_go": "exact"}], ids=["lidar", "depth"])
def test_copies_of_an_environment_go_on_to_the_bit(layout, arguments):
    """Copies made in free motion and in contact; the robot drives ahead until it is stopped."""
    env = LabPointNavEnv(layout=layout, **arguments)
    env.reset(seed=3)
    for _ in range(4):
        for _ in range(25):
            env.step(np.array([1.0, 0.1], np.float32))
        copies = [pickle.loads(pickle.dumps(env)), copy.deepcopy(env)]
        records = []
        for one in (env, *copies):
            steps = [one.step(np.array([v, 0.3], np.float32)) for v in (1.0, -0.5, 0.2, 1.0)]
            records.append([pickle.dumps(jsonable(step)) for step in steps])
        assert records[0] == records[1] == records[2]
    assert env.step(np.zeros(2, np.float32))[4]["contacts"] > 0


def jsonable(step: tuple) -> list:
    observation, *rest = step
    return [{name: np.asarray(value).tobytes() for name, value in observation.items()}, repr(rest)]
