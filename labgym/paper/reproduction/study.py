"""A study: independent cases as shards of a run, their rows, and the figures and the page made of them."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from labgym.documents import Record, json_bytes, validating
from labgym.layouts.batch import catalog_digest
from labgym.paper.reproduction.figures import PublishedFigures
from labgym.paper.reproduction.page import StudySection, study_page
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, code_digest, provenance, run_shards
from labgym.runs.folder import SHARDS

KIND = "reproduce"
ROWS, FIGURES, TABLE, PAGE = "rows.jsonl", "figures.json", "figures.csv", "index.html"

Row = TypeVar("Row", bound=Record)


class Study(ABC, Generic[Row]):
    """A study; derived classes are frozen dataclasses with the arguments that decide the rows.

    Attributes:
        name: of the command. unit: of the progress bar. row: class of the rows.
    """

    name: ClassVar[str]
    unit: ClassVar[str] = "case"
    row: ClassVar[type[Record]]

    @abstractmethod
    def inputs(self) -> dict[str, Any]:
        """Return JSON data that decides the rows, in addition to the code and the catalog."""

    @abstractmethod
    def shards(self) -> Sequence[Shard]:
        """Return the work: each shard returns `rows_output(...)`, and the rows are in the order of the shards."""

    @abstractmethod
    def figures(self, rows: Sequence[Row]) -> PublishedFigures:
        """Return the figures of the rows."""

    def sections(self, rows: Sequence[Row], folder: Path) -> Sequence[StudySection]:
        """Return pictures and explanations for the page.

        Args:
            rows: the rows.
            folder: folder of the run, with the files of the shards.
        """
        del rows, folder
        return ()


def reproduce(
    study: Study[Any],
    out: str | Path,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> PublishedFigures:
    """Run a study and return its figures.

    The folder gets `rows.jsonl`, `figures.json`, `figures.csv` and `index.html`. An interrupted command resumes; the
    files depend on the study alone, not on the executor or on interruptions.

    Args:
        study: what to reproduce.
        out: the folder.
        executor: where the shards run.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        OptionError: the folder holds something else or is in use.
        LabgymError: workers died, or have another version of labgym or another catalog.
    """
    identity = RunIdentity.of(KIND, study=study.name, catalog=catalog_digest(), **study.inputs())
    with RunFolder.open(out, identity, fresh) as folder:
        if folder.finished:
            return PublishedFigures.load(folder.path / FIGURES)
        parts: dict[str, bytes] = {}
        shards = study.shards()
        guard = {"catalog": catalog_digest}
        for shard, output in run_shards(shards, folder, executor, study.name, study.unit, guard, progress=progress):
            parts[shard.name] = output.files[rows_file(shard.name)]
        lines = b"".join(parts[shard.name] for shard in shards)
        rows = parse_rows(lines, study.row)
        figures = study.figures(rows)
        page = study_page(figures, study.sections(rows, folder.path), commit())
        folder.finish(
            {
                ROWS: lines,
                FIGURES: json_bytes(figures.to_json()),
                TABLE: figures.csv().encode(),
                PAGE: page.html().encode(),
            }
        )
    return figures


def rows_output(shard: str, rows: Iterable[Record], files: Mapping[str, bytes] | None = None) -> ShardOutput:
    """Return the output of a shard.

    Args:
        shard: its name.
        rows: its rows.
        files: further files that stay in the folder, such as layouts, by path.
    """
    lines = (json.dumps(row.model_dump(mode="json"), ensure_ascii=False, allow_nan=False) for row in rows)
    return ShardOutput({**(files or {}), rows_file(shard): "".join(f"{line}\n" for line in lines).encode()})


def rows_file(shard: str) -> str:
    """Return the path of a shard's rows."""
    return f"{SHARDS}/{shard}.jsonl"


def parse_rows(lines: bytes, row: type[Row]) -> list[Row]:
    """Return the rows in JSON lines.

    Raises:
        DocumentError: a line is broken; names its number.
    """
    rows = []
    for number, line in enumerate(lines.splitlines(), start=1):
        with validating(f"{ROWS}:{number}"):
            rows.append(row.model_validate_json(line))
    return rows


def code_facts() -> dict[str, str]:
    """Return the code that made figures, as facts."""
    from labgym import __version__

    return {"labgym": __version__, "code": code_digest()[:12]}


def commit() -> str:
    """Return the commit of the checkout in words."""
    session = provenance()
    return f"{session.commit or 'not a checkout'}{' with changes' if session.dirty else ''}"
