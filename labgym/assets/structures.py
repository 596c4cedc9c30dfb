"""Structures of molecules, read from SMILES with RDKit (extra `chem`) within bounds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from labgym.assets.model import Asset
from labgym.errors import LabgymError, optional_package

MAX_CHARACTERS = 500
MAX_ATOMS = 200
"""Longest SMILES and largest molecule; the longest SMILES of the catalog has 90 characters."""


class StructureError(LabgymError, ValueError):
    """A SMILES that is invalid or too large."""


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep RDKit from writing to standard error; its errors are raised here."""
    from rdkit import rdBase

    block = rdBase.BlockLogs()
    try:
        yield
    finally:
        del block


def molecule(smiles: str) -> Any:
    """Return the RDKit molecule of a SMILES; several parts may be joined by dots.

    Raises:
        StructureError: empty, too long, too large, or not a valid SMILES.
        MissingDependencyError: RDKit is not installed.
    """
    if not smiles or len(smiles) > MAX_CHARACTERS or not smiles.isascii() or any(map(str.isspace, smiles)):
        raise StructureError(
            f"{smiles[:60]!r} is not a SMILES: expected 1 to {MAX_CHARACTERS} ASCII characters without spaces"
        )
    with optional_package("rdkit", "reading structures", "chem"):
        from rdkit import Chem
    with _quiet():
        structure = Chem.MolFromSmiles(smiles)
    if structure is None:
        raise StructureError(f"{smiles[:60]!r} is not a valid SMILES: check brackets, ring closures and valences")
    if any(atom.GetAtomicNum() == 0 or atom.HasQuery() for atom in structure.GetAtoms()) or any(
        bond.HasQuery() for bond in structure.GetBonds()
    ):
        raise StructureError(f"{smiles[:60]!r} is a pattern, not a substance: write each element and bond")
    if not 0 < structure.GetNumAtoms() <= MAX_ATOMS:
        raise StructureError(f"{smiles[:60]!r} has {structure.GetNumAtoms()} heavy atoms, expected 1 to {MAX_ATOMS}")
    return structure


@lru_cache(maxsize=4096)
def canonical(smiles: str) -> str:
    """Return the canonical spelling of a structure, the same for all its spellings.

    Atom maps and isotope labels are removed, stereochemistry is kept. Alkoxides and amides that are drawn with a bond
    to their metal become ions.

    Raises:
        StructureError: not a valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    structure = molecule(smiles)
    from rdkit import Chem

    with _quiet():
        return str(Chem.MolToSmiles(_standardized(structure, smiles)))


def standard(smiles: str) -> Any:
    """Return the RDKit molecule of the canonical form, its atoms in the order of that spelling.

    Raises:
        StructureError: not a valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    spelling = canonical(smiles)
    from rdkit import Chem

    with _quiet():
        structure = Chem.MolFromSmiles(spelling)
    if structure is None:
        raise StructureError(f"{smiles[:60]!r} cannot be brought to a canonical form")
    return structure


def _as_ions(structure: Any) -> Any:
    """Return a molecule with halides and cyanides of alkali metals as ions, however they are drawn."""
    from rdkit import Chem

    pattern = Chem.MolFromSmarts("[Li,Na,K,Rb,Cs;D1;+0]-[F,Cl,Br,I,$([CX2]#[NX1]);+0]")
    pairs = structure.GetSubstructMatches(pattern)
    if not pairs:
        return structure
    ions = Chem.RWMol(structure)
    for metal, partner in pairs:
        ions.RemoveBond(metal, partner)
        ions.GetAtomWithIdx(metal).SetFormalCharge(1)
        ions.GetAtomWithIdx(partner).SetFormalCharge(-1)
    result = ions.GetMol()
    Chem.SanitizeMol(result)
    return result


def _standardized(structure: Any, smiles: str) -> Any:
    from rdkit import Chem
    from rdkit.Chem.MolStandardize import rdMolStandardize

    for atom in structure.GetAtoms():
        atom.SetAtomMapNum(0)
        atom.SetIsotope(0)
    with _quiet():
        try:
            structure = _as_ions(Chem.RemoveHs(structure))
            structure = rdMolStandardize.MetalDisconnector().Disconnect(structure)
            return rdMolStandardize.Normalizer().normalize(structure)
        except (ValueError, RuntimeError):
            raise StructureError(f"{smiles[:60]!r} cannot be brought to a canonical form") from None


def reagent_of(smiles: str, reagents: Iterable[Asset]) -> Asset | None:
    """Return the reagent that has a structure, or None; of several packs of one substance, that of the core set.

    Raises:
        StructureError: not a valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    spelling = canonical(smiles)
    for asset in sorted(reagents, key=lambda asset: (not asset.core, asset.name)):
        if asset.smiles and canonical(asset.smiles) == spelling:
            return asset
    return None
