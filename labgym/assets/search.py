"""From user input to canonical names: exact names first, then names with qualifiers, then misspellings."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Annotated, ClassVar, Literal

from pydantic import Field
from rapidfuzz import process
from rapidfuzz.distance import OSA, Indel

from labgym.artefacts import artefacts
from labgym.assets.archive import SHAPE
from labgym.assets.measures import StatedSize, first_size, of_size, size_note
from labgym.assets.model import Asset
from labgym.assets.phrases import MAX_EDITS, MIN_LENGTH, PhraseIndex, edits, misspells_substance, similarity
from labgym.assets.qualifiers import QualifiedName, is_aqueous, is_hydrate, of_equipment, of_substance
from labgym.documents import Document

MAX_QUERY = 200
MIN_SIMILARITY = 0.4
"""Least similarity at which an asset is listed as near to a text."""

_SPELLINGS = str.maketrans({"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"})
_VARIANTS = (("sulph", "sulf"), ("aluminium", "aluminum"), ("caesium", "cesium"))
_SEPARATORS = re.compile(r"[\W_]+")
_WORD = re.compile(r"^(?!.*\b[A-Z]{2,}\b).*[a-z]{3}")
"""A name without abbreviations or formulas: TBDPSCl does not misspell TBDMSCl, nor TMA chloride TMS chloride."""
_ENDING = re.compile(r"[a-z]{3}(?:amine|amide|ide|ane|ene|ole|idine)$")
_FAMILY = re.compile(r"^Large|(?<!\d)\d+$")
"""The part of an asset's name that distinguishes it from those of other sizes."""
_BRACKETS = re.compile(r"^([^()\uff08\uff09]*[^()\uff08\uff09\s])\s*[(\uff08]([^()\uff08\uff09]+)[)\uff09]\s*$")


class Lookalikes(Document):
    """Names of other substances: a text that is as close to one of them is not a misspelling of a reagent."""

    SCHEMA: ClassVar[str] = "labgym.lookalikes/1"

    names: Annotated[tuple[Annotated[str, Field(min_length=1, max_length=80)], ...], Field(max_length=2000)]


@lru_cache(maxsize=1)
def lookalikes() -> tuple[str, ...]:
    """Return the published names; they are read once per process."""
    return Lookalikes.load(artefacts("assets") / "chemistry" / "lookalikes.json").names


def normalize(text: str) -> str:
    """Return text with case, width, accents, spacing and punctuation folded; digits and letters of any script stay.

    "Büchner funnel", "buchner-funnel" and "BuchnerFunnel" become the same string, "H₂SO₄" becomes "h2so4".
    """
    folded = unicodedata.normalize("NFKD", text[:MAX_QUERY]).casefold().translate(_SPELLINGS)
    plain = _SEPARATORS.sub("", "".join(char for char in folded if not unicodedata.combining(char)))
    for variant, usual in _VARIANTS:
        plain = plain.replace(variant, usual)
    return plain


def surface_forms(asset: Asset) -> tuple[str, ...]:
    """Return the names of an asset: its canonical name, its synonyms and its CAS number.

    An imported bottle has the CAS number of its contents, which stays a name of the published reagent alone.
    """
    chemistry = asset.chemistry if asset.shape.name != SHAPE else None
    identifiers = (chemistry.cas,) if chemistry is not None and chemistry.cas is not None else ()
    return (asset.name, *asset.synonyms_en, *asset.synonyms_zh, *identifiers)


@dataclass(frozen=True)
class Match:
    """The asset that a text means.

    Attributes:
        name: canonical.
        form: the name, synonym or CAS number that matched, as the catalog writes it.
        how: "name", "synonym" or "fuzzy".
        score: similarity of form and text; 1 unless fuzzy.
        aside: parts of the text besides the name, such as "1 M", "anhydrous" or "2 L".
        note: how the asset differs from the size or dryness that the text asks for, else "".
    """

    name: str
    form: str
    how: Literal["name", "synonym", "fuzzy"]
    score: float
    aside: tuple[str, ...] = ()
    note: str = ""


