"""What a clause of a description tells one to do."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

from labgym.artefacts import artefacts
from labgym.documents import Document, Record

Phase = Literal["reaction", "quench", "workup", "purification", "analysis"]


class OperationWords(Record):
    """An action of a protocol, the words for it, and the phase of an experiment that it belongs to."""

    action: str
    english: str
    chinese: tuple[str, ...]
    phase: Phase


class Operations(Document):
    """The table of operations.

    Attributes:
        operations: those that are looked for first come first.
        unlisted_words: common substances whose names do not look like chemistry.
        group_formulas: formulas of parts of molecules, which name no reagent.
    """

    SCHEMA: ClassVar[str] = "labgym.operations/1"

    operations: tuple[OperationWords, ...]
    unlisted_words: tuple[str, ...]
    group_formulas: tuple[str, ...]


@dataclass(frozen=True)
class Operation:
    """An action with its place in a text."""

    action: str
    phase: Phase
    start: int


@lru_cache(maxsize=1)
def table() -> Operations:
    """Return the published table; read once a process."""
    return Operations.load(artefacts("assets") / "synthesis" / "operations.json")


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[OperationWords, re.Pattern[str]], ...]:
    return tuple((words, re.compile(rf"\b(?:{words.english})", re.IGNORECASE)) for words in table().operations)


def operations(text: str) -> tuple[Operation, ...]:
    """Return the actions that a text speaks of, in order, each once."""
    found = []
    for words, pattern in _patterns():
        match = pattern.search(text)
        places = [place for word in words.chinese if (place := text.find(word)) >= 0]
        if match is not None:
            places.append(match.start())
        if places:
            found.append(Operation(words.action, words.phase, min(places)))
    return tuple(sorted(found, key=lambda operation: operation.start))


def main_operation(text: str) -> Operation | None:
    """Return what a clause is about: its first action after the reaction, else the most telling one of the reaction."""
    found = operations(text)
    after = [operation for operation in found if operation.phase != "reaction"]
    if after:
        return after[0]
    order = [words.action for words in table().operations]
    return min(found, key=lambda operation: order.index(operation.action), default=None)
