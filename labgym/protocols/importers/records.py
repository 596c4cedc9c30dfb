"""Shared parts of the importers: each record becomes an experiment or a rejection, and no file stops the others."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.experiments.model import Verb
from labgym.quantities import ROOM_RANGE

Records = Iterator[Experiment | Rejection]


class UnreadableError(Exception):
    """A record cannot be expressed as the actions of an experiment; the message says why."""


def from_file(file: Path, folder: Path, read: Callable[[Path, Path], Records]) -> Records:
    """Return the records of a file of a folder; if it cannot be read, the last one is a rejection that says why."""
    try:
        yield from read(file, folder)
    except DocumentError as error:
        yield Rejection(str(file.relative_to(folder)), str(error))


def record(place: str, build: Callable[[], Experiment]) -> Experiment | Rejection:
    """Return the experiment that a function builds, or a rejection if the record is unreadable or invalid.

    Args:
        place: where the record is, as file:line or file:index.
    """
    try:
        return build()
    except UnreadableError as error:
        return Rejection(place, str(error))
    except ValidationError as error:
        return Rejection(place, str(document_error(place, error)))


def printable(name: str) -> str:
    """Return a name on one line, without characters that control a terminal or turn the direction of writing."""
    return " ".join("".join(char if char.isprintable() else " " for char in name).split())


def one_line(error: object, length: int = 200) -> str:
    """Return an error message of another library on one line, cut to a length."""
    return " ".join(str(error).split())[:length]


def slug(text: str) -> str:
    """Return a text as part of an experiment's id."""
    return re.sub(r"[^a-z0-9_-]+", "_", text.lower())


def holding(temperature: float | None) -> Verb:
    """Return the verb for holding a mixture at a temperature in degrees Celsius."""
    if temperature is None or ROOM_RANGE[0] <= temperature <= ROOM_RANGE[1]:
        return "Stir"
    return "Heat" if temperature > ROOM_RANGE[1] else "Cool"
