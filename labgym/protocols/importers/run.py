"""Imports as runs: each file is a shard, and the accepted experiments are merged in the order of the files."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.assets import Catalog
from labgym.documents import Document, json_bytes
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.experiments.collection import Tally, merged
from labgym.protocols.experiments.feasibility import FeasibilityFilter, FeasibilityVerdict, Obstacle
from labgym.protocols.importers.records import ImportSource
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards

SUMMARY = "summary.json"
Count = Annotated[int, Field(ge=0)]


class ImportSummary(Document):
    """Counts of a finished import: accepted experiments, and rejected records by kind of reason."""

    SCHEMA: ClassVar[str] = "labgym.import/1"

    accepted: Count
    reasons: dict[str, Count]


def import_experiments(
    source: ImportSource,
    out: str | Path,
    limit: int | None = None,
    feasible: bool = False,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> Tally:
    """Import experiments into a folder; an interrupted import resumes after its finished files.

    The folder receives files of 1000 experiments, `rejected.csv` and `summary.json`, which do not depend on the
    executor. A file of a folder that cannot be read is a rejected record and does not stop the others.

    Args:
        source: what to import; workers on other machines must find it under the same path.
        out: folder of the import.
        limit: largest number of records to read; None reads all.
        feasible: accept only experiments that the catalog's reagents and equipment can carry out.
        executor: where the files are read.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        OptionError: the folder is in use, or holds another import or other files.
        DocumentError: a single file cannot be read, or the source holds no file of the format.
        MissingDependencyError: the format needs an extra that is not installed.
    """
    files = source.files()
    catalog = Catalog.load() if feasible else None
    identity = RunIdentity.of(
        "import",
        format=source.format,
        product=source.product,
        files={source.name(file): source.digest(file) for file in files},
        limit=limit,
        catalog=None if catalog is None else catalog.digest,
    )
    shards = [
        Shard(f"{number:05d}", import_file, (number, source, file, limit, catalog)) for number, file in enumerate(files)
    ]
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            for _ in run_shards(shards, run, executor, "import", "file", progress=progress):
                pass
            run.finish(_outputs(run, len(files), limit))
        summary = ImportSummary.load(run.path / SUMMARY)
    return Tally(summary.accepted, Counter(summary.reasons))


def import_file(
    number: int, source: ImportSource, file: Path, limit: int | None, catalog: Catalog | None
) -> ShardOutput:
    """Return the records of a file, one per line; with a catalog, experiments have the verdict of its filter."""
    feasibility = None if catalog is None else FeasibilityFilter(catalog)
    lines = []
    for record in islice(source.records(file), limit):
        if isinstance(record, Rejection):
            lines.append(json.dumps({"place": record.place, "reason": record.reason}))
            continue
        verdict = FeasibilityVerdict(record, ()) if feasibility is None else feasibility.judge(record)
        obstacles = [asdict(obstacle) for obstacle in verdict.obstacles]
        experiment = verdict.experiment.model_dump(mode="json")
        lines.append(json.dumps({"experiment": experiment, "obstacles": obstacles}))
    return ShardOutput({_part(number): "".join(f"{line}\n" for line in lines).encode()})


def _outputs(run: RunFolder, files: int, limit: int | None) -> Iterator[tuple[str, bytes]]:
    """Yield the merged files of an import, the summary last."""
    tally = Tally()
    yield from merged(islice(_records(run, files), limit), tally)
    yield SUMMARY, json_bytes(ImportSummary(accepted=tally.accepted, reasons=dict(tally.reasons)).to_json())


def _records(run: RunFolder, files: int) -> Iterator[FeasibilityVerdict | Rejection]:
    for number in range(files):
        with (run.path / _part(number)).open("rb") as stream:
            for line in stream:
                data = json.loads(line)
                if "place" in data:
                    yield Rejection(**data)
                else:
                    obstacles = tuple(Obstacle(**obstacle) for obstacle in data["obstacles"])
                    yield FeasibilityVerdict(Experiment.model_validate(data["experiment"]), obstacles)


def _part(number: int) -> str:
    return f"shards/{number:05d}.jsonl"
