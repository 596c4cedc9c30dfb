"""The table of words, the concepts that many words share, and the language of a text."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, Literal

from labgym.artefacts import artefacts
from labgym.documents import Document, Record

Language = Literal["en", "zh", "unknown"]
_LATIN_WORDS = re.compile(r"[a-zà-öø-ÿ]+(?:'[a-z]+)?", re.IGNORECASE)
_FOREIGN_SCRIPTS = ("HIRAGANA", "KATAKANA", "HANGUL", "CYRILLIC", "ARABIC", "HEBREW", "THAI", "DEVANAGARI")


class ConceptWords(Record):
    """A concept: its name, a pattern over lower-case English that starts at a word, and words in Chinese."""

    name: str
    english: str
    chinese: tuple[str, ...]


class Words(Document):
    """Words by meaning.

    Attributes:
        concepts: operations, transformations and kinds of substance.
        shorthand: laboratory slang for assets, too loose for the catalog's synonyms, by asset.
        classes: names of classes of substances ("aldehyde") that a text may use in place of a substance, by class.
        everyday: synonyms of the catalog that usually mean something else in running text.
        english_words, other_languages: function words that distinguish English from other languages in Latin script.
    """

    SCHEMA: ClassVar[str] = "labgym.words/1"

    concepts: tuple[ConceptWords, ...]
    shorthand: dict[str, tuple[str, ...]]
    classes: dict[str, tuple[str, ...]]
    everyday: frozenset[str]
    english_words: frozenset[str]
    other_languages: frozenset[str]


@lru_cache(maxsize=1)
def word_table() -> Words:
    """Return the published table; it is read once per process."""
    return Words.load(artefacts("assets") / "language" / "words.json")


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


def language_of(text: str) -> Language:
    """Return the language of a text, judged by its script and its function words.

    Chinese is recognized by its characters; Japanese and Korean are excluded by theirs. Latin script counts as English
    unless function words of other languages outnumber the English ones; formulas and abbreviations count for neither.
    """
    letters = [char for char in text if char.isalpha()]
    if not letters:
        return "unknown"
    names = [unicodedata.name(char, "") for char in letters]
    if any(name.startswith(_FOREIGN_SCRIPTS) for name in names):
        return "unknown"
    if sum(name.startswith("CJK") for name in names) >= 0.08 * len(letters):
        return "zh"
    if sum(name.startswith(("LATIN", "GREEK")) for name in names) < len(letters):
        return "unknown"
    table = word_table()
    tokens = [word.lower() for word in _LATIN_WORDS.findall(text)]
    english = sum(word in table.english_words for word in tokens)
    other = sum(word in table.other_languages for word in tokens)
    accented = sum(not word.isascii() for word in tokens)
    return "unknown" if other + accented > english else "en"
