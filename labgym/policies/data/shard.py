"""Making a dataset shard by shard: generate layouts, draw samples, render images."""

from __future__ import annotations

import hashlib
import io
import warnings
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import labgym
from labgym.envs.sensors import Camera
from labgym.errors import LabgymError, OptionError, SearchLimitWarning
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.layouts.places import FIRST_SEEDS, PLACES, SPLIT_SEEDS, layout_at
from labgym.layouts.splits import PUBLISHED, TRAIN_SEEDS, manifest, train_layout
from labgym.policies.data.columns import arrow, map_row, map_schema, sample_row, sample_schema
from labgym.policies.data.manifest import DataOptions, DatasetLayout, DatasetManifest, DatasetShard
from labgym.policies.data.maps import privileged_maps
from labgym.policies.data.situations import Leader, Situations
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.scenes import RayScene

Row = dict[str, Any]

FLOOR_SPLIT = "floors-train"


def make_shard(options: DataOptions, index: int, leader: Leader | None = None) -> ShardOutput:
    """Make a shard and return its files, with its entry in the manifest as record.

    The shard depends on the options and the index alone; `leader` is the learner that the options name.
    """
    sequence = np.random.SeedSequence([options.seed, index])
    counts = _split(options.size(index), options.layout)
    layouts: list[DatasetLayout] = []
    rows: list[Row] = []
    maps: list[Row] = []
    for number, (count, child) in enumerate(zip(counts, sequence.spawn(len(counts)), strict=True)):
        rng = np.random.default_rng(child)
        layout = _drawn_layout(options, rng)
        layouts.append(_entry(layout))
        maps.append(map_row(privileged_maps(layout), number, layout.id, layout.hash))
        samples = _samples(layout, rng, _split(count, options.drive), options.led, leader)
        rows += [{"map_index": number, **row} for row in samples]
    _number(rows, index * options.shard)
    files = {
        f"samples/{index:05d}.parquet": _parquet(rows, sample_schema()),
        f"maps/{index:05d}.parquet": _parquet(maps, map_schema()),
    }
    digests = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    entry = DatasetShard(index=index, samples=len(rows), layouts=tuple(layouts), files=digests)
    return ShardOutput(files, entry.model_dump(mode="json"))


def _drawn_layout(options: DataOptions, rng: np.random.Generator) -> Layout:
    """Return a training room, or a training floor."""
    if options.floors and rng.random() < options.floors:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the floor holds is no loss here.
            return layout_at(FLOOR_SPLIT, int(rng.integers(PLACES)))
    return train_layout(rng)


def _samples(
    layout: Layout, rng: np.random.Generator, drives: list[int], led: float, leader: Leader | None
) -> list[Row]:
    """Return the samples of drives in a layout.

    Args:
        layout: where the robot drives. rng: generator. drives: numbers of samples per drive.
        led: share of the drives that the leader leads.
        leader: leads some drives; None lets the expert lead all.
    """
    situations, rays, camera = Situations(layout), RayScene(layout), Camera()
    guide = None if leader is None else leader.guide(layout, int(rng.integers(2**62)))
    rows: list[Row] = []
    for count in drives:
        leads = guide if guide is not None and rng.random() < led else None
        for situation in situations.drive(rng, count, leads):
            rgb, depth = camera.colour_and_depth(rays, situation.pose)
            rows.append(sample_row(situation, rgb, depth))
    return rows


def _number(rows: list[Row], first: int) -> None:
    """Number samples, beginning with `first`, and drives by their first sample."""
    episode = first
    for place, row in enumerate(rows, first):
        episode = place if row["frame_index"] == 0 else episode
        row.update(index=place, episode_index=episode)


def _entry(layout: Layout) -> DatasetLayout:
    """Return the manifest's entry of a training layout.

    Raises:
        LabgymError: the layout is published for evaluation, or its seed is not a training seed.
    """
    seed = layout.provenance.seed
    held_out = {entry.hash for split in PUBLISHED for entry in manifest(split).layouts}
    if seed is None or not _is_training_seed(seed) or layout.hash in held_out:
        raise LabgymError(f"layout {layout.id!r} with seed {seed} is held out for evaluation and cannot be trained on")
    return DatasetLayout(
        id=layout.id, protocol=str(layout.protocol_id), room=layout.floor.name, seed=seed, hash=layout.hash
    )


def _is_training_seed(seed: int) -> bool:
    """Return whether a seed is one of the training rooms or of the training floors."""
    first = FIRST_SEEDS[FLOOR_SPLIT]
    return 0 <= seed < TRAIN_SEEDS or first <= seed < first + SPLIT_SEEDS


def _split(count: int, size: int) -> list[int]:
    """Split a count into parts of a size; the last part is the remainder."""
    return [min(size, count - begin) for begin in range(0, count, size)]


def _parquet(rows: list[Row], schema: Any) -> bytes:
    pa = arrow()
    stream = io.BytesIO()
    pa.parquet.write_table(pa.Table.from_pylist(rows, schema=schema), stream, compression="zstd")
    return stream.getvalue()


RECORDED_PACKAGES = ("embreex", "numpy", "opencv-python-headless", "ortools", "pyarrow", "scipy")
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
    return {"labgym": labgym.__version__, **{name: metadata.version(name) for name in RECORDED_PACKAGES}}
