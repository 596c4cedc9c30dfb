"""The training layouts: generated once from training seeds and stored as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tqdm import tqdm

from labgym.layouts import Layout
from labgym.layouts.splits import train_layout
from labgym.navigation import goal_pairs


def layout_pool(folder: str | Path, count: int, seed: int = 0, progress: bool = True) -> tuple[Layout, ...]:
    """Return training layouts that have a drive; missing ones are generated and stored.

    Layout i depends on the seed and i alone: a larger pool begins with the smaller one.

    Args:
        folder: folder of the pools; each seed has a subfolder.
        count: number of layouts.
        seed: random seed of the pool.
        progress: whether to show a progress bar while layouts are generated.

    Raises:
        DocumentError: a file is broken; if it is removed, it is generated again.
    """
    home = Path(folder) / f"seed-{seed}"
    paths = [home / f"{index:05d}.json" for index in range(count)]
    missing = [index for index, path in enumerate(paths) if not path.exists()]
    for index in tqdm(missing, desc="training layouts", disable=not (progress and missing)):
        _drawn(np.random.default_rng([seed, index])).save(paths[index])
    return tuple(Layout.load(path) for path in paths)


def _drawn(rng: np.random.Generator) -> Layout:
    while True:
        layout = train_layout(rng)
        if goal_pairs(layout):
            return layout
