"""The files of an evaluation, a line of JSON for each episode: rows, routes and planning times.

Rows and routes are the same in every run; planning times are measured and kept in a separate file.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Generic, Protocol, Self, TypeVar

from pydantic import Field, ValidationError

from labgym.documents import Record, parse_json
from labgym.errors import DocumentError
from labgym.eval.driving.drive import Drive, Route
from labgym.eval.driving.episode_row import Count, EpisodeRow, Key, Length, Pose

EPISODES, ROUTES, TIMES, SUMMARY = "episodes.jsonl", "routes.jsonl", "times.jsonl", "summary.json"
MAX_LINE = 4 * 1024 * 1024
"""Longest line that is read, bytes: a route of 100,000 steps."""


class EpisodeRecord(Record):
    """A record of an episode."""

    layout: str
    pair: Annotated[int, Field(ge=-1)]
    repeat: Count = 0

    @property
    def key(self) -> Key:
        """Layout id, pair and repeat of the episode."""
        return self.layout, self.pair, self.repeat


class EpisodeRoute(EpisodeRecord):
    """A line of `routes.jsonl`: poses (x, y, yaw), meters and radians, rounded to 0.001."""

    poses: tuple[Pose, ...]


class EpisodeTime(EpisodeRecord):
    """A line of `times.jsonl`: mean wall-clock milliseconds of the policy per action, its reset included."""

    planning_ms: Length | None


class KeyedRecord(Protocol):
    """A record with the key of its episode."""

    @property
    def key(self) -> Any:
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

    records: dict[Any, T]
    problems: tuple[str, ...] = ()

    def checked(self, source: object, name: str) -> dict[Any, T]:
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


def drive_files(drives: Iterable[Drive]) -> dict[str, bytes]:
    """Return the content of rows, routes and times of episodes, by the file's name."""
    drives = tuple(drives)
    return {
        EPISODES: b"".join(record_line(drive.row) for drive in drives),
        ROUTES: b"".join(record_line(_route(drive)) for drive in drives),
        TIMES: b"".join(record_line(_time(drive)) for drive in drives),
    }


def read_rows(path: str | Path) -> tuple[EpisodeRow, ...]:
    """Return the rows of an `episodes.jsonl`.

    Raises:
        DocumentError: the file is missing, or a line cannot be read.
    """
    path = Path(path)
    return tuple(read_lines(path, EpisodeRow).checked(path, path.name).values())


def read_routes(path: str | Path) -> dict[Key, Route]:
    """Return the routes in a `routes.jsonl`, by episode.

    Raises:
        DocumentError: the file is missing, or a line cannot be read.
    """
    path = Path(path)
    return {key: record.poses for key, record in read_lines(path, EpisodeRoute).checked(path, path.name).items()}


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


def parse_lines(name: str, content: bytes, kind: type[T]) -> dict[Any, T]:
    """Return the records in the content of a file, by episode.

    Raises:
        DocumentError: a line cannot be read or repeats an episode.
    """
    return _read(name, BytesIO(content), kind).checked(name, name)


def _read(name: str, stream: BinaryIO, kind: type[T]) -> Lines[T]:
    records: dict[Any, T] = {}
    problems: list[str] = []
    number = 0
    while line := stream.readline(MAX_LINE):
        number += 1
        try:
            record = kind.model_validate(parse_json(line, name))
        except ValueError as error:
            problems.append(f"{name} line {number} cannot be read ({_reason(error).removeprefix(f'{name}: ')})")
            continue
        if record.key in records:
            problems.append(f"{name} line {number} repeats the episode {_episode(record.key)}")
        records.setdefault(record.key, record)
    return Lines(records, tuple(problems))


def _episode(key: Any) -> str:
    if isinstance(key, str):
        return repr(key)
    layout, pair, repeat = key
    return f"{layout!r}, pair {pair}, repeat {repeat}"


def _reason(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False, include_input=False)[0]
        field = ".".join(str(part) for part in first["loc"])
        return " ".join(f"{field}: {first['msg']}".split())[:120]
    return " ".join(str(getattr(error, "problem", error)).split())[:120]


def _route(drive: Drive) -> EpisodeRoute:
    layout, pair, repeat = drive.row.key
    return EpisodeRoute(layout=layout, pair=pair, repeat=repeat, poses=drive.route)


def _time(drive: Drive) -> EpisodeTime:
    layout, pair, repeat = drive.row.key
    return EpisodeTime(layout=layout, pair=pair, repeat=repeat, planning_ms=drive.planning_ms)


def record_line(record: Record) -> bytes:
    """Return a record as a line of JSON."""
    return json.dumps(record.model_dump(mode="json"), allow_nan=False).encode() + b"\n"
