"""The table of words that a description of an experiment uses, in English and Chinese."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record


class ConceptWords(Record):
    """One meaning: its name here, a pattern over lower-case English from the start of a word, words in Chinese."""

    name: str
    english: str
    chinese: tuple[str, ...]


class Words(Document):
    """Words by what they mean.

    Attributes:
        concepts: operations, transformations and kinds of substance.
        shorthand: names of assets too loose for the catalogue, by asset.
        classes: names of classes of substances that a text may name in place of a substance, by class.
        everyday: synonyms of the catalogue that mean something else, or nothing in particular, in a running text.
        english_words, other_languages: what tells English from other languages in Latin script.
    """

    SCHEMA: ClassVar[str] = "labgym.words/1"

    concepts: tuple[ConceptWords, ...]
    shorthand: dict[str, tuple[str, ...]]
    classes: dict[str, tuple[str, ...]]
    everyday: frozenset[str]
    english_words: frozenset[str]
    other_languages: frozenset[str]


@lru_cache(maxsize=1)
def words() -> Words:
    """Return the published table; read once a process."""
    return Words.load(artefacts("assets") / "language" / "words.json")
