"""From what people write to canonical names: normalised synonyms first, near spellings after."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Literal

from labgym.assets import remarks
from labgym.assets.archive import SHAPE
from labgym.assets.lookalikes import lookalikes
from labgym.assets.model import Asset
from labgym.assets.spelling import MAX_SLIPS, MIN_LENGTH, edits, same_substance, similarity, slips

MAX_QUERY = 200
NEAR = 0.4
"""Least similarity at which an asset is listed as near to a text."""

_SPELLINGS = str.maketrans({"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"})
_VARIANTS = (("sulph", "sulf"), ("aluminium", "aluminum"), ("caesium", "cesium"))
_SEPARATORS = re.compile(r"[\W_]+")
_WORD = re.compile(r"^(?!.*\b[A-Z]{2,}\b).*[a-z]{3}")
"""A name without abbreviations or formulas: TBDPSCl is no misspelling of TBDMSCl, nor TMA chloride of TMS chloride."""
_ENDING = re.compile(r"[a-z]{3}(?:amine|amide|ide|ane|ene|ole|idine)$")
_FAMILY = re.compile(r"^Large|\d+$")
"""What sets an asset's name apart from those of other sizes."""


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


@dataclass(frozen=True)
class Match:
    """An asset that a text means.

    Attributes:
        name: canonical.
        form: the name, synonym or CAS number that matched, as the catalogue writes it.
        how: "name", "synonym" or "fuzzy".
        score: similarity of form and text, 1 unless fuzzy.
        aside: what the text says beside the name, such as "1 M", "anhydrous" or "2 L".
        note: where the asset is not of the size, or not as dry, as the text asks, what it is; else "".
    """

    name: str
    form: str
    how: Literal["name", "synonym", "fuzzy"]
    score: float
    aside: tuple[str, ...] = ()
    note: str = ""


