"""Hyperparameters are read from YAML, checked, and turned into the arguments of stable-baselines3."""

from __future__ import annotations

import inspect
import math

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("yaml")

import yaml
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from labgym.envs.presets import presets
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.training.hyperparameters import FOLDER, Hyperparameters
from labgym.training.limits import ARGUMENTS, NORMALIZATION

LABNAV = [each for each in presets() if each.startswith("LabNav")]
PACKAGED = [
    (name, each)
    for name in ARGUMENTS
    for entries in [yaml.safe_load((FOLDER / f"{name}.yml").read_text())]
    for each in sorted({*entries, *(LABNAV if "LabNav" in entries else ())} - {"LabNav"})
]

FLOORS = [("ppo", "LabFloorNav-v0", FOLDER / "ppo-floors.yml")]


@pytest.mark.parametrize(("algorithm", "environment", "file"), [(*each, None) for each in PACKAGED] + FLOORS)
def test_the_files_that_come_with_labgym_are_valid(algorithm, environment, file):
    hyperparameters = Hyperparameters.load(algorithm, environment, file)
    hyperparameters.algorithm_arguments()
    hyperparameters.environment_options()
    assert hyperparameters.environment_options(evaluation=True)["split"] in ("val", "floors-val")
    assert hyperparameters.steps >= hyperparameters.n_timesteps
    assert hyperparameters.steps % hyperparameters.leg == 0


def write(path, text: str):
    path.write_text(text)
    return path


def test_numbers_in_exponential_notation_schedules_and_functions_are_read(tmp_path):
    path = write(
        tmp_path / "mine.yml",
        "LabPointNav-v0: {n_envs: 4, n_timesteps: 1e6, n_steps: 32, learning_rate: lin_1e-3, ent_coef: 1e-4,"
        " policy_kwargs: {activation_fn: relu}}",
    )
    hyperparameters = Hyperparameters.load("ppo", "LabPointNav-v0", path)
    arguments = hyperparameters.algorithm_arguments()
    assert hyperparameters.n_timesteps == 1_000_000
    assert arguments["ent_coef"] == 1e-4
    assert [arguments["learning_rate"](left) for left in (1.0, 0.5, 0.0)] == pytest.approx([1e-3, 5e-4, 0.0])
    assert arguments["policy_kwargs"] == {"activation_fn": nn.ReLU}


def test_an_id_of_labnav_replaces_values_of_the_common_entry(tmp_path):
    path = write(
        tmp_path / "mine.yml",
        "LabNav: {n_envs: 4, n_timesteps: 1000, n_steps: 32, frame_stack: 2}\nLabNavAisle-v0: {frame_stack: 3}",
    )
    own, common = (Hyperparameters.load("ppo", each, path) for each in ("LabNavAisle-v0", "LabNavDock-v0"))
    assert (own.n_envs, own.frame_stack) == (4, 3)
    assert (common.n_envs, common.frame_stack) == (4, 2)
    with pytest.raises(UnknownNameError):
        Hyperparameters.load("ppo", "LabFloorNav-v0", path)


def test_changes_replace_the_values_of_the_file():
    hyperparameters = Hyperparameters.load("ppo", "LabPointNav-v0", None, {"n_envs": 3, "gamma": 0.9})
    assert (hyperparameters.n_envs, hyperparameters.arguments["gamma"]) == (3, 0.9)


def test_a_leg_holds_whole_rollouts(tmp_path):
    path = write(tmp_path / "mine.yml", "E: {n_envs: 4, n_timesteps: 1000, eval_freq: 100, n_steps: 32}")
    hyperparameters = Hyperparameters.load("ppo", "E", path)
    assert (hyperparameters.leg, hyperparameters.steps) == (128, 1024)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("Other: {n_envs: 1, n_timesteps: 1}", UnknownNameError, "environment in mine.yml 'E' not found"),
        ("E: 3", DocumentError, "expected a mapping of hyperparameters"),
        ("E: {n_envs: 1}", DocumentError, "n_timesteps: missing"),
        ("E: {n_envs: 0, n_timesteps: 1}", OptionError, "n_envs is 0"),
        ("E: {n_envs: 1, n_timesteps: 1, gama: 0.9}", UnknownNameError, "nearest: gamma"),
        ("E: {n_envs: 1, n_timesteps: 1, normalize: 3}", OptionError, "normalize is 3"),
        ("E: {n_envs: 1, n_timesteps: 1, layouts: -1}", OptionError, "layouts is -1"),
    ],
)
def test_invalid_hyperparameters_are_named(text, error, message, tmp_path):
    with pytest.raises(error, match=message):
        Hyperparameters.load("ppo", "E", write(tmp_path / "mine.yml", text))


