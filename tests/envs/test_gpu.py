"""The robots on a device of Warp against the processor's kernel, MuJoCo and Embree; here on Warp's CPU backend."""

from __future__ import annotations

import math
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from laboratories import island_laboratory

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Camera, Lidar
from labgym.envs.world import World, world_of
from labgym.errors import OptionError
from labgym.layouts import Layout, load_published

pytest.importorskip("numba")
pytest.importorskip("warp")

from planar_agreement import MujocoMotion, commands, free_poses

from labgym.envs.gpu.batch import DeviceBatch
from labgym.envs.planar.batch import PlanarBatch
from labgym.envs.planar.body import TIMESTEP

ID = "LabPointNav-v0"
SENSORS = (LidarSensor(), DepthSensor(rows=18, columns=32))
EACH = 4
"""Robots in each world."""


@pytest.fixture(scope="module")
def layouts() -> list[Layout]:
    """Layouts of different geometry: a room by hand, a published room, a published floor of several rooms."""
    different = (
        island_laboratory(),
        load_published("test", "test-sub_01"),
        load_published("floors-val", "floors-val-0001"),
    )
    return [layout for layout in different for _ in range(EACH)]


@pytest.fixture(scope="module")
def worlds(layouts) -> list[World]:
    return [world_of(layout) for layout in layouts]


@pytest.fixture(scope="module")
def starts(layouts):
    rng = np.random.default_rng(4)
    return [next(free_poses(layout, rng, 1)) for layout in layouts]


def batches(worlds, starts):
    """The robots on the processor and on the device, at the same places of the same worlds."""
    pair = (
        PlanarBatch(len(worlds), ROBOT.control_dt, SENSORS[0], threads=1),
        DeviceBatch(len(worlds), ROBOT.control_dt, SENSORS, "cpu"),
    )
    for batch in pair:
        for robot, (world, pose) in enumerate(zip(worlds, starts, strict=True)):
            field = world.to_go((pose[0] + 0.5, pose[1], 0.0)).field if robot % 2 else None
            batch.place(robot, pose, world, field)
    return pair


@pytest.mark.slow
def test_robots_in_different_worlds_move_as_on_the_processor_over_ten_seconds(worlds, starts):
    """With contacts. Bars: 1 mm and 1 cm over 10 s."""
    kernel, device = batches(worlds, starts)
    drives = [list(commands(np.random.default_rng(robot), 100)) for robot in range(len(worlds))]
    touches = 0
    for step in range(100):
        kernel.robots.targets[:] = device.robots.targets[:] = [drive[step] for drive in drives]
        kernel.step()
        device.step()
        ours, theirs = device.robots, kernel.robots
        distances = np.linalg.norm(ours.poses[:, :2] - theirs.poses[:, :2], axis=1)
        assert distances.max() < (1e-6 if step < 10 else 1e-4)
        assert np.abs(np.sin((ours.poses[:, 2] - theirs.poses[:, 2]) / 2.0)).max() < 1e-4
        np.testing.assert_allclose(ours.velocities, theirs.velocities, atol=1e-3)
        np.testing.assert_allclose(ours.driven, theirs.driven, atol=1e-4)
        np.testing.assert_allclose(ours.clearances, theirs.clearances, atol=1e-4)
        np.testing.assert_allclose(ours.to_go, theirs.to_go, atol=1e-3)
        np.testing.assert_array_equal(ours.touched, theirs.touched)
        touches += int(ours.touched.sum())
    assert touches > 50
    assert 0 < np.isfinite(device.robots.to_go).sum() <= len(worlds) / 2


def test_free_motion_is_that_of_mujoco_at_a_millisecond(worlds, starts):
    device = DeviceBatch(len(worlds), ROBOT.control_dt, (), "cpu")
    references = [MujocoMotion(world.model, TIMESTEP) for world in worlds]
    for robot, (world, pose) in enumerate(zip(worlds, starts, strict=True)):
        device.place(robot, pose, world, None)
        references[robot].place(pose)
    free = np.ones(len(worlds), dtype=bool)
    for v, w in commands(np.random.default_rng(3), 10):
        device.robots.targets[:] = v, w
        device.step()
        for robot, reference in enumerate(references):
            free[robot] &= not reference.drive(v, w)
            if free[robot]:
                assert reference.distance(tuple(device.robots.poses[robot])) < 1e-9
    assert free.sum() > len(worlds) / 2


