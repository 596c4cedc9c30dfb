"""Training of the planners as resumable runs: identity, folder, and epochs over a dataset."""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn
from tqdm import tqdm

from labgym.documents import Document, append_text, write_text
from labgym.errors import MissingDependencyError
from labgym.policies.data import load_manifest
from labgym.policies.learned.checkpoint import Stateful, load_checkpoint, save_checkpoint
from labgym.policies.learned.weights import CONFIG, WEIGHTS
from labgym.policies.options import TrainOptions
from labgym.runs import RunFolder, RunIdentity

CHECKPOINT, HISTORY, TIMES = "checkpoint.pt", "history.jsonl", "times.jsonl"
"""State of a training run, losses by epoch, and seconds by epoch; the last differ between runs."""

OUTPUTS = (CONFIG, WEIGHTS, HISTORY)


@contextmanager
def planner_run(
    policy: str, data: str | Path, out: str | Path, config: Document, fresh: bool = False, start: str | None = None
) -> Iterator[RunFolder | None]:
    """Open the folder of a planner's training run; yield None if the run is finished.

    Write `OUTPUTS` in this context: at its end they get the hashes of the manifest, and the checkpoint is removed.

    Args:
        policy: name of the policy.
        data: folder of the dataset, which is identified by its manifest.
        out: folder of the run.
        config: options of the run.
        fresh: move the files of the folder aside and start anew.
        start: SHA-256 of the weights with which it begins; None for new ones.

    Raises:
        OptionError: the folder is in use, or holds another run or other files; or the dataset is unfinished.
        DocumentError: the dataset's manifest cannot be read, or an output of a finished run was changed.
    """
    options = config.to_json()
    inputs = {name: options[name] for name in options if name not in ("schema", "training")} | options["training"]
    if start is not None:
        inputs["start"] = start
    identity = train_identity(policy, dataset=load_manifest(data).digest, **inputs)
    with RunFolder.open(out, identity, fresh) as run:
        if run.finished:
            yield None
        else:
            yield run
            finish(run, OUTPUTS)
        (run.path / CHECKPOINT).unlink(missing_ok=True)


def train_identity(policy: str, packages: Sequence[str] = (), **inputs: Any) -> RunIdentity:
    """Return the identity of a training run on this machine.

    Args:
        policy: name of the policy.
        packages: packages besides numpy and torch whose versions decide the weights.
        inputs: everything else that decides them.
    """
    versions = {name: _version(name) for name in ("numpy", "torch", *packages)}
    kernels = torch.backends.cpu.get_cpu_capability()  # The last bits of sums depend on the instruction set.
    return RunIdentity.of("train", policy=policy, versions=versions, kernels=kernels, **inputs)


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        raise MissingDependencyError(package, "training", "train") from None


def finish(run: RunFolder, names: Sequence[str]) -> None:
    """Write the manifest of a training run, with the files of these names."""
    run.finish({name: (run.path / name).read_bytes() for name in names})


MIRROR = torch.tensor([1.0, -1.0])
"""Mirrors a point (x, y) of the robot frame: left becomes right."""

Network = TypeVar("Network", bound=nn.Module)


class Trainer(ABC):
    """A network in training, as `run_epochs` calls it.

    Attributes:
        network: trained by gradient steps.
        optimizer: takes the steps.
        clip: largest norm of a gradient.
    """

    network: nn.Module
    optimizer: torch.optim.Optimizer
    clip: float

    @abstractmethod
    def parts(self) -> Mapping[str, Stateful]:
        """Return everything whose state a checkpoint stores."""

    @abstractmethod
    def training_losses(self, chosen: Tensor, generator: torch.Generator) -> Any:
        """Return the losses of the network on samples (b,), by index."""

    @abstractmethod
    def held_out_losses(self, chosen: Tensor, generator: torch.Generator) -> Any:
        """Return the losses on samples (b,) that are not trained on; nothing is mirrored."""

    def after_step(self) -> None:
        """Run after each gradient step."""
        return

    def after_epoch(self, loss: float) -> None:  # noqa: ARG002
        """Run after each epoch, with the total held-out loss, or the training loss where nothing is held out."""
        return

    @abstractmethod
    def save(self, out: Path) -> None:
        """Write configuration and weights."""


