"""Making one shard: generate layouts, draw samples, render images, return two files."""

from __future__ import annotations

import hashlib
import io
from typing import Any

import numpy as np

from labgym.envs.sensors import Camera
from labgym.errors import LabgymError
from labgym.layouts import Layout
from labgym.layouts.splits import FIRST_SEED, TRAIN_SEEDS, manifest, train_layout
from labgym.policies.data.columns import arrow, map_row, map_schema, sample_row, sample_schema
from labgym.policies.data.manifest import DataOptions, DatasetLayout, DatasetShard
from labgym.policies.data.maps import privileged_maps
from labgym.policies.data.situations import Situations
from labgym.runs import ShardOutput
from labgym.scenes import RayScene

Row = dict[str, Any]


def make_shard(options: DataOptions, index: int) -> ShardOutput:
    """Make a shard and return its files, with its entry in the manifest as record.

    The shard depends on the options and the index alone.
    """
    sequence = np.random.SeedSequence([options.seed, index])
    counts = _split(options.size(index), options.layout)
    layouts: list[DatasetLayout] = []
    rows: list[Row] = []
    maps: list[Row] = []
    for number, (count, child) in enumerate(zip(counts, sequence.spawn(len(counts)), strict=True)):
        rng = np.random.default_rng(child)
        layout = train_layout(rng)
        layouts.append(_entry(layout))
        maps.append(map_row(privileged_maps(layout), number, layout.id, layout.hash))
        samples = _samples(layout, rng, _split(count, options.drive))
        rows += [{"map_index": number, **row} for row in samples]
    _number(rows, index * options.shard)
    files = {
        f"samples/{index:05d}.parquet": _parquet(rows, sample_schema()),
        f"maps/{index:05d}.parquet": _parquet(maps, map_schema()),
    }
    digests = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    entry = DatasetShard(index=index, samples=len(rows), layouts=tuple(layouts), files=digests)
    return ShardOutput(files, entry.model_dump(mode="json"))


def _samples(layout: Layout, rng: np.random.Generator, drives: list[int]) -> list[Row]:
    """Return the samples of drives in a layout; `drives` are the numbers of samples per drive."""
    situations, rays, camera = Situations(layout), RayScene(layout), Camera()
    rows: list[Row] = []
    for count in drives:
        for situation in situations.drive(rng, count):
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
    held_out = {entry.hash for split in FIRST_SEED for entry in manifest(split).layouts}
    if seed is None or not 0 <= seed < TRAIN_SEEDS or layout.hash in held_out:
        raise LabgymError(f"layout {layout.id!r} with seed {seed} is held out for evaluation and cannot be trained on")
    return DatasetLayout(
        id=layout.id, protocol=str(layout.protocol_id), room=layout.floor.name, seed=seed, hash=layout.hash
    )


def _split(count: int, size: int) -> list[int]:
    """Split a count into parts of a size; the last part is the remainder."""
    return [min(size, count - begin) for begin in range(0, count, size)]


def _parquet(rows: list[Row], schema: Any) -> bytes:
    pa = arrow()
    stream = io.BytesIO()
    pa.parquet.write_table(pa.Table.from_pylist(rows, schema=schema), stream, compression="zstd")
    return stream.getvalue()
