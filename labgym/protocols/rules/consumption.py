"""Consumption: which hydrides and alkali metals an acid in the same vessel has used up.

Sodium hydride that was stirred with as much of an alcohol is an alkoxide; the mixture is no hydride anymore.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

from labgym.assets import Asset
from labgym.assets.inference.substructures import matches
from labgym.assets.structures import StructureError, standard
from labgym.errors import MissingDependencyError
from labgym.protocols.amounts import moles_of, read_amount

EQUIMOLAR = 0.95
"""Moles of acid per mole of base from which the base counts as used up; amounts are rounded."""
OXIDIZERS = frozenset({"strong_oxidizer", "hypochlorite", "organic_peroxide"})
"""Groups of what a reductant destroys."""
HYDROXYL = ("[OX2H]",)
ACIDS = (
    *HYDROXYL,
    "[SX2H]",
    "[nH]",
    "[NX3;H1,H2][$(C=[O,S]),$(S(=O)=O)]",
    "[CX4;H1,H2]([$(C=O),$(C#N),$(P=O),$([N+](=O)[O-]),$(S(=O)=O)])[$(C=O),$(C#N),$(P=O),$(S(=O)=O)]",
)
"""Patterns of hydrogen that a hydride takes: of alcohols, thiols, azoles, amides and doubly activated carbon."""


def _partners(asset: Asset) -> tuple[str, ...]:
    """Return the patterns of what uses a reagent up; none for complex hydrides and organometallics.

    The former react more than once, and the latter become other organometallics.
    """
    groups, formula = asset.groups, asset.formula
    if "alkali_metal" in groups:
        return HYDROXYL
    simple = not any(element in formula for element in ("C", "B", "Al", "Si", "Sn"))
    return ACIDS if "metal_hydride" in groups and simple else ()


@lru_cache(maxsize=4096)
def _gives(smiles: str, patterns: tuple[str, ...]) -> bool:
    try:
        structure = standard(smiles)
    except (StructureError, MissingDependencyError):
        return False
    return any(matches(structure, smarts) for smarts in patterns)


def used_up(assets: Iterable[Asset], moles: Mapping[str, float]) -> frozenset[str]:
    """Return the names of the hydrides and alkali metals that the acids among some reagents use up.

    Without RDKit (extra `chem`), or if amounts are unknown, nothing is used up.

    Args:
        assets: the reagents in one vessel.
        moles: of each reagent whose amount is known, by name.
    """
    present = tuple(assets)
    found = set()
    for asset in present:
        patterns = _partners(asset)
        if not patterns or not moles.get(asset.name):
            continue
        acids = [
            moles.get(other.name, 0.0)
            for other in present
            if other.name != asset.name and not _partners(other) and other.smiles and _gives(other.smiles, patterns)
        ]
        if sum(acids) >= EQUIMOLAR * moles[asset.name]:
            found.add(asset.name)
    return frozenset(found)


def moles(asset: Asset, amounts: str) -> float | None:
    """Return the moles in all amounts of a reagent, "1.2 g of 60 %; 0.3 g", or None if one of them is not known."""
    total = 0.0
    for amount in amounts.split("; "):
        part = moles_of(asset, amount)
        if part is None:
            return None
        read = read_amount(amount)
        total += part * (read.percent / 100.0 if read.percent and read.moles is None and read.mass else 1.0)
    return total
