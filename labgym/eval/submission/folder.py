"""The files of a submission, read within bounds; nothing in them is executed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from labgym.counts import is_whole
from labgym.documents import document_error, parse_json
from labgym.errors import DocumentError
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.driving.files import EPISODES, MAX_LINE, ROUTES

EXCESS = 100
"""Number of lines beyond the suite's episodes after which reading a file stops."""


@dataclass(frozen=True)
class Episodes:
    """The rows of a submission, and where its routes are.

    Attributes:
        rows: by episode.
        routes: position of each episode's line in `routes.jsonl`, bytes.
        problems: a sentence for each line that cannot be read, repeats an episode or is one too many.
    """

    folder: Path
    rows: dict[Key, EpisodeRow]
    routes: dict[Key, int]
    problems: tuple[str, ...]

    @classmethod
    def read(cls, folder: Path, expected: int) -> Episodes:
        """Read the rows and index the routes of a folder.

        Args:
            folder: the folder.
            expected: number of episodes of the suite; a little more is read of longer files.
        """
        rows: dict[Key, EpisodeRow] = {}
        routes: dict[Key, int] = {}
        problems: list[str] = []
        for place, line, number in _lines(folder / EPISODES, expected, problems):
            try:
                row = _row(line, f"{EPISODES} line {number}")
            except DocumentError as error:
                problems.append(str(error))
                continue
            _add(rows, row.key, row, f"{EPISODES} line {number}", problems)
            del place
        for place, line, number in _lines(folder / ROUTES, expected, problems):
            try:
                key, _ = _route(line, f"{ROUTES} line {number}")
            except DocumentError as error:
                problems.append(str(error))
                continue
            _add(routes, key, place, f"{ROUTES} line {number}", problems)
        return cls(folder, rows, routes, tuple(problems))

    def route(self, key: Key) -> NDArray[np.float64]:
        """Return the poses (n, 3) of an episode's route."""
        with (self.folder / ROUTES).open("rb") as stream:
            stream.seek(self.routes[key])
            return _route(stream.readline(MAX_LINE), ROUTES)[1]


def _lines(path: Path, expected: int, problems: list[str]) -> Iterator[tuple[int, bytes, int]]:
    """Yield position, content and number of each line of a file, a few more than expected at most."""
    if not path.is_file():
        problems.append(f"{path.name} is missing")
        return
    with path.open("rb") as stream:
        for number in range(1, expected + EXCESS + 1):
            place = stream.tell()
            line = stream.readline(MAX_LINE)
            if not line:
                return
            yield place, line, number
        if stream.read(1):
            problems.append(f"{path.name} has more than {expected + EXCESS} lines; the suite has {expected} episodes")


def _row(line: bytes, source: str) -> EpisodeRow:
    try:
        return EpisodeRow.model_validate(parse_json(line, source))
    except ValidationError as error:
        raise document_error(source, error) from None


def _route(line: bytes, source: str) -> tuple[Key, NDArray[np.float64]]:
    data = parse_json(line, source)
    if not isinstance(data, dict) or set(data) - {"repeat"} != {"layout", "pair", "poses"}:
        raise DocumentError(source, "", "expected layout, pair, repeat and poses")
    layout, pair, repeat, poses = data["layout"], data["pair"], data.get("repeat", 0), data["poses"]
    if not isinstance(layout, str) or not _is_index(pair) or not _is_index(repeat):
        raise DocumentError(source, "", "layout must be a text, pair and repeat whole numbers")
    if not isinstance(poses, list) or not poses or not all(map(_is_pose, poses)):
        raise DocumentError(source, "poses", "expected a list of poses (x, y, yaw)")
    return (layout, pair, repeat), np.array(poses, dtype=np.float64)


def _add(records: dict[Key, Any], key: Key, record: Any, source: str, problems: list[str]) -> None:
    if key in records:
        problems.append(f"{source} repeats episode {episode_name(key)}")
    records.setdefault(key, record)


def episode_name(key: Key) -> str:
    """Return the name of an episode in messages."""
    layout, pair, repeat = key
    return f"{layout[:80]} pair {pair}" + (f" repeat {repeat}" if repeat else "")


def _is_index(value: object) -> bool:
    return is_whole(value) and value >= 0


def _is_pose(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(type(number) in (int, float) for number in value)
