"""The commands that make training sets, train policies and publish them."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from tyro.extras import SubcommandApp

from labgym.cli.outcome import written
from labgym.errors import MissingDependencyError, OptionError

Sensor = Literal["lidar", "depth"]

train_app = SubcommandApp()
card_app = SubcommandApp()
ablate_app = SubcommandApp()


def data(out: Path = Path("runs/data"), samples: int = 50_000, seed: int = 0, workers: int = 1) -> int:
    """Make a training set from newly generated layouts: frames, goals, expert paths and privileged maps.

    A folder that holds some of it already gets the rest.

    Args:
        out: Folder for manifest.json and the parquet files.
        samples: How many samples.
        seed: The same seed gives the same bytes with any number of workers.
        workers: Processes to use.
    """
    from labgym.policies.data import DataOptions, make_dataset

    if samples < 1 or seed < 0:
        raise OptionError(f"samples {samples} must be at least 1 and seed {seed} at least 0")
    make_dataset(out, DataOptions(samples=samples, seed=seed), workers)
    return written(out)


@train_app.command
def iplanner(
    data: Path = Path("runs/data"),
    out: Path = Path("runs/iplanner"),
    epochs: int = 20,
    patience: int = 1,
    seed: int = 0,
    threads: int = 1,
) -> int:
    """Train the iPlanner-style network on a dataset, without labels.

    Args:
        data: The dataset's folder, made by labgym data.
        out: Folder for weights, configuration, losses by epoch and checkpoint.
        epochs: Passes over the dataset.
        patience: Passes without a lower held-out loss before the rate falls.
        seed: Of the initial weights and the order of samples.
        threads: Of torch; the weights' last bits depend on it.
    """
    if min(epochs, threads) < 1 or min(seed, patience) < 0:
        given = f"epochs {epochs}, threads {threads}, patience {patience}, seed {seed}"
        raise OptionError(f"{given}: the first two must be at least 1 and the others at least 0")
    need("torch", "labgym train", "train")
    from labgym.policies.iplanner.config import PlannerConfig, TrainOptions
    from labgym.policies.iplanner.train import train

    train(data, out, PlannerConfig(training=TrainOptions(epochs=epochs, patience=patience, seed=seed, threads=threads)))
    return written(out)


@train_app.command
def navdp(
    data: Path = Path("runs/data"), out: Path = Path("runs/navdp"), epochs: int = 12, seed: int = 0, threads: int = 1
) -> int:
    """Train the NavDP-style network on a dataset: diffusion of the expert's paths, and a critic by the true map.

    Args:
        data: The dataset's folder, made by labgym data.
        out: Folder for weights, configuration, losses by epoch and checkpoint.
        epochs: Passes over the dataset.
        seed: Of the initial weights, the order of samples and the noise.
        threads: Of torch; the weights' last bits depend on it.
    """
    if epochs < 1 or seed < 0 or threads < 1:
        raise OptionError(f"epochs {epochs} and threads {threads} must be at least 1 and seed {seed} at least 0")
    need("torch", "labgym train", "train")
    from labgym.policies.navdp.config import NavDPConfig, TrainOptions
    from labgym.policies.navdp.train import train

    train(data, out, NavDPConfig(training=TrainOptions(epochs=epochs, seed=seed, threads=threads)))
    return written(out)


@train_app.command(name="ppo")
def train_ppo(
    observation: Sensor = "lidar",
    steps: int = 200_000,
    layouts: int = 120,
    warm_start: bool = True,
    seed: int = 0,
    out: Path | None = None,
    threads: int = 1,
) -> int:
    """Train by proximal policy optimisation, by default after a warm start that copies a driver with the map.

    Args:
        observation: The sensor.
        steps: Control steps of PPO; a run that is done goes on with more.
        layouts: How many layouts to generate and train in.
        warm_start: Copy a driver with the map first.
        seed: Of everything random.
        out: Folder for checkpoint and weights; by default runs/ppo/OBSERVATION, without a warm start
            runs/ppo/OBSERVATION-cold.
        threads: Of torch; the weights' last bits depend on it.
    """
    if min(steps, layouts, threads) < 1 or seed < 0:
        given = f"steps {steps}, layouts {layouts}, threads {threads}, seed {seed}"
        raise OptionError(f"{given}: the first three must be at least 1 and the seed at least 0")
    need("stable_baselines3", "labgym train", "train")
    import torch

    from labgym.eval import evaluate, load_suite
    from labgym.policies import Policy
    from labgym.policies.ppo.options import TrainingOptions
    from labgym.policies.ppo.training import train

    torch.set_num_threads(threads)
    validation = load_suite("val")

    def judge(policy: Policy) -> float:
        return evaluate(policy, validation, progress=False)["success"] or 0.0

    options = TrainingOptions(observation=observation, steps=steps, layouts=layouts, seed=seed)
    if not warm_start:
        options = options.model_copy(update={"cloning_rounds": 0})
    folder = out or Path("runs/ppo") / (observation if warm_start else f"{observation}-cold")
    return written(train(options, folder, judge))


@ablate_app.command(name="iplanner")
def ablate_iplanner(
    data: Path = Path("runs/data"),
    out: Path = Path("runs/iplanner-ablation"),
    samples: int = 4000,
    epochs: int = 6,
    every: int = 2,
    threads: int = 1,
) -> int:
    """Leave out one main part of the iPlanner-style policy after the other; train and drive the rest.

    Args:
        data: The dataset's folder, made by labgym data.
        out: Folder for the training runs and the evaluations.
        samples: How many of the dataset's samples to train on.
        epochs: Passes over them.
        every: Drive in every so many-th layout of the validation split.
        threads: Of torch.
    """
    if min(samples, epochs, every, threads) < 1:
        raise OptionError(f"samples {samples}, epochs {epochs}, every {every} and threads {threads} must be at least 1")
    need("torch", "labgym ablate", "train")
    from labgym.cards.iplanner_ablation import ablate_iplanner as ablate
    from labgym.policies.iplanner.config import TrainOptions

    return written(ablate(data, out, TrainOptions(samples=samples, epochs=epochs, threads=threads), every))


@ablate_app.command(name="navdp")
def ablate_navdp(
    run: Path = Path("runs/navdp"),
    data: Path = Path("runs/data"),
    out: Path = Path("runs/navdp-ablation"),
    samples: int = 4000,
    epochs: int = 6,
    every: int = 3,
    threads: int = 1,
) -> int:
    """Leave out one main part of the NavDP-style policy after the other; train and drive the rest.

    Args:
        run: Folder of the weights that are driven with where training is the same.
        data: The dataset's folder, made by labgym data.
        out: Folder for the training runs and the evaluations.
        samples: How many of the dataset's samples to train on.
        epochs: Passes over them.
        every: Drive in every so many-th layout of the validation split.
        threads: Of torch.
    """
    if min(samples, epochs, every, threads) < 1:
        raise OptionError(f"samples {samples}, epochs {epochs}, every {every} and threads {threads} must be at least 1")
    need("torch", "labgym ablate", "train")
    from labgym.cards.navdp_ablation import ablate_navdp as ablate
    from labgym.policies.navdp.config import TrainOptions

    return written(ablate(run, data, out, TrainOptions(samples=samples, epochs=epochs, threads=threads), every))


@card_app.command(name="iplanner")
def card_iplanner(
    results: Path,
    run: Path = Path("runs/iplanner"),
    data: Path = Path("runs/data"),
    ablation: Path | None = None,
    out: Path = Path("policies/iplanner"),
) -> int:
    """Publish the weights of a training run with a card.

    Args:
        results: Folder of labgym eval with these weights.
        run: Folder of labgym train iplanner.
        data: Folder of the dataset that it was trained on.
        ablation: Folder of labgym ablate iplanner.
        out: Folder for weights, configuration, losses, figures and CARD.md.
    """
    from labgym.cards.iplanner import write_iplanner_card

    return written(write_iplanner_card(run, data, results, out, ablation))


@card_app.command(name="navdp")
def card_navdp(
    results: Path,
    run: Path = Path("runs/navdp"),
    data: Path = Path("runs/data"),
    ablation: Path | None = None,
    out: Path = Path("policies/navdp"),
) -> int:
    """Publish the weights of a training run with a card.

    Args:
        results: Folder of labgym eval with these weights.
        run: Folder of labgym train navdp.
        data: Folder of the dataset that it was trained on.
        ablation: Folder of labgym ablate navdp.
        out: Folder for weights, configuration, losses, figures and CARD.md.
    """
    from labgym.cards.navdp import write_navdp_card

    return written(write_navdp_card(run, data, results, out, ablation))


@card_app.command(name="ppo")
def card_ppo(
    results: Path,
    observation: Sensor = "lidar",
    run: Path | None = None,
    out: Path | None = None,
    without_warm_start: Path | None = None,
) -> int:
    """Publish the best weights of a training run with a card.

    Args:
        results: Folder that labgym eval wrote with these weights.
        observation: The sensor.
        run: Folder of the training run; by default runs/ppo/OBSERVATION.
        out: Folder to publish in; by default policies/ppo-OBSERVATION.
        without_warm_start: Folder of a run without the warm start, to be set beside it.
    """
    from labgym.cards.ppo import write_ppo_card

    folder, target = run or Path("runs/ppo") / observation, out or Path("policies") / f"ppo-{observation}"
    return written(write_ppo_card(folder, results, target, without_warm_start))


def need(package: str, needed_for: str, extra: str) -> None:
    """Raise MissingDependencyError where a package is not installed."""
    if find_spec(package) is None:
        raise MissingDependencyError(package, needed_for, extra)
