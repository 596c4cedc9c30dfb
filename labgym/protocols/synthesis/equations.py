"""Reactions as SMARTS: the product of substrates, and the substrates of a product. Both need RDKit (extra `chem`)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from itertools import product as product_of
from typing import Any

from labgym.assets.structures import canonical, standard
from labgym.errors import LabgymError

MAX_OUTCOMES = 30
"""Most ways of one reaction that are compared."""
MOST_EQUIVALENTS, MOST_LOST = 3, 4
"""Most molecules of each reactant, and most small molecules, of a balanced equation."""


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


def balanced(reactants: Sequence[str], product: str, losses: Sequence[str]) -> tuple[int, ...]:
    """Return how many of each reactant, up to three, give a product and up to four molecules that are lost; or ().

    Args:
        reactants: SMILES of at most two.
        losses: SMILES of what may be lost.
    """
    wanted, parts = _atoms(product), [_atoms(smiles) for smiles in reactants]
    lost = [_atoms(smiles) for smiles in losses]
    for counts in product_of(range(1, MOST_EQUIVALENTS + 1), repeat=len(parts)):
        total: Counter[str] = Counter()
        for count, atoms in zip(counts, parts, strict=True):
            total.update({element: count * number for element, number in atoms.items()})
        total.subtract(wanted)
        if _is_sum_of(total, lost, MOST_LOST):
            return counts
    return ()


def _is_sum_of(rest: Counter[str], lost: Sequence[Counter[str]], most: int) -> bool:
    if not any(rest.values()):
        return True
    if most == 0 or min(rest.values()) < 0:
        return False
    return any(_is_sum_of(_less(rest, atoms), lost[place:], most - 1) for place, atoms in enumerate(lost))


def _less(rest: Counter[str], atoms: Counter[str]) -> Counter[str]:
    left = Counter(rest)
    left.subtract(atoms)
    return left


@lru_cache(maxsize=2048)
def _atoms(smiles: str) -> Counter[str]:
    """Return how often each element is in a structure, hydrogen included."""
    from rdkit.Chem import AddHs

    add: Any = AddHs
    return Counter(str(atom.GetSymbol()) for atom in add(standard(smiles)).GetAtoms())


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
