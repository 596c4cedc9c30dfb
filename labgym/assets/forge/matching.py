"""Names in files, and the published entry that an imported mesh resembles: by its texts and, among equals, by size."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.assets.catalog import Catalog
from labgym.assets.model import Asset
from labgym.assets.qualifiers import is_neutral, qualifiers
from labgym.assets.search import normalize, surface_forms

_NOISE = """
    model mesh object obj geo geom geometry default root world scene untitled final copy export exported low
    lowpoly high highpoly poly lod lod0 usd usda stl glb asset sm free lab laboratory the a an of with and new
    old test node group xform material mat looks v1 v2 v3 v4 part body mm cm inch vis visual collision col mesh
"""
NOISE = frozenset(_NOISE.split())
"""Words that do not describe an object."""
CONTAINERS = frozenset(
    ("bottle", "jar", "flask", "can", "drum", "vial", "canister", "container", "pack", "reagent", "chemical", "solvent")
)
"""Words for containers of reagents."""
AMOUNT = re.compile(r"\d+(?:\.\d+)?(?:ml|l|g|kg|mg|m|mm|cm|um|pc|percent|n|x)?", re.IGNORECASE)
_BREAKS = re.compile(
    r"(?<=[a-z])(?=[A-Z])|(?<=\d)(?=[a-z]{4})|(?<=[a-z]{3})(?=\d)|(?<=[A-Z])(?=[A-Z][a-z])|(?<!\d)\.|\.(?!\d)|[^\w.]+|_+|(?<=[^\x00-\x7f])(?=[\x00-\x7f])"
)
_AMOUNT_PARTS = re.compile(r"^(\d+(?:\.\d+)?)([a-z]*)$", re.IGNORECASE)
MAX_WORDS = 16
_ML = re.compile(r"(?<![A-Za-z])mL(?![A-Za-z])")
_MILLILITRES = {"ml": 1.0, "l": 1000.0}
UNITS = frozenset({"ml", "l", "g", "kg", "mg", "mm", "cm"})
"""Units that belong to a number before them."""


def name_words(text: str) -> list[str]:
    """Return the words of a name, at most 16: split at separators, at capitals, and between words and numbers.

    "acetone_2.5 L" gives ["acetone", "2.5L"], "RoundBottomFlask" gives ["Round", "Bottom", "Flask"], and
    "blueP1000micropipette" gives ["blue", "P1000", "micropipette"].
    """
    parts: list[str] = []
    for word in _BREAKS.split(_ML.sub("ml", text[:200])):
        if parts and re.fullmatch(r"\d+(\.\d+)?", parts[-1]) and word.casefold() in UNITS:
            parts[-1] += word
        elif word:
            parts.append(word)
    return parts[:MAX_WORDS]


def telling(text: str) -> list[str]:
    """Return the words of a name without `NOISE`, or all of them if none would be left."""
    words = name_words(text)
    return [word for word in words if word.casefold() not in NOISE] or words


def is_amount(word: str) -> bool:
    """Return whether a word is a number with or without a unit, such as 500ml."""
    return AMOUNT.fullmatch(word) is not None


def camel(parts: list[str]) -> str:
    """Return words as one CamelCase name of ASCII letters and digits, at most 60 characters; "" if none are left."""
    plain = [re.sub(r"[^A-Za-z0-9]", "", part.replace(".", "p")) for part in parts]
    name = "".join(part[0].upper() + part[1:] for part in plain if part)[:60]
    return re.sub(r"^[^A-Za-z]+", "", name)


def as_words(name: str) -> str:
    """Return a CamelCase name as lower-case words."""
    return re.sub(r"(?<=[A-Za-z])(?=\d)", " ", " ".join(name_words(name))).lower()


def number_of(word: str) -> tuple[float, str] | None:
    """Return the value and unit of a word such as 500ml, or None if it is not an amount."""
    match = _AMOUNT_PARTS.match(word)
    return (float(match[1]), match[2].lower()) if match else None


def volume_of(text: str) -> float | None:
    """Return the first volume in a name, in mL, or None."""
    amounts = filter(None, map(number_of, telling(text)))
    return next((value * _MILLILITRES[unit] for value, unit in amounts if unit in _MILLILITRES), None)


Extents = tuple[float, float, float]

MAX_PHRASE = 6
MIN_NAME_LETTERS = 3
"""Least length of a part of a name that counts as a catalog name; shorter ones must be the whole name."""
EXACT_CONFIDENCE, PHRASE_CONFIDENCE, HEAD_CONFIDENCE, MISSPELLING_CONFIDENCE = 0.9, 0.8, 0.6, 0.55
"""Confidence by evidence: the whole name; words within it; its last noun, such as flask; a misspelling."""
SIZE_DOUBT = 0.15
"""Confidence lost for each factor of e by which the longest side differs from the entry's, beyond the first."""
SIZE_RATIO = 2.5
"""Ratio of longest sides from which a size is reported as unusual."""
MIN_CONFIDENCE = 0.5
"""Least confidence at which a mesh is identified with an entry."""


@dataclass(frozen=True)
class Resemblance:
    """A published entry that a mesh resembles, the confidence in that, and the text that names it."""

    asset: Asset
    confidence: float
    why: str

    @property
    def is_accepted(self) -> bool:
        """Whether the confidence reaches `MIN_CONFIDENCE`."""
        return self.confidence >= MIN_CONFIDENCE


