"""A pack of training floors with drawn episodes of all LabNav tasks at levels 0 to 3, as files that load fast."""

from __future__ import annotations

import gzip
import json
import warnings
import zlib
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from labgym.documents import Document, canonical_hash, json_bytes, parse_json, read_json, validating
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.tasks import TASKS
from labgym.envs.tasks import Task
from labgym.envs.training import training_floor
from labgym.envs.training_layouts import TURN_EPISODES
from labgym.envs.world import keep
from labgym.errors import DocumentError, LabgymError, OptionError, SearchLimitWarning, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards

INDEX, FOLDER = "pack.json", "floors"
LEVELS = (0, 1, 2, 3)
SEED = 0
"""Random seed of the episodes; the floors differ by their numbers."""
DRAWS = 60
"""Number of drives that are drawn on a floor for a task at a level; some floors have none."""
MAX_FLOOR_BYTES = 64 * 2**20
"""Largest size of an unpacked floor."""
FLOORS_IN_MEMORY = 64
FloorName = Annotated[str, Field(pattern=r"^floors/\d{5}\.json\.gz$")]


class FloorPack(Document):
    """The index of a pack.

    Attributes:
        floors: names of the files of floors, in their order.
        episodes: number of episodes on each floor, by task and level, such as "aisle-2".
        digest: SHA-256 over the SHA-256 of the unpacked floors.
    """

    SCHEMA: ClassVar[str] = "labgym.floor-pack/1"

    floors: Annotated[tuple[FloorName, ...], Field(min_length=1, max_length=100_000)]
    episodes: Annotated[dict[str, tuple[Annotated[int, Field(ge=0)], ...]], Field(max_length=1000)]
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, counts in self.episodes.items():
            if len(counts) != len(self.floors):
                raise ValueError(f"episodes of {name[:40]!r} are counted on {len(counts)} of {len(self.floors)} floors")
        return self


def make_pack(
    out: Path, count: int, per_level: int, executor: ExecutorOptions | None = None, fresh: bool = False
) -> FloorPack:
    """Draw training floors with their episodes into a folder, or resume, and return the index.

    The files depend on the numbers alone, not on the executor. A floor takes about 17 CPU s.

    Args:
        out: the folder, which gets `pack.json` and `floors/00000.json.gz`.
        count: number of floors. per_level: most episodes of each task and level on a floor.
        executor: where they are drawn. fresh: move the files of the folder aside and start anew.

    Raises:
        OptionError: the folder is in use, or holds another pack.
        DocumentError: a finished file was changed.
    """
    levels = canonical_hash(
        {f"{name}-{level}": repr(task.level(level)) for name, task in TASKS.items() for level in LEVELS}
    )
    identity = RunIdentity.of(
        "floor-pack", count=count, per_level=per_level, draws=DRAWS, catalog=catalog_digest(), levels=levels
    )
    shards = [Shard(f"{FOLDER} {number:05d}", draw_pack_floor, (number, per_level)) for number in range(count)]
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            records = {
                shard.name: output.record
                for shard, output in run_shards(
                    shards, run, executor, "training floors", "floor", {"catalog": catalog_digest}
                )
            }
            ordered = [records[shard.name] for shard in shards]
            keys = sorted({key for record in ordered for key in record["episodes"]})
            pack = FloorPack(
                floors=tuple(record["file"] for record in ordered),
                episodes={key: tuple(record["episodes"].get(key, 0) for record in ordered) for key in keys},
                digest=canonical_hash([record["digest"] for record in ordered]),
            )
            run.finish({INDEX: json_bytes(pack.to_json())})
    return read_pack(out)


