"""From what people write to canonical names: normalised synonyms first, near spellings after."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

from labgym.assets.archive import SHAPE
from labgym.assets.model import Asset

MAX_QUERY = 200
MIN_FUZZY_LENGTH = 5
FUZZY = 0.82
"""Least similarity (difflib ratio) at which a misspelling counts as the name of an instrument or facility."""
FUZZY_CHEMICAL = 0.92
"""The same for a reagent: one letter in seven or more, since one letter more often makes another substance."""
AMBIGUOUS = 0.03
"""A second asset within this ratio of the best makes a fuzzy match ambiguous."""

_SPELLINGS = str.maketrans({"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"})
_VARIANTS = (("sulph", "sulf"), ("aluminium", "aluminum"), ("caesium", "cesium"))
_SEPARATORS = re.compile(r"[\W_]+")
_MORPHEMES = re.compile(
    r"meth|eth|prop|but|pent|hex|hept|oct|phen|benz|chlor|brom|iod|fluor|cyclo|iso|tert|mono|di|tri|tetra|"
    r"oyl|yl|ate|ite|ide|ine|amine|amide|ol|al|one|ane|ene|iii|ii|iv|\d+"
)
"""Parts of chemical names that must be the same on both sides: nitrite is no misspelling of nitrate."""


def normalise(text: str) -> str:
    """Return text with case, width, accents, spacing and punctuation folded; digits and letters of any script stay.

    "Büchner funnel", "buchner-funnel" and "BuchnerFunnel" become the same string, "H₂SO₄" becomes "h2so4".
    """
    folded = unicodedata.normalize("NFKD", text[:MAX_QUERY].translate(_SPELLINGS)).casefold()
    plain = _SEPARATORS.sub("", "".join(char for char in folded if not unicodedata.combining(char)))
    for variant, usual in _VARIANTS:
        plain = plain.replace(variant, usual)
    return plain


def surface_forms(asset: Asset) -> tuple[str, ...]:
    """Return what an asset may be called: its name, its synonyms, its CAS number.

    An imported bottle has the CAS number of what is in it, which stays the name of the published reagent.
    """
    chemistry = asset.chemistry if asset.shape.name != SHAPE else None
    identifiers = (chemistry.cas,) if chemistry is not None and chemistry.cas is not None else ()
    return (asset.name, *asset.synonyms_en, *asset.synonyms_zh, *identifiers)


class SynonymIndex:
    """Canonical names by normalised surface form.

    Where assets share a surface form, the first keeps it: canonical names before synonyms, core assets before the rest.
    """

    def __init__(self, assets: Iterable[Asset]) -> None:
        ordered = sorted(assets, key=lambda asset: (not asset.core, asset.name))
        self._reagents = {asset.name for asset in ordered if asset.kind == "reagent"}
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
        return self._fuzzy(query) if len(query) >= MIN_FUZZY_LENGTH else None

    def nearest(self, text: str, count: int = 5) -> tuple[str, ...]:
        """Return the canonical names whose surface forms are nearest to a text, best first."""
        forms = get_close_matches(normalise(text), self._forms, n=3 * count, cutoff=0.4)
        return tuple(dict.fromkeys(self._forms[form] for form in forms))[:count]

    def _fuzzy(self, query: str) -> str | None:
        best: dict[str, float] = {}
        for form in get_close_matches(query, self._forms, n=8, cutoff=FUZZY):
            name = self._forms[form]
            if name not in self._reagents or _same_substance(form, query):
                best[name] = max(best.get(name, 0.0), _ratio(form, query))
        ranked = sorted(best.items(), key=lambda item: (-item[1], item[0]))
        if not ranked or (len(ranked) > 1 and ranked[0][1] - ranked[1][1] < AMBIGUOUS):
            return None
        return ranked[0][0]


def _ratio(form: str, query: str) -> float:
    return SequenceMatcher(None, form, query).ratio()


def _same_substance(form: str, query: str) -> bool:
    """Say whether two spellings of a chemical name differ by no more than a slip of the pen."""
    return (
        form[0] == query[0]
        and _MORPHEMES.findall(form) == _MORPHEMES.findall(query)
        and _ratio(form, query) >= FUZZY_CHEMICAL
    )


def _singulars(query: str) -> tuple[str, ...]:
    """Return singular readings of a normalised English plural."""
    if query.endswith("ies"):
        return (query[:-3] + "y", query[:-1])
    if query.endswith("es"):
        return (query[:-1], query[:-2])
    return (query[:-1],) if query.endswith("s") else ()
