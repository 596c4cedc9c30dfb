"""A program that trains a tiny policy: the kind of policy, the folder, and for planners the folder of the dataset."""

from __future__ import annotations

import sys
from pathlib import Path

import torch

from labgym.layouts import load_published, published


def main(kind: str, out: Path, data: Path) -> None:
    """Train."""
    torch.set_num_threads(1)
    if kind == "ppo":
        from labgym.policies.ppo.options import PPOOptions
        from labgym.policies.ppo.training import train as train_ppo

        options = PPOOptions(
            steps=192, layouts=1, environments=2, horizon=40, cloning_rounds=1, cloning_steps=64, cloning_epochs=1,
            rollout=16, leg=1, epochs=1, batch=16, evaluate_every=2,
        )  # fmt: skip
        train_ppo(options, out, lambda policy: 0.5, (load_published("test", published("test")[0]),))
    elif kind == "iplanner":
        from labgym.policies.iplanner.config import IPlannerConfig, IPlannerNetworkOptions, IPlannerTrainOptions
        from labgym.policies.iplanner.train import train as train_iplanner

        network = IPlannerNetworkOptions(channels=(4, 8))
        training = IPlannerTrainOptions(epochs=5, batch=2, held_out=0.5)
        train_iplanner(data, out, IPlannerConfig(network=network, training=training))
    else:
        from labgym.policies.navdp.config import NavDPConfig, NavDPNetworkOptions, NavDPTrainOptions
        from labgym.policies.navdp.train import train as train_navdp

        network_options = NavDPNetworkOptions(channels=(8, 8, 8), queries=4, width=16, heads=2, layers=1, points=8)
        options_of_training = NavDPTrainOptions(epochs=5, batch=2, held_out=0.5, warmup=2)
        train_navdp(data, out, NavDPConfig(network=network_options, training=options_of_training))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
