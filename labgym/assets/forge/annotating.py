"""Annotation of many mesh files on an executor: each file is a shard, and its entry comes back as bytes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labgym.assets.catalog import OWN_ASSETS, AssetFile, Catalog
from labgym.assets.forge.engine import Annotated, Options, Views, annotate, source_digest
from labgym.assets.forge.modelled import Annotator
from labgym.documents import json_bytes
from labgym.errors import LabgymError
from labgym.runs import ExecutorOptions, Shard, ShardOutput, run_shards
from labgym.runs.shards import DeadlyShardError

ANNOTATIONS = "annotations"
SourceKey = tuple[str, tuple[tuple[str, str], ...]]
"""SHA-256 of a mesh file, and the options that it is annotated with."""


@dataclass(frozen=True)
class NewEntry:
    """The entry of a mesh file, before it is in a catalog folder.

    Attributes:
        name: of the asset; "" if the file failed or has an entry already.
        files: content by path relative to the catalog folder, the entry itself last.
        notes: points for the user to check.
        problem: why the file failed, else "".
        source: the file and its options; None if the file cannot be read.
    """

    name: str = ""
    files: Mapping[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    problem: str = ""
    source: SourceKey | None = None


def source_key(sha256: str, recorded: Mapping[str, str]) -> SourceKey:
    """Return what identifies a source: files of one key give the same asset."""
    return sha256, tuple(sorted(recorded.items()))


def new_entry(result: Annotated) -> NewEntry:
    """Return the files of an annotated mesh."""
    name, geometry = result.asset.name, str(result.asset.shape.parameters["file"])
    files = {
        geometry: result.geometry,
        str(Path(geometry).with_suffix(".glb")): result.visual,
        f"{ANNOTATIONS}/{name}.json": json_bytes(result.annotation.to_json()),
        f"{OWN_ASSETS}/{name}.json": json_bytes(AssetFile(assets=(result.asset,)).to_json()),
    }
    source = result.annotation.source
    return NewEntry(name, files, result.annotation.notes, source=source_key(source.sha256, source.options))


def annotated_files(
    paths: Sequence[Path],
    options: Options,
    executor: ExecutorOptions,
    annotator: Annotator | None = None,
    views: Views | None = None,
    present: Collection[SourceKey] = (),
) -> Iterator[tuple[Path, NewEntry]]:
    """Yield each mesh file with its entry, in the order of the files.

    Args:
        paths: mesh files; workers on other machines must find them under the same paths.
        options: options of the annotation.
        executor: where the files are annotated.
        annotator, views: as `annotate`; only for an executor that runs in this process.
        present: sources that are not annotated.
    """
    waiting = {number: _examined(path, options, present) for number, path in enumerate(paths)}
    shards = [
        Shard(str(number), annotate_file, (paths[number], options, annotator, views))
        for number, entry in waiting.items()
        if entry is None
    ]
    following = 0
    for number, entry in _entries(shards, executor):
        waiting[number] = entry
        while (ready := waiting.get(following)) is not None:
            yield paths[following], ready
            del waiting[following]
            following += 1
    for number, rest in sorted(waiting.items()):
        if rest is not None:
            yield paths[number], rest


def annotate_file(path: Path, options: Options, annotator: Annotator | None, views: Views | None) -> ShardOutput:
    """Return the files of a mesh file's entry, with its name and notes as record; or the problem as record."""
    try:
        entry = new_entry(annotate(path, options, Catalog.published(), annotator, views))
    except LabgymError as error:
        return ShardOutput(record={"problem": str(error)})
    except Exception as error:  # noqa: BLE001 -- a reader's defect must not stop a batch
        return ShardOutput(record={"problem": _defect(path, error)})
    return ShardOutput(entry.files, {"name": entry.name, "notes": entry.notes, "source": entry.source})


def _examined(path: Path, options: Options, present: Collection[SourceKey]) -> NewEntry | None:
    """Return the outcome of a file that needs no annotation: it cannot be read, or is there already."""
    try:
        source = source_key(source_digest(path), options.recorded())
    except LabgymError as error:
        return NewEntry(problem=str(error))
    except Exception as error:  # noqa: BLE001 -- such as no permission
        return NewEntry(problem=_defect(path, error))
    return NewEntry(source=source) if source in present else None


def _entries(shards: Sequence[Shard], executor: ExecutorOptions) -> Iterator[tuple[int, NewEntry]]:
    """Yield the entry of each file as it is finished; a file that kills its workers fails, and the others go on."""
    remaining = {shard.name: shard for shard in shards}
    while remaining:
        try:
            for shard, output in run_shards(list(remaining.values()), None, executor, progress=False):
                del remaining[shard.name]
                yield int(shard.name), _entry(output)
        except DeadlyShardError as error:
            path = remaining.pop(error.shard).arguments[0]
            yield int(error.shard), NewEntry(problem=f"{path}: its annotation killed {error.deaths} processes")


def _entry(output: ShardOutput) -> NewEntry:
    record: dict[str, Any] = output.record
    if "problem" in record:
        return NewEntry(problem=record["problem"])
    return NewEntry(record["name"], output.files, tuple(record["notes"]), source=record["source"])


def _defect(path: Path, error: Exception) -> str:
    problem = " ".join(str(error).split())[:200]
    return f"{path}: cannot be read ({type(error).__name__}: {problem})"
