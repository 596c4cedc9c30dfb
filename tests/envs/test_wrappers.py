"""Wrappers keep Gymnasium's conventions, and what they add agrees with the laboratory."""

from __future__ import annotations

import copy
import math
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RenderCollection
from shapely import Point, Polygon
from shapely.ops import unary_union

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.wrappers import ActionRepeat, EgocentricMap, MapInset, OdometryNoise
from labgym.errors import OptionError
from labgym.layouts import Layout

ID = "LabFloorNav-v0"
KINDS = {
    "repeat": (ActionRepeat, {"times": 3}),
    "map": (EgocentricMap, {"cells": 40, "resolution": 0.2, "name": "grid"}),
    "odometry": (OdometryNoise, {"along": 0.02, "heading": 2.0, "turning": 5.0}),
    "inset": (MapInset, {"share": 0.5}),
}
PICTURE = {"render_mode": "rgb_array", "width": 160, "height": 120}


def make(layout: Layout, **options) -> gym.Env:
    return gym.make(ID, layout=layout, **options)


def wrapped(kind: str, layout: Layout) -> gym.Env:
    wrapper, arguments = KINDS[kind]
    return wrapper(make(layout, **(PICTURE if kind == "inset" else {})), **arguments)


def assert_same(first, second) -> None:
    assert first.keys() == second.keys()
    for key in first:
        np.testing.assert_array_equal(first[key], second[key])


@pytest.mark.parametrize("kind", KINDS)
def test_a_wrapper_forwards_seed_and_options_and_is_accepted_by_the_checker(kind: str, layout: Layout) -> None:
    env, plain = wrapped(kind, layout), make(layout)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*not.*same as `env.unwrapped`|.*different from the unwrapped")
        check_env(env, skip_render_check=True)
    _, info = env.reset(seed=5, options={"pair": 1})
    _, expected = plain.reset(seed=5, options={"pair": 1})
    assert info["pair"] == expected["pair"] == 1
    np.testing.assert_array_equal(info["pose"], expected["pose"])
    _, _, _, _, info = env.step(np.array([-1.0, 0.3], np.float32))
    for _ in range(3 if kind == "repeat" else 1):
        _, _, _, _, expected = plain.step(np.array([-1.0, 0.3], np.float32))
    np.testing.assert_array_equal(info["pose"], expected["pose"])
    env.close()


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_gives_the_same_bits_and_a_pickled_copy_goes_on(kind: str, layout: Layout) -> None:
    first, second = wrapped(kind, layout), wrapped(kind, layout)
    first.reset(seed=1)
    assert_same(first.reset(seed=2)[0], second.reset(seed=2)[0])
    action = np.array([-0.5, 0.4], np.float32)
    for _ in range(3):
        observation = first.step(action)[0]
        assert first.observation_space.contains(observation)
        assert_same(observation, second.step(action)[0])
    for other in (pickle.loads(pickle.dumps(first)), copy.deepcopy(first)):
        assert_same(other.step(action)[0], copy.deepcopy(first).step(action)[0])


@pytest.mark.parametrize("kind", KINDS)
def test_the_specification_makes_the_same_environment_again(kind: str, layout: Layout, tmp_path) -> None:
    wrapper, arguments = KINDS[kind]
    path = str(layout.save(tmp_path / "lab.json"))
    env = wrapper(gym.make(ID, layout=path, **(PICTURE if kind == "inset" else {})), **arguments)
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert type(again) is type(env)
    assert again.observation_space == env.observation_space
    assert_same(again.reset(seed=3)[0], env.reset(seed=3)[0])


def test_a_repeated_action_sums_rewards_costs_and_terms(layout: Layout) -> None:
    env, plain = ActionRepeat(make(layout), times=4), make(layout)
    assert env.metadata["render_fps"] == plain.metadata["render_fps"] / 4
    ahead = np.array([1.0, 0.0], np.float32)  # into the bench that the robot faces
    env.reset(seed=0, options={"pair": 0})
    plain.reset(seed=0, options={"pair": 0})
    contacts = 0
    for _ in range(5):
        observation, reward, _, _, info = env.step(ahead)
        steps = [plain.step(ahead) for _ in range(4)]
        assert_same(observation, steps[-1][0])
        assert reward == pytest.approx(sum(step[1] for step in steps), abs=1e-12)
        assert info["cost"] == sum(step[4]["cost"] for step in steps)
        assert info["collision"] == any(step[4]["collision"] for step in steps)
        assert info["reward_terms"]["time"] == pytest.approx(-0.04)
        assert info["time"] == steps[-1][4]["time"]
        contacts += info["cost"]
    assert contacts > 4


