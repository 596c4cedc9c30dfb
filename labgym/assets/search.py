"""From what people write to canonical names: normalised synonyms first, near spellings after."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

from labgym.assets.model import Asset

MAX_QUERY = 200
FUZZY = 0.82
"""Least similarity (difflib ratio) at which a misspelling counts as the name."""
AMBIGUOUS = 0.03
"""A second asset within this ratio of the best makes a fuzzy match ambiguous."""

_GREEK = str.maketrans({"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"})
_SEPARATORS = re.compile(r"[^\w+#/%]+|_")


def normalise(text: str) -> str:
    """Return text with case, width, accents, spacing and punctuation folded; digits and letters of any script stay.

    "Büchner funnel", "buchner-funnel" and "BuchnerFunnel" become the same string.
    """
    folded = unicodedata.normalize("NFKD", text[:MAX_QUERY].translate(_GREEK)).casefold()
    folded = "".join(char for char in folded if not unicodedata.combining(char))
    return _SEPARATORS.sub("", folded)


class SynonymIndex:
    """Canonical names by normalised surface form.

    Where assets share a surface form, the first in the order given keeps it: canonical names before synonyms,
    core assets before the rest.
    """

    def __init__(self, assets: Iterable[Asset]) -> None:
        ordered = sorted(assets, key=lambda asset: (not asset.core, asset.name))
        self._forms: dict[str, str] = {}
        for asset in ordered:
            self._forms.setdefault(normalise(asset.name), asset.name)
        for asset in ordered:
            for form in surface_forms(asset):
                self._forms.setdefault(normalise(form), asset.name)

    def lookup(self, text: str) -> str | None:
        """Return the canonical name that a text means, or None where nothing or no single asset is near."""
        query = normalise(text)
        for form in (query, *_singulars(query)):
            if form in self._forms:
                return self._forms[form]
        return self._fuzzy(query)

    def nearest(self, text: str, count: int = 5) -> tuple[str, ...]:
        """Return the canonical names whose surface forms are nearest to a text."""
        forms = get_close_matches(normalise(text), self._forms, n=3 * count, cutoff=0.4)
        return tuple(dict.fromkeys(self._forms[form] for form in forms))[:count]

    def _fuzzy(self, query: str) -> str | None:
        if len(query) < 5:
            return None
        best: dict[str, float] = {}
        for form in get_close_matches(query, self._forms, n=8, cutoff=FUZZY):
            ratio = SequenceMatcher(None, form, query).ratio()
            name = self._forms[form]
            best[name] = max(best.get(name, 0.0), ratio)
        ranked = sorted(best.items(), key=lambda item: (-item[1], item[0]))
        if not ranked or (len(ranked) > 1 and ranked[0][1] - ranked[1][1] < AMBIGUOUS):
            return None
        return ranked[0][0]


def surface_forms(asset: Asset) -> tuple[str, ...]:
    """Return what an asset may be called: its name, its synonyms, its formula's and CAS number's spelling."""
    chemistry = asset.chemistry
    identifiers = (chemistry.cas,) if chemistry is not None and chemistry.cas is not None else ()
    return (asset.name, *asset.synonyms_en, *asset.synonyms_zh, *identifiers)


def _singulars(query: str) -> tuple[str, ...]:
    """Return singular readings of a normalised English plural."""
    if query.endswith("ies"):
        return (query[:-3] + "y", query[:-1])
    if query.endswith("es"):
        return (query[:-1], query[:-2])
    return (query[:-1],) if query.endswith("s") else ()
