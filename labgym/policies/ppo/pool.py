"""The training layouts: generated from training seeds in shards, and stored as files of the run."""

from __future__ import annotations

import numpy as np

from labgym.documents import json_bytes, parse_json
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.layouts.splits import train_layout
from labgym.navigation import goal_pairs
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards

PER_SHARD = 5


def layout_pool(
    run: RunFolder, count: int, seed: int = 0, executor: ExecutorOptions | None = None, progress: bool = True
) -> tuple[Layout, ...]:
    """Return training layouts that have a drive; those that the run does not hold are generated and stored.

    Layout i depends on the seed and i alone.

    Args:
        run: the run, which gets the files `layouts/00000.json`.
        count: number of layouts.
        seed: random seed of the pool.
        executor: where the layouts are generated.
        progress: whether to show a progress bar while layouts are generated.
    """
    parts = [range(first, min(first + PER_SHARD, count)) for first in range(0, count, PER_SHARD)]
    shards = [Shard(f"layouts {part[0]:05d}", make_layouts, (seed, part), len(part)) for part in parts]
    outputs = run_shards(
        shards, run, executor, "training layouts", "layout", {"catalog": catalog_digest}, progress=progress
    )
    files = {name: content for _, output in outputs for name, content in output.files.items()}
    return tuple(Layout.parse(parse_json(files[name], run.path / name), run.path / name) for name in sorted(files))


def make_layouts(seed: int, indices: range) -> ShardOutput:
    """Return the files of some layouts of a pool."""
    layouts = {index: _drawn(np.random.default_rng([seed, index])) for index in indices}
    return ShardOutput({f"layouts/{index:05d}.json": json_bytes(layout.to_json()) for index, layout in layouts.items()})


def _drawn(rng: np.random.Generator) -> Layout:
    while True:
        layout = train_layout(rng)
        if goal_pairs(layout):
            return layout
