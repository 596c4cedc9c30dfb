"""Chemical weapons by structure: no substance of these kinds is classified, planned for or stored.

Kinds follow schedule 1 of the Chemical Weapons Convention (Annex on Chemicals, part B), each as a whole: nerve agents
with their last precursors, sulfur and nitrogen mustards, lewisites.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from labgym.assets.inference.substructures import matches
from labgym.errors import LabgymError

_NITROGEN = "[NX3,NX4+;!$(N-[C,S,P]=[O,S,N])]"
_HALOETHYL = "[CX4][CX4][Cl,Br,I]"


class ProhibitedSubstanceError(LabgymError, ValueError):
    """A structure that belongs to a kind of chemical weapon."""


@dataclass(frozen=True)
class Weapon:
    """A kind of chemical weapon.

    Attributes:
        kind: its name in the singular.
        smarts: patterns, any of which must match.
        least: least number of matches of one pattern.
    """

    kind: str
    smarts: tuple[str, ...]
    least: int = 1


WEAPONS = (
    Weapon(
        "an organophosphorus fluoridate, as the nerve agents of the G and A series are",
        ("[P;X4](~[OX1,SX1])(F)[#6,$([O,S,N]~[#6])]", "[P;X4](=[#7])(F)[#6,$([O,S,N]~[#6])]", "[P;X3](F)([CX4])[O,N]"),
    ),
    Weapon(
        "an organophosphorus cyanidate, as tabun is",
        ("[P;X4](~[OX1,SX1])(C#N)[NX3,CX4]",),
    ),
    Weapon(
        "a phosphonochloridate ester, the last precursor of a nerve agent",
        ("[P;X4](~[OX1,SX1])(Cl)([$([CH3]),$([CH2][CH3]),$([CH2][CH2][CH3]),$([CH]([CH3])[CH3])])[O,S;X2][CX4]",),
    ),
    Weapon(
        "an aminoethyl ester of a phosphorus thioacid or phosphonite, as the nerve agents of the V series are",
        (
            "[P;X4](~[OX1,SX1])([O,S;X2,X1])S[CX4][CX4][NX3,NX4+]",
            "[P;X4](~[OX1,SX1])([CX4])[O,S;X2][CX4][CX4][NX3,NX4+]",
            "[P;X3]([CX4])([OX2])[OX2][CX4][CX4][NX3,NX4+]",
        ),
    ),
    Weapon(
        "a carbamate with a quaternary ammonium group next to a pyridine, as carbamate nerve agents are",
        ("[NX3]([CH3])([CH3])C(=O)Oc1cccnc1[CX4][NX4+]",),
    ),
    Weapon(
        "a sulfur mustard",
        (f"[Cl,Br,I][CX4][CX4][SX2]{_HALOETHYL}", f"[Cl,Br,I][CX4][SX2]{_HALOETHYL}"),
    ),
    Weapon("a sulfur mustard", ("[Cl,Br,I][CX4][CX4;!$(C=O)][SX2]",), least=2),
    Weapon("a nitrogen mustard", (f"{_NITROGEN}({_HALOETHYL}){_HALOETHYL}",)),
    Weapon("a lewisite", ("[As][CX3]=[CX3][Cl,Br]",)),
)


def refuse_weapon(structure: Any, spelling: str) -> None:
    """Raise an error if a structure is a chemical weapon.

    Args:
        structure: RDKit molecule of the canonical form.
        spelling: the SMILES, for the message.

    Raises:
        ProhibitedSubstanceError: it belongs to one of `WEAPONS`.
    """
    for weapon in WEAPONS:
        if any(len(matches(structure, smarts)) >= weapon.least for smarts in weapon.smarts):
            raise ProhibitedSubstanceError(
                f"{spelling[:60]!r} is {weapon.kind}: chemical weapons (CWC, schedule 1) are not classified; "
                "do not make, order or store it"
            )
