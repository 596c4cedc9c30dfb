"""Configurations: plain data, files, parts of the user's own."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces

import labgym  # noqa: F401  (registers the environments)
from labgym.envs import LabPointNavEnv, PointNavConfig
from labgym.envs.parts.noise import Gaussian
from labgym.envs.parts.protocols import Sensor
from labgym.envs.parts.rays import LidarSensor
from labgym.envs.presets import configured
from labgym.envs.state import State
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.layouts import Layout

AHEAD = np.array([1.0, 0.2], np.float32)
NOISY = {"kind": "lidar", "rays": 60, "noise": [{"kind": "gaussian", "sigma": 0.03}]}


@dataclass
class Odometer(Sensor):
    """A sensor of the user's own, which counts its readings."""

    name: str = "odometer"
    count: int = 0

    @property
    def space(self) -> spaces.Space[Any]:
        return spaces.Box(0.0, np.inf, (2,), np.float32)

    def reading(self, state: State, rng: np.random.Generator) -> np.ndarray:
        self.count += 1
        return np.array([state.path_length, self.count], np.float32)


def readings(env: gym.Env, steps: int = 3) -> list[dict[str, np.ndarray]]:
    observation, _ = env.reset(seed=4)
    return [observation, *(env.step(AHEAD)[0] for _ in range(steps))]


def test_plain_data_and_objects_make_equal_environments(layout: Layout, tmp_path: Path) -> None:
    plain = {"sensors": ["goal", NOISY]}
    (tmp_path / "c.json").write_text(json.dumps(plain))
    (tmp_path / "c.yaml").write_text(
        "sensors:\n- goal\n- {kind: lidar, rays: 60, noise: {kind: gaussian, sigma: 0.03}}\n"
    )
    objects = PointNavConfig(sensors=["goal", LidarSensor(rays=60, noise=(Gaussian(0.03),))])
    configs = (plain, objects, asdict(objects), tmp_path / "c.json", tmp_path / "c.yaml")
    first, *others = (readings(LabPointNavEnv(config=config, layout=layout)) for config in configs)
    for other in others:
        for a, b in zip(first, other, strict=True):
            assert a.keys() == b.keys()
            assert all((a[key] == b[key]).all() for key in a)


def test_a_specification_survives_json(layout: Layout, tmp_path: Path) -> None:
    path = str(layout.save(tmp_path / "layout.json"))
    sensors = (LidarSensor(rays=60, noise=(Gaussian(0.03),)),)
    env = gym.make("LabPointNav-v0", layout=path, sensors=sensors, endings=[{"kind": "touch", "radius": 0.3}])
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    for a, b in zip(readings(env), readings(again), strict=True):
        np.testing.assert_array_equal(a["lidar"], b["lidar"])
    assert again.unwrapped.config.endings[0].radius == 0.3


def test_environments_do_not_share_what_a_part_remembers(layout: Layout) -> None:
    config = PointNavConfig(layout=layout, sensors=[Odometer()])
    envs = [LabPointNavEnv(config=config) for _ in range(2)]
    assert [[r["odometer"][1] for r in readings(env)] for env in envs] == [[1, 2, 3, 4]] * 2
    assert config.sensors[0].count == 0


def test_noise_depends_on_seed_episode_and_name_alone(layout: Layout) -> None:
    both = readings(LabPointNavEnv(layout=layout, sensors=[NOISY, {**NOISY, "name": "second"}]))
    alone = readings(LabPointNavEnv(layout=layout, sensors=[NOISY]))
    for a, b in zip(both, alone, strict=True):
        np.testing.assert_array_equal(a["lidar"], b["lidar"])
        assert (a["lidar"] != a["second"]).any()
    env = LabPointNavEnv(layout=layout, sensors=[NOISY])
    start = {"start": (4.0, 5.4, 0.0), "goal": (4.0, 1.0)}
    first, _ = env.reset(seed=1, options=start)
    second, _ = env.reset(options=start)
    assert (first["lidar"] != second["lidar"]).any()
    third, _ = env.reset(seed=1, options=start)
    np.testing.assert_array_equal(first["lidar"], third["lidar"])


def test_noise_has_the_stated_deviation_and_stays_in_the_space(layout: Layout) -> None:
    wide = LabPointNavEnv(layout=layout, sensors=["lidar", {**NOISY, "name": "noisy", "rays": 180}])
    drawn = [wide.reset(seed=k)[0] for k in range(20)]
    assert all(observation in wide.observation_space for observation in drawn)
    errors = np.array([o["noisy"] - o["lidar"] for o in drawn])[np.array([o["lidar"] < 9.8 for o in drawn])]
    assert errors.std() == pytest.approx(0.03, rel=0.1)
    assert errors.mean() == pytest.approx(0.0, abs=0.003)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_continues_with_the_same_noise(layout: Layout, copied: Any) -> None:
    env = LabPointNavEnv(layout=layout, sensors=[NOISY])
    readings(env)
    other = copied(env)
    for _ in range(3):
        np.testing.assert_array_equal(env.step(AHEAD)[0]["lidar"], other.step(AHEAD)[0]["lidar"])


