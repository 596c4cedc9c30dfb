"""`interactive=True`: furniture moves in the physics, and sensors see it where it is."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from laboratories import put

from labgym.envs import LabPointNavEnv
from labgym.errors import OptionError
from labgym.layouts import Layout, Room

START: dict[str, Any] = {"start": (1.2, 2.0, 0.0), "goal": (5.0, 3.5)}


@pytest.fixture(scope="module")
def room() -> Layout:
    """A bench along the back wall, and a stool 1.3 m ahead of the robot."""
    return Layout(
        id="moving",
        floor=Room(width=6.0, depth=5.0).floor,
        placements=(put("bench", "LabBench", 3.0, 4.6, yaw=np.pi), put("stool", "LabStool", 2.5, 2.0)),
    )


def make(room: Layout, **options: Any) -> LabPointNavEnv:
    return LabPointNavEnv(layout=room, interactive=True, **options)


def test_before_anything_moves_readings_are_those_of_the_static_scene(room: Layout) -> None:
    sensors = ["lidar", "depth", "segmentation", "rgb"]
    static, moving = LabPointNavEnv(layout=room, sensors=sensors), make(room, sensors=sensors)
    (first, info), (second, other) = (env.reset(seed=0, options=START) for env in (static, moving))
    assert second["lidar"] == pytest.approx(first["lidar"], abs=1e-3)
    assert np.isclose(first["depth"], second["depth"], atol=0.01).mean() > 0.99
    assert (first["segmentation"] == second["segmentation"]).mean() > 0.99
    assert np.abs(first["rgb"].astype(float) - second["rgb"]).mean() < 8.0
    assert other["clearance"] == pytest.approx(info["clearance"], abs=0.01)
    assert moving.observation_space.contains(second)


def test_the_robot_pushes_a_stool_and_the_lidar_sees_it_move(room: Layout) -> None:
    env, fixed = make(room), LabPointNavEnv(layout=room)
    for each in (env, fixed):
        each.reset(seed=0, options=START)
    for _ in range(40):
        observation, _, _, _, info = env.step(np.array([0.5, 0.0], np.float32))
        still = fixed.step(np.array([0.5, 0.0], np.float32))
    assert info["pose"][0] > still[4]["pose"][0] + 0.3
    assert info["collision"]
    # The stool is pushed along: straight ahead, it is as near as at the fixed one.
    assert observation["lidar"][90] < 0.6
    assert info["contacts"] > 5


def test_an_episode_begins_with_everything_in_its_place(room: Layout) -> None:
    env = make(room)
    first = env.reset(seed=0, options=START)[0]
    for _ in range(30):
        env.step(np.array([1.0, 0.0], np.float32))
    again = env.reset(seed=0, options=START)[0]
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_copies_go_on_to_the_bit_and_do_not_share_the_furniture(room: Layout) -> None:
    env = make(room)
    env.reset(seed=0, options=START)
    for _ in range(20):
        env.step(np.array([0.6, 0.0], np.float32))
    other = copy.deepcopy(env)
    action = np.array([0.6, 0.1], np.float32)
    first = [env.step(action)[0] for _ in range(3)]
    second = [other.step(action)[0] for _ in range(3)]
    for one, two in zip(first, second, strict=True):
        assert all(np.array_equal(one[name], two[name]) for name in one)


def test_masses_of_objects_can_be_randomized(room: Layout) -> None:
    env = make(room, randomizations=[{"kind": "mass", "of": "objects"}], measures=("pose", "randomization"))
    factors = env.reset(seed=0, options=START)[1]["randomization"]["mass"]
    assert {"stool", "bench/drawer_1"} <= set(factors)
    assert all(0.8 <= factor <= 1.2 for factor in factors.values())


def test_a_robot_on_wheels_drives_in_an_interactive_scene(room: Layout) -> None:
    env = make(room, robot="wheels")
    env.reset(seed=0, options=START)
    for _ in range(10):
        info = env.step(np.array([0.5, 0.0], np.float32))[4]
    assert info["pose"][0] == pytest.approx(1.2 + 0.5 * (1.0 - 0.5 / 1.5 / 2.0), abs=0.03)
    assert not info["collision"]


def test_the_picture_shows_furniture_and_wheels_where_they_are(room: Layout) -> None:
    env = make(room, robot="wheels", render_mode="rgb_array", width=96, height=72)
    env.reset(seed=0, options=START)
    before = env.render()
    for _ in range(25):
        env.step(np.array([1.0, 0.0], np.float32))
    after = env.render()
    assert before is not None
    assert after is not None
    assert after.shape == (72, 96, 3)
    drawn, simulated = env._view._scene, env._running().simulation.data  # type: ignore[attr-defined]
    for name in ("stool", "bench/drawer_1", "robot/base", "robot/left_wheel"):
        assert drawn.joint(name).qpos == pytest.approx(simulated.joint(name).qpos)
    assert drawn.body("stool").xpos[0] > 2.6
    env.close()


def test_discrete_actions_drive_a_robot_on_wheels(room: Layout) -> None:
    env = LabPointNavEnv(layout=room, config="LabFloorNavDiscrete-v0", robot="wheels")
    env.reset(seed=0, options=START)
    info = env.step(1)[4]
    assert info["pose"][0] == pytest.approx(1.45, abs=0.01)
    info = env.step(2)[4]
    assert info["pose"][2] == pytest.approx(np.radians(15.0), abs=np.radians(1.0))


@pytest.mark.parametrize(
    "options",
    [
        {"interactive": True, "exact": True},
        {"loose": True},
        {"interactive": "yes"},
        {"interactive": True, "loose": 1},
    ],
)
def test_options_that_do_not_fit_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(OptionError):
        LabPointNavEnv(**options)