def test_a_repeated_action_ends_with_the_episode(layout: Layout) -> None:
    env = ActionRepeat(make(layout, max_episode_steps=6), times=4)
    env.reset(seed=0)
    still = np.zeros(2, np.float32)
    assert env.step(still)[3] is False
    assert env.step(still)[3] is True
    assert env.unwrapped.state.steps == 6


def solids(layout: Layout, height: float):
    """What stands in the plane of the lidar."""
    boxes = [layout.box(each.id) for each in layout.placements]
    return unary_union([Polygon(box.corners()) for box in boxes if box.z0 <= height <= box.z1])


def drive(env: gym.Env, layout: Layout, steps: int) -> list[tuple[tuple[float, float, float], np.ndarray]]:
    observation, _ = env.reset(seed=0, options={"start": (2.2, 4.0, 0.3), "goal": (6.5, 1.0)})
    history = [(env.unwrapped.state.pose, observation["map"])]
    for _ in range(steps):
        observation, *_ = env.step(np.array([0.5, -0.4], np.float32))
        history.append((env.unwrapped.state.pose, observation["map"]))
    return history


def test_the_map_is_free_where_the_floor_is_and_occupied_where_furniture_and_walls_are(layout: Layout) -> None:
    env = EgocentricMap(make(layout), cells=80, resolution=0.1)
    history = drive(env, layout, 25)
    (x, y, yaw), picture = history[-1]
    assert picture.shape == (80, 80, 1)
    room = Polygon([(0, 0), (layout.room.width, 0), (layout.room.width, layout.room.depth), (0, layout.room.depth)])
    standing = solids(layout, 0.25)
    wrong, free, occupied = 0, 0, 0
    for row in range(80):
        for column in range(80):
            ahead, left = (39.5 - row) * 0.1, (39.5 - column) * 0.1
            cosine, sine = math.cos(yaw), math.sin(yaw)
            point = Point(x + cosine * ahead - sine * left, y + sine * ahead + cosine * left)
            if picture[row, column, 0] == 0:
                free += 1
                wrong += standing.distance(point) == 0.0 or not room.contains(point)
            elif picture[row, column, 0] == 255:
                occupied += 1
                # A cell that a ray ends in, at most a diagonal from the center of the cell of the picture.
                edge = min(standing.boundary.distance(point), room.boundary.distance(point))
                assert edge <= 0.1 * math.sqrt(2.0) + 1e-6
    assert free > 800
    assert occupied > 60
    assert wrong <= free / 200  # cells of two grids overlap by a rotation
    unknown = int((history[0][1] == 127).sum())
    assert int((picture == 127).sum()) < unknown + 400


def test_the_robot_is_at_the_center_and_looks_upwards(layout: Layout) -> None:
    env = EgocentricMap(make(layout), cells=40, resolution=0.1)
    observation, _ = env.reset(seed=0, options={"start": (2.2, 4.0, math.pi / 2.0), "goal": (6.5, 1.0)})
    picture = observation["map"][:, :, 0]
    assert (picture[19:21, 19:21] == 0).all()
    # The fume hood and the wall behind it are ahead, free floor is behind.
    assert (picture[:20] == 255).sum() > 5
    ahead = float(observation["lidar"][90])
    rows = np.flatnonzero((picture[:20, 19:21] == 255).any(axis=1))
    assert 19.5 - rows.max() == pytest.approx(ahead / 0.1, abs=1.1)


def test_the_map_remembers_what_the_island_hides_again_and_forgets_at_reset(layout: Layout) -> None:
    env = EgocentricMap(make(layout), cells=80, resolution=0.1)
    start = {"start": (2.5, 1.2, 0.0), "goal": (6.5, 1.0)}
    first, _ = env.reset(seed=0, options=start)
    forward = 1.0
    while forward > 0.0 or env.unwrapped.state.pose[0] > 2.5:
        observation, *_ = env.step(np.array([forward, 0.0], np.float32))
        forward = -1.0 if env.unwrapped.state.pose[0] > 4.5 else forward
    assert int((observation["map"] == 127).sum()) < int((first["map"] == 127).sum()) - 100
    again, _ = env.reset(seed=0, options=start)
    np.testing.assert_array_equal(again["map"], first["map"])


def test_odometry_without_errors_leaves_the_goal_where_it_is(layout: Layout) -> None:
    env = OdometryNoise(make(layout), along=0.0, heading=0.0)
    plain = make(layout)
    env.reset(seed=4)
    plain.reset(seed=4)
    for _ in range(20):
        action = np.array([-0.6, 0.5], np.float32)
        observation, expected = env.step(action)[0], plain.step(action)[0]
        np.testing.assert_allclose(observation["goal"], expected["goal"], atol=2e-6)
        np.testing.assert_array_equal(observation["lidar"], expected["lidar"])


