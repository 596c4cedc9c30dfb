"""The episodes of a suite: a document that holds all that an episode needs besides its floor."""

from __future__ import annotations

import json
import math
from collections.abc import Container, Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, model_validator

from labgym.artefacts import artefacts
from labgym.documents import Document, Growing, Record, canonical_hash, write_text
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.envs.labnav.tasks import TaskName, condition_names
from labgym.envs.tasks import Task
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.json_stream import stream_json
from labgym.layouts import Layout, load_published
from labgym.layouts.sealed import SECRET_SPLITS
from labgym.navigation import GoalPair
from labgym.navigation.goals import ANYWHERE
from labgym.suites import Coordinate

FOLDER = "labnav"
BENCHMARK: Literal["floors-test"] = "floors-test"
"""Split of the floors of the benchmark."""
DEVELOPMENT = "val"
"""Folder, and part of the names, of the suites on floors-val."""
UNFILTERED = "unfiltered"
"""End of the name of a suite whose drives are all that have a path."""
Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Angle = Annotated[float, Field(ge=-7.0, le=7.0)]
EpisodePose = tuple[Coordinate, Coordinate, Angle]
MAX_EPISODES = 10_000
Split = Literal["floors-val", "floors-seen", "floors-test", "floors-sealed", "floors-fresh"]


class LabNavLeg(Record):
    """A later drive of an episode.

    Attributes:
        goal: pose (x, y, yaw) in the room frame, meters and radians. location: name of the place.
        length: L* from the goal before, meters.
    """

    goal: EpisodePose
    location: Annotated[str, Field(max_length=100)] = ANYWHERE
    length: Annotated[float, Field(gt=0.0, le=1000.0)]


