"""The ordinary words of laboratory prose; any other unknown word may name a substance."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document
from labgym.units import UNITS

_ENDINGS = ("", "s", "es", "d", "ed", "ing", "ly", "er", "ers", "able", "n", "en", "ally", "y", "'s", "ness")
_VERBAL = re.compile(
    r"(?:e|es|ed|ing|ion|ions|ation|ations|s|r|er|(?:i[sz])?(?:e[sd]?|ing|ation|ations)|ly|al|ive|ally)?$"
)

_PORTION = re.compile(
    r"(?<![A-Za-z0-9.])(\d{1,4}(?:\.\d+)?|an?|one|two|three|half an?|[一二两三四五六七八九十半]{1,3})\s*"
    r"(?:heaped |level |small |large )?"
    r"([A-Za-z]+|[\u3400-\u9fff]{1,2}?)(?=\s*(?:of\b|的|[)）,，。;；]|$|[\u3400-\u9fff]))",
    re.IGNORECASE,
)


_MEASURE = re.compile(
    r"(?:[(（]\s?(?=[^()（）]{1,24}[)）])|\bfor\s)(\d{1,6}(?:\.\d{1,4})?\s?([A-Za-zµμ]{1,14}))(?=\s?[)）]|[,;.。](?!\d)|$)"
)
"""A number with a unit alone in brackets, "(5 V)", or at the end of a clause after "for": "for 3 h."."""
_OTHER_UNITS = frozenset(
    {"a", "m", "mm", "n", "mn", "x", "eq", "equiv", "equivs", "wt", "vol", "rpm", "ppm", "cat", "aq"}
)
"""Abbreviations after numbers that are no amounts, such as those of concentrations and equivalents."""
_KNOWN_UNITS = _OTHER_UNITS.union(
    spelling.lower() for units in UNITS.values() for spellings in units.values() for spelling in spellings
)


class Vocabulary(Document):
    """Words that name no substance.

    Attributes:
        english: base forms in lower case, also hyphenated ones.
        chinese: words, longest first.
        uncounted_units: measures without a defined size, such as "scoop".
    """

    SCHEMA: ClassVar[str] = "labgym.vocabulary/1"

    english: frozenset[str]
    chinese: tuple[str, ...]
    uncounted_units: frozenset[str]


@lru_cache(maxsize=1)
def vocabulary() -> Vocabulary:
    """Return the published vocabulary; it is read once per process."""
    return Vocabulary.load(artefacts("assets") / "language" / "vocabulary.json")


def is_ordinary(word: str) -> bool:
    """Return whether an English word, inflected or hyphenated, is in the vocabulary."""
    lowered = word.lower().strip("-'’.")
    if _stem(lowered) or not any(char.isalpha() for char in lowered):
        return True
    parts = [part for part in re.split(r"[-/’']", lowered) if part]
    return len(parts) > 1 and all(_stem(part) or part.isdigit() for part in parts)


def unmeasured(text: str) -> tuple[str, ...]:
    """Return the amounts in units without a defined size, as written: "3 scoops", 3勺."""
    units = vocabulary().uncounted_units
    portions = []
    for match in _PORTION.finditer(text):
        unit = match[2].lower()
        if unit in units or unit.removesuffix("s") in units or unit.removesuffix("ful") in units:
            portions.append(match[0].strip())
    return tuple(portions)


def unknown_measures(text: str) -> tuple[str, ...]:
    """Return the quantities in units that are not known, as written: "5 V", "3 furlongs"."""
    return tuple(
        match[1]
        for match in _MEASURE.finditer(text)
        if match[2].lower() not in _KNOWN_UNITS and (len(match[2]) == 1 or not is_ordinary(match[2]))
    )


def is_verbal_ending(rest: str) -> bool:
    """Return whether an ending turns the stem of an operation into a verb or noun: "hydrogenat" + "ion"."""
    return _VERBAL.match(rest) is not None


def ordinary_chinese(text: str) -> Iterator[tuple[int, int]]:
    """Yield the spans of the vocabulary's Chinese words of two characters or more, longest first at each place."""
    for match in _chinese().finditer(text):
        yield match.span()


def is_particle(char: str) -> bool:
    """Return whether a single Chinese character is a word of the vocabulary."""
    return char in _particles()


def _stem(word: str) -> bool:
    words = vocabulary().english
    for ending in _ENDINGS:
        if ending and not word.endswith(ending):
            continue
        base = word.removesuffix(ending) if ending else word
        doubled = base[:-1] if len(base) > 3 and base[-1] == base[-2] else base
        if not words.isdisjoint({base, f"{base}e", doubled, f"{base[:-1]}y" if base.endswith("i") else base}):
            return True
    return False


@lru_cache(maxsize=1)
def _chinese() -> re.Pattern[str]:
    words = sorted((word for word in vocabulary().chinese if len(word) > 1), key=len, reverse=True)
    return re.compile("|".join(map(re.escape, words)))


@lru_cache(maxsize=1)
def _particles() -> frozenset[str]:
    return frozenset(word for word in vocabulary().chinese if len(word) == 1)