def test_the_goal_of_drifting_odometry_is_that_of_the_reckoned_pose(layout: Layout) -> None:
    env = OdometryNoise(make(layout), along=0.2, heading=20.0)
    env.reset(seed=4)
    start, goal = env.unwrapped.state.pose, env.unwrapped.state.goal
    differs = False
    for _ in range(30):
        observation = env.step(np.array([-0.8, 0.5], np.float32))[0]
        x, y, cosine, sine = (float(value) for value in observation["odometry"])
        to_goal = complex(goal[0] - start[0], goal[1] - start[1]) * complex(math.cos(start[2]), -math.sin(start[2]))
        seen = (to_goal - complex(x, y)) / complex(cosine, sine)
        distance, ahead, left = (float(value) for value in observation["goal"])
        assert distance * complex(ahead, left) == pytest.approx(seen, abs=1e-4)
        differs |= abs(distance - env.unwrapped.state.distance) > 0.02
    assert differs


def test_the_map_follows_the_reckoned_pose(layout: Layout) -> None:
    env = EgocentricMap(OdometryNoise(make(layout), along=0.3, heading=30.0))
    true = EgocentricMap(make(layout))
    env.reset(seed=1)
    true.reset(seed=1)
    for _ in range(15):
        action = np.array([-0.8, 0.6], np.float32)
        drifting, exact = env.step(action)[0]["map"], true.step(action)[0]["map"]
    assert (drifting != exact).any()


def test_the_inset_shows_the_robot_the_goal_and_the_way_in_the_corner(layout: Layout) -> None:
    env = MapInset(make(layout, **PICTURE), share=0.5)
    env.reset(seed=0, options={"start": (2.5, 1.2, 0.0), "goal": (6.5, 1.0)})
    for _ in range(15):
        env.step(np.array([1.0, 0.0], np.float32))
    plain, picture = env.unwrapped.render(), env.render()
    assert picture.shape == plain.shape
    width = min(80, round(60 * layout.room.width / layout.room.depth))
    height = round(width * layout.room.depth / layout.room.width)
    np.testing.assert_array_equal(picture[height + 1 :], plain[height + 1 :])
    np.testing.assert_array_equal(picture[:, : 160 - width - 1], plain[:, : 160 - width - 1])
    inset = picture[:height, 160 - width :].astype(int)

    def center(color: tuple[int, int, int]) -> tuple[float, float]:
        rows, columns = np.nonzero(np.abs(inset - color).sum(axis=2) < 60)
        return columns.mean() / width * layout.room.width, (1.0 - rows.mean() / height) * layout.room.depth

    x, y, _ = env.unwrapped.state.pose
    assert center((32, 92, 196)) == pytest.approx((x, y), abs=0.35)
    assert center((46, 160, 67)) == pytest.approx((6.5, 1.0), abs=0.3)
    env.close()


def test_gymnasiums_wrappers_take_the_pictures(layout: Layout) -> None:
    env = RenderCollection(MapInset(make(layout, **PICTURE)))
    env.reset(seed=0)
    env.step(np.zeros(2, np.float32))
    pictures = env.render()
    assert [picture.shape for picture in pictures] == [(120, 160, 3)] * 2
    env.close()


def test_what_does_not_fit_is_refused_in_one_line(layout: Layout) -> None:
    env = make(layout)
    goals = gym.make("LabFloorNavGoal-v0", layout=layout)
    for wrapper, inside, arguments, message in (
        (ActionRepeat, env, {"times": 0}, "times is 0"),
        (EgocentricMap, env, {"cells": 0}, "cells"),
        (EgocentricMap, env, {"name": "lidar"}, "cannot add the entry 'lidar'"),
        (EgocentricMap, goals, {}, "needs the entry 'lidar'"),
        (OdometryNoise, OdometryNoise(env), {}, "cannot add the entry 'odometry'"),
        (OdometryNoise, env, {"along": -1.0}, "along"),
        (MapInset, env, {}, "render_mode 'rgb_array', not None"),
        (MapInset, env, {"share": 0.0}, "share is 0.0"),
        (EgocentricMap, gym.make("CartPole-v1"), {}, "not for CartPoleEnv"),
    ):
        with pytest.raises(OptionError, match=message) as caught:
            wrapper(inside, **arguments)
        assert "\n" not in str(caught.value)
