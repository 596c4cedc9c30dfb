"""A training that stops at any leg and resumes ends with the files of one that does not stop."""

from __future__ import annotations

import json
import signal
import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("yaml")
pytest.importorskip("numba")

from labgym.cli.app import main
from labgym.errors import DocumentError, OptionError
from labgym.policies import make_policy
from labgym.training import legs, run
from labgym.training.hyperparameters import Hyperparameters
from labgym.training.run import BEST, HYPERPARAMETERS, LAST, LOGS, SCORES, RunSettings, train
from runs import killing

ROOM = {"layout": "test-sub_01", "max_episode_steps": 8}
SMALL = {"n_envs": 2, "eval_freq": 32, "n_eval_episodes": 2, "n_timesteps": 128, "env_kwargs": ROOM, "layouts": 0}
OFF_POLICY = {"learning_starts": 24, "batch_size": 8, "train_freq": 2, "gradient_steps": 1, "buffer_size": 100}
NETWORK = {"policy_kwargs": {"net_arch": [8]}, "eval_env_kwargs": {}}
LABNAV = {
    "near_goal": True,
    "observe": ["goal", "near_goal", "velocity", "lidar"],
    "env_kwargs": {**ROOM, "drives": "pair"},
}
CURRICULUM = {"env_kwargs": {**ROOM, "level": 1, "curriculum": "rising"}, "eval_env_kwargs": {"curriculum": None}}
CASES = {
    "ppo": ("LabPointNav-v0", {"n_steps": 8, "batch_size": 8, "n_epochs": 2, "learning_rate": "lin_1e-3"}),
    "sac": ("LabPointNav-v0", OFF_POLICY),
    "her": ("LabFloorNavGoal-v0", OFF_POLICY),
    "recurrent-ppo": (
        "LabNavOdometry-v0",
        {
            **LABNAV,
            "n_steps": 8,
            "batch_size": 8,
            "n_epochs": 2,
            "policy": "MultiInputLstmPolicy",
            "policy_kwargs": {"net_arch": [8], "lstm_hidden_size": 8},
        },
    ),
    "ppo, frames and ladder": (
        "LabNavOdometry-v0",
        {**LABNAV, **CURRICULUM, "n_steps": 8, "batch_size": 8, "n_epochs": 2, "frame_stack": 2},
    ),
    "ppo, imitation": (
        "LabPointNav-v0",
        {"n_steps": 8, "batch_size": 8, "n_epochs": 2, "imitation": 80, "learning_rate": "lin_1e-3"},
    ),
    "sac, frames": ("LabNavOdometry-v0", {**LABNAV, **OFF_POLICY, "frame_stack": 3}),
}


CHECKPOINT = f"killed/{legs.CHECKPOINT}"


class StopError(Exception):
    """Ends a training after a checkpoint."""


def files(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in (BEST, LAST, SCORES, HYPERPARAMETERS)}


@pytest.mark.parametrize("case", CASES)
def test_a_stopped_training_resumes_to_the_same_files(case, tmp_path, monkeypatch):
    (environment, changes), algorithm = CASES[case], case.split(",")[0]
    if algorithm == "recurrent-ppo":
        pytest.importorskip("sb3_contrib")
    hyperparameters = Hyperparameters.load(algorithm, environment, None, {**SMALL, **NETWORK, **changes})
    settings = partial(RunSettings, seed=3, verbose=False)
    train(hyperparameters, settings(tmp_path / "whole"))

    def save(path, parts, record, write=legs.save_checkpoint):
        write(path, parts, record)
        if record["steps"] == 64:
            raise StopError

    monkeypatch.setattr(legs, "save_checkpoint", save)
    with pytest.raises(StopError):
        train(hyperparameters, settings(tmp_path / "stopped"))
    monkeypatch.undo()
    best = train(hyperparameters, settings(tmp_path / "stopped"))
    assert files(tmp_path / "stopped") == files(tmp_path / "whole")
    assert len((tmp_path / "whole" / SCORES).read_text().splitlines()) == 4
    assert make_policy(str(best)).observation == "lidar"
    assert not (tmp_path / "stopped" / legs.CHECKPOINT).exists()
    changed = {**SMALL, **NETWORK, **changes, "gamma": 0.5}
    with pytest.raises(OptionError, match="holds another run"):
        train(Hyperparameters.load(algorithm, environment, None, changed), settings(tmp_path / "stopped"))
    (tmp_path / "stopped" / LAST).write_bytes(b"other")
    with pytest.raises(DocumentError):
        train(hyperparameters, settings(tmp_path / "stopped"))


