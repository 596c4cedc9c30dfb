"""Hyperparameters are read from YAML, checked, and turned into the arguments of stable-baselines3."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("yaml")

import yaml
from torch import nn

from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.training.hyperparameters import ALGORITHMS, FOLDER, Hyperparameters

PACKAGED = [(name, each) for name in ALGORITHMS for each in yaml.safe_load((FOLDER / f"{name}.yml").read_text())]


@pytest.mark.parametrize(("algorithm", "environment"), PACKAGED)
def test_the_files_that_come_with_labgym_are_valid(algorithm, environment):
    hyperparameters = Hyperparameters.load(algorithm, environment)
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


def test_an_unknown_activation_or_schedule_is_named():
    base = {"n_envs": 1}
    for changes, error in (
        ({"policy_kwargs": {"activation_fn": "nn.Tanh"}}, UnknownNameError),
        ({"learning_rate": "lin_fast"}, OptionError),
    ):
        with pytest.raises(error):
            Hyperparameters.load("ppo", "LabPointNav-v0", None, {**base, **changes}).algorithm_arguments()
