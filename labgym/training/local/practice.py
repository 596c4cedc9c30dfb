"""The episodes to practice on: drives of every task of LabNav on training floors, as files of a run."""

from __future__ import annotations

import warnings
from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, json_bytes, parse_json
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.tasks import HEADLINE, TASKS
from labgym.envs.training import training_floor
from labgym.errors import SearchLimitWarning
from labgym.layouts import Layout
from labgym.layouts.batch import catalog_digest
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards

FOLDER = "practice"
DRAWS = 60
"""Number of drives that are drawn on a floor for a task; some floors have none."""


class PracticeFloor(Document):
    """A training floor and drives of each task on it.

    Attributes:
        floor: number of the floor in the split "floors-train". layout_hash: of its layout.
        episodes: by the name of the task.
    """

    SCHEMA: ClassVar[str] = "labgym.practice-floor/1"

    floor: Annotated[int, Field(ge=0)]
    layout_hash: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    episodes: dict[str, tuple[LabNavEpisode, ...]]


def practice_floors(
    run: RunFolder, count: int, per_task: int, seed: int = 0, executor: ExecutorOptions | None = None
) -> tuple[Path, ...]:
    """Return the files of some training floors with their drives; those that the run does not hold are drawn.

    Args:
        run: the run, which gets the files `practice/00000.json` and `practice/00000-layout.json`.
        count: number of floors. per_task: most drives of each task on a floor.
        seed: random seed of the drives.
        executor: where they are drawn.
    """
    shards = [Shard(f"{FOLDER} {number:05d}", draw_practice, (number, per_task, seed)) for number in range(count)]
    guard = {"catalog": catalog_digest}
    for _ in run_shards(shards, run, executor, "training floors", "floor", guard):
        pass
    return tuple(run.path / FOLDER / f"{number:05d}.json" for number in range(count))


def draw_practice(number: int, per_task: int, seed: int) -> ShardOutput:
    """Return the files of a training floor; they depend on the arguments alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the floor holds is no loss here.
        layout = training_floor(number)
    episodes = {task: draw_floor(layout, task, HEADLINE, per_task, seed, DRAWS)[0] for task in TASKS}
    floor = PracticeFloor(floor=number, layout_hash=layout.hash, episodes=episodes)
    name = f"{FOLDER}/{number:05d}"
    return ShardOutput(
        {f"{name}.json": json_bytes(floor.to_json()), f"{name}-layout.json": json_bytes(layout.to_json())}
    )


@lru_cache(maxsize=6)
def read_floor(path: Path) -> tuple[Layout, PracticeFloor]:
    """Return a training floor and its drives.

    Raises:
        DocumentError: a file cannot be read.
    """
    floor = PracticeFloor.load(path)
    file = path.with_name(f"{path.stem}-layout.json")
    return Layout.parse(parse_json(file.read_bytes(), file), file), floor
