"""A folder of experiments that came from outside: files of a thousand, and a list of what was turned down."""

from __future__ import annotations

import csv
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from labgym.errors import OptionError
from labgym.protocols.experiments.feasibility import FeasibilityFilter, Verdict
from labgym.protocols.experiments.model import Experiment, ExperimentFile, Rejection

PER_FILE = 1000
REJECTED = "rejected.csv"


class TurnedDown(NamedTuple):
    """A line of the list: the record's id or place, the kind of reason, the reason."""

    record: str
    kind: str
    reason: str


@dataclass
class Tally:
    """What became of the records.

    Attributes:
        kept: how many were written. reasons: how many were turned down by kind of reason.
    """

    kept: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def rejected(self) -> int:
        """How many were turned down."""
        return sum(self.reasons.values())


def filtered(
    records: Iterable[Experiment | Rejection], feasibility: FeasibilityFilter
) -> Iterator[Verdict | Rejection]:
    """Return the filter's verdict on each experiment; rejections pass through."""
    for record in records:
        yield record if isinstance(record, Rejection) else feasibility.judge(record)


def collect(records: Iterable[Experiment | Verdict | Rejection], folder: str | Path, replace: bool = False) -> Tally:
    """Write records to a folder: files of `PER_FILE` experiments, and a list of what was turned down.

    Infeasible experiments and those whose id occurred before are turned down with the rest. What the folder held stays
    until all has been read.

    Args:
        replace: write over files of experiments that are there.

    Raises:
        OptionError: the folder holds files of experiments, and they are not to be replaced.
    """
    folder = Path(folder)
    present = sorted(folder.glob("experiments-*.json"))
    if present and not replace:
        raise OptionError(f"{folder} holds {present[0].name} and perhaps more; name another folder, or --replace")
    folder.mkdir(parents=True, exist_ok=True)
    tally, seen, batch = Tally(), set[str](), list[Experiment]()
    with tempfile.TemporaryDirectory(dir=folder, prefix=".import-") as name:
        apart = Path(name)
        with (apart / REJECTED).open("w", newline="", encoding="utf-8") as stream:
            table = csv.writer(stream, lineterminator="\n")
            table.writerow(TurnedDown._fields)
            for record in records:
                accepted = _accepted(record, seen)
                if isinstance(accepted, TurnedDown):
                    table.writerow(accepted)
                    tally.reasons[accepted.kind] += 1
                    continue
                seen.add(accepted.id)
                batch.append(accepted)
                if len(batch) == PER_FILE:
                    _write(batch, apart, tally)
        if batch:
            _write(batch, apart, tally)
        for file in present:
            file.unlink()
        for file in sorted(apart.iterdir()):
            file.replace(folder / file.name)
    return tally


def _accepted(record: Experiment | Verdict | Rejection, seen: set[str]) -> Experiment | TurnedDown:
    """Return the experiment of a record, or why it is turned down."""
    if isinstance(record, Rejection):
        return TurnedDown(record.place, "unreadable", record.reason)
    experiment = record.experiment if isinstance(record, Verdict) else record
    if experiment.id in seen:
        return TurnedDown(experiment.id, "repeated", "an experiment of that id came before")
    if isinstance(record, Verdict) and record.obstacles:
        reason = "; ".join(item.message for item in record.obstacles)
        return TurnedDown(experiment.id, record.obstacles[0].code, reason)
    return experiment


def _write(batch: list[Experiment], folder: Path, tally: Tally) -> None:
    number = tally.kept // PER_FILE
    ExperimentFile(experiments=tuple(batch)).save(folder / f"experiments-{number:05d}.json")
    tally.kept += len(batch)
    batch.clear()