INVALID = {
    "ppo": {
        "learning_rate": ("abc", -1.0, 0, "lin_abc", None, math.nan, math.inf, True),
        "n_steps": (0, -3, 1.5, "8", True),
        "batch_size": (0, 1, "abc"),
        "n_epochs": (0,),
        "gamma": ("abc", 2.0, -0.1),
        "clip_range": ("abc", 0.0),
        "ent_coef": ("auto", -0.1),
        "target_kl": ("x",),
        "use_sde": ("maybe", 1),
        "stats_window_size": (0, "abc"),
        "policy_kwargs": (3, "dict(net_arch=[64])", {"net_arch": [0]}, {"net_arch": 64}, {"net_arch": {"pi": [8, -1]}}),
        "policy": (3,),
        "near_goal": (3,),
        "normalize": ({"foo": 1}, {"clip_obs": "a"}, {"norm_obs_keys": "lidar"}),
        "rollout_buffer_class": ("Foo",),
        "device": ("cuda",),
    },
    "her": {
        "ent_coef": ("automatic", "auto_", "auto_x"),
        "train_freq": (0, [1, "episode"]),
        "gradient_steps": (0, -2),
        "tau": (0.0, 1.5),
        "replay_buffer_kwargs": ("future",),
        "action_noise": ("normal",),
    },
}


@pytest.mark.parametrize(
    ("algorithm", "name", "value"),
    [
        (algorithm, name, value)
        for algorithm, each in INVALID.items()
        for name, values in each.items()
        for value in values
    ],
)
def test_a_value_that_stable_baselines_would_not_take_is_refused_by_name(algorithm, name, value):
    environment = next(each for one, each in PACKAGED if one == algorithm)
    inner = name if name == "policy_kwargs" else next(iter(value)) if isinstance(value, dict) else name
    with pytest.raises((OptionError, UnknownNameError), match=inner):
        Hyperparameters.load(algorithm, environment, None, {name: value})


@pytest.mark.parametrize(
    ("algorithm", "changes"),
    [
        ("ppo", {"clip_range_vf": None, "target_kl": 0.02, "learning_rate": "lin_0.001", "clip_range": "lin_0.2"}),
        ("sac", {"ent_coef": "auto_0.1", "gradient_steps": -1, "target_entropy": -2.0, "learning_rate": 0.001}),
        ("ppo", {"policy_kwargs": {"net_arch": {"pi": [8], "vf": []}}}),
        ("sac", {"ent_coef": 0, "normalize": {"norm_obs_keys": ["lidar"], "clip_obs": 5}}),
    ],
)
def test_every_value_that_stable_baselines_takes_is_accepted(algorithm, changes):
    Hyperparameters.load(algorithm, "LabPointNav-v0", None, changes).algorithm_arguments()


@pytest.mark.parametrize(("name", "made"), [("ppo", PPO), ("sac", SAC), ("her", SAC)])
def test_arguments_that_files_can_hold_are_those_of_the_algorithms(name, made):
    assert set(ARGUMENTS[name]) <= set(inspect.signature(made.__init__).parameters)
    assert set(NORMALIZATION) <= set(inspect.signature(VecNormalize.__init__).parameters)


def test_an_unknown_activation_or_schedule_is_named():
    base = {"n_envs": 1}
    for changes, error in (
        ({"policy_kwargs": {"activation_fn": "nn.Tanh"}}, UnknownNameError),
        ({"learning_rate": "lin_fast"}, OptionError),
    ):
        with pytest.raises(error):
            Hyperparameters.load("ppo", "LabPointNav-v0", None, {**base, **changes}).algorithm_arguments()