class LabNavEpisode(Growing):
    """An episode.

    Attributes:
        floor, floor_hash: id and hash of the published floor.
        number: among the episodes of the floor, from 0.
        start, goal: poses (x, y, yaw) in the room frame, meters and radians.
        start_location, goal_location: names of the two places.
        conditions: data of the conditions by name.
        seed: of the environment: errors of sensors, and what conditions draw on the way.
        length: L*, the shortest path of the 0.30 m disc to the success disc on the true floor, through what the robot
            can push, meters.
        following: the drives after the first one, in their order.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"following"})

    floor: Annotated[str, Field(max_length=100)]
    floor_hash: Hash
    number: Annotated[int, Field(ge=0, le=10_000)]
    start: EpisodePose
    goal: EpisodePose
    start_location: Annotated[str, Field(max_length=100)] = ANYWHERE
    goal_location: Annotated[str, Field(max_length=100)] = ANYWHERE
    conditions: Annotated[dict[str, Any], Field(default_factory=dict, max_length=16)]
    seed: Annotated[int, Field(ge=0, le=2**53)]
    length: Annotated[float, Field(gt=0.0, le=1000.0)]
    following: Annotated[tuple[LabNavLeg, ...], Field(max_length=MOST_LEGS - 1)] = ()

    @property
    def key(self) -> str:
        """Floor and number: identifies the episode within a suite."""
        return f"{self.floor}/{self.number}"

    @property
    def pair(self) -> GoalPair:
        """The drive."""
        return GoalPair(self.number, self.start, self.goal, self.start_location, self.goal_location)

    @property
    def pairs(self) -> tuple[GoalPair, ...]:
        """All drives, each from the goal before."""
        pairs = [self.pair]
        for leg in self.following:
            last = pairs[-1]
            pairs.append(GoalPair(last.index + 1, last.goal, leg.goal, last.goal_location, leg.location))
        return tuple(pairs)

    @property
    def lengths(self) -> tuple[float, ...]:
        """L* of all drives, meters."""
        return (self.length, *(leg.length for leg in self.following))

    def task(self, layout: Layout) -> Task:
        """Return the task on the floor, as it is before the conditions."""
        return Task(layout, layout.protocol, self.pair, self.pairs[1:], conditions=self.conditions)


class Draws(Record):
    """How many drives were drawn on a floor, and how many of them were accepted."""

    drawn: Annotated[int, Field(ge=0)]
    accepted: Annotated[int, Field(ge=0)]


class LabNavEpisodes(Document):
    """The episodes of a task at a level.

    Attributes:
        task, level: name and number. version: rises with every change of episodes or rules.
        draft: whether the episodes may still change.
        filtered: whether the drives have the properties of the task and level, such as length and neck; otherwise they
            are all that have a path.
        split: of the floors. seed: random seed of the draw; that of sealed and fresh suites follows from their secret.
        episodes: by floor and number. draws: acceptance by floor, of all floors that were tried.
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-episodes/1"

    task: Annotated[TaskName, Field(pattern=r"^[a-z]{1,20}$")]
    level: Annotated[int, Field(ge=1, le=3)]
    version: Annotated[int, Field(ge=0)] = 0
    draft: bool = True
    filtered: bool = True
    split: Split
    seed: Annotated[int, Field(ge=0, le=2**53)]
    episodes: Annotated[tuple[LabNavEpisode, ...], Field(min_length=1, max_length=MAX_EPISODES)]
    draws: Annotated[dict[str, Draws], Field(default_factory=dict, max_length=10_000)]
    _unpublished: dict[str, Layout] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _check_keys(self) -> Self:
        keys = [each.key for each in self.episodes]
        if len(set(keys)) < len(keys):
            raise ValueError("two episodes have the same floor and number")
        names = condition_names(self.task, self.level)
        for episode in self.episodes:
            for name in episode.conditions:
                if name not in names:
                    raise ValueError(str(UnknownNameError(f"condition of {self.task}-{self.level}", name, names)))
        return self

    @classmethod
    def _read(cls, path: str | Path) -> Any:
        return stream_json(path, cls.SCHEMA, "episodes", LabNavEpisode, MAX_EPISODES)

    @property
    def name(self) -> str:
        """Name of the suite."""
        return f"{FOLDER}-{self.task}-{self.level}" + ("" if self.filtered else f"-{UNFILTERED}")

    @property
    def label(self) -> str:
        """Name and version, whether it is a draft, and floors other than the benchmark's, as reports print them."""
        elsewhere = "" if self.split == BENCHMARK else f" on {self.split}"
        return f"{self.name}/{self.version}{elsewhere}" + (" (draft)" if self.draft else "")

    @property
    def hash(self) -> str:
        """SHA-256 of the document."""
        return canonical_hash(self.to_json())

    @property
    def text(self) -> str:
        """Content of the file: JSON with an episode a line."""
        fields = self.to_json()
        lines = ",\n".join(f"  {_line(each)}" for each in fields.pop("episodes"))
        head = "".join(f" {_line(name)}: {_line(value)},\n" for name, value in fields.items())
        return f'{{\n{head} "episodes": [\n{lines}\n ]\n}}\n'

    def save(self, path: str | Path) -> Path:
        """Write the document atomically and return its path."""
        return write_text(path, self.text)

    @property
    def floors(self) -> dict[str, tuple[LabNavEpisode, ...]]:
        """The episodes by floor, in their order."""
        floors: dict[str, list[LabNavEpisode]] = {}
        for each in self.episodes:
            floors.setdefault(each.floor, []).append(each)
        return {name: tuple(each) for name, each in floors.items()}

    def layout(self, floor: str) -> Layout:
        """Return a floor.

        Raises:
            DocumentError: its hash is not that of the episodes.
            UnknownNameError: the split has no such floor, or the episodes do not bring it.
            OptionError: the floors follow from a secret, and the episodes bring none.
        """
        brought = self._unpublished
        if not brought and self.split in SECRET_SPLITS:
            raise OptionError(f"the floors of {self.split} are not published: pass their folder (--layouts)")
        if brought and floor not in brought:
            raise UnknownNameError(f"layout of {self.label}", floor, brought)
        layout = brought[floor] if brought else load_published(self.split, floor)
        expected = next(each.floor_hash for each in self.episodes if each.floor == floor)
        if layout.hash != expected:
            raise DocumentError(self.name, f"episodes of {floor}", f"their floor has the hash {expected[:12]}")
        return layout

    def on(self, layouts: Iterable[Layout]) -> LabNavEpisodes:
        """Return the episodes with their floors, which then need not be published."""
        copy = self.model_copy()
        copy._unpublished = {layout.id: layout for layout in layouts}
        return copy

    def first(self, floors: int | None, per_floor: int, goals: int | None = None) -> LabNavEpisodes:
        """Return the episodes of the first floors, at most `per_floor` on each, with their first goals."""
        names = list(self.floors)[:floors]
        chosen = tuple(each for name in names for each in self.floors[name][:per_floor])
        if goals is not None:
            chosen = tuple(one.model_copy(update={"following": one.following[: goals - 1]}) for one in chosen)
        return self.model_copy(update={"episodes": chosen})

    @property
    def by_key(self) -> dict[str, LabNavEpisode]:
        """The episodes by task, level, floor and number, such as "aisle-2/floors-test-0000/1"."""
        return {f"{self.task}-{self.level}/{one.key}": one for one in self.episodes}

    def only(self, keys: Container[str]) -> LabNavEpisodes | None:
        """Return the episodes with some keys, such as "aisle-2/floors-test-0000/1"; None if it has none of them."""
        chosen = tuple(one for key, one in self.by_key.items() if key in keys)
        return self.model_copy(update={"episodes": chosen}) if chosen else None