def draw_pack_floor(number: int, per_level: int) -> ShardOutput:
    """Return the file of a training floor; it depends on the arguments alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the floor holds is no loss here.
        layout = training_floor(number)
    episodes: dict[str, list[Any]] = {}
    for task in TASKS:
        for level in LEVELS:
            drawn = draw_floor(layout, task, level, per_level, SEED, DRAWS)[0]
            if drawn:
                episodes[f"{task}-{level}"] = [episode.model_dump(mode="json") for episode in drawn]
    data = {"layout": layout.to_json(), "episodes": episodes}
    raw = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    name = f"{FOLDER}/{number:05d}.json.gz"
    record = {
        "file": name,
        "digest": canonical_hash(data),
        "episodes": {key: len(drawn) for key, drawn in episodes.items()},
    }
    return ShardOutput({name: gzip.compress(raw, 9, mtime=0)}, record)


def read_pack(folder: str | Path) -> FloorPack:
    """Return the index of a pack.

    Raises:
        LabgymError: the folder holds no finished pack.
        DocumentError: the index is damaged.
    """
    path = Path(folder) / INDEX
    if not path.is_file():
        raise LabgymError(f"{folder} holds no finished pack of floors: labgym train floors --out {folder}")
    return FloorPack.parse(read_json(path), path)


@lru_cache(maxsize=FLOORS_IN_MEMORY)
def _floor(path: Path) -> tuple[Layout, dict[str, Any]]:
    """Return a floor of a pack, and its episodes as plain data.

    Raises:
        DocumentError: the file is missing or damaged.
    """
    try:
        unpacker = zlib.decompressobj(31)
        raw = unpacker.decompress(path.read_bytes(), MAX_FLOOR_BYTES)
        if not unpacker.eof:
            raise DocumentError(path, "", f"is cut off, or unpacks to more than {MAX_FLOOR_BYTES} bytes")
    except (OSError, zlib.error) as error:
        raise DocumentError(path, "", f"cannot be read ({error})") from None
    data = parse_json(raw, path)
    if not isinstance(data, Mapping) or set(data) != {"layout", "episodes"} or not isinstance(data["episodes"], dict):
        raise DocumentError(path, "", "is no floor of a pack: expected layout and episodes")
    return Layout.parse(data["layout"], path), data["episodes"]


class PackTasks:
    """Draws the episodes of a task at a level from a pack: a floor for up to 8 episodes, then another one.

    The reset options "floor", a place in the pack, and "episode", a number on the floor, choose.

    Args:
        folder: of the pack. name: task and level, such as "aisle-2". resident_mb: budget of this process for prepared
            layouts, megabytes.

    Raises:
        LabgymError: the folder holds no pack.
        OptionError: no floor has an episode of the task at the level.
    """

    def __init__(self, folder: str | Path, name: str, resident_mb: float) -> None:
        self._folder, self._name, self._resident_mb = Path(folder), name, resident_mb
        self._pack = read_pack(folder)
        counts = self._pack.episodes.get(name, ())
        self._floors = [place for place, count in enumerate(counts) if count]
        if not self._floors:
            raise OptionError(f"pack {str(folder)!r} has no episode of {name}: make one with more floors")
        self._place, self._left = -1, 0

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task.

        Raises:
            UnknownNameError: an option, floor or episode does not exist.
        """
        for name in options:
            if name not in ("floor", "episode"):
                raise UnknownNameError("reset option", name, ("floor", "episode"))
        if fresh or self._left == 0:
            self._place, self._left = self._floors[int(rng.integers(len(self._floors)))], TURN_EPISODES
        self._left -= 1
        place = options.get("floor", self._place)
        if place not in self._floors:
            raise UnknownNameError(f"floor with episodes of {self._name}", place, map(str, self._floors))
        path = self._folder / self._pack.floors[place]
        layout, episodes = _floor(path)
        drawn = episodes.get(self._name)
        if not isinstance(drawn, list) or not drawn:
            raise DocumentError(path, f"episodes.{self._name}", "expected a list of episodes, as the index counts them")
        number = options.get("episode")
        number = int(rng.integers(len(drawn))) if number is None else number
        if number not in range(len(drawn)):
            raise UnknownNameError("episode", number, map(str, range(len(drawn))))
        with validating(path, "episodes", self._name, number):
            episode = LabNavEpisode.model_validate(drawn[number])
        keep(layout, self._resident_mb)
        return episode.task(layout)

    def close(self) -> None:
        """Do nothing."""


def described(pack: FloorPack) -> str:
    """Return a line on a pack: floors, episodes and digest."""
    total = Counter({key: sum(counts) for key, counts in pack.episodes.items()})
    return f"{len(pack.floors)} floors, {sum(total.values())} episodes of {len(total)} tasks and levels, {pack.digest}"
