"""Training of the iPlanner-style network, from the dataset to the weights.

The network proposes a path for each sample, the path is laid over the cost map of the sample's layout, and its cost is
differentiated back into the network. No path is a label. The targets are, unless they are of the cost to go: each lies
on the expert's path (`IPlannerLossOptions.target`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor

from labgym.policies.data import Dataset, load_dataset
from labgym.policies.data.maps import Maps
from labgym.policies.iplanner.config import IPlannerConfig, IPlannerLossOptions
from labgym.policies.iplanner.cost_to_go import Targets, targets_of
from labgym.policies.iplanner.network import IPlannerNetwork, load_iplanner, save_iplanner
from labgym.policies.learned.checkpoint import Stateful
from labgym.policies.learned.map_stack import MapStack, to_world
from labgym.policies.learned.training_loop import (
    MIRROR,
    Trainer,
    planner_run,
    run_epochs,
    seeded,
    split_by_layout,
)


@dataclass(frozen=True, eq=False)
class IPlannerSamples:
    """A dataset of n samples as tensors.

    Attributes:
        depth: (n, 72, 128) uint16, millimeters.
        pose: (n, 3) in the room frame.
        goal: (n, 2) in the robot frame, meters.
        place: (n,) index of each sample's maps.
        targets: where each path should end.
    """

    depth: Tensor
    pose: Tensor
    goal: Tensor
    place: Tensor
    targets: Targets

    @classmethod
    def of(cls, data: Dataset, options: IPlannerLossOptions) -> IPlannerSamples:
        """Return the samples of a dataset."""
        return cls(
            depth=torch.from_numpy(data.depth),
            pose=torch.from_numpy(data.pose),
            goal=torch.from_numpy(data.goal),
            place=torch.from_numpy(data.place),
            targets=targets_of(data, options),
        )


def cost_maps(maps: Sequence[Maps]) -> MapStack:
    """Return the cost maps of layouts, sampled bicubically and continued by their edge."""
    return MapStack(maps, [each.cost for each in maps], "bicubic", "edge")


class IPlannerLosses(NamedTuple):
    """The loss and its terms before weighting, each a mean over the batch."""

    total: Tensor
    obstacle: Tensor
    motion: Tensor
    goal: Tensor


def planning_loss(
    path: Tensor, costs: Tensor, miss: Tensor, reach: Tensor, options: IPlannerLossOptions
) -> IPlannerLosses:
    """Return the loss of planned paths.

    Args:
        path: (b, n, 2) from the origin, robot frame, meters.
        costs: (b, n) of the cost map at the path's points.
        miss: (b,) distance by which each path's end misses its target, meters.
        reach: (b,) length of the way to the target, meters.
        options: weights of the terms.
    """
    steps = (path[:, 1:] - path[:, :-1]).norm(dim=2)
    even = reach[:, None] / steps.shape[1]
    obstacle = costs.sum(dim=1).mean()
    motion = (steps - even).abs().sum(dim=1).mean()
    goal = torch.log1p(miss).mean()
    total = options.obstacle * obstacle + options.motion * motion + options.goal * goal
    return IPlannerLosses(total, obstacle, motion, goal)


def train(
    data: str | Path, out: str | Path, config: IPlannerConfig, progress: bool = True, fresh: bool = False
) -> IPlannerNetwork:
    """Train a network on a dataset, or resume an interrupted run, and return it.

    Args:
        data: folder of a dataset.
        out: folder for `config.json`, `weights.safetensors`, `history.jsonl` (losses by epoch) and the checkpoint.
        config: network, loss and training.
        progress: whether to show progress bars.
        fresh: move the files of the folder aside and start anew.

    Raises:
        OptionError: the folder is in use or holds another run; the message names the differences.
        DocumentError: the dataset or the checkpoint cannot be read, or a finished run was changed.
    """
    options = config.training
    with planner_run("iplanner", data, out, config, fresh) as run:
        if run is None:
            return load_iplanner(out)
        torch.set_num_threads(options.threads)
        dataset = load_dataset(data, options.samples)
        samples, maps = IPlannerSamples.of(dataset, config.loss), cost_maps(dataset.maps)
        trained, held_out = split_by_layout(samples.place, len(dataset.maps), options.held_out)
        trainer = IPlannerTrainer(seeded(lambda: IPlannerNetwork(config.network), options.seed), samples, maps, config)
        run_epochs(trainer, trained, held_out, options, run.path, progress)
    return trainer.network.eval()


class IPlannerTrainer(Trainer):
    """An iPlanner-style network in training; the rate falls when the held-out loss does not."""

    network: IPlannerNetwork
    clip = 10.0

    def __init__(
        self, network: IPlannerNetwork, samples: IPlannerSamples, maps: MapStack, config: IPlannerConfig
    ) -> None:
        options = config.training
        self.network, self._samples, self._maps, self._config = network, samples, maps, config
        self.optimizer = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
        self._schedule = torch.optim.lr_scheduler.ReduceLROnPlateau(
            self.optimizer, factor=options.plateau, patience=options.patience
        )

    def parts(self) -> Mapping[str, Stateful]:
        """Return network, optimizer and schedule."""
        return {"network": self.network, "optimizer": self.optimizer, "schedule": self._schedule}

    def training_losses(self, chosen: Tensor, generator: torch.Generator) -> IPlannerLosses:
        """Return the losses on samples (b,), half of them, at random, mirrored."""
        return self._losses(chosen, torch.rand(len(chosen), generator=generator) < 0.5)

    def held_out_losses(self, chosen: Tensor, generator: torch.Generator) -> IPlannerLosses:  # noqa: ARG002
        """Return the losses on samples (b,) as they are."""
        return self._losses(chosen, torch.zeros(len(chosen), dtype=torch.bool))

    def after_epoch(self, loss: float) -> None:
        """Lower the rate if the loss has stopped falling."""
        self._schedule.step(loss)

    def save(self, out: Path) -> None:
        """Write configuration and weights."""
        save_iplanner(out, self.network, self._config)

    def _losses(self, chosen: Tensor, mirrored: Tensor) -> IPlannerLosses:
        """Return the losses on samples (b,); mirrored ones (b,) are shown left for right, and their paths back."""
        samples = self._samples
        depth = samples.depth[chosen].float() / 1000.0
        depth = torch.where(mirrored[:, None, None], depth.flip(2), depth)
        sides = torch.where(mirrored[:, None], MIRROR, torch.ones(2))
        path = self.network(depth, samples.goal[chosen] * sides) * sides[:, None]
        world = to_world(path, samples.pose[chosen])
        costs = self._maps.at(world, samples.place[chosen])
        miss = samples.targets.miss(chosen, path[:, -1], world[:, -1])
        return planning_loss(path, costs, miss, samples.targets.reach[chosen], self._config.loss)
