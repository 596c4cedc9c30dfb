"""Names of equipment as phrases within a text, word by word, and misspellings.

"disposable Pasteur pipettes" names Pasteur pipettes; a misspelling must not be the name of another substance.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rapidfuzz.distance import OSA, Indel

from labgym.assets.qualifiers import is_neutral

MIN_LENGTH = 6
"""Shortest text, and shortest name, that may be a misspelling of the other."""
MIN_CHEMICAL = 7
"""The same for names of reagents: short names and formulas are too close to one another."""
LONG_NAME_LETTERS = 9
"""Length from which `MAX_EDITS` are accepted in the name of an instrument or facility; below it one is."""
MAX_EDITS = 2
DEUTERATED_SUFFIX = "d"
"""Suffix of a name with one deuterium atom, as in chloroform-d (IUPAC, P-84): another substance, not a misspelling."""

_CONFUSABLE = (
    ("ate", "ite", "ide", "ine", "ane", "ene", "one", "ol", "al", "yl", "ic", "ous", "ium"),
    ("ane", "ene", "yne", "ine"),
    ("yl", "oyl"),
    ("ole", "oline", "ine", "idine"),
    ("meth", "menth", "eth", "prop", "but", "pent", "hex", "hept", "oct", "non", "dec", "undec", "dodec"),
    ("phen", "benz", "tol", "xyl", "benzo", "benzyl", "benzoyl"),
    ("chlor", "brom", "iod", "fluor", "cyan"),
    ("mono", "di", "tri", "tetra", "bi", "bis", "tris", "penta", "hexa", "hydr", "hydro"),
    ("amine", "amide", "imine", "imide", "azine", "azole", "azide", "aniline"),
    ("oxy", "thio", "aza", "oxa", "oxo", "hydroxy", "peroxy"),
    ("sulf", "sulfen", "sulfin", "sulfon", "sulfur"),
    ("iso", "n", "sec", "tert", "neo", "cyclo"),
    ("malic", "maleic", "malonic"),
    ("pyrid", "pyraz", "pyrimid", "pyridaz", "pyrrolid", "piperid", "piperaz", "pipecol"),
    ("i", "ii", "iii", "iv", "vi"),
    ("mesyl", "tosyl", "tolyl", "besyl", "nosyl", "dansyl"),
)
"""Parts of chemical names that distinguish substances; each group holds parts that are mistaken for one another."""


def similarity(one: str, other: str) -> float:
    """Return the share of letters that two spellings have in common, in order, between 0 and 1."""
    return Indel.normalized_similarity(one, other)


def edits(form: str, query: str) -> int | None:
    """Return the number of edits by which a query misspells the name of an instrument or facility, or None.

    Both are normalized. An edit inserts, deletes or changes a letter, or swaps two neighbors (optimal string
    alignment). Numbers must agree, and Chinese names are not compared letter by letter. None means another word.
    """
    limit = MAX_EDITS if len(form) >= LONG_NAME_LETTERS else 1
    if min(len(form), len(query)) < MIN_LENGTH or not (form.isascii() and query.isascii()):
        return None
    if re.findall(r"\d+", form) != re.findall(r"\d+", query):
        return None
    count = OSA.distance(form, query, score_cutoff=limit)
    return count if count <= limit else None


def misspells_substance(form: str, query: str) -> bool:
    """Return whether a query can only be a misspelling of a chemical name, both normalized.

    It can with one edit, not in the first letter, in a name of letters only. A query that is as close to a rival (the
    name with a part such as -ite or meth- exchanged for another of its group) is a misspelling of neither.
    """
    if min(len(form), len(query)) < MIN_CHEMICAL or not (form.isalpha() and query.isalpha() and form[0] == query[0]):
        return False
    if query == form + DEUTERATED_SUFFIX or OSA.distance(form, query, score_cutoff=1) != 1:
        return False
    return all(OSA.distance(rival, query, score_cutoff=1) > 1 for rival in _rivals(form))


def _rivals(form: str) -> Iterator[str]:
    for group in _CONFUSABLE:
        for part in group:
            at = form.find(part)
            while at >= 0:
                for other in group:
                    if other != part:
                        yield form[:at] + other + form[at + len(part) :]
                at = form.find(part, at + 1)


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