def test_rays_read_what_embree_reads(worlds, starts):
    """Rays that graze an edge may hit or miss it; of the others the readings differ by rounding."""
    _, device = batches(worlds, starts)
    camera, lidar = Camera((18, 32)), Lidar()
    expected = {
        "lidar": np.array([lidar.scan(world.solid, pose) for world, pose in zip(worlds, starts, strict=True)]),
        "depth": np.array(
            [camera.depth(world.visible, pose).ravel() for world, pose in zip(worlds, starts, strict=True)]
        ),
    }
    for name, readings in expected.items():
        ours = device.readings(name)
        assert (ours.dtype, ours.shape) == (np.float32, readings.shape)
        difference = np.abs(ours - readings)
        assert (difference > 0.01).mean() < 0.0005
        assert np.median(difference) < 1e-5
        assert readings.std() > 0.5


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_the_vector_environment_on_a_device_equals_that_on_threads(mode):
    options = {"num_envs": 6, "vectorization_mode": "vector_entry_point", "autoreset_mode": mode}
    options |= {"split": "val", "max_episode_steps": 25}
    threads, device = gym.make_vec(ID, **options), gym.make_vec(ID, device="cpu", **options)
    assert device.single_observation_space == threads.single_observation_space
    rng = np.random.default_rng(0)
    pairs = [(threads.reset(seed=5)[0], device.reset(seed=5)[0])]
    ends = 0
    for _ in range(60):
        action = rng.uniform(-1.0, 1.0, (6, 2)).astype(np.float32)
        expected, actual = threads.step(action), device.step(action)
        pairs.append((expected[0], actual[0]))
        np.testing.assert_allclose(actual[1], expected[1], atol=1e-3)
        np.testing.assert_array_equal(actual[2], expected[2])
        np.testing.assert_array_equal(actual[3], expected[3])
        assert actual[4].keys() == expected[4].keys()
        ends += int(actual[2].sum() + actual[3].sum())
        done = actual[2] | actual[3]
        if mode == "Disabled" and done.any():
            options = {"reset_mask": done}
            pairs.append((threads.reset(options=options)[0], device.reset(options=options)[0]))
        if "final_obs" in actual[4]:
            for row in np.flatnonzero(actual[4]["_final_obs"]):
                last, other = actual[4]["final_obs"][row], expected[4]["final_obs"][row]
                np.testing.assert_allclose(last["goal"], other["goal"], atol=1e-4)
    assert ends >= 12
    for name in pairs[0][0]:
        theirs, ours = (np.array([pair[k][name] for pair in pairs]) for k in (0, 1))
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape)
        tolerance = 0.01 if name == "lidar" else 1e-3
        assert (np.abs(ours - theirs) > tolerance).mean() < 0.002, name


def test_a_device_has_depth_cameras_and_several_lidars():
    sensors = [{"kind": "depth", "rows": 9, "columns": 16}, "lidar", {"kind": "lidar", "name": "high", "height": 0.7}]
    envs = gym.make_vec(
        ID, 2, "vector_entry_point", device="cpu", layout=island_laboratory(), sensors=["goal", *sensors]
    )
    observations, _ = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    observations = envs.step(np.tile(np.array([0.5, 0.2], np.float32), (2, 1)))[0]
    assert envs.observation_space.contains(observations)
    assert observations["depth"].shape == (2, 144)
    assert not np.array_equal(observations["high"], observations["lidar"])
    envs.close()


def test_a_device_that_is_missing_is_refused_in_one_line():
    options = {"num_envs": 2, "vectorization_mode": "vector_entry_point", "layout": island_laboratory()}
    with pytest.raises(OptionError, match=r"device is 'cuda:77'; this machine has cpu") as caught:
        gym.make_vec(ID, device="cuda:77", **options)
    assert "\n" not in str(caught.value)
    with pytest.raises(OptionError, match="threads is 2 with device 'cpu'"):
        gym.make_vec(ID, device="cpu", threads=2, **options)
    with pytest.raises(OptionError, match="no sensor LidarSensor or its noise"):
        gym.make_vec(ID, device="cpu", sensors=[{"kind": "lidar", "noise": ["gaussian"]}], **options)


def test_without_warp_the_extra_is_named_in_one_line():
    code = (
        "import sys\nsys.modules['warp'] = None\n"
        "try:\n    import labgym.envs.gpu.batch\n"
        "except ImportError as error:\n    print(error)\n"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.count("\n") == 1
    assert "pip install 'labgym-nav[warp]'" in printed


def test_the_pose_of_a_robot_that_turned_is_within_half_a_turn(worlds, starts):
    device = DeviceBatch(1, ROBOT.control_dt, (), "cpu")
    device.place(0, (*starts[0][:2], 3.0), worlds[0], None)
    for _ in range(30):
        device.robots.targets[:] = 0.0, 1.5
        device.step()
        assert -math.pi < device.robots.poses[0, 2] <= math.pi
