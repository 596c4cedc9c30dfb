"""Misspellings: how far two spellings are apart, and when a misspelling cannot be the name of another substance."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rapidfuzz.distance import OSA, Indel

MIN_LENGTH = 6
"""Shortest text, and shortest name, that may be a misspelling of the other."""
MIN_CHEMICAL = 7
"""The same for names of reagents: short names and formulas are too close to one another."""
LONG = 9
"""Length from which `MAX_EDITS` are accepted in the name of an instrument or facility; below it one is."""
MAX_EDITS = 2
DEUTERATED = "d"
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
    limit = MAX_EDITS if len(form) >= LONG else 1
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
    if query == form + DEUTERATED or OSA.distance(form, query, score_cutoff=1) != 1:
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
