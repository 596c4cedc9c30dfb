"""Structures of molecules, read from SMILES with RDKit (extra `chem`) within bounds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

from labgym.assets.model import Asset
from labgym.errors import LabgymError, MissingDependencyError

MAX_CHARACTERS = 500
MAX_ATOMS = 200
"""The longest SMILES and the largest molecule that are read; the catalogue's largest has 90 characters."""


class StructureError(LabgymError, ValueError):
    """A SMILES that cannot be read, or is too large."""


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep RDKit from writing to standard error while a structure is read; its errors are raised here."""
    from rdkit import rdBase

    block = rdBase.BlockLogs()
    try:
        yield
    finally:
        del block


def molecule(smiles: str) -> Any:
    """Return the RDKit molecule of a SMILES; several parts may be joined by dots.

    Raises:
        StructureError: empty, too long, too large, or no valid SMILES.
        MissingDependencyError: RDKit is not installed.
    """
    if not smiles or len(smiles) > MAX_CHARACTERS or not smiles.isascii() or any(map(str.isspace, smiles)):
        raise StructureError(
            f"{smiles[:60]!r} is no SMILES: 1 to {MAX_CHARACTERS} characters without spaces are expected"
        )
    try:
        from rdkit import Chem
    except ImportError:
        raise MissingDependencyError("rdkit", "reading structures", "chem") from None
    with _quiet():
        found = Chem.MolFromSmiles(smiles)
    if found is None:
        raise StructureError(f"{smiles[:60]!r} is no valid SMILES: check brackets, ring closures and valences")
    if any(atom.GetAtomicNum() == 0 or atom.HasQuery() for atom in found.GetAtoms()) or any(
        bond.HasQuery() for bond in found.GetBonds()
    ):
        raise StructureError(f"{smiles[:60]!r} is a pattern, not a substance: write each element and bond")
    if not 0 < found.GetNumAtoms() <= MAX_ATOMS:
        raise StructureError(f"{smiles[:60]!r} has {found.GetNumAtoms()} heavy atoms; 1 to {MAX_ATOMS} are read")
    return found


@lru_cache(maxsize=4096)
def canonical(smiles: str) -> str:
    """Return the one spelling of a structure that all its spellings share.

    Atom maps and isotope labels are dropped, stereochemistry stays. Alkoxides and amides that are
    drawn with a bond to their metal are brought to the separated form.

    Raises:
        StructureError: no valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    drawn = molecule(smiles)
    from rdkit import Chem

    with _quiet():
        return str(Chem.MolToSmiles(_standardised(drawn, smiles)))


def standard(smiles: str) -> Any:
    """Return the RDKit molecule of the canonical form, its atoms in the order of that spelling.

    Raises:
        StructureError: no valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    spelling = canonical(smiles)
    from rdkit import Chem

    with _quiet():
        found = Chem.MolFromSmiles(spelling)
    if found is None:
        raise StructureError(f"{smiles[:60]!r} cannot be brought to a canonical form")
    return found


def _parted(found: Any) -> Any:
    """Return a molecule with halides and cyanides of alkali metals as their ions, however they were drawn."""
    from rdkit import Chem

    pattern = Chem.MolFromSmarts("[Li,Na,K,Rb,Cs;D1;+0]-[F,Cl,Br,I,$([CX2]#[NX1]);+0]")
    pairs = found.GetSubstructMatches(pattern)
    if not pairs:
        return found
    parted = Chem.RWMol(found)
    for metal, partner in pairs:
        parted.RemoveBond(metal, partner)
        parted.GetAtomWithIdx(metal).SetFormalCharge(1)
        parted.GetAtomWithIdx(partner).SetFormalCharge(-1)
    result = parted.GetMol()
    Chem.SanitizeMol(result)
    return result


def _standardised(found: Any, smiles: str) -> Any:
    from rdkit import Chem
    from rdkit.Chem.MolStandardize import rdMolStandardize

    for atom in found.GetAtoms():
        atom.SetAtomMapNum(0)
        atom.SetIsotope(0)
    with _quiet():
        try:
            found = _parted(Chem.RemoveHs(found))
            found = rdMolStandardize.MetalDisconnector().Disconnect(found)
            return rdMolStandardize.Normalizer().normalize(found)
        except (ValueError, RuntimeError):
            raise StructureError(f"{smiles[:60]!r} cannot be brought to a canonical form") from None


def same_substance(first: str, second: str) -> bool:
    """Say whether two SMILES are spellings of one substance; see `canonical` for what is looked through."""
    return canonical(first) == canonical(second)


def reagent_of(smiles: str, reagents: Iterable[Asset]) -> Asset | None:
    """Return the reagent that is a structure, or None; of several bottles of one substance that of the core set.

    Raises:
        StructureError: no valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    wanted = canonical(smiles)
    for asset in sorted(reagents, key=lambda asset: (not asset.core, asset.name)):
        if asset.chemistry is not None and asset.chemistry.smiles and canonical(asset.chemistry.smiles) == wanted:
            return asset
    return None