def resemblance(catalog: Catalog, texts: Sequence[tuple[str, str]], extents: Extents) -> Resemblance | None:
    """Return the entry that the first telling text names, or None; its confidence may be below `MIN_CONFIDENCE`.

    Args:
        texts: (source, text), most trusted first.
        extents: sides of the bounding box in meters; among entries that fit equally well the nearest size decides.
    """
    index = _Index(catalog)
    for search in (index.named, index.headed, index.misspelt):
        for where, text in texts:
            evidence = search(telling(text))
            if evidence is not None:
                alike = index.of_volume(evidence, volume_of(text))
                asset = min(alike, key=lambda asset: (size_distance(asset, extents), asset.name))
                confidence = _less_doubt(asset, evidence.confidence, extents)
                return Resemblance(asset, confidence, f"{where} says {evidence.words!r}")
    return None


def size_distance(asset: Asset, extents: Extents) -> float:
    """Return how unlike two sizes are: the norm of the logarithms of the ratios of sorted sides."""
    ours = sorted((asset.size.width, asset.size.depth, asset.size.height))
    return math.dist([math.log(side) for side in ours], [math.log(max(side, 1e-9)) for side in sorted(extents)])


def _less_doubt(asset: Asset, confidence: float, extents: Extents) -> float:
    if asset.kind == "reagent":
        return confidence  # a name states the contents; bottles come in all sizes
    longest = max(asset.size.width, asset.size.depth, asset.size.height)
    off = abs(math.log(max(max(extents), 1e-9) / longest))
    return max(confidence - SIZE_DOUBT * max(off - 1.0, 0.0), 0.1)


@dataclass(frozen=True)
class _Evidence:
    """Entries that words of a text name."""

    assets: list[Asset]
    confidence: float
    words: str


class _Index:
    """Names of a catalog, whole and by their last word.

    A head is the last word of a canonical name, such as flask of RoundBottomFlask. Words such as device or system
    are excluded because they are too general.
    """

    def __init__(self, catalog: Catalog) -> None:
        self._catalog = catalog
        self._forms: dict[str, list[Asset]] = defaultdict(list)
        self._heads: dict[str, list[Asset]] = defaultdict(list)
        generic = {normalize(word) for word in qualifiers().descriptors}
        for asset in catalog.roles:
            for form in surface_forms(asset):
                self._forms[normalize(form)].append(asset)
            head = _singular(telling(asset.name)[-1])
            if asset.kind != "reagent" and head.isalpha() and head not in generic:
                self._heads[head].append(asset)

    def named(self, words: list[str]) -> _Evidence | None:
        """Entries that the longest run of words names.

        A reagent is named only if the other words say what it is in; equipment only by the last words, because a vial
        holder is not a vial. Amounts, materials and the like may follow.
        """
        for length in range(min(len(words), MAX_PHRASE), 0, -1):
            for start in range(len(words) - length, -1, -1):
                run, before, after = words[start : start + length], words[:start], words[start + length :]
                form = normalize("".join(run))
                partial = bool(before or after)
                if not form or is_amount("".join(run)) or (partial and len(form) < MIN_NAME_LETTERS and form.isascii()):
                    continue
                named = self._forms.get(form) or self._forms.get(_singular(form)) or []
                packed = all(is_amount(word) or word.casefold() in CONTAINERS for word in before + after)
                assets = [
                    asset for asset in named if (packed if asset.kind == "reagent" else all(map(_is_modifier, after)))
                ]
                if assets:
                    return _Evidence(assets, EXACT_CONFIDENCE if packed else PHRASE_CONFIDENCE, " ".join(run))
        return None

    def headed(self, words: list[str]) -> _Evidence | None:
        """Entries whose canonical names end with the last noun of the words."""
        nouns = [word for word in words if not _is_modifier(word)]
        assets = self._heads.get(_singular(nouns[-1])) if nouns else None
        return _Evidence(assets, HEAD_CONFIDENCE, nouns[-1]) if assets else None

    def misspelt(self, words: list[str]) -> _Evidence | None:
        """The entry that the search of the catalog finds for all words together."""
        text = " ".join(word for word in words if not is_amount(word))
        match = self._catalog.match(text)
        return None if match is None else _Evidence([self._catalog.get(match.name)], MISSPELLING_CONFIDENCE, text)

    def of_volume(self, evidence: _Evidence, milliliters: float | None) -> Iterable[Asset]:
        """Return the entries that can hold a volume: of "centrifuge 50 ml" the centrifuge tube, not the centrifuge."""
        if milliliters is None or any(asset.kind == "reagent" or asset.specs.volume_mL for asset in evidence.assets):
            return evidence.assets
        stems = tuple(asset.name for asset in evidence.assets)
        vessels = [asset for asset in self._catalog if asset.name.startswith(stems) and asset.specs.volume_mL]
        return vessels or evidence.assets


def _is_modifier(word: str) -> bool:
    """Return whether a word after a name leaves its meaning: amounts, materials, colors, and words such as final."""
    return is_amount(word) or word.casefold() in NOISE or is_neutral([word])


def _singular(word: str) -> str:
    plain = normalize(word)
    return plain[:-1] if plain.endswith("s") and not plain.endswith("ss") and len(plain) > MIN_NAME_LETTERS else plain