def _line(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


class EpisodeTasks:
    """The tasks of one floor's episodes: the reset option "episode" chooses one by its number.

    Args:
        layout: the floor. episodes: on it.
    """

    def __init__(self, layout: Layout, episodes: tuple[LabNavEpisode, ...]) -> None:
        self._tasks = {each.number: each.task(layout) for each in episodes}

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:  # noqa: ARG002
        """Return the task of an episode, the first by default.

        Raises:
            UnknownNameError: an option or an episode does not exist.
        """
        for name in options:
            if name != "episode":
                raise UnknownNameError("reset option", name, ("episode",))
        number = options.get("episode", min(self._tasks))
        if number not in self._tasks:
            raise UnknownNameError("episode", number, map(str, self._tasks))
        return self._tasks[number]

    def close(self) -> None:
        """Do nothing."""


def suite_file(name: str) -> Path:
    """Return the path of the episodes of a suite such as "labnav-aisle-2" or "labnav-val-aisle-2"."""
    folder, name = artefacts("eval") / FOLDER, name.removeprefix(f"{FOLDER}-")
    if name.startswith(f"{DEVELOPMENT}-"):
        folder, name = folder / DEVELOPMENT, name.removeprefix(f"{DEVELOPMENT}-")
    return folder / f"{name}.json"


def published_episodes(task: str, level: int, filtered: bool = True, development: bool = False) -> LabNavEpisodes:
    """Return the published episodes of a task at a level.

    Args:
        task, level: of LabNav. filtered: whether they have the properties of the task; False for all drives.
        development: whether they are on floors-val.

    Raises:
        UnknownNameError: they are not published.
        DocumentError: the file is broken.
    """
    folder = f"{FOLDER}-{DEVELOPMENT}" if development else FOLDER
    name = f"{folder}-{task}-{level}" + ("" if filtered else f"-{UNFILTERED}")
    path = suite_file(name)
    if not path.is_file():
        names = sorted(f"{folder}-{each.stem}" for each in path.parent.glob("*-[123]*.json"))
        raise UnknownNameError("LabNav suite", name, names)
    return _loaded(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=16)
def _loaded(path: Path, changed: int) -> LabNavEpisodes:  # noqa: ARG001 - a file that was changed is read again
    return LabNavEpisodes.load(path)


def straight(episode: LabNavEpisode) -> float:
    """Return the straight distance from start to goal, meters; of several drives the sum."""
    return math.fsum(math.dist(pair.start[:2], pair.goal[:2]) for pair in episode.pairs)
