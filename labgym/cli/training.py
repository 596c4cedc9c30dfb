"""The commands that train policies, evaluate their parts and publish them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from labgym.cli.arguments import OptionalPath
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import written
from labgym.cli.problems import check_training

Sensor = Literal["lidar", "depth"]

DataFolder = Annotated[Path, arg(help="Folder of the dataset, written by labgym data.")]
Threads = Annotated[int, arg(help="Number of torch threads; the last bits of the weights depend on it.")]
Fresh = Annotated[bool, arg(help="Move the files of the folder aside and start anew.")]
WarmStart = Annotated[
    bool, arg(help="Skip the warm start, which imitates an expert with the map.", help_behavior_hint="")
]
Every = Annotated[int, arg(help="Drive in every EVERY-th layout of the validation split.")]


def iplanner(
    data: DataFolder = Path("runs/data"),
    *,
    out: Path = Path("runs/iplanner"),
    epochs: int = 20,
    patience: int = 1,
    target: Literal["cost-to-go", "expert", "goal"] = "expert",
    seed: int = 0,
    threads: Threads = 1,
    fresh: Fresh = False,
) -> int:
    """Train the iPlanner-style network on a dataset: its loss is the cost of its path on the true map.

    Args:
        out: Folder for weights, configuration, losses by epoch and checkpoint.
        epochs: Passes over the dataset.
        patience: Epochs without a lower held-out loss after which the learning rate falls.
        target: Where a path should end: where the cost to go has fallen by 3.5 m (no expert), at the point 3.5 m
            along the expert's path, or at the goal.
        seed: Random seed of the initial weights and the order of samples.
    """
    check_training("labgym train", "torch", epochs=epochs, threads=threads, patience=patience, seed=seed)
    from labgym.policies.iplanner.config import IPlannerConfig, IPlannerLossOptions, IPlannerTrainOptions
    from labgym.policies.iplanner.train import train

    training = IPlannerTrainOptions(epochs=epochs, patience=patience, seed=seed, threads=threads)
    train(data, out, IPlannerConfig(loss=IPlannerLossOptions(target=target), training=training), fresh=fresh)
    return written(out)


def navdp(
    data: DataFolder = Path("runs/data"),
    *,
    out: Path = Path("runs/navdp"),
    start: OptionalPath = None,
    epochs: int = 12,
    memory: int = 3,
    shrink: Literal[1, 2, 4] = 2,
    seed: int = 0,
    threads: Threads = 1,
    fresh: Fresh = False,
) -> int:
    """Train the NavDP-style network on a dataset: diffusion of the expert's paths, and a critic from the true map.

    Args:
        out: Folder for weights, configuration, losses by epoch and checkpoint.
        start: Folder of a trained network, to train it further; by default the weights are new.
        epochs: Passes over the dataset.
        memory: Frames that the network sees, half a second apart.
        shrink: Factor by which they are smaller than the camera's images of 72 x 128; with 1 the encoder has one stage
            more.
        seed: Random seed of the initial weights, the order of samples and the noise.
    """
    check_training("labgym train", "torch", epochs=epochs, memory=memory, threads=threads, seed=seed)
    from labgym.policies.navdp.config import NavDPConfig, NavDPNetworkOptions, NavDPTrainOptions
    from labgym.policies.navdp.train import train

    network = NavDPNetworkOptions.for_frames(memory, shrink)
    training = NavDPTrainOptions(epochs=epochs, seed=seed, threads=threads)
    train(data, out, NavDPConfig(network=network, training=training), fresh=fresh, start=start)
    return written(out)


def train_ppo(
    observation: Sensor = "lidar",
    *,
    steps: int = 200_000,
    layouts: int = 120,
    warm_start: WarmStart = True,
    seed: int = 0,
    out: OptionalPath = None,
    threads: Threads = 1,
    fresh: Fresh = False,
) -> int:
    """Train the published policy ppo: PPO, by default after a warm start that imitates an expert with the map.

    Args:
        observation: The sensor.
        steps: Control steps of PPO.
        layouts: Number of layouts to generate and train in.
        seed: Random seed of the whole run.
        out: Folder for checkpoint and weights; by default runs/ppo/OBSERVATION, without warm start
            runs/ppo/OBSERVATION-cold.
    """
    check_training("labgym train", "stable_baselines3", steps=steps, layouts=layouts, threads=threads, seed=seed)
    import torch

    from labgym.eval import evaluate, load_suite
    from labgym.policies import Policy
    from labgym.policies.ppo.options import PPOOptions
    from labgym.policies.ppo.training import train

    torch.set_num_threads(threads)
    validation = load_suite("val")

    def judge(policy: Policy) -> float:
        return evaluate(policy, validation, progress=False)["success"] or 0.0

    options = PPOOptions(observation=observation, steps=steps, layouts=layouts, seed=seed)
    if not warm_start:
        options = options.model_copy(update={"cloning_rounds": 0})
    folder = out or Path("runs/ppo") / (observation if warm_start else f"{observation}-cold")
    return written(train(options, folder, judge, fresh=fresh))


def ablate_iplanner(
    data: DataFolder = Path("runs/data"),
    out: Path = Path("runs/iplanner-ablation"),
    samples: int = 4000,
    epochs: int = 6,
    every: Every = 2,
    threads: Threads = 1,
) -> int:
    """Ablate the iPlanner-style policy: change one part at a time, train and evaluate each variant.

    Args:
        out: Folder for the training runs and the evaluations.
        samples: Number of the dataset's samples to train on.
        epochs: Passes over them.
    """
    check_training("labgym ablate", "torch", samples=samples, epochs=epochs, every=every, threads=threads)
    from labgym.cards import ablation
    from labgym.policies.iplanner.config import IPlannerTrainOptions

    training = IPlannerTrainOptions(samples=samples, epochs=epochs, threads=threads)
    return written(ablation.ablate_iplanner(data, out, training, every))


def ablate_navdp(run: Path = Path("runs/navdp"), out: Path = Path("runs/navdp-ablation"), every: Every = 3) -> int:
    """Ablate the NavDP-style policy: change one driving option at a time; all variants use the same weights.

    Args:
        run: Folder of the weights.
        out: Folder for the evaluations.
    """
    check_training("labgym ablate", "torch", every=every)
    from labgym.cards import ablation

    return written(ablation.ablate_navdp(run, out, every))


def card_iplanner(
    results: Path,
    run: Path = Path("runs/iplanner"),
    data: DataFolder = Path("runs/data"),
    ablation: OptionalPath = None,
    out: Path = Path("policies/iplanner"),
) -> int:
    """Publish the weights of a training run with a model card.

    Args:
        results: Folder of labgym eval with these weights.
        run: Folder of labgym train iplanner.
        ablation: Folder of labgym ablate iplanner.
        out: Folder for weights, configuration, losses, figures and CARD.md.
    """
    from labgym.cards.iplanner import write_iplanner_card

    return written(write_iplanner_card(run, data, results, out, ablation))


def card_navdp(
    results: Path,
    run: Path = Path("runs/navdp"),
    data: DataFolder = Path("runs/data"),
    ablation: OptionalPath = None,
    out: Path = Path("policies/navdp"),
) -> int:
    """Publish the weights of a training run with a model card.

    Args:
        results: Folder of labgym eval with these weights.
        run: Folder of labgym train navdp.
        ablation: Folder of labgym ablate navdp.
        out: Folder for weights, configuration, losses, figures and CARD.md.
    """
    from labgym.cards.navdp import write_navdp_card

    return written(write_navdp_card(run, data, results, out, ablation))


@refuses_idle_flags("card ppo")
def card_ppo(
    results: Path,
    observation: Sensor = "lidar",
    run: OptionalPath = None,
    out: OptionalPath = None,
    without_warm_start: OptionalPath = None,
) -> int:
    """Publish the best weights of a training run with a model card.

    Args:
        results: Folder of labgym eval with these weights.
        observation: The sensor.
        run: Folder of the training run; by default runs/ppo/OBSERVATION.
        out: Folder to publish in; by default policies/ppo-OBSERVATION.
        without_warm_start: Folder of a run without warm start, for comparison.
    """
    from labgym.cards.ppo import write_ppo_card

    folder, target = run or Path("runs/ppo") / observation, out or Path("policies") / f"ppo-{observation}"
    return written(write_ppo_card(folder, results, target, without_warm_start))
