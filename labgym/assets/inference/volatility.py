"""Boiling points from a table of small molecules or estimated from a structure, and flash points from them.

Boiling points by the group contributions of Joback and Reid (Chem. Eng. Commun. 57, 1987, 233), silicon counted as
carbon; flash points from them by the correlation of Hshieh (Fire Mater. 21, 1997, 277). The first has an error
of some 15 K on small molecules and more on large ones, so the estimates are hints, not data.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, ClassVar

from labgym.artefacts import artefacts
from labgym.assets.inference.substructures import matches, pattern
from labgym.assets.structures import canonical
from labgym.documents import Document

MAX_HEAVY_MASS_SHARE = 0.76
"""Mass fraction of bromine and iodine above which a vapor hardly burns: bromoethane (0.73) and allyl iodide (0.755)
have flash points, iodoethane (0.81) and bromomethane (0.84) have none."""
HYDROGEN_G_MOL = 1.008
"""Molar mass of hydrogen, g/mol."""
_BASE, _KELVIN = 198.2, 273.15
_WHOLE: tuple[tuple[str, float], ...] = (
    ("[OX2][N+](=O)[O-]", 116.0),
    ("[CX3](=O)[OX2H]", 169.09),
    ("[CX3;!R](=O)[OX2]", 81.10),
    ("[CX3;R](=O)[OX2;R]", 81.10),
    ("[CX3H1](=O)", 72.24),
    ("[CX3;!R]=O", 76.75),
    ("[CX3;R]=O", 94.97),
    ("C#N", 125.66),
    ("[N+](=O)[O-]", 152.54),
)
"""Contributions of groups of several atoms, kelvin; an atom belongs to the first group that matches it. That of nitrate
esters is from the boiling point of ethyl nitrate, 87.5 C."""
_SINGLE: tuple[tuple[str, float], ...] = (
    ("[C,Si;X4;H3,H4;!R]", 23.58),
    ("[C,Si;X4;H2;!R]", 22.88),
    ("[C,Si;X4;H1;!R]", 21.74),
    ("[C,Si;X4;H0;!R]", 18.25),
    ("[CX3;H2;!R]", 18.18),
    ("[CX3;H1;!R]", 24.96),
    ("[CX3;H0;!R]", 24.14),
    ("[CX2;H0;$(C(=*)=*)]", 26.15),
    ("[CX2;H1]", 9.20),
    ("[CX2;H0]", 27.38),
    ("[C,Si;X4;H2;R]", 27.15),
    ("[C,Si;X4;H1;R]", 21.78),
    ("[C,Si;X4;H0;R]", 21.32),
    ("[c,C;X3;H1;R]", 26.73),
    ("[c,C;X3;H0;R]", 31.01),
    ("F", -0.03),
    ("Cl", 38.13),
    ("Br", 66.86),
    ("I", 93.84),
    ("[OX2H]-c", 76.34),
    ("[OX2H]", 92.88),
    ("[OX2;R,o]", 31.22),
    ("[OX2]", 22.42),
    ("[OX1]", -10.50),
    ("[NX3;H2]", 73.23),
    ("[N,n;X3;H1;R]", 52.82),
    ("[NX3;H1]", 50.17),
    ("[N,n;X3;H0]", 11.74),
    ("[N,n;X2;R;H0]", 57.55),
    ("[NX2;H0]", 74.60),
    ("[NX2;H1]", 83.08),
    ("[SX2H]", 63.56),
    ("[S,s;X2;R]", 52.10),
    ("[SX2]", 68.78),
)
"""Contributions of groups of one atom, kelvin; in a pattern of two atoms the first one counts."""


class BoilingPoints(Document):
    """Boiling points of molecules too small for the method of groups, and of metal alkyls and carbonyls.

    Attributes:
        celsius: degrees Celsius by SMILES.
    """

    SCHEMA: ClassVar[str] = "labgym.boiling_points/1"

    source: str
    celsius: dict[str, float]


@lru_cache(maxsize=1)
def measured_boiling_points() -> dict[str, float]:
    """Return the measured boiling points by canonical SMILES, degrees Celsius; they are read once per process."""
    table = BoilingPoints.load(artefacts("assets") / "chemistry" / "boiling_points.json")
    return {canonical(smiles): celsius for smiles, celsius in table.celsius.items()}


def boiling_point(molecule: Any) -> float | None:
    """Return the estimated boiling point of an uncharged molecule with carbon, degrees Celsius.

    None if the method has no group for an atom: ions, metals, phosphorus, sulfur bound to oxygen.
    """
    if not molecule.HasSubstructMatch(pattern("[#6]")) or parts(molecule) > 1:
        return None
    free = set(range(molecule.GetNumAtoms()))
    total = _BASE
    for smarts, kelvin in _WHOLE:
        for atoms in matches(molecule, smarts):
            if free.issuperset(atoms):
                free.difference_update(atoms)
                total += kelvin
    for smarts, kelvin in _SINGLE:
        claimed = {atoms[0] for atoms in matches(molecule, smarts)} & free
        free -= claimed
        total += kelvin * len(claimed)
    return None if free else round(total - _KELVIN, 1)


def flash_point(boiling: float) -> float:
    """Return the estimated closed-cup flash point for a boiling point, both in degrees Celsius."""
    return round(-54.5377 + 0.5883 * boiling + 0.00022 * boiling**2, 1)


def burns(molecule: Any) -> bool:
    """Return whether the vapor burns: more hydrogen than halogen, and not mostly bromine and iodine by mass."""
    hydrogens = sum(int(atom.GetTotalNumHs()) for atom in molecule.GetAtoms())
    heavy = sum(float(atom.GetMass()) for atom in molecule.GetAtoms() if atom.GetSymbol() in ("Br", "I"))
    return hydrogens > len(matches(molecule, "[F,Cl,Br,I]")) and heavy < MAX_HEAVY_MASS_SHARE * molar_mass(molecule)


def parts(molecule: Any) -> int:
    """Return the number of ions or molecules that are not bound to each other."""
    from rdkit import Chem

    return len(Chem.GetMolFrags(molecule))


def molar_mass(molecule: Any) -> float:
    """Return the molar mass of all parts together, g/mol, hydrogens included."""
    return math.fsum(float(atom.GetMass()) + HYDROGEN_G_MOL * int(atom.GetTotalNumHs()) for atom in molecule.GetAtoms())
