"""The words of procedures: operations with what they take, nouns for the batch, qualities, and names of substances.

The table is `assets/language/procedures.json`. A word that it does not know is a name if its form says so
(`names_substance`), or if an amount stands with it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import ClassVar, Literal

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.protocols.experiments.model import Verb

Frame = Literal["theme", "with", "in", "onto", "from", "hold", "over", "between", "result", "none", "refers"]
"""Where a verb names its substances: its object ("theme"), after with, in, onto, from, over or between, or nowhere."""


@dataclass(frozen=True)
class VerbWord:
    """An operation word: the verb, where its substances stand, and whether the word is a noun."""

    verb: Verb
    frame: Frame
    noun: bool = False


class VerbEntry(Record):
    """An operation word: a pattern over lower case, the verb, and where its substances stand."""

    pattern: str
    verb: Verb
    frame: Frame


class ProcedureWords(Document):
    """The words of procedures in English.

    Attributes:
        verbs: in the order in which they are tried; `~` in a pattern stands for the endings of a regular verb.
        nouns: operation words that are nouns ("filtration").
        batch: nouns for the batch, its parts and its vessel; they name no substance.
        qualities: adjectives and measures before a name that are no part of it.
        other: words that name neither a substance nor an operation.
        substances: names and parts of names whose form says nothing.
        no_names: words that end as names do and are none.
        solutions: nouns that hold their contents: "a solution of A in B".
        vessels, solid: nouns for vessels and for solids.
        solvent_adjectives: solvents as adjectives ("ethereal").
        prepositions, auxiliaries, determiners: function words.
        endings: patterns of endings of names.
        stems: patterns of short parts of names.
    """

    SCHEMA: ClassVar[str] = "labgym.procedure-words/1"

    verbs: tuple[VerbEntry, ...]
    nouns: frozenset[str]
    batch: frozenset[str]
    qualities: frozenset[str]
    other: frozenset[str]
    substances: frozenset[str]
    no_names: frozenset[str]
    solutions: frozenset[str]
    vessels: frozenset[str]
    solid: frozenset[str]
    solvent_adjectives: frozenset[str]
    prepositions: frozenset[str]
    auxiliaries: frozenset[str]
    determiners: frozenset[str]
    endings: tuple[str, ...]
    stems: tuple[str, ...]


TABLE = ProcedureWords.load(artefacts("assets") / "language" / "procedures.json")
BATCH, QUALITIES, SUBSTANCES = TABLE.batch, TABLE.qualities, TABLE.substances
SOLUTIONS, VESSELS, SOLID, SOLVENT_ADJECTIVES = TABLE.solutions, TABLE.vessels, TABLE.solid, TABLE.solvent_adjectives
PREPOSITIONS, AUXILIARIES, DETERMINERS = TABLE.prepositions, TABLE.auxiliaries, TABLE.determiners
WORDS_OF_AMOUNT = {
    "saturated": "saturated", "sat.": "saturated", "sat": "saturated", "satd": "saturated", "satd.": "saturated",
    "sat'd": "saturated", "concentrated": "concentrated", "conc.": "concentrated", "conc": "concentrated",
    "dilute": "dilute", "diluted": "dilute", "dil.": "dilute", "dil": "dilute", "excess": "excess",
    "catalytic": "catalytic", "aqueous": "aqueous", "aq.": "aqueous", "aq": "aqueous", "glacial": "glacial",
    "half-saturated": "half-saturated", "half-concentrated": "half-concentrated", "little": "little", "equal": "equal",
}  # fmt: skip
MANNERS = {
    "dropwise": "dropwise", "drop-wise": "dropwise", "drop": "", "portionwise": "portionwise",
    "portion-wise": "portionwise",
    "slowly": "slowly", "gradually": "slowly", "rapidly": "quickly", "quickly": "quickly", "carefully": "slowly",
    "progressively": "slowly", "careful": "slowly", "cautiously": "slowly", "cautious": "slowly",
}  # fmt: skip
GASES = {
    "nitrogen": "nitrogen",
    "n2": "nitrogen",
    "argon": "argon",
    "ar": "argon",
    "hydrogen": "hydrogen",
    "h2": "hydrogen",
    "air": "air",
}
_STOPS = PREPOSITIONS | AUXILIARIES | DETERMINERS | TABLE.other | frozenset(MANNERS)
_REGULAR = r"(?:e[sd]?|ing|ed|s)?"
_ENDING = re.compile(r"^[A-Za-z][A-Za-z-]{3,}(?:ate|ide|ine|ol|one|ene|ane|yne|ium|yl|oxy|ose|thiol|ite)s?$")
_SUFFIX = re.compile(rf"(?:(?:^|[a-z)\]])(?:{'|'.join(TABLE.endings)}))s?$", re.IGNORECASE)
_SHORT = re.compile(rf"^(?:{'|'.join(TABLE.stems)})$", re.IGNORECASE)
_ELEMENT = (
    "H|He|Li|Be|B|C|N|O|F|Na|Mg|Al|Si|P|S|Cl|K|Ca|Sc|Ti|V|Cr|Mn|Fe|Co|Ni|Cu|Zn|Ga|Ge|As|Se|Br|"
    "Rb|Sr|Y|Zr|Nb|Mo|Ru|Rh|Pd|"
    "Ag|Cd|In|Sn|Sb|Te|I|Cs|Ba|La|Ce|Sm|Yb|Hf|Ta|W|Re|Os|Ir|Pt|Au|Hg|Tl|Pb|Bi|Me|Et|Pr|Bu|Ph|Ac|"
    "Ts|Ms|Tf|Bn|Bz|Boc|OAc|dba|Ar|D"
)
_ELEMENTS = "|".join(sorted(_ELEMENT.split("|"), key=len, reverse=True))
"""Symbols, longest first: a formula is read without going back, in linear time."""
_FORMULA = re.compile(
    rf"^(?:[nist]-|i|t|n)?(?>(?:{_ELEMENTS})\d{{0,2}}|[()\[\]·.*+-]|\d{{1,2}}(?=[A-Z(])|(?<=\))\d|aq)+$"
)
_DIGIT_LETTERS = re.compile(
    r"\d[,\d']{0,40}-[A-Za-z(\[]|[a-z)\]]-\d|\d[A-Z]-|[(\[]\d|^[NOS],[NOS]|^[NOSRE]-[a-z]|^\((?:[RSEZ±+-]|\d)", re.ASCII
)
_POSITION = re.compile(r"^\d{1,3}[A-Z]$")
_OXIDATION = re.compile(r"(?<=[a-z)])\((?:0|I{1,3}|IV|V|VI)\)$", re.IGNORECASE)
"""The oxidation state at the end of a word: "palladium(II)"."""
_NOTEBOOK = re.compile(r"^[A-Z]{2,6}\d{0,4}-\d{4,}(?:-\d{1,4}){0,3}$")
"""The number of a page in a laboratory notebook: "PBO-01132-93-01"."""
_NECKED = re.compile(r"^(?:\d|two|three|four)-neck(?:ed)?$", re.IGNORECASE)
_HYPHENED = (
    "-filled",
    "-flushed",
    "-purged",
    "-free",
    "-washed",
    "-containing",
    "-based",
    "-cooled",
    "-lined",
    "-separator",
)
"""Ends of adjectives that begin with a name: "argon-filled"."""
_GREEK = re.compile(r"^[α-ωΑ-Ω]")
_CODE = re.compile(r"^\(?(?:\d{1,3}[a-z]?|[IVX]{1,5}|[A-Z]{1,2}-?\d{1,3}[a-z]?)\)?$")


_OFTEN_MISPRINTED = (
    "acidified", "chromatographed", "collected", "concentrated", "crystallized", "dissolved", "distilled", "evaporated",
    "extracted", "filtered", "neutralized", "obtained", "partitioned", "precipitated", "purified", "recrystallized",
    "refluxed", "separated", "stirred", "suspended", "transferred", "triturated",
)  # fmt: skip
"""Participles of which misprints are read."""
LEAST_LIKENESS = 0.88
"""Least ratio of `difflib` between a misprint and its participle."""


@lru_cache(maxsize=1)
def _verb_patterns() -> tuple[tuple[re.Pattern[str], Verb, Frame], ...]:
    return tuple(
        (re.compile(rf"^(?:{entry.pattern.replace('~', _REGULAR)})$"), entry.verb, entry.frame) for entry in TABLE.verbs
    )


@lru_cache(maxsize=4096)
def verb_word(word: str) -> VerbWord | None:
    """Return the operation that a word in lower case names, or None."""
    if len(word) > 24:
        return None
    for pattern, verb, frame in _verb_patterns():
        if pattern.match(word):
            return VerbWord(verb, frame, word in TABLE.nouns)
    if len(word) > 6 and word.endswith("ed") and word not in QUALITIES and word not in TABLE.other:
        near = get_close_matches(word, _OFTEN_MISPRINTED, 1, LEAST_LIKENESS)
        return verb_word(near[0]) if near and near[0][0] == word[0] else None
    return None


@lru_cache(maxsize=8192)
def names_substance(word: str) -> bool:
    """Return whether the form of a word says that it is a name of a substance or part of one."""
    if len(word) > 400 or not any(map(str.isalnum, word)):
        return False
    word = _OXIDATION.sub("", word)
    lower = word.lower().rstrip(".,;:™®")
    if lower in SUBSTANCES:
        return True
    if lower in _STOPS or lower in BATCH or lower in SOLUTIONS or verb_word(lower) is not None:
        return False
    if _SHORT.match(word) or _GREEK.match(word):
        return True
    if _NOTEBOOK.match(word) or _NECKED.match(word) or lower.endswith(_HYPHENED) or "vacuum" in lower:
        return False
    if "/" in word.strip("/") and len(word) < 60 and "[" not in word:
        return any(names_substance(part) for part in word.split("/") if part)
    if _POSITION.match(word):
        return False
    if any(map(str.isdigit, word)) and len(word) > 3 and _DIGIT_LETTERS.search(word):
        return True
    if (
        len(word) <= 40
        and len(word) > 1
        and _FORMULA.match(word)
        and (any(map(str.isdigit, word)) or sum(map(str.isupper, word)) > 1 or "-" in word)
    ):
        return True
    if "-" in word and len(word) > 6 and any(names_substance(part) for part in word.split("-") if len(part) > 2):
        return True
    if lower in TABLE.no_names or lower.removesuffix("s") in TABLE.no_names:
        return False
    return len(word) > 4 and (_SUFFIX.search(word) is not None or _ENDING.match(word) is not None)


def is_stop(word: str) -> bool:
    """Return whether a word in lower case is known to name no substance and no operation."""
    return word in _STOPS


def is_code(word: str) -> bool:
    """Return whether a word numbers a compound: "12b", "(IV)"."""
    return _CODE.match(word) is not None
