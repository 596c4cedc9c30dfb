"""The first and last steps of every protocol: weighing, and cleaning up; and the names that steps use for assets."""

from __future__ import annotations

import re

from labgym.assets import Asset, Catalog
from labgym.protocols.synthesis.builder import ProtocolBuilder

GLOVE_BOX = (
    *("AluminumChloride", "Lithium", "LithiumAluminumHydride", "Potassium", "PotassiumTertButoxide", "Sodium"),
    *("SodiumEthoxide", "SodiumHydride", "SodiumMethoxide", "TertButyldimethylsilylChloride"),
)
"""Solids that are weighed without moisture."""
_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")


def weigh_first(builder: ProtocolBuilder, vessel: str) -> None:
    """Insert the preparation before all other steps: solids are weighed, moisture-sensitive ones in the glove box."""
    catalog = builder.catalog
    solids = [use.name for use in builder.reagents if catalog.get(use.name).phase == "solid"]
    dry = tuple(name for name in solids if name in GLOVE_BOX or is_pyrophoric(catalog.get(name)))
    open_ = tuple(name for name in solids if name not in dry)
    count = len(builder.steps)
    liquids = "carry the closed bottles of the liquids to the hood."
    if open_:
        names = ", ".join(short_name(name, catalog) for name in open_)
        builder.do("Weigh", f"Weigh {names}; {liquids}", open_)
    else:
        builder.do("Measure", f"Lay out the dry {short_name(vessel, catalog)}; {liquids}", vessel=(vessel,))
    if dry:
        names = ", ".join(short_name(name, catalog) for name in dry)
        builder.do("Weigh", f"Weigh {names} in the glove box into a stoppered vial.", dry, setup="WeighDry")
    builder.prepend(len(builder.steps) - count)


def clean_up(builder: ProtocolBuilder) -> None:
    """Append the last step: waste by kind, and the glassware."""
    groups = [group for use in builder.reagents for group in groups_of(builder.catalog.get(use.name))]
    halogens = any("halogen" in group for group in groups)
    waste = "halogenated and other solvent waste apart" if halogens else "solvent and aqueous waste apart"
    builder.do("Clean", f"Collect {waste} and wash the glassware.")


def short_name(name: str, catalog: Catalog) -> str:
    """Return the name that a step's text uses for an asset.

    A reagent has its first English synonym without a remark in parentheses; anything else its canonical name in words,
    as "three neck flask" or "NMR tube".
    """
    asset = catalog.get(name)
    if asset.kind == "reagent" and asset.synonyms_en:
        return asset.synonyms_en[0].split(" (")[0]
    return " ".join(word if word.isupper() else word.lower() for word in _WORDS.findall(name))


def is_pyrophoric(asset: Asset) -> bool:
    """Return whether a reagent ignites in air."""
    return asset.chemistry is not None and asset.chemistry.pyrophoric


def groups_of(asset: Asset) -> tuple[str, ...]:
    """Return the reactive groups of a reagent."""
    return () if asset.chemistry is None else asset.chemistry.groups
