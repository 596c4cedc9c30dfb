"""The episodes to practice on: drives of every task of LabNav on training floors, as files of a run.

The drafts on floors-val, by which policies are judged while they learn, have the same form.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, canonical_hash, json_bytes, parse_json, write_bytes
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode, published_episodes
from labgym.envs.labnav.tasks import HEADLINE, TASKS
from labgym.envs.training import training_floor
from labgym.errors import LabgymError, SearchLimitWarning
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.manifest import MANIFEST_FILE, file_digest

FOLDER, VALIDATION, LAYOUT = "practice", "validation", "-layout"
SEED = 0
"""Random seed of the drives; the floors differ by their numbers."""
DRAWS = 60
"""Number of drives that are drawn on a floor for a task; some floors have none."""


class PracticeFloor(Document):
    """A floor and drives of each task on it.

    Attributes:
        floor: id of the layout. layout_hash: of the layout.
        episodes: by the name of the task.
    """

    SCHEMA: ClassVar[str] = "labgym.practice-floor/1"

    floor: Annotated[str, Field(max_length=100)]
    layout_hash: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    episodes: dict[str, tuple[LabNavEpisode, ...]]


def make_practice(
    out: Path, count: int, per_task: int, executor: ExecutorOptions | None = None, fresh: bool = False
) -> tuple[Path, ...]:
    """Draw training floors with their drives into a folder, or resume, and return their files.

    Args:
        out: the folder, which gets the files `practice/00000.json` and `practice/00000-layout.json`.
        count: number of floors. per_task: most drives of each task on a floor.
        executor: where they are drawn. fresh: move the files of the folder aside and start anew.

    Raises:
        OptionError: the folder is in use, or holds other floors.
        DocumentError: a finished file was changed.
    """
    identity = RunIdentity.of("practice", count=count, per_task=per_task, draws=DRAWS, catalog=catalog_digest())
    shards = [Shard(f"{FOLDER} {number:05d}", draw_practice, (number, per_task)) for number in range(count)]
    guard = {"catalog": catalog_digest}
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            for _ in run_shards(shards, run, executor, "training floors", "floor", guard):
                pass
            run.finish({})
    return practice_files(out)


def practice_files(folder: Path) -> tuple[Path, ...]:
    """Return the files of the floors in a folder of `make_practice`.

    Raises:
        LabgymError: the folder holds none, or is unfinished.
    """
    if not (folder / MANIFEST_FILE).is_file():
        raise LabgymError(f"{folder} holds no finished practice floors: labgym train local-practice --out {folder}")
    return tuple(sorted(file for file in (folder / FOLDER).glob("*.json") if not file.stem.endswith(LAYOUT)))


def digest_of(floors: Sequence[Path]) -> str:
    """Return a digest of practice floors."""
    return canonical_hash([file_digest(floor) for floor in floors])


def draw_practice(number: int, per_task: int) -> ShardOutput:
    """Return the files of a training floor; they depend on the arguments alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the floor holds is no loss here.
        layout = training_floor(number)
    episodes = {task: draw_floor(layout, task, HEADLINE, per_task, SEED, DRAWS)[0] for task in TASKS}
    return ShardOutput(_files(f"{FOLDER}/{number:05d}", layout, episodes))


def validation_floors(out: Path) -> tuple[Path, ...]:
    """Write the floors of floors-val with the drafts of all tasks into a folder, and return their files."""
    suites = {task: published_episodes(task, HEADLINE, development=True) for task in TASKS}
    floors = sorted({floor for suite in suites.values() for floor in suite.floors})
    paths = []
    for floor in floors:
        suite = next(each for each in suites.values() if floor in each.floors)
        episodes = {task: each.floors.get(floor, ()) for task, each in suites.items()}
        for name, content in _files(f"{VALIDATION}/{floor}", suite.layout(floor), episodes).items():
            write_bytes(out / name, content)
        paths.append(out / VALIDATION / f"{floor}.json")
    return tuple(paths)


def _files(name: str, layout: Layout, episodes: dict[str, tuple[LabNavEpisode, ...]]) -> dict[str, bytes]:
    """Return the files of a floor with its drives."""
    floor = PracticeFloor(floor=layout.id, layout_hash=layout.hash, episodes=episodes)
    return {f"{name}.json": json_bytes(floor.to_json()), f"{name}{LAYOUT}.json": json_bytes(layout.to_json())}


@lru_cache(maxsize=6)
def read_floor(path: Path) -> tuple[Layout, PracticeFloor]:
    """Return a training floor and its drives.

    Raises:
        DocumentError: a file cannot be read.
    """
    floor = PracticeFloor.load(path)
    file = path.with_name(f"{path.stem}{LAYOUT}.json")
    return Layout.parse(parse_json(file.read_bytes(), file), file), floor
