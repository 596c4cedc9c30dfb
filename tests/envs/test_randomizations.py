"""Randomizations: seeded per episode, independent of each other, and with the effect that their values say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.envs.parts.noise import Dropout, Gaussian
from labgym.envs.parts.randomizations import with_errors
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Camera, Lidar
from labgym.envs.simulation import Simulation
from labgym.errors import LabgymError, OptionError
from labgym.layouts import Layout

START: dict[str, Any] = {"start": (4.0, 4.8, 0.4), "goal": (5.5, 4.8)}
EVERY = ("mass", "friction", "sensor_pose", "noise", "appearance")
MEASURES = ("pose", "collision", "randomization")


def make(layout: Layout, randomizations: Any, **options: Any) -> LabPointNavEnv:
    return LabPointNavEnv(layout=layout, randomizations=randomizations, measures=MEASURES, **options)


def drawn(env: LabPointNavEnv, seed: int | None) -> dict[str, Any]:
    values: dict[str, Any] = env.reset(seed=seed, options=START)[1]["randomization"]
    return values


def test_values_depend_on_the_seed_and_the_episode_alone(layout: Layout) -> None:
    sensors = ["goal", {"kind": "lidar", "noise": {"kind": "gaussian", "sigma": 0.02}}, "odometry"]
    first, second = (make(layout, EVERY, sensors=sensors) for _ in range(2))
    assert drawn(first, 3) == drawn(second, 3)
    assert set(drawn(first, 3)) == set(EVERY)
    following = drawn(first, None)
    assert following == drawn(second, None)
    assert following != drawn(second, 3)
    drawn(first, 3)
    one, two = first.step(np.ones(2))[0], second.step(np.ones(2))[0]
    assert all(np.array_equal(one[name], two[name]) for name in one)


def test_one_randomization_does_not_change_the_values_of_another(layout: Layout) -> None:
    together, single = make(layout, EVERY), make(layout, ["friction"])
    assert drawn(together, 5)["friction"] == drawn(single, 5)["friction"]


def test_without_randomizations_an_episode_is_the_same_to_the_bit(layout: Layout) -> None:
    plain, none = LabPointNavEnv(layout=layout), make(layout, [{"kind": "mass", "factor": [1.0, 1.0]}])
    first, second = (env.reset(seed=1, options=START)[0] for env in (plain, none))
    for _ in range(20):
        assert all(np.array_equal(first[name], second[name]) for name in first)
        first, second = (env.step(np.array([1.0, 0.4]))[0] for env in (plain, none))


def test_a_heavier_robot_accelerates_less_by_its_factor(layout: Layout) -> None:
    env = make(layout, [{"kind": "mass", "factor": [2.0, 2.0]}])
    assert drawn(env, 0) == {"mass": 2.0}
    env.step(np.array([1.0, 0.0]))
    env.step(np.array([1.0, 0.0]))
    assert env.state.velocity[0] == pytest.approx(ROBOT.acceleration / 2.0 * 0.2, rel=0.01)
    models = env._running().simulation
    assert isinstance(models, Simulation)
    assert models.model.body("robot/base").mass[0] == pytest.approx(2.0 * ROBOT.mass)


def test_the_shared_model_of_a_layout_stays_as_it_is(layout: Layout) -> None:
    env = make(layout, ["mass", "friction"])
    drawn(env, 0)
    assert env.state.world.model.body("robot/base").mass[0] == ROBOT.mass
    assert env.state.world.model.geom("robot/chassis").friction[0] == 0.2


def test_a_randomized_robot_alone_moves_as_in_the_scene_to_the_bit(layout: Layout) -> None:
    env = make(layout, ["mass", "friction"])
    drawn(env, 2)
    quick = env._running().simulation
    assert isinstance(quick, Simulation)
    whole = Simulation(quick.model)
    whole.place(START["start"])
    for k in range(60):
        command = (0.8, 0.9 if k < 30 else -0.6)
        assert quick.drive(*command) == whole.drive(*command)
        assert quick.pose == whole.pose


def test_less_grip_slides_farther_sideways(layout: Layout) -> None:
    slips = []
    for factor in (1.0, 0.1):
        env = make(layout, [{"kind": "friction", "factor": [factor, factor]}])
        drawn(env, 0)
        for _ in range(12):
            env.step(np.array([1.0, 1.0]))
        slips.append(abs(env._running().simulation.sideways))
    assert slips[1] > 5.0 * slips[0]


def test_a_moved_lidar_reads_what_one_on_a_moved_robot_reads(layout: Layout) -> None:
    env = make(layout, [{"kind": "sensor_pose", "forward": 0.1, "left": 0.1, "height": 0.03, "yaw": 20.0}])
    offsets = drawn(env, 1)["sensor_pose"]["lidar"]
    ranges = env.reset(seed=1, options=START)[0]["lidar"]
    x, y, yaw = START["start"]
    ahead, left = offsets["forward"], offsets["left"]
    place = (
        x + ahead * math.cos(yaw) - left * math.sin(yaw),
        y + ahead * math.sin(yaw) + left * math.cos(yaw),
        yaw + math.radians(offsets["yaw"]),
    )
    expected = Lidar(height=ROBOT.lidar_height + offsets["height"]).scan(env.state.world.solid, place)
    assert ranges == pytest.approx(expected, abs=1e-4)
    assert max(abs(ahead), abs(left)) > 0.01


def test_a_turned_camera_sees_what_one_on_a_turned_robot_sees(layout: Layout) -> None:
    sensor = DepthSensor(yaw=0.3, forward=0.0)
    env = LabPointNavEnv(layout=layout, sensors=[sensor])
    seen = env.reset(seed=0, options=START)[0]["depth"]
    x, y, yaw = START["start"]
    expected = Camera(forward=0.0).depth(env.state.world.visible, (x, y, yaw + 0.3))
    near = np.isclose(seen, expected.ravel(), atol=1e-3)
    assert near.mean() > 0.995


def test_a_camera_pitched_down_sees_the_floor_at_the_distance_of_its_height(empty_room: Layout) -> None:
    pitch, height = math.radians(30.0), 0.5
    sensor = DepthSensor(pitch=pitch, height=height, rows=1, columns=1)
    env = LabPointNavEnv(layout=empty_room, sensors=[sensor])
    depth = env.reset(seed=0, options={"start": (2.0, 3.0, 0.0), "goal": (3.0, 3.0)})[0]["depth"]
    assert depth[0] == pytest.approx(height / math.sin(pitch), abs=1e-3)


def test_noise_is_scaled_by_the_drawn_factor(layout: Layout) -> None:
    noisy = {"kind": "lidar", "noise": {"kind": "gaussian", "sigma": 0.01}}
    env = make(layout, [{"kind": "noise", "factor": [3.0, 3.0]}], sensors=[noisy])
    assert drawn(env, 0)["noise"] == {"lidar": 3.0}
    clean = Lidar().scan(env.state.world.solid, env.state.pose)
    errors = [env.reset(seed=seed, options=START)[0]["lidar"] - clean for seed in range(20)]
    assert np.std(errors) == pytest.approx(0.03, rel=0.05)


def test_noise_models_scale_what_their_errors_follow() -> None:
    sensor = LidarSensor(noise=(Gaussian(0.01, 0.02, 0.003), Dropout(0.4)))
    gaussian, dropout = with_errors(sensor, 2.0).noise  # type: ignore[union-attr]
    assert (gaussian.sigma, gaussian.relative, gaussian.bias) == (0.02, 0.04, 0.006)
    assert dropout.rate == 0.8
    assert with_errors(sensor, 5.0).noise[1].rate == 1.0  # type: ignore[union-attr]
    assert with_errors(LidarSensor(), 2.0) is None


def test_appearance_changes_colors_and_not_depth(layout: Layout) -> None:
    plain = LabPointNavEnv(layout=layout, observation="rgbd")
    darker = make(layout, [{"kind": "appearance", "tint": 0.0, "brightness": 0.5}], observation="rgbd")
    first = plain.reset(seed=0, options=START)[0]
    brightness = drawn(darker, 0)["appearance"]["brightness"]
    second = darker.reset(seed=0, options=START)[0]
    assert np.array_equal(first["depth"], second["depth"])
    ground = (first["rgb"] < 255 / max(brightness, 1.0) - 2).all(axis=2) & (first["depth"].reshape(72, 128) < 10.0)
    expected = first["rgb"][ground].astype(float) * brightness
    assert np.abs(second["rgb"][ground] - expected).max() <= 2.0
    assert abs(brightness - 1.0) > 0.01
    assert np.array_equal(plain.reset(seed=0, options=START)[0]["rgb"], first["rgb"])


def test_sensors_of_a_joint_vector_are_randomized_too(layout: Layout) -> None:
    joint = {"kind": "joint", "sensors": ["pose", {"kind": "lidar", "noise": {"kind": "gaussian", "sigma": 0.01}}]}
    env = make(layout, ["noise", "sensor_pose"], sensors=[joint])
    values = drawn(env, 0)
    assert set(values["noise"]) == {"observation/lidar"}
    assert set(values["sensor_pose"]) == {"observation/lidar"}


@dataclass
class Loud:
    """A randomization of a user."""

    name: str = "loud"

    def randomize(self, setting: Any, rng: np.random.Generator) -> float:
        reach = float(rng.uniform(0.1, 0.2))
        setting.sensors["lidar"] = LidarSensor(noise=(Gaussian(reach),))
        return reach


def test_a_user_can_write_one(layout: Layout) -> None:
    env = make(layout, [Loud()])
    assert 0.1 <= drawn(env, 0)["loud"] <= 0.2


@dataclass
class Shorter(Loud):
    def randomize(self, setting: Any, rng: np.random.Generator) -> float:
        setting.sensors["lidar"] = LidarSensor(reach=5.0)
        return 5.0


def test_one_that_changes_a_space_is_refused(layout: Layout) -> None:
    with pytest.raises(OptionError, match="space of sensor 'lidar'"):
        make(layout, [Shorter()]).reset(seed=0, options=START)


@pytest.mark.parametrize(
    "randomizations",
    [
        ["weather"],
        "mass",
        [{"kind": "mass", "factor": 2.0}],
        [{"kind": "mass", "factor": [0.0, 1.0]}],
        [{"kind": "mass", "factor": [2.0, 1.0]}],
        [{"kind": "mass", "of": "walls"}],
        [{"kind": "noise", "factor": [-1.0, 1.0]}],
        [{"kind": "sensor_pose", "yaw": -1.0}],
        [{"kind": "appearance", "tint": "red"}],
        ["mass", "mass"],
        [3],
    ],
)
def test_values_out_of_range_are_refused_when_the_environment_is_made(randomizations: Any) -> None:
    with pytest.raises(LabgymError):
        LabPointNavEnv(randomizations=randomizations)


def test_unknown_sensors_and_sensors_without_errors_are_refused_at_reset(layout: Layout) -> None:
    for randomization in (
        {"kind": "sensor_pose", "sensors": ["nose"]},
        {"kind": "noise", "sensors": ["lidar"]},
        {"kind": "sensor_pose", "sensors": ["goal"]},
    ):
        with pytest.raises(LabgymError):
            make(layout, [randomization]).reset(seed=0, options=START)


def test_the_planar_kernel_takes_those_of_sensors_alone(layout: Layout) -> None:
    pytest.importorskip("numba")
    env = make(layout, ["sensor_pose"], physics="planar")
    reference = make(layout, ["sensor_pose"])
    assert drawn(env, 0) == drawn(reference, 0)
    first, second = (each.reset(seed=0, options=START)[0]["lidar"] for each in (env, reference))
    assert np.isclose(first, second, atol=0.01).mean() > 0.98
    with pytest.raises(OptionError, match="planar kernel"):
        make(layout, ["mass"], physics="planar").reset(seed=0, options=START)
