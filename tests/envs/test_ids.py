"""The rules of the environments on floors."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import labgym  # noqa: F401  (registers the environments)
from labgym.envs.parts.actions import FORWARD, LEFT, RIGHT, STOP
from labgym.envs.presets import preset
from labgym.errors import OptionError, UnknownNameError
from labgym.geometry import wrap_angle
from labgym.layouts import Layout
from labgym.navigation import goal_pairs, shortest_path

OPEN = {"start": (4.0, 4.8, 0.0), "goal": (5.5, 4.8)}


def towards(state: Any) -> np.ndarray:
    """An action that drives to the goal over free floor and brakes there."""
    x, y, yaw = state.pose
    bearing = wrap_angle(math.atan2(state.goal[1] - y, state.goal[0] - x) - yaw)
    if state.distance < 0.3:
        return np.zeros(2, np.float32)
    return np.array([max(0.0, 1.0 - 2.0 * abs(bearing)) * min(1.0, state.distance), np.clip(2.0 * bearing, -1, 1)])


def test_the_robot_must_stop_at_the_goal(layout: Layout) -> None:
    env = gym.make("LabFloorNav-v0", layout=layout).unwrapped
    env.reset(seed=0, options=OPEN)
    passed, terminated = False, False
    while not terminated:
        _, reward, terminated, _, info = env.step(towards(env.state))
        passed |= info["distance"] <= 0.36 and not terminated
        assert info["time"] < 10.0
    assert passed
    assert info["is_success"]
    assert info["ending"] == "rest"
    assert reward == pytest.approx(10.0, abs=0.2)
    assert np.hypot(*env.state.velocity) <= math.hypot(0.05, 0.1)


def test_passing_the_goal_is_not_arriving(layout: Layout) -> None:
    env = gym.make("LabFloorNav-v0", layout=layout).unwrapped
    env.reset(seed=0, options={**OPEN, "goal": (4.8, 4.8)})
    nearest = math.inf
    for _ in range(14):
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0]))
        nearest = min(nearest, info["distance"])
        assert not terminated
    assert nearest < 0.1


def test_shortest_paths_end_at_the_success_disc(layout: Layout) -> None:
    env = gym.make("LabFloorNav-v0", layout=layout).unwrapped
    for pair in goal_pairs(layout):
        _, info = env.reset(seed=0, options={"pair": pair.index})
        whole = shortest_path(layout, pair.start[:2], pair.goal[:2]).length
        assert info["shortest_path_length"] == pytest.approx(whole - 0.36, abs=1e-9)


def test_discrete_actions_move_the_robot_by_their_amounts(layout: Layout) -> None:
    env = gym.make("LabFloorNavDiscrete-v0", layout=layout).unwrapped
    env.reset(seed=0, options=OPEN)
    for action in (FORWARD, FORWARD, LEFT, FORWARD, RIGHT, RIGHT, FORWARD):
        (x, y, yaw) = env.state.pose
        _, _, terminated, _, _ = env.step(action)
        moved = (env.state.pose[0] - x, env.state.pose[1] - y)
        ahead = 0.25 if action == FORWARD else 0.0
        turned = {LEFT: 15.0, RIGHT: -15.0}.get(action, 0.0)
        assert moved == pytest.approx((ahead * math.cos(yaw), ahead * math.sin(yaw)), abs=0.003)
        assert math.degrees(wrap_angle(env.state.pose[2] - yaw)) == pytest.approx(turned, abs=0.15)
        assert not terminated


@pytest.mark.parametrize(("goal", "success"), [((4.2, 4.8), True), ((5.5, 4.8), False)])
def test_stop_ends_the_episode_wherever_the_robot_is(layout: Layout, goal: tuple, success: bool) -> None:
    env = gym.make("LabFloorNavDiscrete-v0", layout=layout)
    env.reset(seed=0, options={**OPEN, "goal": goal})
    _, reward, terminated, truncated, info = env.step(STOP)
    assert (terminated, truncated, info["is_success"], info["ending"]) == (True, False, success, "stop")
    assert (reward > 5.0) == success


def test_a_wall_ends_a_discrete_step_early(layout: Layout) -> None:
    env = gym.make("LabFloorNavDiscrete-v0", layout=layout).unwrapped
    env.reset(seed=0, options={"pair": 0})
    for _ in range(3):
        _, _, _, _, info = env.step(FORWARD)
    assert info["collision"]
    assert info["cost"] > 1.0
    assert info["time"] <= 13.0


def test_rewards_of_relabeled_goals_are_those_of_the_steps(layout: Layout) -> None:
    env = gym.make("LabFloorNavGoal-v0", layout=layout).unwrapped
    observation, _ = env.reset(seed=0, options=OPEN)
    achieved, rewards, terminated = [], [], False
    while not terminated:
        observation, reward, terminated, _, info = env.step(towards(env.state) + np.array([0.2, 0.0]))
        assert reward == env.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
        assert terminated == env.compute_terminated(observation["achieved_goal"], observation["desired_goal"], info)
        achieved.append(observation["achieved_goal"])
        rewards.append(reward)
    assert rewards == [-1.0] * (len(rewards) - 1) + [0.0]
    table = env.compute_reward(np.array(achieved)[:, None], np.array(achieved)[None], {})
    straight = np.linalg.norm(np.array(achieved)[:, None] - np.array(achieved)[None], axis=-1)
    np.testing.assert_array_equal(table, np.where(straight <= 0.36, 0.0, -1.0))


def test_hindsight_experience_replay_learns_from_it(layout: Layout) -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    env = gym.make("LabFloorNavGoal-v0", layout=layout, max_episode_steps=40)
    model = sb3.SAC(
        "MultiInputPolicy", env, replay_buffer_class=sb3.HerReplayBuffer, learning_starts=80, train_freq=40,
        gradient_steps=4, batch_size=32, buffer_size=1000, seed=0, device="cpu", policy_kwargs={"net_arch": [32]},
    )  # fmt: skip
    model.learn(200)
    sample = model.replay_buffer.sample(64)
    achieved, desired = (sample.next_observations["achieved_goal"], sample.observations["desired_goal"])
    expected = env.unwrapped.compute_reward(achieved.numpy(), desired.numpy(), {})
    np.testing.assert_array_equal(sample.rewards.numpy()[:, 0], expected)


def test_a_whole_protocol_is_one_episode(layout: Layout) -> None:
    env = gym.make("LabProtocolNav-v0", layout=layout).unwrapped
    pairs = goal_pairs(layout)
    _, info = env.reset(seed=0)
    assert (info["leg"], info["legs"]) == (0, len(pairs))
    paid, goals, terminated = 0, [], False
    while not terminated:
        goals.append(tuple(info["goal"]))
        leg = info["leg"]
        env._episode.simulation.place((*info["goal"][:2], 0.0))  # the robot is carried to its goal
        _, _, terminated, _, info = env.step(np.zeros(2, np.float32))
        paid += info["reward_terms"]["success"] == 10.0
        assert info["is_success"] == terminated
        assert info["leg"] == leg + (not terminated)
    assert goals == [pytest.approx(pair.goal) for pair in pairs]
    assert paid == len(pairs)
    _, info = env.reset(seed=0, options={"pair": 1})
    assert (info["legs"], info["pair"]) == (len(pairs) - 1, 1)
    with pytest.raises(OptionError, match="whole protocol"):
        env.reset(options=OPEN)


def test_a_delay_makes_the_robot_obey_later(layout: Layout) -> None:
    prompt, late = (
        gym.make("LabFloorNav-v0", layout=layout, actions={"kind": "velocity", "delay": delay}).unwrapped
        for delay in (0, 3)
    )
    for env in (prompt, late):
        env.reset(seed=0, options=OPEN)
    poses: tuple[list, list] = ([], [])
    for k in range(9):
        for env, track in zip((prompt, late), poses, strict=True):
            env.step(np.array([0.8, 0.2]) if k < 6 else np.zeros(2))
            track.append(env.state.pose)
    assert poses[1][:3] == [OPEN["start"]] * 3
    np.testing.assert_allclose(poses[1][3:], poses[0][:6], atol=1e-12)


def test_a_third_component_stops(layout: Layout) -> None:
    arguments = {"actions": {"kind": "velocity", "stop": True}, "endings": ["stop"]}
    env = gym.make("LabFloorNav-v0", layout=layout, **arguments)
    assert env.action_space.shape == (3,)
    env.reset(seed=0, options=OPEN)
    assert not env.step(np.array([1.0, 0.0, -1.0], np.float32))[2]
    _, _, terminated, _, info = env.step(np.array([1.0, 0.0, 0.5], np.float32))
    assert (terminated, info["is_success"]) == (True, False)


@pytest.mark.parametrize("level", [1, 3])
def test_a_task_of_labnav_takes_a_level(level: int) -> None:
    config = gym.make("LabNavCarry-v0", level=level, observation="depth").unwrapped.config
    assert config == preset(f"labnav-carry-{level}-depth")


@pytest.mark.parametrize("level", [-1, 4, True, "two"])
def test_an_unknown_level_is_refused(level: object) -> None:
    with pytest.raises(UnknownNameError, match="available: 0, 1, 2, 3"):
        gym.make("LabNavCarry-v0", level=level)