class SynonymIndex:
    """Canonical names by normalized surface form.

    If assets share a surface form, the first keeps it: canonical names before synonyms, core assets before the rest.
    A variant of another asset is matched by its exact name and synonyms alone.
    """

    def __init__(self, assets: Iterable[Asset]) -> None:
        everything = sorted(assets, key=lambda asset: (not asset.core, asset.name))
        self._assets = {asset.name: asset for asset in everything}
        ordered = self._roles = tuple(asset for asset in everything if asset.variant_of is None)
        variants = (asset for asset in everything if asset.variant_of is not None)
        self._variant_forms = {
            normalize(form): (asset.name, form) for asset in variants for form in surface_forms(asset)
        }
        self._forms: dict[str, tuple[str, str]] = {}
        for asset in ordered:
            self._forms.setdefault(normalize(asset.name), (asset.name, asset.name))
        for asset in ordered:
            for form in surface_forms(asset):
                self._forms.setdefault(normalize(form), (asset.name, form))
        # A name that follows from a rule may be near to names that its source is far from: phenyl ether to phenylethen.
        self._signatures = tuple((form, _letters(form)) for form in self._forms if len(form) >= MIN_LENGTH)
        for asset in ordered:
            for form in _variants(asset):
                self._forms.setdefault(normalize(form), (asset.name, form))

    def match(self, text: str) -> Match | None:
        """Return the asset that a text means and how it was found, or None if nothing, or no single asset, is near.

        Tried in this order: a name, synonym or CAS number; one with an amount, a size, a concentration or a grade; two
        names of one asset, the second in brackets; equipment with maker, model and material; a misspelling. Of assets
        that differ in size, the one of the size in the text is taken.
        """
        if len(text) > MAX_QUERY:
            return None
        size, sizeless = first_size(text)
        match = self.exact(text)
        if match is None and size is not None:
            match = self._equipment(self.exact(sizeless))
        if match is None:
            strengths, grades = of_substance(text)
            match = self._reagent(strengths, self.exact) or self._reagent(grades, self.exact)
            match = match or self._both_names(text) or self._equipment(self._phrase(sizeless))
            match = match or self._equipment(self._misspelt(sizeless)) or self._reagent(grades, self._misspelt)
        if match is None or size is None or self._assets[match.name].kind == "reagent":
            return match
        return self._sized(match, size)

    def candidates(self, text: str, count: int = 5) -> tuple[Match, ...]:
        """Return the assets whose names or synonyms are spelled most like a text, best first, each with its score."""
        best: dict[str, Match] = {}
        for query in dict.fromkeys((normalize(text), normalize(of_substance(text[:MAX_QUERY])[1].name))):
            near = process.extract(
                query,
                self._forms.keys(),
                scorer=Indel.normalized_similarity,
                limit=3 * count,
                score_cutoff=MIN_SIMILARITY,
            )
            for form, score, _ in near if query else ():
                name, written = self._forms[form]
                if name not in best or best[name].score < score:
                    best[name] = Match(name, written, "fuzzy", score)
        return tuple(sorted(best.values(), key=lambda match: (-match.score, match.name))[:count])

    @cached_property
    def _phrases(self) -> PhraseIndex:
        return PhraseIndex(
            (form, asset.name)
            for asset in self._roles
            if asset.kind != "reagent"
            for form in (asset.name, *asset.synonyms_en)
        )

    def exact(self, text: str) -> Match | None:
        """Return the asset that has a text as a name, synonym or CAS number, or None."""
        query = normalize(text)
        for form in (query, *_singulars(query)):
            if form in self._forms:
                name, written = self._forms[form]
                # A plural of a formula is another formula: H2S is not several H2.
                if form == query or self._assets[name].kind != "reagent" or (len(form) >= 5 and form.isalpha()):
                    return Match(name, written, "name" if form == normalize(name) else "synonym", 1.0)
        if query in self._variant_forms:
            name, written = self._variant_forms[query]
            return Match(name, written, "name" if query == normalize(name) else "synonym", 1.0)
        return None

    def _phrase(self, text: str) -> Match | None:
        """Return the equipment that a text names by a phrase in it, if maker, model and material are the rest."""
        for rest in of_equipment(text):
            match = self.exact(rest) if rest else None
            if match is not None:
                return match
            phrase = self._phrases.find(rest)
            if phrase is not None:
                return Match(phrase.name, phrase.form, "synonym", 1.0, phrase.rest)
        return None

    def _both_names(self, text: str) -> Match | None:
        """Return the asset that is meant both before and within brackets: "brine (sat. NaCl)"."""
        parts = _BRACKETS.match(text)
        if parts is None:
            return None
        matches = [self.exact(part) or self._reagent(of_substance(part)[1], self.exact) for part in parts.groups()]
        first, second = matches
        if first is None or second is None or first.name != second.name:
            return None
        return replace(first, aside=(*first.aside, parts[2]))

    def _misspelt(self, text: str) -> Match | None:
        query = normalize(text)
        near: dict[str, tuple[int, float, str]] = {}
        letters = _letters(query)
        for form, signature in self._signatures:
            if abs(len(form) - len(query)) > MAX_EDITS or (letters ^ signature).bit_count() > 2 * MAX_EDITS:
                continue
            name, _ = self._forms[form]
            count = edits(form, query)
            if count is not None:
                near[name] = min(near.get(name, (9, 0.0, "")), (count, -similarity(form, query), form))
        ranked = sorted((count, score, name, form) for name, (count, score, form) in near.items())
        if not ranked or (len(ranked) > 1 and ranked[0][0] == ranked[1][0]):
            return None
        count, score, name, form = ranked[0]
        written = self._forms[form][1]
        if _WORD.search(written) is None or _is_other_substance(query, count):
            return None
        if self._assets[name].kind == "reagent" and not misspells_substance(form, query):
            return None
        return Match(name, written, "fuzzy", -score)

    def _equipment(self, match: Match | None) -> Match | None:
        return None if match is None or self._assets[match.name].kind == "reagent" else match

    def _reagent(self, text: QualifiedName, look_up: Callable[[str], Match | None]) -> Match | None:
        match = look_up(text.name)
        if match is None or self._assets[match.name].kind != "reagent":
            return None
        asset = self._assets[match.name]
        if text.excludes_water and is_aqueous(asset):
            return None
        note = "the catalog's is a hydrate" if text.excludes_water and is_hydrate(asset) else ""
        return replace(match, aside=text.qualifiers, note=note)

    def _sized(self, match: Match, size: StatedSize) -> Match:
        asset, stem = self._assets[match.name], _FAMILY.sub("", match.name)
        family = [other for other in self._roles if _FAMILY.sub("", other.name) == stem]
        chosen = of_size([asset, *(other for other in family if other.subtype == asset.subtype)], size)
        return replace(match, name=chosen.name, aside=(size.written, *match.aside), note=size_note(chosen, size))


