"""Make a dataset shard by shard, in several processes; an interrupted run resumes."""

from __future__ import annotations

import hashlib
import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from importlib import metadata
from pathlib import Path

from tqdm import tqdm

import labgym
from labgym.errors import LabgymError, OptionError
from labgym.policies.data.columns import map_schema, sample_schema
from labgym.policies.data.manifest import DataOptions, DatasetManifest, Shard
from labgym.policies.data.shard import make_shard

MANIFEST = "manifest.json"
RECORDED = ("embreex", "numpy", "opencv-python-headless", "ortools", "pyarrow", "scipy")
"""Packages whose versions can change the bytes of a dataset."""


def make_dataset(
    folder: str | Path, options: DataOptions | None = None, workers: int = 1, progress: bool = True
) -> DatasetManifest:
    """Make a dataset, or the missing shards of one, and return its manifest.

    The bytes depend on the options and the recorded versions alone, not on the number of workers.

    Args:
        folder: for `manifest.json`, `samples/*.parquet` and `maps/*.parquet`.
        options: number of samples, seed and sizes.
        workers: number of processes, each of which makes one shard at a time.
        progress: whether to show a progress bar.

    Raises:
        OptionError: fewer than one worker, or the folder holds a dataset of other options or versions.
        MissingDependencyError: pyarrow is not installed.
        LabgymError: a worker died.
    """
    folder, options = Path(folder), options or DataOptions()
    if workers < 1:
        raise OptionError(f"workers is {workers}, expected at least 1")
    done = {shard.index: shard for shard in _finished(folder, options)}
    missing = [index for index in range(options.shards) if index not in done]
    with tqdm(total=options.samples, initial=_count(done), desc="data", unit="", disable=not progress) as bar:
        for shard in _make_shards(folder, options, missing, workers):
            done[shard.index] = shard
            _manifest(options, done).save(folder / MANIFEST)
            bar.update(shard.samples)
    manifest = _manifest(options, done)
    manifest.save(folder / MANIFEST)
    return manifest


def _make_shards(folder: Path, options: DataOptions, indices: list[int], workers: int) -> Iterator[Shard]:
    """Make shards and yield each when it is finished."""
    if workers == 1 or len(indices) < 2:
        for index in indices:
            yield make_shard(options, index, folder)
        return
    # Spawned, not forked: OR-Tools and OpenCV have threads.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(indices)), mp_context=context, initializer=_ignore_interrupts)
    try:
        for future in as_completed([pool.submit(make_shard, options, index, folder) for index in indices]):
            yield future.result()
    except BrokenProcessPool as error:
        raise LabgymError(
            "a worker process died while it made a shard (out of memory?); run the command again to resume"
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the main process, which waits for the current shards."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _finished(folder: Path, options: DataOptions) -> list[Shard]:
    """Return the finished shards whose files have the hashes of the manifest."""
    if not (folder / MANIFEST).exists():
        return []
    manifest = DatasetManifest.load(folder / MANIFEST)
    if manifest.options != options or manifest.versions != _versions():
        raise OptionError(
            f"{folder} holds a dataset of other options or versions ({manifest.options.samples} samples, "
            f"seed {manifest.options.seed}); choose another folder or remove it"
        )
    return [
        shard for shard in manifest.shards if all(_matches(folder / n, digest) for n, digest in shard.files.items())
    ]


def _matches(path: Path, digest: str) -> bool:
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest


def _count(done: dict[int, Shard]) -> int:
    return sum(shard.samples for shard in done.values())


def _manifest(options: DataOptions, done: dict[int, Shard]) -> DatasetManifest:
    return DatasetManifest(
        options=options,
        versions=_versions(),
        columns={field.name: str(field.type) for field in sample_schema()},
        map_columns={field.name: str(field.type) for field in map_schema()},
        complete=len(done) == options.shards,
        shards=tuple(done[index] for index in sorted(done)),
    )


def _versions() -> dict[str, str]:
    return {"labgym": labgym.__version__, **{name: metadata.version(name) for name in RECORDED}}
