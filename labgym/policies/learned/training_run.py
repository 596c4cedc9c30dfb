"""Training as a resumable run: its identity, its checkpoints and its end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Any

import torch

from labgym.documents import Document
from labgym.errors import MissingDependencyError
from labgym.policies.data import load_manifest
from labgym.policies.learned.weights import CONFIG, WEIGHTS
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
