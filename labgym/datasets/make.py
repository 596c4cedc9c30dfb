"""Make a dataset of drives shard by shard, and merge it into a format; an interrupted run resumes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import labgym
from labgym.datasets.card import card
from labgym.datasets.lerobot_format import lerobot_files
from labgym.datasets.minari_format import minari_files
from labgym.datasets.options import DriveOptions
from labgym.datasets.shard import FinishedShards, attempts_of, make_shard
from labgym.datasets.tables import parquet_bytes
from labgym.documents import files_digest
from labgym.errors import MissingDependencyError
from labgym.eval.driving.runner import installed_catalog, open_driver, policy_fingerprint, policy_source
from labgym.policies.data.columns import arrow
from labgym.policies.kernels import kernel_mode
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, run_shards
from labgym.runs.folder import Content

EPISODES = "episodes.parquet"

RECORDED = (
    "embreex",
    "gymnasium",
    "mujoco",
    "numpy",
    "opencv-python-headless",
    "ortools",
    "pyarrow",
    "scipy",
    "shapely",
)
"""Packages whose versions can change the bytes of a dataset."""

PACKAGES = {
    "parquet": (),
    "minari": (("minari", "minari"), ("h5py", "h5py")),
    "lerobot": (("imageio_ffmpeg", "imageio-ffmpeg"),),
}
"""Packages of each format, besides pyarrow: names for import and of the distribution."""


CARD = "README.md"


def parquet_files(options: DriveOptions, shards: FinishedShards) -> Iterator[tuple[str, Content]]:  # noqa: ARG001
    """Yield the merged file, that of the episodes: the shards wrote `steps/*.parquet` themselves."""
    yield EPISODES, parquet_bytes([shard.episodes for shard in shards])


FILES: dict[str, Callable[[DriveOptions, FinishedShards], Iterator[tuple[str, Content]]]] = {
    "parquet": parquet_files,
    "minari": minari_files,
    "lerobot": lerobot_files,
}
"""The merged files of each format."""


def make_drives(
    folder: str | Path,
    options: DriveOptions,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> Path:
    """Make a dataset of drives, or the missing shards of one, and return its folder.

    The bytes depend on the options, the code and the recorded versions alone, not on the executor; `ledger.jsonl` and
    `provenance.jsonl`, which record the run, are no part of the dataset.

    Args:
        folder: for the files of the format, `README.md` and the record of the run.
        options: what to drive.
        executor: where the shards are driven; by default in this process.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        OptionError: the folder is in use, or holds another dataset or other files.
        MissingDependencyError: a package of the format or of the expert is not installed.
        LabgymError: the expert failed by an error, or too often; or workers died.
    """
    executor, folder = executor or ExecutorOptions(), Path(folder)
    arrow()
    _check_installed(options)
    mode, source = kernel_mode(), policy_source(options.policy, {})
    with open_driver(options.policy, source, None, mode, isolated=True) as driver:
        paths = driver.files()
        fingerprint = policy_fingerprint(options.policy, source, options.policy, paths)
        portable = source.portable(paths) if executor.kind == "dask" else source
        if driver.foresees and executor == ExecutorOptions():
            executor = replace(executor, apart=True)  # It drives in a process with one thread, as in an evaluation.
    identity = RunIdentity.of(
        "drives",
        options=options.model_dump(mode="json"),
        policy=fingerprint.model_dump(),
        kernels=mode.name,
        catalog=installed_catalog(),
        versions=_versions(options),
    )
    arguments = portable, files_digest(paths), mode.kind
    shards = [
        Shard(f"{index:05d}", make_shard, (options, index, *arguments), len(options.numbers(index)))
        for index in range(options.shards)
    ]
    with RunFolder.open(folder, identity, fresh) as run:
        if run.finished:
            return folder
        guard = {"catalog": installed_catalog}
        for _ in run_shards(shards, run, executor, options.task_id, "ep", guard, progress=progress):
            pass  # The folder holds the output, which may be larger than the memory.
        run.finish(_merged(options, FinishedShards(run, options)))
    return folder


def _merged(options: DriveOptions, shards: FinishedShards) -> Iterator[tuple[str, Content]]:
    """Yield the merged files, the card last."""
    yield from FILES[options.format](options, shards)
    attempts = [attempt for record in shards.records for attempt in attempts_of(record)]
    yield CARD, card(options, attempts, _versions(options)).encode()


def _check_installed(options: DriveOptions) -> None:
    for package, distribution in PACKAGES[options.format]:
        if find_spec(package) is None:
            raise MissingDependencyError(distribution, f"labgym data --format {options.format}", "data")


def _versions(options: DriveOptions) -> dict[str, str]:
    names = (*RECORDED, *(distribution for _, distribution in PACKAGES[options.format]))
    return {"labgym": labgym.__version__, **{name: metadata.version(name) for name in names}}
