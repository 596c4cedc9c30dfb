"""Describes splits of floors: their floors and episodes, the blind policies, and the bars."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from labgym.documents import Document, json_bytes
from labgym.errors import OptionError, check_name
from labgym.eval.variety.figures import BLIND_FLOORS, GroupFigures, group_figures
from labgym.eval.variety.rows import DriveRow, FloorRow, drive_blind, survey
from labgym.eval.variety.sketch import FloorSketch
from labgym.layouts.floors import SPLITS
from labgym.layouts.places import FIRST_SEEDS, LAST_DEVELOPMENT_SEED, check_numbers
from labgym.layouts.splits import published as published_ids
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, run_shards

CELLS = 128
"""Number of cells along each side of a floor."""
ALIKE = 1.25
"""Floors whose areas, longer sides and shorter sides differ by at most this factor are of about one size."""

Mask = NDArray[np.bool_]


def occupied(floor: FloorSketch) -> Mask:
    """Return the cells that furniture without clutter takes, (128, 128).

    The bounds of the floor are stretched onto a square, so that walls of floors of different sizes coincide.
    """
    middles = (np.arange(CELLS) + 0.5) / CELLS
    px, py = np.meshgrid(floor.extent[0] + middles * floor.size[0], floor.extent[1] + middles * floor.size[1])
    taken = np.zeros((CELLS, CELLS), dtype=bool)
    for x, y, width, depth, yaw in floor.furniture.tolist():
        cosine, sine = math.cos(yaw), math.sin(yaw)
        dx, dy = px - x, py - y
        along, across = np.abs(dx * cosine + dy * sine), np.abs(dy * cosine - dx * sine)
        taken |= (along <= width / 2.0) & (across <= depth / 2.0)
    return taken


def best_overlap(first: Mask, second: Mask) -> float:
    """Return the largest intersection over union of two square masks, the second turned and mirrored; 0 if empty."""
    best = 0.0
    for image in symmetries(second):
        union = np.count_nonzero(first | image)
        best = max(best, np.count_nonzero(first & image) / union if union else 0.0)
    return best


def symmetries(image: Mask) -> Iterator[Mask]:
    """Yield the eight turned and mirrored images of a square mask."""
    for mirrored in (image, image[:, ::-1]):
        for quarter in range(4):
            yield np.rot90(mirrored, quarter)


def overlaps(floors: Sequence[FloorSketch], areas: Sequence[float]) -> list[float]:
    """Return the best overlap of each pair of floors of about one size."""
    images = [occupied(floor) for floor in floors]
    sizes = [(area, max(floor.size), min(floor.size)) for floor, area in zip(floors, areas, strict=True)]
    pairs = (
        (a, b)
        for a, b in combinations(range(len(floors)), 2)
        if all(max(one, other) <= ALIKE * min(one, other) for one, other in zip(sizes[a], sizes[b], strict=True))
    )
    return [best_overlap(images[a], images[b]) for a, b in pairs]


KIND = "describe"
_Item = TypeVar("_Item")
SUMMARY, FLOORS, DRIVES = "summary.json", "floors.jsonl", "drives.jsonl"
TOGETHER = 6
"""Number of floors in a shard of the blind policies."""


class SplitsSummary(Document):
    """The figures of splits of floors, `summary.json`.

    Attributes:
        floors: number of floors of each family.
        episodes: number of episodes of each floor, at most.
        seed: first development seed; null for the splits' own seeds.
        known: number of other floors whose furniture the blind policies know.
        groups: each split's families, then the whole split.
    """

    SCHEMA: ClassVar[str] = "labgym.splits/1"

    floors: int
    episodes: int
    seed: int | None
    known: int
    groups: tuple[GroupFigures, ...]


@dataclass(frozen=True)
class SplitsDescription:
    """A description of splits of floors.

    Attributes:
        summary: the figures.
        floors, drives: the rows they are computed from.
    """

    summary: SplitsSummary
    floors: tuple[FloorRow, ...]
    drives: tuple[DriveRow, ...]


def describe_splits(
    splits: Sequence[str] = ("floors-test",),
    floors: int = BLIND_FLOORS + 1,
    episodes: int = 12,
    seed: int | None = 0,
    out: str | Path | None = None,
    *,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
    published: bool = False,
) -> SplitsDescription:
    """Draw floors of splits and their episodes, and measure them.

    The result depends on the first four arguments and `published` alone, not on the executor; with a folder an
    interrupted description resumes.

    Args:
        splits: names of splits.
        floors: number of floors of each family; the blind policies know up to 90 others of them.
        episodes: number of episodes of each floor.
        seed: first development seed; None for the splits' own seeds.
        out: folder for `summary.json`, `floors.jsonl` and `drives.jsonl`; None writes nothing.
        executor: where the floors are made.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show progress bars.
        published: describe all published floors of the splits, in place of `floors` floors of a seed.

    Raises:
        UnknownNameError: there is no such split.
        OptionError: a number is out of range, the folder holds something else, the published splits have different
            numbers of floors, or this version's generator makes other floors than the published ones.
        InfeasibleError: no seed of a place gives a layout.
        LabgymError: workers died.
    """
    for split in splits:
        check_name("split of floors", split, FIRST_SEEDS)
    if published:
        floors, seed = _published_floors(splits), None
    seeds = seed or 0, 0, LAST_DEVELOPMENT_SEED
    check_numbers({"floors": (floors, 2, 10_000), "episodes": (episodes, 1, 1000), "seed": seeds})
    run = _Description(tuple(dict.fromkeys(splits)), floors, episodes, seed, executor, progress, published)
    if out is None:
        return run.made(None)
    identity = RunIdentity.of(KIND, splits=run.splits, floors=floors, episodes=episodes, seed=seed, published=published)
    with RunFolder.open(out, identity, fresh) as folder:
        if folder.finished:
            return _read(folder.path)
        description = run.made(folder)
        folder.finish(
            {
                SUMMARY: json_bytes(description.summary.to_json()),
                FLOORS: _lines(description.floors),
                DRIVES: _lines(description.drives),
            }
        )
    return description


@dataclass(frozen=True)
class _Family:
    """The floors of a family of a split, their drives and their sketches, in the order of the split."""

    split: str
    name: str
    floors: tuple[FloorRow, ...]
    drives: tuple[tuple[DriveRow, ...], ...]
    sketches: tuple[bytes, ...]


@dataclass(frozen=True)
class _Description:
    """A description that is being made."""

    splits: tuple[str, ...]
    floors: int
    episodes: int
    seed: int | None
    executor: ExecutorOptions | None
    progress: bool
    published: bool

    def made(self, folder: RunFolder | None) -> SplitsDescription:
        """Return the description; finished shards of the folder are taken from it."""
        families = list(self._driven_blind(list(self._surveyed(folder)), folder))
        groups: list[GroupFigures] = []
        for split in self.splits:
            own = [family for family in families if family.split == split]
            shares = [_overlaps(family) for family in own]
            groups += [
                group_figures(split, family.name, family.floors, _flat(family.drives), share)
                for family, share in zip(own, shares, strict=True)
            ]
            floors, drives = [row for f in own for row in f.floors], [row for f in own for row in _flat(f.drives)]
            groups.append(group_figures(split, None, floors, drives, _flat(shares)))
        summary = SplitsSummary(
            floors=self.floors,
            episodes=self.episodes,
            seed=self.seed,
            known=min(BLIND_FLOORS, self.floors - 1),
            groups=tuple(groups),
        )
        return SplitsDescription(
            summary,
            tuple(row for family in families for row in family.floors),
            tuple(row for family in families for row in _flat(family.drives)),
        )

    def _surveyed(self, folder: RunFolder | None) -> Iterator[_Family]:
        """Yield the families of all splits, their floors made and measured."""
        places = [(s, k) for s in self.splits for k in range(self.floors * len(SPLITS[s]))]
        shards = [Shard(_name(*place), survey, (*place, self.seed, self.episodes, self.published)) for place in places]
        run = run_shards(shards, folder, self.executor, "floors", "floor", progress=self.progress)
        done = {shard.name: output.files for shard, output in run}
        for split in self.splits:
            populations = SPLITS[split]
            for offset, population in enumerate(populations):
                names = [_name(split, k * len(populations) + offset) for k in range(self.floors)]
                records = [json.loads(_file(done[name], ".json")) for name in names]
                yield _Family(
                    split,
                    population.family,
                    tuple(FloorRow.model_validate(record["floor"]) for record in records),
                    tuple(tuple(DriveRow.model_validate(row) for row in record["drives"]) for record in records),
                    tuple(_file(done[name], ".npz") for name in names),
                )

    def _driven_blind(self, families: Sequence[_Family], folder: RunFolder | None) -> Iterator[_Family]:
        """Yield the families with the results of the blind policies."""
        shards = {}
        for number, family in enumerate(families):
            for first in range(0, len(family.floors), TOGETHER):
                chosen = range(first, min(first + TOGETHER, len(family.floors)))
                name = f"{family.split}-{family.name}-{first:05d}"
                reachable = [[row for row in family.drives[k] if row.length is not None] for k in chosen]
                arguments = (name, list(chosen), family.sketches, BLIND_FLOORS, reachable)
                shards[f"blind/{name}"] = number, chosen, Shard(f"blind/{name}", drive_blind, arguments, len(chosen))
        results: dict[tuple[int, int], list[tuple[bool, bool]]] = {}
        tasks = [shard for _, _, shard in shards.values()]
        for shard, output in run_shards(
            tasks, folder, self.executor, "blind policies", "floor", progress=self.progress
        ):
            number, chosen, _ = shards[shard.name]
            for k, free in zip(chosen, json.loads(_file(output.files, ".json")), strict=True):
                results[number, k] = free
        for number, family in enumerate(families):
            drives = tuple(_with_blind(rows, results[number, k]) for k, rows in enumerate(family.drives))
            yield _Family(family.split, family.name, family.floors, drives, family.sketches)


def _published_floors(splits: Sequence[str]) -> int:
    """Return the number of published floors of each family of some splits."""
    counts = {split: len(published_ids(split)) // len(SPLITS[split]) for split in splits}
    if len(set(counts.values())) != 1:
        numbers = ", ".join(f"{split} {count}" for split, count in counts.items())
        raise OptionError(f"published floors of each family: {numbers}; describe splits of one size at a time")
    return next(iter(counts.values()))


def _with_blind(rows: Sequence[DriveRow], free: Sequence[tuple[bool, bool]]) -> tuple[DriveRow, ...]:
    """Return drives with the blind policies' results for those that have a path."""
    results = iter(free)
    names = "blind", "blind_walls"
    return tuple(
        row if row.length is None else row.model_copy(update=dict(zip(names, next(results), strict=True)))
        for row in rows
    )


def _overlaps(family: _Family) -> list[float]:
    return overlaps([FloorSketch.from_bytes(s) for s in family.sketches], [floor.area for floor in family.floors])


def _name(split: str, index: int) -> str:
    return f"{split}/{index:05d}"


def _file(files: Mapping[str, bytes], suffix: str) -> bytes:
    return next(content for name, content in files.items() if name.endswith(suffix))


def _flat(parts: Iterable[Sequence[_Item]]) -> list[_Item]:
    return [item for part in parts for item in part]


def _lines(rows: Sequence[FloorRow] | Sequence[DriveRow]) -> bytes:
    return "".join(f"{row.model_dump_json()}\n" for row in rows).encode()


def _read(folder: Path) -> SplitsDescription:
    floors = [FloorRow.model_validate_json(line) for line in (folder / FLOORS).read_bytes().splitlines()]
    drives = [DriveRow.model_validate_json(line) for line in (folder / DRIVES).read_bytes().splitlines()]
    return SplitsDescription(SplitsSummary.load(folder / SUMMARY), tuple(floors), tuple(drives))
