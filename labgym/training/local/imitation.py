"""Imitation of the navigation stack: DAgger, with the stack's advice in every state that the network drives into."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch.nn.functional import smooth_l1_loss
from tqdm import tqdm

from labgym.documents import append_text, write_text
from labgym.eval.labnav.figure import geometric
from labgym.policies.learned.training_loop import TIMES, finish, train_identity
from labgym.policies.local.policy import FILE
from labgym.runs import ExecutorOptions, RunFolder
from labgym.training.local.collection import Mode, Records, driven
from labgym.training.local.model import mean_actions, new_model, save_actor
from labgym.training.local.options import ImitationOptions
from labgym.training.local.practice import digest_of, validation_floors
from labgym.training.local.schedule import check_tasks, drawn_drives, validation_drives

OPTIONS, HISTORY = "options.json", "history.jsonl"
ROUND, VALIDATION = "round", "validation"
"""Kinds of records of a history, and names of units of work."""
NOISE = 0.15
"""Standard deviation of the actions in the model; imitation does not use it."""
_SAMPLES = ("inputs", "advice")


def imitate(
    options: ImitationOptions,
    floors: Sequence[Path],
    out: Path,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
) -> Path:
    """Train, or resume, the run in a folder and return the file of the policy.

    Args:
        options: of the run. floors: files of `make_practice`.
        out: its folder: the policy, `history.jsonl` and the recorded drives.
        executor: where drives are driven. fresh: move the files of the folder aside and start anew.

    Raises:
        UnknownNameError: a task does not exist.
        OptionError: the folder is in use or holds another run.
        DocumentError: a finished run was changed.
    """
    check_tasks(options.tasks)
    torch.set_num_threads(1)
    inputs = options.to_json() | {"practice": digest_of(floors)}
    identity = train_identity("local-imitation", ("stable-baselines3",), **inputs)
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            options.save(out / OPTIONS)
            _train(options, floors, run, executor)
            finish(run, (OPTIONS, HISTORY, FILE))
    return out / FILE


def _train(options: ImitationOptions, floors: Sequence[Path], run: RunFolder, executor: ExecutorOptions | None) -> None:
    model = new_model(options.seed, NOISE)
    network = run.path / "network.safetensors"
    records: list[Records] = []
    history: list[dict[str, Any]] = []
    for number in range(options.rounds):
        with timed(run.path, number):
            save_actor(model, network, "imitation")
            drives = drawn_drives(floors, options.tasks, options.drives, options.seed, number)
            mode: Mode = "network" if number else "expert"
            new, rows = driven(drives, options.shard, network, mode, f"{ROUND} {number}", executor, run=run)
            records += new
            last = number == options.rounds - 1
            error = fit(model, records, options, number, options.last_epochs if last else options.epochs)
            facts = {"number": number, "driver": mode, "samples": _count(records), "error": error}
            history.append({"kind": ROUND, **facts, **means(rows)})
            write_history(run.path, history)
    network.unlink(missing_ok=True)
    save_actor(model, run.path / FILE, "imitation")
    judged = validation_drives(validation_floors(run.path), options.tasks, options.validation)
    _, rows = driven(judged, options.shard, run.path / FILE, "alone", VALIDATION, executor, run=run)
    write_history(run.path, [*history, validation_record(options.rounds, rows)])


def validation_record(number: int, rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return the record of an evaluation on floors-val, with LabNav's figure over the tasks that were driven."""
    result = means(rows)
    figure = round(geometric(list(result["scores"].values())), 3)
    return {"kind": VALIDATION, "number": number, "figure": figure, **result}


def write_history(folder: Path, history: Iterable[dict[str, Any]]) -> None:
    """Write the history of a run, a line for each record."""
    write_text(folder / HISTORY, "".join(json.dumps(record) + "\n" for record in history))


@contextmanager
def timed(folder: Path, number: int) -> Iterator[None]:
    """Add the wall-clock time of a round, or of the part before an interruption, to the times of a run."""
    begun = time.perf_counter()
    try:
        yield
    finally:
        append_text(folder / TIMES, json.dumps({"number": number, "seconds": time.perf_counter() - begun}) + "\n")


def means(rows: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return mean scores by task, and the number of drives by ending."""
    scores: dict[str, list[float]] = {}
    endings: dict[str, int] = {}
    for row in rows:
        scores.setdefault(row["task"], []).append(row["score"])
        endings[row["ending"]] = endings.get(row["ending"], 0) + 1
    by_task = {task: round(math.fsum(each) / len(each), 4) for task, each in sorted(scores.items())}
    return {"scores": by_task, "endings": dict(sorted(endings.items()))}


def _count(records: list[Records]) -> int:
    return sum(len(each["advice"]) for each in records)


def fit(model: ActorCriticPolicy, records: list[Records], options: ImitationOptions, number: int, epochs: int) -> float:
    """Teach the actor the expert's advice by all samples, and return the mean error in the last pass.

    Args:
        model: learns. records: of all rounds. options: of the run. number: of the round. epochs: passes.
    """
    inputs, advice = (torch.from_numpy(np.concatenate([each[name] for each in records])) for name in _SAMPLES)
    rng = np.random.default_rng([options.seed, number, 1])  # That of the drives is [seed, number].
    optimizer = torch.optim.Adam(model.parameters(), options.rate)
    batches = math.ceil(len(inputs) / options.batch)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs * batches)
    model.train()
    total = 0.0
    for _ in tqdm(range(epochs), desc=f"learning {number}", unit="epoch", leave=False):
        total = 0.0
        for batch in np.array_split(rng.permutation(len(inputs)), batches):
            loss = smooth_l1_loss(mean_actions(model, inputs[batch]), advice[batch], beta=0.1)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
            total += float(loss.detach()) * len(batch)
    model.eval()
    return round(total / len(inputs), 6)
