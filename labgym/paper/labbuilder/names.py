"""From LabBuilder's names to assets of the catalog."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from labgym.assets import Catalog

EQUIVALENTS: Mapping[str, tuple[str, str]] = {
    "ReagentCabinet": ("TallReagentCabinet", "its items stand at 0.80 m, the height of a shelf of this cabinet"),
    "Shelf": ("EquipmentRack", "open shelving that stands on the floor"),
    "CryogenicCabinet": ("UltraLowFreezer", "upright freezer of about the same size"),
    "GrahamCondenser": ("RefluxCondenser", "condenser with a coil; Graham is one of its forms"),
    "GravityChromatographyColumn": ("ChromatographyColumn", "the same column without pressure"),
    "GasChromatographyMassSpectrometer": ("GCMS", "the same instrument"),
    "InfraredSpectrophotometer": ("FTIRSpectrometer", "infrared spectrometer for the bench"),
    "ChloroperbenzoicAcid": ("MetaChloroperbenzoicAcid", "the isomer that is sold as a reagent"),
}
"""Asset and reason by the name in LabBuilder, where the search of the catalog finds nothing or something else."""
_NUMBER = re.compile(r"_?(?<!\d)\d+$")


@dataclass(frozen=True)
class Meaning:
    """The asset that a name means, and why if the name alone does not say it."""

    asset: str
    reason: str = ""


def kind_of(name: str) -> str:
    """Return a name without the number behind it: Chair of Chair_2, FumeHood of FumeHood2."""
    return _NUMBER.sub("", name) or name


def meaning(name: str, catalog: Catalog, mapping: Mapping[str, str]) -> Meaning | None:
    """Return the asset that a name means, or None if none is found.

    The name is tried before the name without its number. Of each, the caller's mapping goes first, then `EQUIVALENTS`,
    names of the catalog, and its search.

    Args:
        mapping: names or synonyms in the catalog by LabBuilder's names.

    Raises:
        UnknownNameError: the mapping names no asset.
    """
    for text in dict.fromkeys((name, kind_of(name))):
        if text in mapping:
            asset = catalog.find(mapping[text]).name
            return Meaning(asset, f"{text} stands for it by request")
    for text in dict.fromkeys((name, kind_of(name))):
        if text in EQUIVALENTS and EQUIVALENTS[text][0] in catalog:
            return Meaning(*EQUIVALENTS[text])
        if text in catalog:
            return Meaning(text)
    for text in dict.fromkeys((name, kind_of(name))):
        match = catalog.match(text)
        if match is not None:
            reason = f"{match.form!r} is spelled like it ({match.score:.2f})" if match.how == "fuzzy" else match.note
            return Meaning(match.name, reason)
    return None


def unique_ids(names: Sequence[str]) -> tuple[str, ...]:
    """Return an id for each name: the name if it occurs once, else the name with _1, _2, ... behind it."""
    counts, reserved = Counter(names), set(names)
    numbers: Counter[str] = Counter()
    ids = []
    for name in names:
        candidate = name
        while counts[name] > 1 and candidate in reserved:
            numbers[name] += 1
            candidate = f"{name[:74]}_{numbers[name]}"
        reserved.add(candidate)
        ids.append(candidate)
    return tuple(ids)
