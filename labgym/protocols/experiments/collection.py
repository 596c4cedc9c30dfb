"""Collections of imported experiments: a folder with files of a thousand, and a list of the rejected records."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from labgym.documents import folder_path, json_bytes, write_bytes
from labgym.errors import OptionError
from labgym.protocols.experiments.feasibility import FeasibilityFilter, FeasibilityVerdict
from labgym.protocols.experiments.model import Experiment, ExperimentFile, Rejection
from labgym.runs.folder import only_writer
from labgym.temporary import temporary_folder

PER_FILE = 1000
REJECTED = "rejected.csv"


class RejectedRecord(NamedTuple):
    """A line of the list of rejected records: its id or place, the kind of reason, and the reason."""

    record: str
    kind: str
    reason: str


@dataclass
class Tally:
    """Counts of accepted and rejected records.

    Attributes:
        accepted: number of experiments that were written.
        reasons: number of rejected records by kind of reason.
    """

    accepted: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    @property
    def rejected(self) -> int:
        """Number of rejected records."""
        return sum(self.reasons.values())


def filtered(
    records: Iterable[Experiment | Rejection], feasibility: FeasibilityFilter
) -> Iterator[FeasibilityVerdict | Rejection]:
    """Return the filter's verdict on each experiment; rejections pass through."""
    for record in records:
        yield record if isinstance(record, Rejection) else feasibility.judge(record)


def collect(
    records: Iterable[Experiment | FeasibilityVerdict | Rejection], folder: str | Path, replace: bool = False
) -> Tally:
    """Write records to a folder: files of `PER_FILE` experiments, and a list of the rejected records.

    Infeasible experiments and repeated ids are rejected too. The previous content of the folder stays until all records
    have been read.

    Args:
        records: experiments, verdicts of the feasibility filter, and rejections.
        folder: where the files go.
        replace: whether to replace files of experiments that are already there.

    Raises:
        OptionError: the folder holds files of experiments and `replace` is false, or another process writes into it.
    """
    folder = folder_path(folder)
    present = sorted(folder.glob("experiments-*.json"))
    if present and not replace:
        raise OptionError(f"{folder} already holds {present[0].name}; name another folder, or use --overwrite")
    tally = Tally()
    with only_writer(folder), temporary_folder(folder) as temporary:
        for name, content in merged(records, tally):
            write_bytes(temporary / name, content)
        for file in present:
            file.unlink()
        for file in sorted(temporary.iterdir()):
            file.replace(folder / file.name)
    return tally


def merged(records: Iterable[Experiment | FeasibilityVerdict | Rejection], tally: Tally) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a collection with their content, the list of the rejected records last.

    Args:
        records: as `collect`.
        tally: counts the records.
    """
    ids, batch, rejected = set[str](), list[Experiment](), io.StringIO()
    table = csv.writer(rejected, lineterminator="\n")
    table.writerow(RejectedRecord._fields)
    for record in records:
        accepted = _accepted(record, ids)
        if isinstance(accepted, RejectedRecord):
            table.writerow(accepted)
            tally.reasons[accepted.kind] += 1
            continue
        ids.add(accepted.id)
        batch.append(accepted)
        if len(batch) == PER_FILE:
            yield _file(batch, tally)
    if batch:
        yield _file(batch, tally)
    yield REJECTED, rejected.getvalue().encode()


def _accepted(record: Experiment | FeasibilityVerdict | Rejection, ids: set[str]) -> Experiment | RejectedRecord:
    """Return the experiment of a record, or the reason for its rejection."""
    if isinstance(record, Rejection):
        return RejectedRecord(record.place, "unreadable", record.reason)
    experiment = record.experiment if isinstance(record, FeasibilityVerdict) else record
    if experiment.id in ids:
        return RejectedRecord(experiment.id, "repeated", "an earlier experiment has the same id")
    if isinstance(record, FeasibilityVerdict) and record.obstacles:
        reason = "; ".join(item.message for item in record.obstacles)
        return RejectedRecord(experiment.id, record.obstacles[0].code, reason)
    return experiment


def _file(batch: list[Experiment], tally: Tally) -> tuple[str, bytes]:
    """Return the next file of a collection and empty the batch."""
    name = f"experiments-{tally.accepted // PER_FILE:05d}.json"
    content = json_bytes(ExperimentFile(experiments=tuple(batch)).to_json())
    tally.accepted += len(batch)
    batch.clear()
    return name, content
