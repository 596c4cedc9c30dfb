"""Make a dataset shard by shard; an interrupted run resumes."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import labgym
from labgym.errors import OptionError
from labgym.layouts.batch import catalog_digest
from labgym.policies.data.columns import arrow, map_schema, sample_schema
from labgym.policies.data.leader import Leader
from labgym.policies.data.manifest import DataOptions, DatasetManifest, DatasetShard
from labgym.policies.data.shard import make_shard
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, run_shards

RECORDED = ("embreex", "numpy", "opencv-python-headless", "ortools", "pyarrow", "scipy")
"""Packages whose versions can change the bytes of a dataset."""


def make_dataset(
    folder: str | Path,
    options: DataOptions | None = None,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
    leader: Leader | None = None,
) -> DatasetManifest:
    """Make a dataset, or the missing shards of one, and return its manifest.

    The bytes depend on the options, the code and the recorded versions alone, not on the executor.

    Args:
        folder: for `manifest.json`, `samples/*.parquet` and `maps/*.parquet`.
        options: number of samples, seed and sizes.
        executor: where the shards are made.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.
        leader: the learner that leads some of the drives.

    Raises:
        OptionError: the folder is in use, or holds another dataset or other files; or the options name another learner.
        MissingDependencyError: pyarrow is not installed.
        LabgymError: workers died, or have another version of labgym or another catalog.
    """
    options = options or DataOptions()
    if options.learner != (None if leader is None else leader.digest):
        raise OptionError("the options name another learner than the one that is passed")
    arrow()  # Look for pyarrow before its version.
    identity = RunIdentity.of(
        "data", options=options.model_dump(mode="json"), catalog=catalog_digest(), versions=_versions()
    )
    columns = {field.name: str(field.type) for field in sample_schema()}
    map_columns = {field.name: str(field.type) for field in map_schema()}
    shards = [Shard(f"{k:05d}", make_shard, (options, k, leader), options.size(k)) for k in range(options.shards)]
    guard = {"catalog": catalog_digest}
    with RunFolder.open(folder, identity, fresh) as run:
        outputs = run_shards(shards, run, executor, "data", "sample", guard, progress=progress)
        entries = [DatasetShard.model_validate(output.record) for _, output in outputs]
        manifest = DatasetManifest(
            options=options,
            versions=_versions(),
            columns=columns,
            map_columns=map_columns,
            complete=True,
            shards=tuple(sorted(entries, key=lambda entry: entry.index)),
        )
        run.finish({}, manifest)
    return manifest


def _versions() -> dict[str, str]:
    return {"labgym": labgym.__version__, **{name: metadata.version(name) for name in RECORDED}}
