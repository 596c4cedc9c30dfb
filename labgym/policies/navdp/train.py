"""Training, from the dataset to the weights, in the order in which it happens."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor
from tqdm import tqdm

from labgym.documents import write_text
from labgym.errors import OptionError
from labgym.policies.navdp.config import NavDPConfig, TrainOptions
from labgym.policies.navdp.diffusion import make_schedule, noised
from labgym.policies.navdp.network import CONFIG, NavDPNetwork, save_navdp
from labgym.policies.navdp.samples import Samples
from labgym.policies.navdp.trajectory import LEFT_FOR_RIGHT, steps_of, turned
from labgym.policies.navdp.value import DistanceMaps, in_room, path_value

CHECKPOINT, HISTORY = "checkpoint.pt", "history.jsonl"
MIRROR = torch.tensor([1.0, -1.0])


class Losses(NamedTuple):
    """The loss and its terms before weighting, each a mean over the batch."""

    total: Tensor
    noise_with_goal: Tensor
    noise_without: Tensor
    critic: Tensor
    critic_turned: Tensor


def train(data: str | Path, out: str | Path, config: NavDPConfig, progress: bool = True) -> NavDPNetwork:
    """Train a network on a dataset; a run that was stopped goes on after its last whole epoch.

    Args:
        data: folder that `labgym data` made.
        out: folder for `config.json`, `weights.safetensors`, `history.jsonl` and the checkpoint.

    Raises:
        OptionError: the dataset has no samples, or `out` holds a run of another configuration.
        DocumentError: the dataset cannot be read.
        MissingDependencyError: diffusers or pyarrow is not installed.
    """
    out, options = Path(out), config.training
    if (out / CONFIG).exists() and NavDPConfig.load(out / CONFIG) != config:
        raise OptionError(f"{out} holds a run of another configuration; choose another folder or remove it")
    schedule = make_schedule(config.diffusion)
    config.save(out / CONFIG)
    torch.set_num_threads(options.threads)

    samples, dataset = Samples.read(data, config)
    maps = DistanceMaps(dataset.maps)
    first_held_out = round((1.0 - options.held_out) * len(dataset.maps))
    trained = torch.nonzero(samples.place < first_held_out)[:, 0]
    held_out = torch.nonzero(samples.place >= first_held_out)[:, 0]

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(options.seed)
        network = NavDPNetwork(config)
    average = copy.deepcopy(network).eval()
    optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
    steps = -(-len(trained) // options.batch)
    rates = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda step: _rate(step, steps * options.epochs, options))
    state = {"network": network, "average": average, "optimiser": optimiser, "rates": rates}
    history = _resume(out / CHECKPOINT, state)

    for epoch in range(len(history), options.epochs):
        network.train()
        generator = torch.Generator().manual_seed(options.seed * 1_000_003 + epoch)
        order = trained[torch.randperm(len(trained), generator=generator)]
        sums: list[Losses] = []
        for chosen in tqdm(torch.split(order, options.batch), f"epoch {epoch + 1}", steps, disable=not progress):
            losses = judge(network, schedule, samples, maps, chosen, generator)
            optimiser.zero_grad()
            losses.total.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            rates.step()
            _follow(average, network, options.average)
            sums.append(Losses(*(term.detach() for term in losses)))
        row: dict[str, Any] = {"epoch": epoch + 1, "rate": optimiser.param_groups[0]["lr"], "train": _means(sums)}
        if len(held_out):
            row["held_out"] = _means(_assess(average, schedule, samples, maps, held_out, config))
        history.append(row)
        _keep(out / CHECKPOINT, state, history)
        write_text(out / HISTORY, "".join(json.dumps(each) + "\n" for each in history))
        save_navdp(out, average, config)
    return average


def judge(
    network: NavDPNetwork,
    schedule: Any,
    samples: Samples,
    maps: DistanceMaps,
    chosen: Tensor,
    generator: torch.Generator,
    mirroring: bool = True,
) -> Losses:
    """Return the loss of the network on chosen samples (b,), half of them, drawn, shown left for right."""
    config, batch = network.config, len(chosen)
    weights = config.loss
    mirrored = (torch.rand(batch, generator=generator) < 0.5) & mirroring
    sides = torch.where(mirrored[:, None], MIRROR, torch.ones(2))
    seen = network.encode(samples.seen(chosen, mirrored))
    goal = samples.goal[chosen] * sides
    label = torch.where(mirrored[:, None, None], samples.steps[chosen] * LEFT_FOR_RIGHT, samples.steps[chosen])

    # One half of the batch, drawn by the shuffle, is denoised with the goal, the other without.
    half = torch.arange(batch) < (batch + 1) // 2
    time = torch.randint(config.diffusion.steps, (batch,), generator=generator)
    noise = torch.randn(label.shape, generator=generator)
    said = network.noise(seen, noised(schedule, label, noise, time), time, goal, half)
    with_goal, without = _by_half((said - noise).square().mean(dim=(1, 2)), half)

    # The critic judges the path itself or, in half of the batch, turned; what either is worth, the true map says.
    other = torch.rand(batch, generator=generator) < 0.5
    angle = weights.rotation * (2.0 * torch.rand(batch, generator=generator) - 1.0)
    path = turned(samples.path[chosen] * sides[:, None], angle * other)
    there = in_room(path * sides[:, None], samples.pose[chosen])
    worth = path_value(maps.at(there, samples.place[chosen]), weights)
    steps = torch.where(other[:, None, None], steps_of(path, config.diffusion.scale), label)
    critic, critic_turned = _by_half((network.value(seen, steps) - worth).square(), ~other)

    total = weights.noise * (0.5 * with_goal + 0.5 * without) + weights.critic * (critic + critic_turned)
    return Losses(total, with_goal, without, critic, critic_turned)


def _by_half(errors: Tensor, first: Tensor) -> tuple[Tensor, Tensor]:
    """Return the mean error where `first` holds and where not; 0 for an empty half."""
    return errors[first].sum() / first.sum().clamp(min=1), errors[~first].sum() / (~first).sum().clamp(min=1)


@torch.no_grad()
def _follow(average: NavDPNetwork, network: NavDPNetwork, share: float) -> None:
    """Move the averaged weights towards the present ones."""
    for mean, value in zip(average.parameters(), network.parameters(), strict=True):
        mean.lerp_(value, 1.0 - share)


@torch.no_grad()
def _assess(
    network: NavDPNetwork, schedule: Any, samples: Samples, maps: DistanceMaps, chosen: Tensor, config: NavDPConfig
) -> list[Losses]:
    """Return the losses on samples that are not trained on, with the same noise each time."""
    generator = torch.Generator().manual_seed(config.training.seed)
    batches = torch.split(chosen, config.training.batch)
    return [judge(network, schedule, samples, maps, each, generator, mirroring=False) for each in batches]


def _rate(step: int, steps: int, options: TrainOptions) -> float:
    """Return the share of the rate at a step: a linear rise, then half a cosine down to a hundredth."""
    if step < options.warmup:
        return (step + 1) / options.warmup
    done = min(1.0, (step - options.warmup) / max(1, steps - options.warmup))
    return 0.01 + 0.99 * 0.5 * (1.0 + math.cos(math.pi * done))


def _means(losses: list[Losses]) -> dict[str, float]:
    table = torch.tensor([[float(term) for term in each] for each in losses])
    return dict(zip(Losses._fields, table.mean(dim=0).tolist(), strict=True))


def _keep(path: Path, state: dict[str, Any], history: list[dict[str, Any]]) -> None:
    """Write the checkpoint; a crash meanwhile leaves the one before."""
    torch.save(
        {**{name: part.state_dict() for name, part in state.items()}, "history": history}, path.with_suffix(".new")
    )
    path.with_suffix(".new").replace(path)


def _resume(path: Path, state: dict[str, Any]) -> list[dict[str, Any]]:
    """Load the checkpoint where there is one and return the history so far."""
    if not path.exists():
        return []
    kept = torch.load(path, weights_only=True)
    for name, part in state.items():
        part.load_state_dict(kept[name])
    return list(kept["history"])
