"""Training of the iPlanner-style network: read from top to bottom, it is all there is.

The network proposes a path for each sample, the path is laid over the cost map of the sample's layout, and what it
costs there is differentiated back into the network. No path is shown to it; the expert's is used for the place where a
path is to end (`LossOptions.horizon`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from tqdm import tqdm

from labgym.documents import write_text
from labgym.errors import OptionError
from labgym.policies.data import Dataset, load_dataset
from labgym.policies.iplanner.config import LossOptions, PlannerConfig, TrainOptions
from labgym.policies.iplanner.loss import CostMaps, Losses, in_room, planning_loss
from labgym.policies.iplanner.network import CONFIG, PlannerNetwork, save_planner

CHECKPOINT, HISTORY = "checkpoint.pt", "history.jsonl"
MIRROR = torch.tensor([1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Samples:
    """A dataset as tensors.

    Attributes:
        target: (n, 2) where each path is to end, robot frame, metres. reach: (n,) how far the way there is, metres.
    """

    depth: Tensor
    pose: Tensor
    goal: Tensor
    target: Tensor
    reach: Tensor
    place: Tensor

    @classmethod
    def of(cls, data: Dataset, options: LossOptions) -> Samples:
        """Take over a dataset."""
        target = targets(data, options.horizon)
        return cls(
            depth=torch.from_numpy(data.depth),
            pose=torch.from_numpy(data.pose),
            goal=torch.from_numpy(data.goal),
            target=torch.from_numpy(target),
            reach=torch.from_numpy(reaches(data, target, options)),
            place=torch.from_numpy(data.place),
        )


def targets(data: Dataset, horizon: float | None) -> NDArray[np.float32]:
    """Return the place that lies a horizon along each expert path, or the goal: (n, 2) float32."""
    if horizon is None:
        return data.goal
    last = data.path.shape[1] - 1
    along = np.minimum(horizon / np.maximum(data.length, 1e-6), 1.0) * last
    before = np.minimum(along.astype(np.int64), last - 1)
    share = (along - before)[:, None]
    each = np.arange(len(data))
    found = (1.0 - share) * data.path[each, before] + share * data.path[each, before + 1]
    return np.asarray(found, dtype=np.float32)


def reaches(data: Dataset, target: NDArray[np.float32], options: LossOptions) -> NDArray[np.float32]:
    """Return the length of the way to each target (n, 2), (n,): along the expert path, or straight as published."""
    if not options.along or options.horizon is None:
        return np.asarray(np.linalg.norm(target, axis=1), dtype=np.float32)
    return np.minimum(data.length, np.float32(options.horizon))


def divided(data: Dataset, options: TrainOptions) -> tuple[Tensor, Tensor]:
    """Return the indices of the samples to train on and of those held out, which are in layouts of their own."""
    held_out = torch.from_numpy(data.place >= round((1.0 - options.held_out) * len(data.maps)))
    return torch.nonzero(~held_out)[:, 0], torch.nonzero(held_out)[:, 0]


def train(data: str | Path, out: str | Path, config: PlannerConfig, progress: bool = True) -> PlannerNetwork:
    """Train a network on a dataset, or go on with one, and return it.

    Each epoch leaves a checkpoint: a run that was stopped ends with the weights of one that was not.

    Args:
        data: folder of a dataset.
        out: folder for `config.json`, `weights.safetensors`, `history.jsonl` (losses by epoch) and the checkpoint.
        config: network, loss and training.
        progress: whether to show progress bars.

    Raises:
        OptionError: the folder holds a run of another configuration.
        DocumentError: the dataset cannot be read.
    """
    out, options = Path(out), config.training
    if (out / CONFIG).exists() and PlannerConfig.load(out / CONFIG) != config:
        raise OptionError(f"{out} holds a run of another configuration; choose another folder or remove it")
    config.save(out / CONFIG)
    torch.set_num_threads(options.threads)

    dataset = load_dataset(data, options.samples)
    samples, maps = Samples.of(dataset, config.loss), CostMaps(dataset.maps)
    trained, held_out = divided(dataset, options)

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(options.seed)
        network = PlannerNetwork(config.network)
    optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
    schedule = torch.optim.lr_scheduler.ReduceLROnPlateau(optimiser, factor=options.plateau, patience=options.patience)
    history = _resume(out / CHECKPOINT, network, optimiser, schedule)

    for epoch in range(len(history), options.epochs):
        network.train()
        generator = torch.Generator().manual_seed(options.seed * 1_000_003 + epoch)
        sums: list[Losses] = []
        steps = -(-len(trained) // options.batch)
        batches = _batches(trained, options.batch, generator)
        for chosen in tqdm(batches, f"epoch {epoch + 1}", steps, disable=not progress):
            mirrored = torch.rand(len(chosen), generator=generator) < 0.5
            losses = judge(network, samples, maps, chosen, mirrored, config)
            optimiser.zero_grad()
            losses.total.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
            optimiser.step()
            sums.append(Losses(*(term.detach() for term in losses)))
        row = {"epoch": epoch + 1, "rate": optimiser.param_groups[0]["lr"], "train": _means(sums)}
        if len(held_out):
            row["held_out"] = _means(_assess(network, samples, maps, held_out, config))
        schedule.step(row.get("held_out", row["train"])["total"])
        history.append(row)
        _keep(out / CHECKPOINT, network, optimiser, schedule, history)
        write_text(out / HISTORY, "".join(json.dumps(each) + "\n" for each in history))
        save_planner(out, network, config)
    return network.eval()


def judge(
    network: PlannerNetwork, samples: Samples, maps: CostMaps, chosen: Tensor, mirrored: Tensor, config: PlannerConfig
) -> Losses:
    """Return the loss of the network on chosen samples; mirrored ones are shown left for right, paths turned back."""
    depth = samples.depth[chosen].float() / 1000.0
    depth = torch.where(mirrored[:, None, None], depth.flip(2), depth)
    sides = torch.where(mirrored[:, None], MIRROR, torch.ones(2))
    path, fear = network(depth, samples.goal[chosen] * sides)
    path = path * sides[:, None]
    costs = maps.at(in_room(path, samples.pose[chosen]), samples.place[chosen])
    return planning_loss(path, fear, costs, samples.target[chosen], samples.reach[chosen], config.loss)


@torch.no_grad()
def _assess(
    network: PlannerNetwork, samples: Samples, maps: CostMaps, chosen: Tensor, config: PlannerConfig
) -> list[Losses]:
    network.eval()
    batches = torch.split(chosen, config.training.batch)
    return [judge(network, samples, maps, each, torch.zeros(len(each), dtype=torch.bool), config) for each in batches]


def _batches(indices: Tensor, size: int, generator: torch.Generator) -> Iterator[Tensor]:
    return iter(torch.split(indices[torch.randperm(len(indices), generator=generator)], size))


def _means(losses: list[Losses]) -> dict[str, float]:
    table = torch.tensor([[float(term) for term in each] for each in losses])
    return dict(zip(Losses._fields, table.mean(dim=0).tolist(), strict=True))


def _keep(path: Path, network: Any, optimiser: Any, schedule: Any, history: list[dict[str, Any]]) -> None:
    """Write the checkpoint; a crash meanwhile leaves the one before."""
    state = {
        "network": network.state_dict(),
        "optimiser": optimiser.state_dict(),
        "schedule": schedule.state_dict(),
        "history": history,
    }
    torch.save(state, path.with_suffix(".new"))
    path.with_suffix(".new").replace(path)


def _resume(path: Path, network: Any, optimiser: Any, schedule: Any) -> list[dict[str, Any]]:
    """Load the checkpoint where there is one and return the history so far."""
    if not path.exists():
        return []
    state = torch.load(path, weights_only=True)
    network.load_state_dict(state["network"])
    optimiser.load_state_dict(state["optimiser"])
    schedule.load_state_dict(state["schedule"])
    return list(state["history"])
