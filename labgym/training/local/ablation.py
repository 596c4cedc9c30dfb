"""Ablations of the local planner, judged on floors-val.

Imitation: networks that learn from the same recorded drives without a part of the input. PPO: the policy before it, the
policy without its safety layer, and policies that have practiced a single task each.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import torch
from torch import nn

from labgym.documents import Document, Record
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav.figure import paired_difference
from labgym.policies.learned.training_loop import train_identity
from labgym.policies.local.inputs import SIZES, place_of
from labgym.policies.local.policy import FILE as WEIGHTS
from labgym.policies.local.policy import checked_actor
from labgym.runs import ExecutorOptions, RunFolder
from labgym.runs.identity import read_identity
from labgym.runs.manifest import MANIFEST_FILE, file_digest
from labgym.training.local.collection import ROUNDS, Records, TrainingDrive, driven, read_records
from labgym.training.local.imitation import NOISE, OPTIONS, ROUND, fit, means
from labgym.training.local.model import actor_parts, new_model, save_actor
from labgym.training.local.options import ImitationOptions, ReinforcementOptions
from labgym.training.local.practice import validation_floors
from labgym.training.local.schedule import validation_drives

FILE = "ablation.json"
HISTORIES = "training.json"
"""Histories of the training seeds of a published policy."""
WHOLE, EXPERT = "whole", "DAgger"
HIDDEN = ("free", "room", "arcs", "people", "motion", "knowledge")
"""Parts of the input that are left out, one at a time; without the path, the network does not know where to go."""
BEFORE, UNGUARDED, SINGLE = "PPO", "the safety layer", "other tasks"
"""What the variants of PPO lack."""


class LocalVariant(Record):
    """A network that lacks something.

    Attributes:
        name: what it lacks; "whole" lacks nothing. difference: of its mean score from that of the whole network, with
            its interval over floors; None for the whole one.
        scores: means by task. endings: numbers of drives.
    """

    name: str
    difference: Estimate | None = None
    scores: dict[str, float]
    endings: dict[str, int]


class Ablation(Document):
    """The results of an ablation.

    Attributes:
        weights: SHA-256 of the policy of the run. drives: of each variant. variants: the whole network first.
    """

    SCHEMA: ClassVar[str] = "labgym.local-ablation/1"

    weights: str
    drives: int
    variants: tuple[LocalVariant, ...]


def ablate_imitation(
    run: Path, out: Path, executor: ExecutorOptions | None = None, each: int = 3, fresh: bool = False
) -> Path:
    """Train the variants on the drives of a run, judge them, and return the file of the results.

    Args:
        run: folder of `imitate`. out: folder of the ablation.
        executor: where drives are driven. each: drives of a task on a floor of floors-val.
        fresh: move the files of the folder aside and start anew.

    Raises:
        DocumentError: the run's options or drives cannot be read.
        OptionError: the run is not finished; the folder is in use or holds another ablation.
    """
    torch.set_num_threads(1)
    options = ImitationOptions.load(run / OPTIONS)
    files = sorted((run / ROUNDS).glob(f"{ROUND}-*.npz"), key=_round_and_unit)
    weights = _finished(run)
    if not files:
        raise DocumentError(run, "rounds", "holds no recorded drives; train with labgym train local-imitation")
    inputs = {"run": options.to_json(), "drives": [file_digest(file) for file in files], "each": each}
    with RunFolder.open(out, train_identity("local-ablation", (), **inputs), fresh) as folder:
        if not folder.finished:
            floors = validation_floors(out)
            drives = validation_drives(floors, options.tasks, each)
            variants: list[tuple[str, list[dict[str, Any]]]] = []
            for name in (WHOLE, EXPERT, *HIDDEN):
                network = out / "networks" / f"{name.replace(' ', '-')}.safetensors"
                if not network.is_file():
                    _learned(name, files, options, network)
                variants.append((name, driven(drives, options.shard, network, "alone", name, executor)[1]))
            _results(file_digest(weights) or "", variants).save(out / FILE)
            folder.finish({FILE: (out / FILE).read_bytes()})
    return out / FILE


def ablate_reinforcement(
    run: Path,
    start: Path,
    out: Path,
    singles: Sequence[Path] = (),
    executor: ExecutorOptions | None = None,
    each: int = 3,
    fresh: bool = False,
) -> Path:
    """Judge variants of a policy of PPO, and return the file of the results.

    Args:
        run: folder of `reinforce`, or of the published policy. start: file of the policy with which it began; of a
            published policy it cannot be checked. out: folder of the ablation.
        singles: folders of `reinforce` for one task each; together they have all tasks of the run. None: no comparison.
        executor: where drives are driven. each: drives of a task on a floor of floors-val.
        fresh: move the files of the folder aside and start anew.

    Raises:
        DocumentError: options or weights cannot be read.
        OptionError: a run is not finished or did not begin with `start`, the single tasks are not those of the run, or
            the folder is in use or holds another ablation.
    """
    torch.set_num_threads(1)
    options = ReinforcementOptions.load(run / OPTIONS)
    alone = _of_tasks(singles, options.tasks)
    weights = _finished(run)
    for file in (weights, start, *alone.values()):
        checked_actor(file)
    for each_run in (run, *singles):
        if not (each_run / MANIFEST_FILE).is_file():
            continue
        identity = read_identity(each_run)
        if identity is None or identity.inputs.get("start") != file_digest(start):
            raise OptionError(f"{each_run} did not begin with {start}: pass its first policy by --start")
    inputs = {
        "weights": file_digest(weights),
        "start": file_digest(start),
        "singles": {task: file_digest(file) for task, file in alone.items()},
        "each": each,
    }
    with RunFolder.open(out, train_identity("local-ablation", (), **inputs), fresh) as folder:
        if not folder.finished:
            floors = validation_floors(out)
            drives = validation_drives(floors, options.tasks, each)

            def rows(
                name: str, network: Path, chosen: list[TrainingDrive], safety: bool = True
            ) -> list[dict[str, Any]]:
                return driven(chosen, options.shard, network, "alone", name, executor, safety=safety)[1]

            variants = [
                (WHOLE, rows(WHOLE, weights, drives)),
                (BEFORE, rows(BEFORE, start, drives)),
                (UNGUARDED, rows(UNGUARDED, weights, drives, safety=False)),
            ]
            if alone:
                parts = [rows(f"only {t}", file, [one for one in drives if one.task == t]) for t, file in alone.items()]
                variants.append((SINGLE, [row for part in parts for row in part]))
            _results(file_digest(weights) or "", variants).save(out / FILE)
            folder.finish({FILE: (out / FILE).read_bytes()})
    return out / FILE


def _of_tasks(singles: Sequence[Path], tasks: tuple[str, ...]) -> dict[str, Path]:
    """Return the weights of runs for one task each, by task."""
    found: dict[str, Path] = {}
    for folder in singles:
        practiced = ReinforcementOptions.load(folder / OPTIONS).tasks
        if len(practiced) != 1 or practiced[0] in found or practiced[0] not in tasks:
            raise OptionError(f"{folder} practiced {', '.join(practiced)}: pass one run for each of {', '.join(tasks)}")
        found[practiced[0]] = _finished(folder)
    missing = [task for task in tasks if task not in found]
    if found and missing:
        raise OptionError(f"no run for {', '.join(missing)}: pass one run for each of {', '.join(tasks)}")
    return found


def _finished(run: Path) -> Path:
    """Return the policy of a finished training, or of a published one.

    Raises:
        OptionError: the training is not finished.
    """
    if not (run / MANIFEST_FILE).is_file() and not (run / HISTORIES).is_file():
        raise OptionError(f"{run} is no finished training: run labgym train again with --out {run}")
    return run / WEIGHTS


def _round_and_unit(file: Path) -> list[int]:
    """Return the numbers of the round and of the unit of work in the name of a file of records."""
    return [int(part) for part in file.stem.split("-") if part.isdigit()]


def _learned(name: str, files: list[Path], options: ImitationOptions, network: Path) -> None:
    """Train a variant and write its network."""
    chosen = [file for file in files if file.name.startswith(f"{ROUND}-0-")] if name == EXPERT else files
    records = [hidden(read_records(file.read_bytes()), name) for file in chosen]
    model = new_model(options.seed, NOISE)
    fit(model, records, options, options.rounds, options.last_epochs)
    first = next(part for part in actor_parts(model) if isinstance(part, nn.Linear))
    with torch.no_grad():
        first.weight[:, _columns(name)] = 0.0
    save_actor(model, network, "imitation")


def hidden(records: Records, name: str) -> Records:
    """Return records with a part of the input set to 0."""
    records["inputs"][:, _columns(name)] = 0.0
    return records


def _columns(name: str) -> slice:
    """Return the place of the input that a variant lacks, nothing for one that lacks none."""
    return place_of(name) if name in SIZES else slice(0, 0)


def _results(weights: str, variants: list[tuple[str, list[dict[str, Any]]]]) -> Ablation:
    scores = {name: {row["key"]: float(row["score"]) for row in rows} for name, rows in variants}
    results = []
    for name, rows in variants:
        difference = None if name == WHOLE else paired_difference(scores[name], scores[WHOLE]).difference
        results.append(LocalVariant(name=name, difference=difference, **means(rows)))
    return Ablation(weights=weights, drives=len(variants[0][1]), variants=tuple(results))