@pytest.mark.parametrize(
    "options",
    [
        {"colour": "red"},
        {"width": "wide"},
        {"width": 2.5},
        {"height": True},
        {"control_dt": "slow"},
        {"episodes_per_layout": 1.5},
        {"exact": 1},
        {"physics": "chemistry"},
        {"robot": "broom"},
        {"robot": {"kind": "differential", "size": {"mass": -80.0}}},
        {"robot": {"kind": "differential", "size": {"wings": 2}}},
        {"actions": "telepathy"},
        {"sensors": []},
        {"sensors": "lidar"},
        {"sensors": ["nose"]},
        {"sensors": [LidarSensor]},
        {"sensors": [{"rays": 3}]},
        {"sensors": [{"kind": "lidar", "rays": 0}]},
        {"sensors": [{"kind": "lidar", "reach": float("nan")}]},
        {"sensors": [{"kind": "lidar", "noise": "hiss"}]},
        {"sensors": [{"kind": "lidar", "noise": [{"kind": "gaussian", "sigma": -1}]}]},
        {"sensors": [{"kind": "lidar", "noise": [{"kind": "dropout", "rate": 2}]}]},
        {"sensors": [{"kind": "no.such.module:Sensor"}]},
        {"endings": [{"kind": "touch", "radius": 0}]},
        {"endings": [{"kind": "stuck", "duration": "long"}]},
        {"measures": ["mood"]},
        {"measures": 3},
        {"weights": 3.0},
        {"weights": {"fun": 1.0}},
        {"tasks": 3},
        {"config": 3},
        {"config": {"colour": "red"}},
    ],
)
def test_a_bad_argument_is_refused_in_one_line(options: dict[str, Any]) -> None:
    with pytest.raises(LabgymError) as caught:
        LabPointNavEnv(**options)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, OptionError | UnknownNameError)


@pytest.mark.parametrize("text", ["[1, 2]", "{", ""])
def test_a_broken_file_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.json"
    path.write_text(text)
    with pytest.raises(DocumentError, match=r"broken\.json"):
        LabPointNavEnv(config=path)


def test_endings_give_their_verdicts(layout: Layout) -> None:
    ends = {"start": (4.0, 4.8, 0.0), "goal": (4.8, 4.8)}
    rest = LabPointNavEnv(layout=layout, endings=["rest"], measures=["success", "ending", "distance"])
    rest.reset(seed=0, options=ends)
    info, terminated, steps = {"distance": 1.0}, False, 0
    while not terminated and steps < 60:
        _, _, terminated, _, info = rest.step(np.array([1.0 if info["distance"] > 0.45 else 0.0, 0.0]))
        steps += 1
    assert (info["success"], info["ending"]) == (True, "rest")
    assert info["distance"] <= 0.36
    assert abs(rest.state.velocity[0]) <= 0.05
    for endings, expected in ((["contact"], "contact"), ([{"kind": "stuck", "duration": 1.0}], "stuck")):
        env = LabPointNavEnv(layout=layout, endings=endings, measures=["success", "ending", "time"])
        env.reset(seed=0, options={"pair": 0})
        terminated = False
        while not terminated:
            _, _, terminated, _, info = env.step(np.array([1.0 if expected == "contact" else 0.0, 0.0]))
            assert info["time"] < 10.0
        assert (info["success"], info["ending"]) == (False, expected)


def test_a_labnav_environment_has_the_sensors_of_the_observation_that_is_asked_for() -> None:
    for observation in ("lidar", "depth", "rgbd"):
        config = configured("LabNavCarry-v0", {"observation": observation, "split": "floors-val"})
        assert config.observed == configured(f"labnav-carry-2-{observation}", {}).observed
        assert (config.split, config.drives) == ("floors-val", "labnav-carry-2")
    harder = configured("labnav-odometry-3", {"observation": "depth"})
    assert harder == configured("labnav-odometry-3-depth", {})
    with pytest.raises(UnknownNameError, match="depth, lidar, rgbd"):
        configured("LabNavCarry-v0", {"observation": "radar"})


def test_an_observation_is_refused_where_sensors_of_the_configuration_would_override_it() -> None:
    for config in ("LabFloorNavGoal-v0", configured("LabNavCarry-v0", {}), {"sensors": ["goal", "lidar"]}):
        with pytest.raises(OptionError, match="observation='depth' has no effect"):
            configured(config, {"observation": "depth"})
        with pytest.raises(OptionError, match="observation='depth' has no effect"):
            configured(config, {"observation": "depth", "sensors": ["depth"]})
        assert configured(config, {"sensors": ["depth"]}).observed[0].name == "depth"
        assert configured(config, {"observation": "lidar"}).observed[-1].name != "depth"


CODE = {
    "a class of the standard library": {"sensors": [{"kind": "subprocess:Popen", "args": ["touch", "SPRUNG"]}]},
    "a class in a list": {"sensors": ["goal", "os:makedirs"]},
    "a reward's function": {"rewards": [{"kind": "function", "name": "a", "function": "os:system"}]},
    "a robot": {"robot": {"kind": "pathlib:Path.touch", "self": "SPRUNG"}},
    "a measure": {"measures": ["antigravity:fly"]},
}


@pytest.mark.parametrize("suffix", ["json", "yaml"])
@pytest.mark.parametrize("name", CODE)
def test_a_file_may_not_name_code(tmp_path: Path, layout: Layout, name: str, suffix: str) -> None:
    sprung, path = tmp_path / "sprung", tmp_path / f"c.{suffix}"
    path.write_text(json.dumps(CODE[name]).replace("SPRUNG", str(sprung)))
    with pytest.raises(DocumentError, match="names the code") as caught:
        LabPointNavEnv(config=path, layout=layout)
    assert "\n" not in str(caught.value)
    assert not sprung.exists()
