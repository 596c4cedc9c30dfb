"""Slips of the pen: how far two spellings are apart, and when a slip cannot be the name of another substance."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import SequenceMatcher

MIN_LENGTH = 6
"""Texts shorter than this, and names, are no misspelling of anything."""
MIN_CHEMICAL = 7
"""The same for the name of a reagent: short names and formulas are too near to one another."""
LONG = 9
"""From this length on MAX_SLIPS in the name of an instrument or facility are forgiven, else one."""
MAX_SLIPS = 2

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
"""Parts of chemical names that tell one substance from another, each in the group that it is mistaken within."""


def edits(one: str, other: str, limit: int) -> int:
    """Return how many letters must be left out, put in, changed or swapped with a neighbour; limit + 1 for any more.

    The optimal string alignment distance.
    """
    if abs(len(one) - len(other)) > limit:
        return limit + 1
    before, row = [0] * (len(other) + 1), list(range(len(other) + 1))
    for i, a in enumerate(one, 1):
        above, row = row, [i] + [0] * len(other)
        for j, b in enumerate(other, 1):
            row[j] = min(above[j] + 1, row[j - 1] + 1, above[j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and one[i - 2] == b:
                row[j] = min(row[j], before[j - 2] + 1)
        if min(row) > limit:
            return limit + 1
        before = above
    return min(row[-1], limit + 1)


def similarity(one: str, other: str) -> float:
    """Return the share of letters that two spellings have in common, in order, between 0 and 1."""
    return SequenceMatcher(None, one, other).ratio()


def slips(form: str, query: str) -> int | None:
    """Return the slips by which a query misspells an instrument's or facility's name, None where it is another word.

    Both are normalised. Numbers must be the same, and a Chinese name is not misspelt letter by letter.
    """
    limit = MAX_SLIPS if len(form) >= LONG else 1
    if min(len(form), len(query)) < MIN_LENGTH or not (form.isascii() and query.isascii()):
        return None
    if re.findall(r"\d+", form) != re.findall(r"\d+", query):
        return None
    count = edits(form, query, limit)
    return count if count <= limit else None


def same_substance(form: str, query: str) -> bool:
    """Say whether a query can only be a misspelling of a chemical name, both normalised.

    One slip, not in the first letter, in a name of letters alone. A query that is as near to a rival, the same name
    with a part such as -ite or meth- exchanged, left out or put before, is not taken for either.
    """
    if min(len(form), len(query)) < MIN_CHEMICAL or not (form.isalpha() and query.isalpha() and form[0] == query[0]):
        return False
    if query == form + "d":  # chloroform-d
        return False
    return edits(form, query, 1) == 1 and all(edits(rival, query, 1) > 1 for rival in _rivals(form))


def _rivals(form: str) -> Iterator[str]:
    for group in _CONFUSABLE:
        for part in group:
            at = form.find(part)
            while at >= 0:
                for other in group:
                    if other != part:
                        yield form[:at] + other + form[at + len(part) :]
                at = form.find(part, at + 1)
