"""Stoichiometry of a batch: moles and equivalents of its reactants, and the waste that it leaves."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.protocols.amounts import moles_of, read_amount

_IN_THE_REACTION = re.compile(
    r"reactant|reagent|substrate|catalyst|base|acid|oxidant|reductant|agent$|agent \d|ligand|source|nucleophile"
    r"|electrophile|promoter|additive|protecting"
)
_ASIDE = re.compile(
    r"wash|drying|extract|quench|work-?up|recrystalli|medium|filter|decolou?ri|stationary|adsorbent|chromatogr"
)
_LIMITING = re.compile(r"reactant|substrate")
_HALOGENATED = re.compile(r"Cl|Br|I(?![a-z])")
SOLVENTS = ("organic_solvent", "solvent")
"""Categories of organic liquids."""
WATER = "DeionizedWater"


@dataclass(frozen=True)
class Use:
    """A substance of a batch: its name, its amount as written, its role, and its entry if it is known."""

    name: str
    amount: str
    role: str
    asset: Asset | None = None


@dataclass(frozen=True)
class StoichiometryRow:
    """A reactant of a batch.

    Attributes:
        moles: mol; None if they cannot be known.
        mass, volume: g and mL as stated, or from the moles; None if they cannot be known.
        equivalents: moles per mole of the limiting reagent.
        limiting: whether it is that reagent.
    """

    name: str
    role: str
    moles: float | None
    mass: float | None
    volume: float | None
    equivalents: float | None = None
    limiting: bool = False


@dataclass(frozen=True)
class WasteStream:
    """A container of waste: what goes into it, and how much, mL for liquids and g for solids."""

    kind: str
    names: tuple[str, ...]
    milliliters: float
    grams: float


def stoichiometry(uses: Iterable[Use]) -> tuple[StoichiometryRow, ...]:
    """Return the reactants with moles and equivalents; those of the work-up and the solvents are left out.

    The limiting reagent is the one of role reactant or substrate with the fewest moles. Stated equivalents count where
    the moles are unknown.
    """
    rows: list[StoichiometryRow] = []
    stated: dict[int, float] = {}
    for use in uses:
        if _ASIDE.search(use.role) or not _IN_THE_REACTION.search(use.role):
            continue
        row = _row(use)
        equivalents = read_amount(use.amount).equivalents
        if equivalents is not None:
            stated[len(rows)] = equivalents
        rows.append(row)
    candidates = [row.moles for row in rows if row.moles and _LIMITING.search(row.role)]
    candidates = candidates or [row.moles for row in rows if row.moles]
    least = min(candidates, default=None)
    found = False
    for place, row in enumerate(rows):
        limiting = not found and least is not None and row.moles == least
        found = found or limiting
        ratio = row.moles / least if row.moles and least else stated.get(place)
        moles = row.moles if row.moles is not None else ratio * least if ratio and least else None
        rows[place] = StoichiometryRow(row.name, row.role, moles, row.mass, row.volume, ratio, limiting)
    return tuple(rows)


def _row(use: Use) -> StoichiometryRow:
    amount = read_amount(use.amount)
    asset = use.asset
    moles = moles_of(asset, use.amount) if asset is not None else amount.moles
    if moles is None and amount.molarity is not None and amount.volume is not None:
        moles = amount.volume * amount.portions * amount.molarity / 1000.0
    mass = None if amount.mass is None else amount.mass * amount.portions
    volume = None if amount.volume is None else amount.volume * amount.portions
    chemistry = asset.chemistry if asset is not None else None
    solution = amount.molarity is not None or amount.percent is not None
    if mass is None and moles is not None and chemistry is not None and chemistry.molar_mass and not solution:
        mass = moles * chemistry.molar_mass
    return StoichiometryRow(use.name, use.role, moles, mass, volume)


def waste(uses: Sequence[Use]) -> tuple[WasteStream, ...]:
    """Return the waste of a batch: halogenated and other organic solvents, aqueous layers, and solids.

    Everything that is not known to be an organic liquid or a solid aid counts as aqueous if it is measured by volume.
    """
    streams: dict[str, list[Use]] = {}
    for use in uses:
        kind = _stream(use)
        if kind:
            streams.setdefault(kind, []).append(use)
    return tuple(
        WasteStream(
            kind,
            tuple(dict.fromkeys(use.name for use in streams[kind])),
            sum(_milliliters(use) for use in streams[kind]),
            sum(_grams(use) for use in streams[kind]),
        )
        for kind in ("halogenated solvents", "organic solvents", "aqueous", "solids")
        if kind in streams
    )


def _stream(use: Use) -> str:
    asset = use.asset
    category = asset.category if asset is not None else ""
    if category in SOLVENTS and use.name != WATER and (asset is None or asset.name != WATER):
        smiles = asset.smiles if asset is not None else ""
        return "halogenated solvents" if smiles and _HALOGENATED.search(smiles) else "organic solvents"
    if category in ("drying_agent", "adsorbent") or re.search(r"drying|filter aid|stationary|adsorbent", use.role):
        return "solids"
    if asset is not None and asset.phase == "gas":
        return ""
    return "aqueous" if _ASIDE.search(use.role) or (asset is not None and asset.name == WATER) else ""


def _milliliters(use: Use) -> float:
    amount = read_amount(use.amount)
    return (amount.volume or 0.0) * amount.portions


def _grams(use: Use) -> float:
    amount = read_amount(use.amount)
    return (amount.mass or 0.0) * amount.portions
