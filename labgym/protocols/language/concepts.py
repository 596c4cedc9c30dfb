"""Concepts: operations, transformations and kinds of substance, one name each for all the words that mean it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from labgym.protocols.language.words import word_table


@dataclass(frozen=True)
class Concept:
    """A meaning that many words share.

    Attributes:
        name: one or two English words.
        english: pattern over lower-case English.
        chinese: words in Chinese.
    """

    name: str
    english: re.Pattern[str]
    chinese: tuple[str, ...]

    def position(self, text: str) -> int:
        """Return the index of the concept's first occurrence in a lower-case text, or -1."""
        match = self.english.search(text)
        places = [place for word in self.chinese if (place := text.find(word)) >= 0]
        return min([*places, *([match.start()] if match else [])], default=-1)


@lru_cache(maxsize=1)
def lexicon() -> dict[str, Concept]:
    """Return the concepts by name, in the order of the table."""
    return {
        entry.name: Concept(
            entry.name, re.compile(rf"\b(?:{entry.english})"), tuple(word.lower() for word in entry.chinese)
        )
        for entry in word_table().concepts
    }


def concepts(text: str) -> tuple[str, ...]:
    """Return the names of the concepts that occur in a text, in the order of the table."""
    lowered = text.lower()
    return tuple(name for name, concept in lexicon().items() if concept.position(lowered) >= 0)


def gloss(text: str) -> str:
    """Return a text with the Chinese words of the table replaced by English ones, longest first."""
    return _chinese().sub(lambda match: f" {_english()[match[0].lower()]} ", text)


@lru_cache(maxsize=1)
def _english() -> dict[str, str]:
    names: dict[str, str] = {}
    for concept in lexicon().values():
        for word in concept.chinese:
            names.setdefault(word, concept.name)
    return names


@lru_cache(maxsize=1)
def _chinese() -> re.Pattern[str]:
    words = sorted(_english(), key=lambda word: (-len(word), word))
    return re.compile("|".join(map(re.escape, words)), re.IGNORECASE)
