"""Training layouts, and drives between the places of a laboratory and between points of its floor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.documents import json_bytes, parse_json
from labgym.envs.tasks import Task
from labgym.envs.world import keep
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.layouts.splits import train_layout
from labgym.navigation import PLANNING_RADIUS, GoalPair, goal_pairs, goal_poses, occupancy
from labgym.navigation.goals import ANYWHERE, resolve_protocol, same_place
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards

LAYOUTS_PER_SHARD = 5

POOL_MB = 4096.0
"""Default budget for the prepared layouts of a pool, megabytes: 120 rooms take 0.2 GB with the lidar, 2.4 GB with
a camera."""


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
    parts = [range(first, min(first + LAYOUTS_PER_SHARD, count)) for first in range(0, count, LAYOUTS_PER_SHARD)]
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


class TrainingDrives:
    """A source of tasks: draws a layout of a pool, then a drive in it.

    Half of the drives go from a place of the protocol to another such place, half from a point of the free floor, at
    any heading, to another point. Drives with a straight distance above `farthest` are left out, unless a layout has
    no shorter one.

    Args:
        layouts: the pool; each is prepared once, if all fit the budget.
        seed: random seed of the points on the floor.
        points: pairs of points per layout.
        resident_mb: budget of the process for prepared layouts, megabytes.

    Attributes:
        farthest: largest straight distance of a drive, meters; training raises it.
    """

    def __init__(
        self, layouts: Sequence[Layout], seed: int = 0, points: int = 24, resident_mb: float = POOL_MB
    ) -> None:
        self.farthest = math.inf
        self._layouts = tuple(layouts)
        self._seed, self._points = seed, points
        self._resident_mb = resident_mb
        self._drives: dict[int, tuple[tuple[GoalPair, ...], tuple[GoalPair, ...]]] = {}

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:  # noqa: ARG002
        """Return the next drive; it depends on the generator alone, and there are no options."""
        index = int(rng.integers(len(self._layouts)))
        layout = self._layouts[index]
        keep(layout, self._resident_mb)
        places, points = self._drives.get(index) or self._drives.setdefault(index, self._drives_in(index))
        candidates = points if points and rng.random() < 0.5 else places
        near = [pair for pair in candidates if _straight(pair) <= self.farthest] or [min(candidates, key=_straight)]
        pair = near[int(rng.integers(len(near)))]
        if pair.start_location == ANYWHERE:
            pair = replace(pair, start=(*pair.start[:2], float(rng.uniform(-math.pi, math.pi))))
        return Task(layout, resolve_protocol(layout, None), pair)

    def close(self) -> None:
        """Keep the layouts: another environment may share this source."""

    def _drives_in(self, index: int) -> tuple[tuple[GoalPair, ...], tuple[GoalPair, ...]]:
        layout = self._layouts[index]
        poses = list(goal_poses(layout).items())
        places = [(a, b) for a in poses for b in poses if not same_place(a[1], b[1])]
        return (
            tuple(GoalPair(k, a[1], b[1], a[0], b[0]) for k, (a, b) in enumerate(places)),
            tuple(_point_pairs(layout, np.random.default_rng([self._seed, index]), self._points)),
        )


def _straight(pair: GoalPair) -> float:
    return math.dist(pair.start[:2], pair.goal[:2])


def _point_pairs(layout: Layout, rng: np.random.Generator, count: int) -> list[GoalPair]:
    """Return drives between cells of the largest free region of the floor that are at least 1 m apart."""
    grid = occupancy(layout).dilated(PLANNING_RADIUS)
    sizes = np.bincount(grid.components.ravel())[1:]
    if len(sizes) == 0:
        return []
    rows, columns = np.nonzero(grid.components == 1 + int(np.argmax(sizes)))
    pairs: list[GoalPair] = []
    for _ in range(4 * count):
        start, goal = (grid.centre_of(int(rows[k]), int(columns[k])) for k in rng.integers(len(rows), size=2))
        if math.dist(start, goal) >= 1.0 and len(pairs) < count:
            pairs.append(GoalPair(len(pairs), (*start, 0.0), (*goal, 0.0), ANYWHERE, ANYWHERE))
    return pairs
