"""Operations, transformations and kinds of substance under one name each, whatever words a text uses for them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from labgym.protocols.language.words import words


@dataclass(frozen=True)
class Concept:
    """One meaning.

    Attributes:
        name: what it is called here, one or two English words.
        english: pattern over lower-case English.
        chinese: words for it.
    """

    name: str
    english: re.Pattern[str]
    chinese: tuple[str, ...]

    def found(self, text: str) -> int:
        """Return where a lower-case text first speaks of it, or -1."""
        match = self.english.search(text)
        places = [place for word in self.chinese if (place := text.find(word)) >= 0]
        return min([*places, *([match.start()] if match else [])], default=-1)


@lru_cache(maxsize=1)
def lexicon() -> dict[str, Concept]:
    """Return the concepts by name, in the order of the table."""
    return {
        given.name: Concept(
            given.name, re.compile(rf"\b(?:{given.english})"), tuple(word.lower() for word in given.chinese)
        )
        for given in words().concepts
    }


def concepts(text: str) -> tuple[str, ...]:
    """Return the names of the concepts that a text speaks of, in the order of the table."""
    lowered = text.lower()
    return tuple(name for name, concept in lexicon().items() if concept.found(lowered) >= 0)


def gloss(text: str) -> str:
    """Return a text with the Chinese words of the table replaced by English ones, longest first."""
    return _chinese().sub(lambda match: f" {_english()[match[0].lower()]} ", text)


@lru_cache(maxsize=1)
def _english() -> dict[str, str]:
    found: dict[str, str] = {}
    for concept in lexicon().values():
        for word in concept.chinese:
            found.setdefault(word, concept.name)
    return found


@lru_cache(maxsize=1)
def _chinese() -> re.Pattern[str]:
    words = sorted(_english(), key=lambda word: (-len(word), word))
    return re.compile("|".join(map(re.escape, words)), re.IGNORECASE)