def _is_other_substance(query: str, count: int) -> bool:
    """Return whether a text is within `count` edits of a substance that is not in the catalog."""
    return any(OSA.distance(name, query, score_cutoff=count) <= count for name in _other_substances())


@lru_cache(maxsize=1)
def _other_substances() -> tuple[str, ...]:
    return tuple(normalize(name) for name in lookalikes())


def _letters(form: str) -> int:
    """Return the set of a text's characters as bits; an edit changes at most two, so most forms are excluded fast."""
    bits = 0
    for char in form:
        bits |= 1 << (ord(char) % 64)
    return bits


def _variants(asset: Asset) -> Iterator[str]:
    """Yield further names of a reagent that follow from rules.

    "hydrochloric acid" of "hydrochloric acid (37%)", "三氯化铝" of "无水三氯化铝", German "triethylamin".
    """
    if asset.kind == "reagent":
        yield from (form[:-1] for form in (asset.name, *asset.synonyms_en) if _ENDING.search(form))
        yield from (form.partition(" (")[0] for form in asset.synonyms_en if form.endswith(")") and " (" in form)
        yield from (form.removeprefix("无水") for form in asset.synonyms_zh if form.startswith("无水"))


def _singulars(query: str) -> tuple[str, ...]:
    """Return singular readings of a normalized English plural."""
    if query.endswith("ies"):
        return (query[:-3] + "y", query[:-1])
    if query.endswith("es"):
        return (query[:-1], query[:-2])
    return (query[:-1],) if query.endswith("s") else ()