def run_epochs(
    trainer: Trainer, trained: Tensor, held_out: Tensor, options: TrainOptions, out: Path, progress: bool
) -> None:
    """Train for all epochs that a folder's checkpoint does not have yet.

    Each epoch writes the weights, `history.jsonl`, and last a checkpoint, from which training resumes. Its randomness
    depends on the seed and the epoch alone: an interrupted run ends with the weights of an uninterrupted one.

    Args:
        trainer: the network in training.
        trained, held_out: indices of the samples.
        options: options of the training.
        out: folder of the run.
        progress: whether to show progress bars.

    Raises:
        DocumentError: the checkpoint is damaged.
    """
    history: list[dict[str, Any]] = []
    if (out / CHECKPOINT).exists():
        history = load_checkpoint(out / CHECKPOINT, trainer.parts(), _is_history)
    for epoch in range(len(history), options.epochs):
        begun = time.perf_counter()
        generator = torch.Generator().manual_seed(options.seed * 1_000_003 + epoch)
        losses = _one_epoch(trainer, trained, options, generator, f"epoch {epoch + 1}" if progress else None)
        row: dict[str, Any] = {"epoch": epoch + 1, "rate": trainer.optimizer.param_groups[0]["lr"], "train": losses}
        if len(held_out):
            row["held_out"] = _held_out(trainer, held_out, options)
        trainer.after_epoch(row.get("held_out", row["train"])["total"])
        history.append(row)
        trainer.save(out)
        write_text(out / HISTORY, "".join(json.dumps(each) + "\n" for each in history))
        save_checkpoint(out / CHECKPOINT, trainer.parts(), history)
        append_text(out / TIMES, json.dumps({"epoch": epoch + 1, "seconds": time.perf_counter() - begun}) + "\n")


def seeded(make: Callable[[], Network], seed: int) -> Network:
    """Return a network whose initial weights depend on the seed alone; torch's global generator is unchanged."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return make()


def split_by_layout(place: Tensor, layouts: int, held_out: float) -> tuple[Tensor, Tensor]:
    """Return the indices of the samples to train on and of the held-out ones; they share no layout.

    Args:
        place: (n,) index of each sample's layout.
        layouts: number of layouts.
        held_out: share of the layouts, the last ones, that is held out.
    """
    first = round((1.0 - held_out) * layouts)
    return torch.nonzero(place < first)[:, 0], torch.nonzero(place >= first)[:, 0]


def _one_epoch(
    trainer: Trainer, trained: Tensor, options: TrainOptions, generator: torch.Generator, title: str | None
) -> dict[str, float]:
    """Train on every sample once, in random order; return the mean of each loss term."""
    trainer.network.train()
    order = trained[torch.randperm(len(trained), generator=generator)]
    history: list[Any] = []
    for chosen in tqdm(torch.split(order, options.batch), title, disable=title is None):
        losses = trainer.training_losses(chosen, generator)
        trainer.optimizer.zero_grad()
        losses.total.backward()
        torch.nn.utils.clip_grad_norm_(trainer.network.parameters(), trainer.clip)
        trainer.optimizer.step()
        trainer.after_step()
        history.append(type(losses)(*(term.detach() for term in losses)))
    return _means(history)


@torch.no_grad()
def _held_out(trainer: Trainer, held_out: Tensor, options: TrainOptions) -> dict[str, float]:
    """Return the mean of each loss term on the held-out samples, with the same noise every time."""
    trainer.network.eval()
    generator = torch.Generator().manual_seed(options.seed)
    return _means([trainer.held_out_losses(chosen, generator) for chosen in torch.split(held_out, options.batch)])


def _is_history(record: Any) -> bool:
    """Return whether a checkpoint's record is a list of epochs, numbered from 1."""
    return isinstance(record, list) and all(
        isinstance(row, dict) and row.get("epoch") == number for number, row in enumerate(record, 1)
    )


def _means(losses: Sequence[Any]) -> dict[str, float]:
    table = torch.tensor([[float(term) for term in each] for each in losses])
    return dict(zip(losses[0]._fields, table.mean(dim=0).tolist(), strict=True))
