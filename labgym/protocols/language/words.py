"""The table of words for descriptions of experiments, in English and Chinese."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record


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
