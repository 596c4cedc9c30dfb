"""Reaction types from reaction SMILES, by counting atoms, rings and functional groups (extra `chem`).

The main product is compared with its substrates. The rules are tried in this order: a protecting group is added or
removed; electrons are gained or lost; a ring closes; a carbonyl group forms a double bond to its partner; an acyl or
alkyl group is transferred to a nucleophile; a leaving group is replaced; an acid or a carbonyl compound joins another
molecule; anything else is a functional group transformation. Types overlap (an O-alkylation is also a substitution), so
the result is a proposal for reactions without a label.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from labgym.assets.inference.substructures import matches, pattern
from labgym.assets.structures import StructureError, canonical, standard
from labgym.errors import MissingDependencyError
from labgym.protocols.model import ReactionType

MAX_SPECIES = 60
"""Largest number of molecules and ions on both sides."""

_PROTECTING = (
    "[#7]C(=O)OC([CH3])([CH3])[CH3]",
    "[#7]C(=O)OCc",
    "[#6;!$(C=C)][OX2][Si]",
    "[CX4]1[OX2][CX4][CX4][OX2]1",
    "[CX4]([OX2][CH3])[OX2][CH3]",
    "[CX4]1([OX2][#6])CCCCO1",
    "[#7]C(=O)C(F)(F)F",
    "[NX3]S(=O)(=O)c",
)
_PROTECTORS = ("C(=O)OC(=O)O", "[Si][Cl,Br]", "ClC(=O)OCc", "FC(F)(F)C(=O)O", "cS(=O)(=O)Cl")
"""Reagents that introduce a protecting group; they do not count as protected substrates."""
_REDUCTANTS = ("[BH4-]", "[AlH4-]", "[#13;H1]", "[H][H]", "[B;H1,H2,H3;!$(BO)]")
_OXIDANTS = ("[Mn+7,Mn+8,Mn+4,Cr+6,Cr+5,Cr+7,Os+8]", "[#53X3,#53X4]", "[OX2][OX2]", "[OX1-][Cl;X1]", "[OX1]~[I]~[OX1]")
_SPENT = (
    "[PX3](c)(c)c",
    "O=P(c)(c)c",
    "[#6]N=C=N[#6]",
    "[NX3]C(=O)[NX3;H1]C1CCCCC1",
    "C(=O)N=NC(=O)",
    "C(=O)NNC(=O)O[CH]",
    "O=C1CCC(=O)N1",
    "[NX3;H0;+0]([CX4])([CX4])[CX4]",
    "C(=O)[OX2][OX2H]",
    "[#53]~O",
)
"""Reagents and their by-products; such a substance is a substrate only if there is no other."""
_ACYLATING = ("[CX3](=O)[Cl,Br]", "[CX3;!$(C(=O)(O)OC)](=O)[OX2][CX3]=O")
_CARBON_NUCLEOPHILES = ("[Mg]", "[Li][#6]", "[#6][Mg]", "[Li]c")
_LEAVING = ("[CX4][Cl,Br,I]", "[CX4][OX2]S(=O)(=O)")
_ACTIVATED = "[CX4;H1,H2;$(C(C=O)C(=O))]"
_ORGANIC = "[#6;!$([C-]#N);!$(C(=O)([O-])[O-,OH]);!$([CX2](=O)=O);!$([C-]#[O+])]"
"""Carbon other than that of cyanide, carbonate and carbon oxides."""


@dataclass(frozen=True)
class TypeProposal:
    """A proposed reaction type, and the reason."""

    reaction_type: ReactionType
    why: str


@dataclass(frozen=True)
class _Sides:
    """A reaction: reactants and agents, the organic substrates of the product, the main product, and all products."""

    inputs: list[Any]
    substrates: list[Any]
    product: Any
    products: list[Any]

    def gain(self, *patterns: str) -> int:
        """Return how many more matches of the patterns the product has than all substrates together."""
        return _count([self.product], *patterns) - _count(self.substrates, *patterns)

    def has(self, *patterns: str) -> bool:
        """Return whether any reactant or agent matches a pattern."""
        return _count(self.inputs, *patterns) > 0


def typed(reaction: str) -> TypeProposal | None:
    """Return the proposed type of a reaction, or None if it is not a reaction SMILES or has no organic product.

    Raises:
        MissingDependencyError: RDKit is not installed.
    """
    try:
        sides = _sides(reaction)
    except StructureError:
        return None
    if sides is None:
        return None
    proposal = next((proposal for rule in _RULES if (proposal := rule(sides)) is not None), None)
    return proposal or TypeProposal("functional_group_transformation", "no other rule applies")


def propose(reaction: str) -> TypeProposal | None:
    """Return the proposed type of a reaction as `typed` does, or None if RDKit is not installed."""
    try:
        return typed(reaction)
    except MissingDependencyError:
        return None


def _sides(reaction: str) -> _Sides | None:
    parts = [[smiles for smiles in side.split(".") if smiles] for side in reaction.split(">")]
    if len(parts) != 3 or not parts[0] or not parts[2] or sum(map(len, parts)) > MAX_SPECIES:
        return None
    reactants_count = Counter(canonical(smiles) for smiles in parts[0])
    left_over = Counter(canonical(smiles) for smiles in parts[2])
    new = [standard(smiles) for smiles in (left_over - reactants_count).elements()]
    organic = [molecule for molecule in new if _carbons(molecule)]
    if not organic:
        return None
    product = max(organic, key=lambda molecule: (not _count([molecule], *_SPENT), molecule.GetNumHeavyAtoms()))
    reactants = [standard(smiles) for smiles in (reactants_count - left_over).elements()]
    substrates = [item for item in reactants if _carbons(item) and not _count([item], *_SPENT)]
    if product.HasSubstructMatch(pattern("[P,N;X4;+;H0]")) or not substrates:
        substrates = [item for item in reactants if _carbons(item)]
    inputs = [standard(smiles) for side in parts[:2] for smiles in side]
    return _Sides(inputs, substrates, product, new) if substrates else None


def _protection(sides: _Sides) -> TypeProposal | None:
    carriers = [item for item in sides.substrates if not _count([item], *_PROTECTORS)]
    change = _count([sides.product], *_PROTECTING) - _count(carriers, *_PROTECTING)
    if change and carriers:
        return TypeProposal("protection_deprotection", f"a protecting group is {'added' if change > 0 else 'removed'}")
    return None


def _redox(sides: _Sides) -> TypeProposal | None:
    if len(sides.substrates) == 1 or _same(sides.substrates):
        before, after = sides.substrates[0], sides.product
        times = _carbons(after) / _carbons(before)
        same = all(count == times * _others(before)[symbol] for symbol, count in _others(after).items())
        same = same and _others(before).keys() == _others(after).keys()
        if times.is_integer() and same and _electrons(after) != times * _electrons(before):
            return TypeProposal("redox", "the carbon skeleton is unchanged, its oxidation state is not")
    if sides.has(*_REDUCTANTS):
        return TypeProposal("redox", "a hydride or hydrogen is a reagent")
    if sides.has(*_OXIDANTS) and sides.gain("[OX1]", "[OX2H]", "[OX2r3]") > 0:
        return TypeProposal("redox", "an oxidant is a reagent, and the product contains more oxygen")
    return None


def _cyclization(sides: _Sides) -> TypeProposal | None:
    more = _rings([sides.product]) - _rings(sides.substrates)
    return TypeProposal("cyclization", "the product has more rings than its substrates") if more > 0 else None


def _alkylation(sides: _Sides) -> TypeProposal | None:
    if sides.has(*_CARBON_NUCLEOPHILES):
        return TypeProposal("alkylation_acylation", "an organometallic is a reagent")
    if sides.gain(*_ACYLATING) < 0 and not _count([sides.product], *_ACYLATING) and len(sides.substrates) > 1:
        return TypeProposal("alkylation_acylation", "an acyl halide or anhydride transfers its acyl group")
    carbon = _count(sides.substrates, _ACTIVATED) or (
        _count(sides.inputs, "[Al+3,Zn+2,Fe+3].[Cl-]", "[Al+3]", "[Zn+2]")
    )
    if carbon and _count(sides.substrates, *_LEAVING) and len(sides.substrates) > 1:
        return TypeProposal("alkylation_acylation", "an alkyl halide transfers its alkyl group to carbon")
    return None


def _substitution(sides: _Sides) -> TypeProposal | None:
    lost = _count(sides.substrates, *_LEAVING) > 0 and sides.gain(*_LEAVING) < 0
    swapped = any(sides.gain(f"[CX4]{symbol}") > 0 for symbol in ("Br", "I", "Cl")) and (
        sides.gain("[CX4][OX2H]") < 0 or lost or sides.gain(*_LEAVING) == 0
    )
    if (lost or swapped) and not sides.has("[#7][Br,Cl]", "C=C"):
        return TypeProposal("substitution", "a leaving group on saturated carbon is replaced")
    return None


def _double_bond(sides: _Sides) -> TypeProposal | None:
    if sides.gain("[CX3]=[CX3]", "[CX3]=[NX2]") > 0 and sides.gain("[CX3;!$(C[O,N])]=[OX1]") < 0:
        return TypeProposal("condensation", "a carbonyl group and a nucleophile join by a double bond")
    return None


def _condensation(sides: _Sides) -> TypeProposal | None:
    if len(sides.substrates) < 2:
        return None
    acids = _count(sides.substrates, "C(=O)[OX2H]")
    if acids and sides.gain("C(=O)[OX2H]") < 0 and sides.gain("C(=O)[OX2][#6]", "C(=O)[#7]") > 0:
        return TypeProposal("condensation", "an acid joins an alcohol or amine")
    if sides.gain("[#6]C(=O)[CH2,CH1]C(=O)", "[OX2H][CX4][CX3]=O") > 0:
        return TypeProposal("condensation", "two carbonyl compounds join at carbon")
    return None


_RULES = (_protection, _redox, _cyclization, _double_bond, _alkylation, _substitution, _condensation)


def _count(molecules: list[Any], *patterns: str) -> int:
    return sum(len(matches(molecule, smarts)) for molecule in molecules for smarts in patterns)


def _carbons(molecule: Any) -> int:
    if not molecule.HasSubstructMatch(pattern(_ORGANIC)):
        return 0
    return sum(atom.GetSymbol() == "C" for atom in molecule.GetAtoms())


def _electrons(molecule: Any) -> int:
    """Return a count that redox reactions change, and reactions with water, acid or ammonia do not."""
    worth = {"C": 4, "N": -3, "O": -2, "S": -2, "F": -1, "Cl": -1, "Br": -1, "I": -1}
    total = sum(worth.get(atom.GetSymbol(), 0) + int(atom.GetTotalNumHs()) for atom in molecule.GetAtoms())
    return total - int(sum(atom.GetFormalCharge() for atom in molecule.GetAtoms()))


def _others(molecule: Any) -> Counter[str]:
    """Return the number of atoms of each element except carbon, oxygen and metals."""
    symbols = (atom.GetSymbol() for atom in molecule.GetAtoms())
    return Counter(symbol for symbol in symbols if symbol in ("N", "S", "P", "B", "Si", "F", "Cl", "Br", "I"))


def _rings(molecules: list[Any]) -> int:
    return sum(molecule.GetRingInfo().NumRings() for molecule in molecules)


def _same(molecules: list[Any]) -> bool:
    from rdkit import Chem

    return len({Chem.MolToSmiles(molecule) for molecule in molecules}) == 1