@pytest.mark.slow
def test_a_killed_command_resumes_to_the_same_files(tmp_path):
    values = {**SMALL, **NETWORK, **CASES["ppo"][1], "n_timesteps": 640}
    words = ["train", "ppo", "--set", *(f"{name}={json.dumps(value)}" for name, value in values.items()), "--out"]
    killed = killing.kill([*words, str(tmp_path / "killed")], tmp_path, signal.SIGKILL, (tmp_path / CHECKPOINT).exists)
    assert killed.returncode == -signal.SIGKILL
    assert (tmp_path / CHECKPOINT).exists()
    for name in ("whole", "killed"):
        assert main([*words, str(tmp_path / name)]) == 0
    assert files(tmp_path / "killed") == files(tmp_path / "whole")


def test_tensorboard_reads_the_scores_and_the_losses(tmp_path):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    environment, changes = CASES["ppo"]
    train(
        Hyperparameters.load("ppo", environment, None, {**SMALL, **NETWORK, **changes}),
        RunSettings(tmp_path, verbose=False),
    )
    events = accumulator.EventAccumulator(str(tmp_path / LOGS))
    events.Reload()
    scores = [json.loads(line) for line in (tmp_path / SCORES).read_text().splitlines()]
    for tag, name in (("eval/success_rate", "success_rate"), ("eval/spl", "spl"), ("eval/mean_reward", "mean_reward")):
        logged = [(event.step, event.value) for event in events.Scalars(tag)]
        assert logged == [(score["steps"], pytest.approx(score[name])) for score in scores]
    assert {"rollout/ep_rew_mean", "rollout/success_rate", "train/loss", "time/fps"} <= {*events.Tags()["scalars"]}


def test_weights_and_biases_receives_the_log(tmp_path, monkeypatch):
    runs = []

    class Run:
        def __init__(self, **options):
            self.options, self.logged, self.finished = options, [], False
            runs.append(self)

        def log(self, numbers, step):
            self.logged.append((step, numbers))

        def finish(self):
            self.finished = True

    environment, changes = CASES["ppo"]
    hyperparameters = Hyperparameters.load("ppo", environment, None, {**SMALL, **NETWORK, **changes})
    monkeypatch.setitem(sys.modules, "wandb", None)
    monkeypatch.setattr(run, "find_spec", lambda name: None if name == "wandb" else find_spec(name))
    with pytest.raises(OptionError, match="pip install wandb"):
        train(hyperparameters, RunSettings(tmp_path / "none", verbose=False, wandb="labnav"))
    assert not (tmp_path / "none").exists()
    monkeypatch.setattr(run, "find_spec", lambda name: True if name == "wandb" else find_spec(name))
    monkeypatch.setitem(sys.modules, "wandb", SimpleNamespace(init=Run))
    train(hyperparameters, RunSettings(tmp_path / "run", verbose=False, wandb="labnav"))
    (logged,) = runs
    assert (logged.options["project"], logged.options["config"]["algorithm"]) == ("labnav", "ppo")
    scores = [json.loads(line) for line in (tmp_path / "run" / SCORES).read_text().splitlines()]
    found = [(step, each["eval/success_rate"]) for step, each in logged.logged if "eval/success_rate" in each]
    assert found == [(score["steps"], score["success_rate"]) for score in scores]
    assert logged.finished


def test_a_damaged_checkpoint_is_refused_with_the_remedy(tmp_path):
    environment, changes = CASES["ppo"]
    hyperparameters = Hyperparameters.load("ppo", environment, None, {**SMALL, **NETWORK, **changes})
    (tmp_path / "run").mkdir()
    settings = RunSettings(tmp_path / "run", verbose=False)
    train(hyperparameters, settings)
    (tmp_path / "run" / "manifest.json").unlink()
    (tmp_path / "run" / legs.CHECKPOINT).write_bytes(b"PK")
    with pytest.raises(DocumentError, match="--fresh"):
        train(hyperparameters, settings)
