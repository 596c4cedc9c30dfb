"""Reactions as SMARTS: the product of substrates, and the substrates of a product. Both need RDKit (extra `chem`)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from labgym.assets.structures import canonical, standard
from labgym.errors import LabgymError

MAX_OUTCOMES = 30
"""Most ways of one reaction that are compared."""


def forward(equations: Sequence[str], reactants: Sequence[str]) -> tuple[str, ...]:
    """Return the products that the first equation gives that applies, canonical, without repeats.

    Args:
        equations: reaction SMARTS with one product each.
        reactants: SMILES in the order of the equations.
    """
    for equation in equations:
        products = tuple(dict.fromkeys(product for (product,) in _run(equation, tuple(reactants), 1)))
        if products:
            return products
    return ()


def backward(retro: str, product: str) -> tuple[tuple[str, ...], ...]:
    """Return the sets of substrates that a product may come from, canonical, without repeats."""
    return tuple(dict.fromkeys(_run(retro, (product,), 0)))


def may_be_product(equations: Sequence[str], product: str) -> bool:
    """Return whether a product has the groups that one of the equations makes; True without RDKit."""
    try:
        from rdkit.Chem import MolFromSmarts, MolFromSmiles
    except ImportError:
        return True
    molecule = MolFromSmiles(product)
    parts = [MolFromSmarts(equation.rpartition(">>")[2]) for equation in equations]
    return molecule is not None and any(part is not None and molecule.HasSubstructMatch(part) for part in parts)


def same(a: str, b: str) -> bool:
    """Return whether two structures agree, apart from stereochemistry, small ions and charges."""
    return _core(a) == _core(b)


def molar_mass(smiles: str) -> float:
    """Return the molar mass of a structure in g/mol."""
    from rdkit.Chem import Descriptors

    compute: Any = Descriptors.MolWt  # type: ignore[attr-defined]
    return float(compute(standard(smiles)))


@lru_cache(maxsize=2048)
def _run(equation: str, reactants: tuple[str, ...], size: int) -> tuple[tuple[str, ...], ...]:
    """Return the outcomes of a reaction; with `size`, only outcomes of `size` molecules."""
    try:
        from rdkit.Chem import AllChem, MolFromSmiles, MolToSmiles
        from rdkit.RDLogger import DisableLog  # type: ignore[attr-defined]
    except ImportError:
        return ()
    DisableLog("rdApp.*")
    read: Any = AllChem.ReactionFromSmarts  # type: ignore[attr-defined]
    reaction = read(equation)
    molecules = [MolFromSmiles(smiles) for smiles in reactants]
    if reaction.GetNumReactantTemplates() != len(molecules) or None in molecules:
        return ()
    outcomes = []
    for products in reaction.RunReactants(tuple(molecules), maxProducts=MAX_OUTCOMES):
        try:
            names = tuple(canonical(MolToSmiles(product)) for product in products)
        except LabgymError:
            continue
        if not size or len(names) == size:
            outcomes.append(names)
    return tuple(outcomes)


@lru_cache(maxsize=2048)
def _core(smiles: str) -> str:
    """Return the largest part of a structure, uncharged, without stereochemistry; "" if it cannot be read."""
    try:
        from rdkit.Chem import MolFromSmiles, MolToSmiles
        from rdkit.Chem.MolStandardize import rdMolStandardize
    except ImportError:
        return smiles
    molecule = MolFromSmiles(re.sub(r"[/\\]", "", smiles))
    if molecule is None:
        return ""
    uncharged = rdMolStandardize.Uncharger().uncharge(rdMolStandardize.FragmentParent(molecule))
    return str(MolToSmiles(uncharged, isomericSmiles=False))
