"""Names of equipment as phrases within a text, word by word: "disposable Pasteur pipettes" names Pasteur pipettes."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from labgym.assets.qualifiers import is_neutral

MAX_WORDS = 16
_WORD = re.compile(r"\d+/\d+|[^\s,;()\[\]/_]+")
_COMPOUND = re.compile(r"[^\W\d_]{2,}(?:-[^\W\d_]{2,})+")
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


@dataclass(frozen=True)
class Phrase:
    """An asset that a phrase names, the form of its name, and the other words of the text."""

    name: str
    form: str
    rest: tuple[str, ...]


class PhraseIndex:
    """Assets by the words of their names.

    Args:
        forms: (name or synonym, canonical name of the asset), the most important first.
    """

    def __init__(self, forms: Iterable[tuple[str, str]]) -> None:
        self._names: dict[tuple[str, ...], tuple[str, str]] = {}
        self._own_words: dict[str, set[str]] = defaultdict(set)
        self._long_forms: dict[str, list[tuple[str, ...]]] = defaultdict(list)
        abbreviations: dict[str, str] = {}
        for form, name in forms:
            words = tuple(_stem(word) for word in _words(_CAMEL.sub(" ", form) if form == name else form))
            self._names.setdefault(words, (name, form))
            self._own_words[name].update(words)
            if len(words) > 1:
                self._long_forms[name].append(words)
            elif form.isupper() and len(form) > 1:
                abbreviations.setdefault(words[0], name)
        self._abbreviations = abbreviations

    def find(self, text: str) -> Phrase | None:
        """Return the asset that the longest phrase of a text names, if all other words are neutral, else None.

        Neutral words are those of `is_neutral` and the asset's own: "graduated measuring cylinder" is a measuring
        cylinder, which is also called graduated cylinder. "flask, round bottom" is read as "round bottom flask", and an
        abbreviation such as RBF as what it stands for.
        """
        words = _words(text)
        readings = [words]
        head, comma, tail = text.partition(",")
        if comma and "," not in tail:
            readings.append(_words(f"{tail} {head}"))
        for k, word in enumerate(words):
            name = self._abbreviations.get(_stem(word), "")
            readings += [[*words[:k], *long_form, *words[k + 1 :]] for long_form in self._long_forms.get(name, ())]
        return next((phrase for reading in readings if (phrase := self._in(reading)) is not None), None)

    def _in(self, words: list[str]) -> Phrase | None:
        stems = tuple(_stem(word) for word in words)
        for length in range(len(stems), 0, -1):
            for start in range(len(stems) - length, -1, -1):
                name, form = self._names.get(stems[start : start + length], ("", ""))
                if not name:
                    continue
                others = [*range(start), *range(start + length, len(stems))]
                foreign = [words[k] for k in others if stems[k] not in self._own_words[name]]
                if not foreign or is_neutral(foreign) or is_neutral(words[k] for k in others):
                    return Phrase(name, form, tuple(words[k] for k in others))
        return None


def _words(text: str) -> list[str]:
    """Return the words of a text, at most 16; compounds such as round-bottom are several."""
    parts = [
        part for word in _WORD.findall(text) for part in (word.split("-") if _COMPOUND.fullmatch(word) else [word])
    ]
    return parts[:MAX_WORDS]


def _stem(word: str) -> str:
    """Return a word in lower case and, by its ending, in the singular."""
    plain = word.casefold()
    return plain[:-1] if len(plain) > 3 and plain.endswith("s") and not plain.endswith("ss") else plain
