"""Which published entry an imported mesh resembles: by its texts, and among equals by size."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.assets.catalog import Catalog
from labgym.assets.forge.words import CONTAINERS, is_amount, telling
from labgym.assets.model import Asset
from labgym.assets.search import normalise, surface_forms
from labgym.errors import UnknownNameError

Extents = tuple[float, float, float]

MAX_PHRASE = 6
SHORTEST = 3
"""Least length of a part of a name that counts as a catalogue name; shorter ones must be the whole."""
EXACT, PHRASE, HEAD, MISSPELT = 0.9, 0.8, 0.6, 0.55
"""How sure a match is: the whole name; words within it; a noun such as flask; a misspelling."""
SIZE_DOUBT = 0.15
"""Taken off for each factor of e that the longest side differs from the entry's, beyond the first."""


@dataclass(frozen=True)
class Match:
    """A published entry that a mesh resembles, how sure that is, and by which text."""

    asset: Asset
    confidence: float
    why: str


def match(catalog: Catalog, texts: Sequence[tuple[str, str]], extents: Extents) -> Match | None:
    """Return the entry that the first telling text names, or None.

    Args:
        texts: (where it is from, text), most trusted first.
        extents: sides of the bounding box in metres: nearest sizes decide among entries that fit equally well.
    """
    index = _Index(catalog)
    for search in (index.named, index.headed, index.misspelt):
        for where, text in texts:
            found, confidence, said = search(telling(text))
            if found:
                asset = min(found, key=lambda asset: (size_distance(asset, extents), asset.name))
                return Match(asset, _doubted(asset, confidence, extents), f"{where} says {said!r}")
    return None


def size_distance(asset: Asset, extents: Extents) -> float:
    """Return how unlike two sizes are: the norm of the logarithms of the ratios of sorted sides."""
    ours = sorted((asset.size.width, asset.size.depth, asset.size.height))
    return math.dist([math.log(side) for side in ours], [math.log(max(side, 1e-9)) for side in sorted(extents)])


def _doubted(asset: Asset, confidence: float, extents: Extents) -> float:
    if asset.kind == "reagent":
        return confidence  # a name tells the contents; bottles come in all sizes
    longest = max(asset.size.width, asset.size.depth, asset.size.height)
    off = abs(math.log(max(max(extents), 1e-9) / longest))
    return max(confidence - SIZE_DOUBT * max(off - 1.0, 0.0), 0.1)


Found = tuple[list[Asset], float, str]
NOTHING: Found = ([], 0.0, "")


class _Index:
    def __init__(self, catalog: Catalog) -> None:
        self._catalog = catalog
        self._forms: dict[str, list[Asset]] = defaultdict(list)
        self._heads: dict[str, list[Asset]] = defaultdict(list)
        for asset in catalog:
            for form in surface_forms(asset):
                self._forms[normalise(form)].append(asset)
                if asset.kind != "reagent":
                    self._heads[_singular(telling(form)[-1])].append(asset)

    def named(self, words: list[str]) -> Found:
        """Entries that the longest run of words names; a reagent only where the other words say what it is in."""
        for length in range(min(len(words), MAX_PHRASE), 0, -1):
            for start in range(len(words) - length, -1, -1):
                run, rest = words[start : start + length], words[:start] + words[start + length :]
                form = normalise("".join(run))
                if not form or is_amount("".join(run)) or (rest and len(form) < SHORTEST and form.isascii()):
                    continue
                found = self._forms.get(form) or self._forms.get(_singular(form)) or []
                if rest and not all(is_amount(word) or word.casefold() in CONTAINERS for word in rest):
                    found = [asset for asset in found if asset.kind != "reagent"]
                if found:
                    return found, EXACT if _amounts(rest) else PHRASE, " ".join(run)
        return NOTHING

    def headed(self, words: list[str]) -> Found:
        """Entries whose names end with a word, the last such word first."""
        for word in reversed(words):
            if not is_amount(word) and (found := self._heads.get(_singular(word))):
                return found, HEAD, word
        return NOTHING

    def misspelt(self, words: list[str]) -> Found:
        """The entry that the search of the catalogue finds for all words together."""
        text = " ".join(word for word in words if not is_amount(word))
        try:
            return [self._catalog.find(text)], MISSPELT, text
        except UnknownNameError:
            return NOTHING


def _amounts(rest: Iterable[str]) -> bool:
    return all(is_amount(word) or word.casefold() in CONTAINERS for word in rest)


def _singular(word: str) -> str:
    plain = normalise(word)
    return plain[:-1] if plain.endswith("s") and not plain.endswith("ss") and len(plain) > SHORTEST else plain
