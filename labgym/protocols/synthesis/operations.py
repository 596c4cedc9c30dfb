"""The operations that a clause of a description names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

from labgym.artefacts import artefacts
from labgym.documents import Document, Record

Phase = Literal["reaction", "quench", "workup", "purification", "analysis"]


class OperationWords(Record):
    """An action of a protocol, the words for it, and its phase of an experiment."""

    action: str
    english: str
    chinese: tuple[str, ...]
    phase: Phase


class Operations(Document):
    """The table of operations.

    Attributes:
        operations: in the order of priority.
        unlisted_words: common substances whose names do not look like chemistry.
        group_formulas: formulas of parts of molecules, which do not name a reagent.
    """

    SCHEMA: ClassVar[str] = "labgym.operations/1"

    operations: tuple[OperationWords, ...]
    unlisted_words: tuple[str, ...]
    group_formulas: tuple[str, ...]


@dataclass(frozen=True)
class Operation:
    """An action with its position in a text."""

    action: str
    phase: Phase
    start: int


@lru_cache(maxsize=1)
def table() -> Operations:
    """Return the published table; it is read once per process."""
    return Operations.load(artefacts("assets") / "synthesis" / "operations.json")


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[OperationWords, re.Pattern[str]], ...]:
    return tuple((words, re.compile(rf"\b(?:{words.english})", re.IGNORECASE)) for words in table().operations)


def operations(text: str) -> tuple[Operation, ...]:
    """Return the actions that a text names, in order, each once."""
    actions = []
    for words, pattern in _patterns():
        match = pattern.search(text)
        places = [place for word in words.chinese if (place := text.find(word)) >= 0]
        if match is not None:
            places.append(match.start())
        if places:
            actions.append(Operation(words.action, words.phase, min(places)))
    return tuple(sorted(actions, key=lambda operation: operation.start))


def main_operation(text: str) -> Operation | None:
    """Return the main action of a clause: the first one after the reaction, else the most specific of the reaction."""
    actions = operations(text)
    after = [operation for operation in actions if operation.phase != "reaction"]
    if after:
        return after[0]
    order = [words.action for words in table().operations]
    return min(actions, key=lambda operation: order.index(operation.action), default=None)


def operation_stem(word: str) -> re.Match[str] | None:
    """Return the match of the first operation whose pattern begins a lower-case word, or None."""
    return next((match for _, pattern in _patterns() if (match := pattern.match(word)) is not None), None)
