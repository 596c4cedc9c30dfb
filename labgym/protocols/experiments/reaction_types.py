"""The type of a reaction from its SMILES, by bookkeeping of atoms, rings and functional groups (extra `chem`).

The main product is compared with the substrates that it is made of. The rules are tried in order: protecting groups
come or go; electrons are gained or lost; a ring closes; a carbonyl group becomes a double bond to its partner; an acyl
or alkyl group joins a nucleophile; a leaving group is replaced; an acid or a carbonyl compound joins another molecule;
anything else is a change of a functional group. Types overlap (an O-alkylation is a substitution as well), so the
answer is a proposal for reactions that nobody has labelled.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from labgym.assets.inference.substructures import matches, pattern
from labgym.assets.structures import StructureError, canonical, standard
from labgym.protocols.model import ReactionType

MAX_SPECIES = 60
"""Molecules and ions on both sides that are read."""

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
"""What brings a protecting group along, not to be counted as carrying it."""
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
"""Reagents and what becomes of them; a substance of these kinds is a substrate only where nothing else is left."""
_ACYLATING = ("[CX3](=O)[Cl,Br]", "[CX3;!$(C(=O)(O)OC)](=O)[OX2][CX3]=O")
_CARBON_NUCLEOPHILES = ("[Mg]", "[Li][#6]", "[#6][Mg]", "[Li]c")
_LEAVING = ("[CX4][Cl,Br,I]", "[CX4][OX2]S(=O)(=O)")
_ACTIVATED = "[CX4;H1,H2;$(C(C=O)C(=O))]"
_ORGANIC = "[#6;!$([C-]#N);!$(C(=O)([O-])[O-,OH]);!$([CX2](=O)=O);!$([C-]#[O+])]"
"""Carbon other than that of cyanide, carbonate and carbon oxides."""


@dataclass(frozen=True)
class Typed:
    """A proposed reaction type, and why."""

    reaction_type: ReactionType
    why: str


@dataclass(frozen=True)
class _Sides:
    """A reaction as the rules see it: molecules, the organic ones that the product is made of, and its main product."""

    given: list[Any]
    substrates: list[Any]
    product: Any
    products: list[Any]

    def gain(self, *patterns: str) -> int:
        """Return how many more places of any pattern the product has than the substrates together."""
        return _count([self.product], *patterns) - _count(self.substrates, *patterns)

    def has(self, *patterns: str) -> bool:
        """Say whether anything that is put in has a pattern."""
        return _count(self.given, *patterns) > 0


def typed(reaction: str) -> Typed | None:
    """Return the proposed type of a reaction SMILES; None where it is not one, or has no organic product.

    Raises:
        MissingDependencyError: RDKit is not installed.
    """
    try:
        sides = _sides(reaction)
    except StructureError:
        return None
    if sides is None:
        return None
    found = next((found for rule in _RULES if (found := rule(sides)) is not None), None)
    return found or Typed("functional_group_transformation", "no other rule holds")


def _sides(reaction: str) -> _Sides | None:
    parts = [[smiles for smiles in side.split(".") if smiles] for side in reaction.split(">")]
    if len(parts) != 3 or not parts[0] or not parts[2] or sum(map(len, parts)) > MAX_SPECIES:
        return None
    put_in = Counter(canonical(smiles) for smiles in parts[0])
    left_over = Counter(canonical(smiles) for smiles in parts[2])
    new = [standard(smiles) for smiles in (left_over - put_in).elements()]
    organic = [found for found in new if _carbons(found)]
    if not organic:
        return None
    product = max(organic, key=lambda found: (not _count([found], *_SPENT), found.GetNumHeavyAtoms()))
    reactants = [standard(smiles) for smiles in (put_in - left_over).elements()]
    substrates = [found for found in reactants if _carbons(found) and not _count([found], *_SPENT)]
    if product.HasSubstructMatch(pattern("[P,N;X4;+;H0]")) or not substrates:
        substrates = [found for found in reactants if _carbons(found)]
    given = [standard(smiles) for side in parts[:2] for smiles in side]
    return _Sides(given, substrates, product, new) if substrates else None


def _protection(sides: _Sides) -> Typed | None:
    carriers = [found for found in sides.substrates if not _count([found], *_PROTECTORS)]
    change = _count([sides.product], *_PROTECTING) - _count(carriers, *_PROTECTING)
    if change and carriers:
        return Typed("protection_deprotection", f"a protecting group {'comes' if change > 0 else 'goes'}")
    return None


def _redox(sides: _Sides) -> Typed | None:
    if len(sides.substrates) == 1 or _same(sides.substrates):
        before, after = sides.substrates[0], sides.product
        times = _carbons(after) / _carbons(before)
        kept = all(count == times * _others(before)[symbol] for symbol, count in _others(after).items())
        kept = kept and _others(before).keys() == _others(after).keys()
        if times.is_integer() and kept and _electrons(after) != times * _electrons(before):
            return Typed("redox", "the carbon skeleton stays, its electrons change")
    if sides.has(*_REDUCTANTS):
        return Typed("redox", "a hydride or hydrogen is put in")
    if sides.has(*_OXIDANTS) and sides.gain("[OX1]", "[OX2H]", "[OX2r3]") > 0:
        return Typed("redox", "an oxidant is put in, and the product holds more oxygen")
    return None


def _cyclization(sides: _Sides) -> Typed | None:
    more = _rings([sides.product]) - _rings(sides.substrates)
    return Typed("cyclization", "the product has more rings than what it is made of") if more > 0 else None


def _alkylation(sides: _Sides) -> Typed | None:
    if sides.has(*_CARBON_NUCLEOPHILES):
        return Typed("alkylation_acylation", "an organometallic is put in")
    if sides.gain(*_ACYLATING) < 0 and not _count([sides.product], *_ACYLATING) and len(sides.substrates) > 1:
        return Typed("alkylation_acylation", "an acyl halide or anhydride gives its acyl group")
    carbon = _count(sides.substrates, _ACTIVATED) or (_count(sides.given, "[Al+3,Zn+2,Fe+3].[Cl-]", "[Al+3]", "[Zn+2]"))
    if carbon and _count(sides.substrates, *_LEAVING) and len(sides.substrates) > 1:
        return Typed("alkylation_acylation", "an alkyl halide gives its alkyl group to carbon")
    return None


def _substitution(sides: _Sides) -> Typed | None:
    lost = _count(sides.substrates, *_LEAVING) > 0 and sides.gain(*_LEAVING) < 0
    swapped = any(sides.gain(f"[CX4]{symbol}") > 0 for symbol in ("Br", "I", "Cl")) and (
        sides.gain("[CX4][OX2H]") < 0 or lost or sides.gain(*_LEAVING) == 0
    )
    if (lost or swapped) and not sides.has("[#7][Br,Cl]", "C=C"):
        return Typed("substitution", "a leaving group on saturated carbon is replaced")
    return None


def _double_bond(sides: _Sides) -> Typed | None:
    if sides.gain("[CX3]=[CX3]", "[CX3]=[NX2]") > 0 and sides.gain("[CX3;!$(C[O,N])]=[OX1]") < 0:
        return Typed("condensation", "a carbonyl group and a nucleophile join by a double bond")
    return None


def _condensation(sides: _Sides) -> Typed | None:
    if len(sides.substrates) < 2:
        return None
    acids = _count(sides.substrates, "C(=O)[OX2H]")
    if acids and sides.gain("C(=O)[OX2H]") < 0 and sides.gain("C(=O)[OX2][#6]", "C(=O)[#7]") > 0:
        return Typed("condensation", "an acid joins an alcohol or amine")
    if sides.gain("[#6]C(=O)[CH2,CH1]C(=O)", "[OX2H][CX4][CX3]=O") > 0:
        return Typed("condensation", "two carbonyl compounds join at carbon")
    return None


_RULES = (_protection, _redox, _cyclization, _double_bond, _alkylation, _substitution, _condensation)


def _count(molecules: list[Any], *patterns: str) -> int:
    return sum(len(matches(found, smarts)) for found in molecules for smarts in patterns)


def _carbons(found: Any) -> int:
    if not found.HasSubstructMatch(pattern(_ORGANIC)):
        return 0
    return sum(atom.GetSymbol() == "C" for atom in found.GetAtoms())


def _electrons(found: Any) -> int:
    """Return what a redox reaction changes and one with water, acid or ammonia does not."""
    worth = {"C": 4, "N": -3, "O": -2, "S": -2, "F": -1, "Cl": -1, "Br": -1, "I": -1}
    total = sum(worth.get(atom.GetSymbol(), 0) + int(atom.GetTotalNumHs()) for atom in found.GetAtoms())
    return total - int(sum(atom.GetFormalCharge() for atom in found.GetAtoms()))


def _others(found: Any) -> Counter[str]:
    """Return how many atoms there are of each element but carbon, oxygen and metals."""
    symbols = (atom.GetSymbol() for atom in found.GetAtoms())
    return Counter(symbol for symbol in symbols if symbol in ("N", "S", "P", "B", "Si", "F", "Cl", "Br", "I"))


def _rings(molecules: list[Any]) -> int:
    return sum(found.GetRingInfo().NumRings() for found in molecules)


def _same(molecules: list[Any]) -> bool:
    from rdkit import Chem

    return len({Chem.MolToSmiles(found) for found in molecules}) == 1
