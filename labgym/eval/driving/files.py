"""The files of an evaluation, a line of JSON for each episode: rows, routes, actions and planning times.

Rows, routes and actions are the same in every run; planning times are measured and kept in a separate file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Generic, Protocol, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from labgym.documents import Record, parse_json
from labgym.errors import DocumentError
from labgym.eval.driving.actions import StoredActions
from labgym.eval.driving.drive import DrivenEpisode
from labgym.eval.driving.episode_row import Count, Length, Pose, TransitionRow
from labgym.policies.registry import FILES, is_class_place

EPISODES, ROUTES, ACTIONS, TIMES = "episodes.jsonl", "routes.jsonl", "actions.jsonl", "times.jsonl"
SUMMARY = "summary.json"
MAX_LINE = 4 * 1024 * 1024
"""Longest line that is read, bytes: a route of 100,000 steps."""


class TransitionPlace(Record):
    """The fields by which the files of transitions name an episode, where those of LabNav have its key."""

    layout: str
    pair: Annotated[int, Field(ge=-1)]
    repeat: Count = 0


class EpisodeRecord(Record):
    """A record of the episode of a key."""

    key: str

    @model_validator(mode="before")
    @classmethod
    def _joined(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "layout" not in data:
            return data
        place = {name: data[name] for name in TransitionPlace.model_fields if name in data}
        key = "/".join(map(str, TransitionPlace(**place).model_dump().values()))
        return {name: value for name, value in data.items() if name not in place} | {"key": key}


class EpisodeRoute(EpisodeRecord):
    """A line of `routes.jsonl`: poses (x, y, yaw), meters and radians, rounded to 0.001."""

    poses: tuple[Pose, ...]


class EpisodeActions(EpisodeRecord):
    """A line of `actions.jsonl`: the policy's decisions, with which the episode can be simulated again."""

    actions: StoredActions


class EpisodeTime(EpisodeRecord):
    """A line of `times.jsonl`, which is measured.

    Attributes:
        planning_ms: mean wall-clock milliseconds of the policy per action; None without an action. In transitions the
            time of its reset is added.
        high_ms: 90th percentile of its actions.
        slow: whether that is longer than the latency of the drive, or than a control step if it is less.
    """

    planning_ms: Length | None
    high_ms: Length | None = None
    slow: bool = False


class KeyedRecord(Protocol):
    """A record with the key of its episode."""

    @property
    def key(self) -> str:
        """Identifies the episode within an evaluation."""
        ...

    @classmethod
    def model_validate(cls, obj: Any) -> Self:
        """Return the record in the data of a line."""
        ...


T = TypeVar("T", bound=KeyedRecord)


@dataclass(frozen=True)
class Lines(Generic[T]):
    """The lines of a file.

    Attributes:
        records: by episode, in the order of the file.
        problems: a sentence for each line that cannot be read or repeats an episode.
    """

    records: dict[str, T]
    problems: tuple[str, ...] = ()

    def checked(self, source: object, name: str) -> dict[str, T]:
        """Return the records of a file without problems.

        Args:
            source: the file in the error message.
            name: the file's name, with which the problems begin.

        Raises:
            DocumentError: a line cannot be read or repeats an episode, or the file is missing.
        """
        if self.problems:
            raise DocumentError(source, "", self.problems[0].removeprefix(f"{name} "))
        return self.records


def drive_files(drives: Iterable[DrivenEpisode[Any]]) -> dict[str, bytes]:
    """Return the content of rows, routes, actions and times of episodes, by the file's name."""
    drives = tuple(drives)
    routes = ({**drive.row.place, "poses": drive.route} for drive in drives)
    actions = ({**drive.row.place, "actions": drive.actions.model_dump(mode="json")} for drive in drives)
    times = (
        {**drive.row.place, "planning_ms": drive.planning_ms, "high_ms": drive.high_ms, "slow": drive.slow}
        for drive in drives
    )
    return {
        EPISODES: b"".join(record_line(drive.row) for drive in drives),
        ROUTES: b"".join(map(_line, routes)),
        ACTIONS: b"".join(map(_line, actions)),
        TIMES: b"".join(map(_line, times)),
    }


def read_records(path: str | Path, kind: type[T]) -> dict[str, T]:
    """Return the records of a file by episode.

    Raises:
        DocumentError: the file is missing, or a line cannot be read or repeats an episode.
    """
    path = Path(path)
    return read_lines(path, kind).checked(path, path.name)


def read_rows(path: str | Path) -> tuple[TransitionRow, ...]:
    """Return the rows of an `episodes.jsonl` of transitions, as `read_records`."""
    return tuple(read_records(path, TransitionRow).values())


def read_lines(path: Path, kind: type[T]) -> Lines[T]:
    """Return the records in a file, and a problem for each line that is left out.

    Args:
        path: the file.
        kind: type of the records.
    """
    if not path.is_file():
        return Lines({}, (f"{path.name} is missing",))
    with path.open("rb") as stream:
        return _read(path.name, stream, kind)


def parse_lines(name: str, content: bytes, kind: type[T]) -> dict[str, T]:
    """Return the records in the content of a file, by episode.

    Raises:
        DocumentError: a line cannot be read or repeats an episode.
    """
    return _read(name, BytesIO(content), kind).checked(name, name)


def _read(name: str, stream: BinaryIO, kind: type[T]) -> Lines[T]:
    problems: list[str] = []
    records = {record.key: record for _, record in each_record(name, stream, kind, problems)}
    return Lines(records, tuple(problems))


def each_record(
    name: str, stream: BinaryIO, kind: type[T], problems: list[str], most: int | None = None
) -> Iterator[tuple[int, T]]:
    """Yield the place, in bytes, and the record of each line of a file that can be read and repeats no episode.

    Args:
        name: of the file. stream: its content. kind: type of the records.
        problems: receives a sentence for each other line.
        most: number of lines after which reading stops; None for all.
    """
    keys = set()
    number = place = 0
    while (most is None or number < most) and (line := stream.readline(MAX_LINE)):
        number += 1
        begin, place = place, place + len(line)
        try:
            record = kind.model_validate(parse_json(line, name))
        except ValueError as error:
            problems.append(f"{name} line {number} cannot be read ({_reason(error).removeprefix(f'{name}: ')})")
            continue
        if record.key in keys:
            problems.append(f"{name} line {number} repeats the episode {record.key[:120]!r}")
            continue
        keys.add(record.key)
        yield begin, record
    if most is not None and stream.read(1):
        problems.append(f"{name} has more than {most} lines")


def _reason(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        return " ".join(f"{field}: {first['msg']}".split())[:120]
    return " ".join(str(getattr(error, "problem", error)).split())[:120]


def record_line(record: Record) -> bytes:
    """Return a record as a line of JSON."""
    return _line(record.model_dump(mode="json"))


def _line(data: Mapping[str, Any]) -> bytes:
    return json.dumps(data, allow_nan=False).encode() + b"\n"


def default_folder(policy: str, suite: str | Path) -> Path:
    """Return where `labgym eval` writes by default: runs/POLICY-SUITE."""
    return Path("runs") / f"{folder_name(policy)}-{Path(suite).stem}"


def folder_name(policy: str) -> str:
    """Return the name of a policy as the name of a folder: `mine:GoToGoal` becomes mine_GoToGoal."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", short_name(policy) if Path(policy).suffix.lower() in FILES else policy)


def short_name(policy: str) -> str:
    """Return a policy's label as tables show it: of a class without its module, of a file without path and suffix."""
    if Path(policy).suffix.lower() in FILES:
        return Path(policy).stem
    return policy.rpartition(":")[2] if is_class_place(policy) else policy
