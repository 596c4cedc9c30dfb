"""Training of the NavDP-style network: samples in memory, losses, and the weights."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.errors import OptionError
from labgym.policies.data.maps import Maps
from labgym.policies.data.read import Dataset, load_dataset, pictures
from labgym.policies.learned.checkpoint import Stateful
from labgym.policies.learned.map_stack import MapStack, rotated, to_world
from labgym.policies.learned.training_loop import (
    MIRROR,
    Trainer,
    planner_run,
    run_epochs,
    seeded,
    split_by_layout,
)
from labgym.policies.learned.weights import WEIGHTS
from labgym.policies.navdp.config import NavDPConfig, NavDPLossOptions, NavDPTrainOptions
from labgym.policies.navdp.diffusion import MIRROR_STEP, first_part, make_schedule, noised, steps_of
from labgym.policies.navdp.network import NavDPNetwork, frame, load_navdp, save_navdp
from labgym.runs.manifest import file_digest

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class NavDPSamples:
    """A dataset of n samples as tensors.

    Attributes:
        frames: (n, h, w, 4) uint8 of `frame_shape`.
        memory: (n, memory) index of the frames that a sample sees, the oldest first, its own last; a drive that is
            younger than that repeats its first frame.
        goal: (n, 2) in the robot frame, meters.
        pose: (n, 3) in the room frame.
        place: (n,) index of each sample's maps.
        path: (n, points + 1, 2) of the expert, robot frame, meters.
        steps: (n, points, 3), the path as steps.
    """

    frames: Tensor
    memory: Tensor
    goal: Tensor
    pose: Tensor
    place: Tensor
    path: Tensor
    steps: Tensor

    @classmethod
    def read(cls, folder: str | Path, config: NavDPConfig) -> tuple[NavDPSamples, Dataset]:
        """Read a dataset; return its samples and the dataset itself.

        Raises:
            DocumentError: the manifest is missing or broken.
            OptionError: no shard of it is finished.
            MissingDependencyError: pyarrow is not installed.
        """
        dataset = load_dataset(folder, config.training.samples)
        path = first_part(
            torch.from_numpy(dataset.path),
            torch.from_numpy(dataset.length),
            config.loss.horizon,
            config.network.points,
        )
        images, shrink = zip(pictures(folder, len(dataset)), dataset.depth, strict=True), config.network.shrink
        samples = cls(
            frames=torch.from_numpy(np.stack([frame(rgb, depth / 1000.0, shrink) for rgb, depth in images])),
            memory=torch.from_numpy(memory_of(dataset.drive, config.network.memory)),
            goal=torch.from_numpy(dataset.goal),
            pose=torch.from_numpy(dataset.pose),
            place=torch.from_numpy(dataset.place),
            path=path,
            steps=steps_of(path, config.diffusion.scale),
        )
        return samples, dataset

    def remembered(self, chosen: Tensor, mirrored: Tensor) -> Tensor:
        """Return the frames (b, memory, h, w, 4) that samples (b,) see; mirrored ones (b,) left for right."""
        frames = self.frames[self.memory[chosen]]
        return torch.where(mirrored[:, None, None, None, None], frames.flip(3), frames)


def memory_of(drives: Indices, count: int) -> Indices:
    """Return the samples whose frames each sample remembers, (n, count), the oldest first, itself last.

    Args:
        drives: (n,) number of each sample's drive; the samples of a drive are adjacent and in temporal order.
        count: number of frames.
    """
    row = np.arange(len(drives))
    first = np.maximum.accumulate(np.where(np.diff(drives, prepend=-1) != 0, row, 0))
    indices: Indices = np.maximum(row[:, None] - np.arange(count - 1, -1, -1), first[:, None])
    return indices


def distance_maps(maps: Sequence[Maps]) -> MapStack:
    """Return the distances to the nearest obstacle, meters, sampled bilinearly; everything outside is an obstacle."""
    return MapStack(maps, [each.distance for each in maps], "bilinear", "zero")


def path_value(distance: Tensor, options: NavDPLossOptions) -> Tensor:
    """Return the value (b,) of paths from the distances (b, n) of their points to the nearest obstacle, meters."""
    unsafe = (distance < options.margin).float().mean(dim=1)
    return options.unsafe * unsafe + options.opening * (distance[:, -1] - distance[:, 0])


class NavDPLosses(NamedTuple):
    """The loss and its terms before weighting, each a mean over the batch."""

    total: Tensor
    noise_with_goal: Tensor
    noise_without: Tensor
    critic: Tensor
    critic_turned: Tensor


def train(
    data: str | Path,
    out: str | Path,
    config: NavDPConfig,
    progress: bool = True,
    fresh: bool = False,
    start: Path | None = None,
) -> NavDPNetwork:
    """Train a network on a dataset, or resume an interrupted run, and return the averaged network.

    Args:
        data: folder that `labgym data` wrote.
        out: folder for `config.json`, `weights.safetensors`, `history.jsonl` and the checkpoint.
        config: network, diffusion, loss and training.
        progress: whether to show progress bars.
        fresh: move the files of the folder aside and start anew.
        start: folder of a trained network of the same size, with whose weights the training begins; None draws new
            weights.

    Raises:
        OptionError: the dataset is unfinished; `out` is in use or holds another run (named with its differences); or
            the network in `start` has another size.
        DocumentError: the dataset, the checkpoint or `start` cannot be read, or a finished run was changed.
        MissingDependencyError: diffusers or pyarrow is not installed.
    """
    options = config.training
    schedule = make_schedule(config.diffusion)
    begun = None if start is None else _start(start, config)
    digest = None if start is None else file_digest(start / WEIGHTS)
    with planner_run("navdp", data, out, config, fresh, digest) as run:
        if run is None:
            return load_navdp(out)
        torch.set_num_threads(options.threads)
        samples, dataset = NavDPSamples.read(data, config)
        trained, held_out = split_by_layout(samples.place, len(dataset.maps), options.held_out)
        network, maps = seeded(lambda: NavDPNetwork(config), options.seed), distance_maps(dataset.maps)
        if begun is not None:
            network.load_state_dict(begun.state_dict())
        trainer = NavDPTrainer(network, schedule, samples, maps, len(trained))
        run_epochs(trainer, trained, held_out, options, run.path, progress)
    return trainer.average


def _start(folder: Path, config: NavDPConfig) -> NavDPNetwork:
    """Return the network in a folder.

    Raises:
        DocumentError: it cannot be read.
        OptionError: it has another size, or its trajectories another scale, than a configuration says.
    """
    network = load_navdp(folder)
    if (network.config.network, network.config.diffusion) != (config.network, config.diffusion):
        raise OptionError(f"{folder} holds a network of another size: pass its --memory and --shrink")
    return network


class NavDPTrainer(Trainer):
    """A NavDP-style network in training.

    Args:
        network: the network to train, with its configuration.
        schedule: of `make_schedule`.
        samples, maps: samples and maps of the dataset.
        trained: number of samples that are trained on.

    Attributes:
        average: running average of the network's weights; it is validated and saved.
    """

    network: NavDPNetwork
    clip = 1.0

    def __init__(
        self, network: NavDPNetwork, schedule: Any, samples: NavDPSamples, maps: MapStack, trained: int
    ) -> None:
        options = network.config.training
        self.network, self._schedule, self._samples, self._maps = network, schedule, samples, maps
        self.average = copy.deepcopy(network).eval()
        self.optimizer = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
        steps = -(-trained // options.batch) * options.epochs
        self._rates = torch.optim.lr_scheduler.LambdaLR(self.optimizer, lambda step: rate_share(step, steps, options))

    def parts(self) -> Mapping[str, Stateful]:
        """Return network, average, optimizer and schedule."""
        return {
            "network": self.network,
            "average": self.average,
            "optimizer": self.optimizer,
            "rates": self._rates,
        }

    def training_losses(self, chosen: Tensor, generator: torch.Generator) -> NavDPLosses:
        """Return the losses of the network on samples (b,), half of them, at random, mirrored."""
        return self._losses(self.network, chosen, generator, mirroring=True)

    def held_out_losses(self, chosen: Tensor, generator: torch.Generator) -> NavDPLosses:
        """Return the losses of the average on samples (b,) as they are."""
        return self._losses(self.average, chosen, generator, mirroring=False)

    @torch.no_grad()
    def after_step(self) -> None:
        """Set the rate of the next step and move the average towards the network."""
        self._rates.step()
        share = 1.0 - self.network.config.training.average
        for mean, value in zip(self.average.parameters(), self.network.parameters(), strict=True):
            mean.lerp_(value, share)

    def save(self, out: Path) -> None:
        """Write configuration and averaged weights."""
        save_navdp(out, self.average, self.network.config)

    def _losses(
        self, network: NavDPNetwork, chosen: Tensor, generator: torch.Generator, mirroring: bool
    ) -> NavDPLosses:
        """Return the losses of a network on samples (b,), half of them, if `mirroring`, shown left for right."""
        samples, config, batch = self._samples, network.config, len(chosen)
        weights, scale = config.loss, config.diffusion.scale
        mirrored = (torch.rand(batch, generator=generator) < 0.5) & mirroring
        sides = torch.where(mirrored[:, None], MIRROR, torch.ones(2))
        tokens = network.encode(samples.remembered(chosen, mirrored))
        goal = samples.goal[chosen] * sides
        label = torch.where(mirrored[:, None, None], samples.steps[chosen] * MIRROR_STEP, samples.steps[chosen])

        # The first half of the shuffled batch is denoised with the goal, the rest without.
        half = torch.arange(batch) < (batch + 1) // 2
        time = torch.randint(config.diffusion.steps, (batch,), generator=generator)
        noise = torch.randn(label.shape, generator=generator)
        predicted = network.noise(tokens, noised(self._schedule, label, noise, time), time, goal, half)
        with_goal, without = _by_half((predicted - noise).square().mean(dim=(1, 2)), half)

        # The critic sees the label path or, for half of the batch, a rotated one; the true map gives the value.
        other = torch.rand(batch, generator=generator) < 0.5
        angle = weights.rotation * (2.0 * torch.rand(batch, generator=generator) - 1.0)
        path = rotated(samples.path[chosen] * sides[:, None], angle * other)
        in_room = to_world(path * sides[:, None], samples.pose[chosen])
        value = path_value(self._maps.at(in_room, samples.place[chosen]), weights)
        steps = torch.where(other[:, None, None], steps_of(path, scale), label)
        critic, critic_turned = _by_half((network.value(tokens, steps) - value).square(), ~other)

        total = weights.noise * (0.5 * with_goal + 0.5 * without) + weights.critic * (critic + critic_turned)
        return NavDPLosses(total, with_goal, without, critic, critic_turned)


def rate_share(step: int, steps: int, options: NavDPTrainOptions) -> float:
    """Return the share of the rate at a step: a linear rise, then half a cosine down to a hundredth."""
    if step < options.warmup:
        return (step + 1) / options.warmup
    done = min(1.0, (step - options.warmup) / max(1, steps - options.warmup))
    return 0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * done))


def _by_half(errors: Tensor, first: Tensor) -> tuple[Tensor, Tensor]:
    """Return the mean error where `first` holds and where not; 0 for an empty half."""
    return errors[first].sum() / first.sum().clamp(min=1), errors[~first].sum() / (~first).sum().clamp(min=1)