class SynonymIndex:
    """Canonical names by normalised surface form.

    Where assets share a surface form, the first keeps it: canonical names before synonyms, core assets before the rest.
    """

    def __init__(self, assets: Iterable[Asset]) -> None:
        ordered = sorted(assets, key=lambda asset: (not asset.core, asset.name))
        self._assets = {asset.name: asset for asset in ordered}
        self._forms: dict[str, tuple[str, str]] = {}
        for asset in ordered:
            self._forms.setdefault(normalise(asset.name), (asset.name, asset.name))
        for asset in ordered:
            for form in surface_forms(asset):
                self._forms.setdefault(normalise(form), (asset.name, form))
        # A name made by rule is near to names that the name it is made of is not: phenyl ether to phenylethen.
        self._signatures = tuple((form, _letters(form)) for form in self._forms if len(form) >= MIN_LENGTH)
        for asset in ordered:
            for form in _variants(asset):
                self._forms.setdefault(normalise(form), (asset.name, form))

    def lookup(self, text: str) -> str | None:
        """Return the canonical name that a text means, or None where nothing or no single asset is near."""
        found = self.match(text)
        return None if found is None else found.name

    def match(self, text: str) -> Match | None:
        """Return the asset that a text means and how it was found, or None where nothing or no single asset is near.

        A name, synonym or CAS number comes first, then one beside an amount, a size, a concentration or a grade, then
        one that is misspelt. Of assets that differ in size the one of the size that the text gives is taken.
        """
        if len(text) > MAX_QUERY:
            return None
        size, sizeless = remarks.measure(text)
        amounts, grades = remarks.of_substance(text)
        found = self._exact(text)
        if found is None and size is not None:
            found = self._equipment(self._exact(sizeless))
        if found is None:
            found = self._equipment(self._exact(remarks.of_equipment(sizeless)))
        if found is None:
            found = self._reagent(amounts, self._exact) or self._reagent(grades, self._exact)
        if found is None:
            found = self._equipment(self._misspelt(sizeless)) or self._reagent(grades, self._misspelt)
        if found is None or size is None or self._assets[found.name].kind == "reagent":
            return found
        return self._sized(found, size)

    def candidates(self, text: str, count: int = 5) -> tuple[Match, ...]:
        """Return the assets whose names or synonyms are spelt most like a text, best first, each with its score."""
        best: dict[str, Match] = {}
        for query in dict.fromkeys((normalise(text), normalise(remarks.of_substance(text[:MAX_QUERY])[1].rest))):
            for form in get_close_matches(query, self._forms, n=3 * count, cutoff=NEAR):
                name, written = self._forms[form]
                score = similarity(form, query)
                if name not in best or best[name].score < score:
                    best[name] = Match(name, written, "fuzzy", score)
        return tuple(sorted(best.values(), key=lambda match: (-match.score, match.name))[:count])

    def nearest(self, text: str, count: int = 5) -> tuple[str, ...]:
        """Return the canonical names whose surface forms are nearest to a text, best first."""
        return tuple(match.name for match in self.candidates(text, count))

    def _exact(self, text: str) -> Match | None:
        query = normalise(text)
        for form in (query, *_singulars(query)):
            if form in self._forms:
                name, written = self._forms[form]
                # A plural of a formula is another formula: H2S is not several H2.
                if form == query or self._assets[name].kind != "reagent" or (len(form) >= 5 and form.isalpha()):
                    return Match(name, written, "name" if form == normalise(name) else "synonym", 1.0)
        return None

    def _misspelt(self, text: str) -> Match | None:
        query = normalise(text)
        near: dict[str, tuple[int, float, str]] = {}
        letters = _letters(query)
        for form, signature in self._signatures:
            if abs(len(form) - len(query)) > MAX_SLIPS or (letters ^ signature).bit_count() > 2 * MAX_SLIPS:
                continue
            name, _ = self._forms[form]
            count = slips(form, query)
            if count is not None:
                near[name] = min(near.get(name, (9, 0.0, "")), (count, -similarity(form, query), form))
        ranked = sorted((count, score, name, form) for name, (count, score, form) in near.items())
        if not ranked or (len(ranked) > 1 and ranked[0][0] == ranked[1][0]):
            return None
        count, score, name, form = ranked[0]
        written = self._forms[form][1]
        if _WORD.search(written) is None or _stranger(query, count):
            return None
        if self._assets[name].kind == "reagent" and not same_substance(form, query):
            return None
        return Match(name, written, "fuzzy", -score)

    def _equipment(self, found: Match | None) -> Match | None:
        return None if found is None or self._assets[found.name].kind == "reagent" else found

    def _reagent(self, reading: remarks.Reading, look: Callable[[str], Match | None]) -> Match | None:
        found = look(reading.rest)
        if found is None or self._assets[found.name].kind != "reagent":
            return None
        if reading.without_water and found.name in remarks.AQUEOUS:
            return None
        hydrate = reading.without_water and found.name in remarks.HYDRATES
        return replace(found, aside=reading.aside, note="the catalogue's one is a hydrate" if hydrate else "")

    def _sized(self, found: Match, size: remarks.Measure) -> Match:
        asset, stem = self._assets[found.name], _FAMILY.sub("", found.name)
        family = [other for name, other in self._assets.items() if _FAMILY.sub("", name) == stem]
        chosen = remarks.of_size([asset, *(other for other in family if other.subtype == asset.subtype)], size)
        return replace(found, name=chosen.name, aside=(size.written,), note=remarks.difference(chosen, size))


def _stranger(query: str, count: int) -> bool:
    """Say whether a text is within so many slips of a substance that the catalogue does not hold."""
    return any(edits(normalise(name), query, count) <= count for name in lookalikes())


def _letters(form: str) -> int:
    """Return the set of a text's characters as bits; a slip changes two at most, so it rules most forms out fast."""
    bits = 0
    for char in form:
        bits |= 1 << (ord(char) % 64)
    return bits


def _variants(asset: Asset) -> Iterator[str]:
    """Yield what else a reagent is called by rule.

    "hydrochloric acid" of "hydrochloric acid (37%)", "三氯化铝" of "无水三氯化铝", "triethylamin", as German has it.
    """
    if asset.kind == "reagent":
        yield from (form[:-1] for form in (asset.name, *asset.synonyms_en) if _ENDING.search(form))
        yield from (form.partition(" (")[0] for form in asset.synonyms_en if form.endswith(")") and " (" in form)
        yield from (form.removeprefix("无水") for form in asset.synonyms_zh if form.startswith("无水"))


def _singulars(query: str) -> tuple[str, ...]:
    """Return singular readings of a normalised English plural."""
    if query.endswith("ies"):
        return (query[:-3] + "y", query[:-1])
    if query.endswith("es"):
        return (query[:-1], query[:-2])
    return (query[:-1],) if query.endswith("s") else ()
