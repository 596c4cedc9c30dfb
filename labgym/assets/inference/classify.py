"""Classification of a substance by structure: reactive groups, hazard flags, storage class, each with its reasons."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any, Literal

from labgym.assets.flags import BOILING_LIMIT, FLAGS, FLASH_LIMIT, Flag, group_flags
from labgym.assets.inference.substructures import Reason, matches, reasons, substructures
from labgym.assets.inference.volatility import boiling_point, burns, flash_point, molar_mass, parts
from labgym.assets.model import StorageClass
from labgym.assets.specs import REFERENCE_TEMPERATURE
from labgym.assets.structures import canonical, molecule, standard
from labgym.documents import Record

State = Literal["solid", "liquid", "gas"]
SOLID_ABOVE = 230.0
"""Estimated boiling point above which an organic substance is proposed to be a solid, degrees Celsius."""
LIQUID_ATOMS = 10
"""Heavy atoms above which a molecule without an estimated boiling point is proposed to be a solid."""
ESTIMATED = 0.6
"""Confidence in a flag that follows from an estimated boiling or flash point."""
_BY_STRUCTURE = ("explosive",)
"""Flags that depend on the structure rather than on the group: few azides of long chains explode."""
_NOT_COLD = ("azide", "oxidizing_acid", "halogenating_agent", "nitro", "energetic_heterocycle")
"""Groups whose explosives are not made safer by a refrigerator: salts, mixtures, and nitro and nitrogen-rich ones."""
EXPLOSIVE = "may explode: no ordinary cabinet suffices, follow its safety data sheet"
PYROPHORIC = "may ignite in air: store under inert gas"
"""Additions to the reason of a storage class."""
_GASES = (
    "[He,Ne,Ar,Kr,Xe,Rn]",
    "[H][H]",
    "N#N",
    "O=O",
    "[F,Cl;X1]-[F,Cl;X1]",
    "[NH3,PH3,SH2,SiH4;D0]",
    "O=C=O",
    "[C-]#[O+]",
    "[SX2](=O)=O",
)
_ZWITTERION = (
    "[$([CX3](=O)[OX2H]),$([#6]S(=O)(=O)[OX2H]),$([#6]P(=O)[OX2H])]",
    "[NX3;+0;!$(N-[!#6]);!$(N-[#6]=,#,:[!#6;!#1]);!$(N-a);!$(N-C=C)]-[CX4]",
)
"""Acid and alkylamine: the proton of the one is on the other, in a crystal of ions."""
_SOLIDS = ("[CX3;!H1](=O)[NH2]", "[nH]1cncc1", "[nH]1nncc1", "[nH]1nnnc1", "[nH]1cccn1")
"""Primary amides and azoles, which are solids because of hydrogen bonds, however small they are."""


class Inference(Record):
    """Classification of a structure; nothing in it was measured.

    Attributes:
        smiles: canonical. formula: in Hill order, all parts together. molar_mass: g/mol.
        state: proposed. boiling_point, flash_point: estimates in degrees Celsius, None if the method lacks a group.
        groups, flags: reactive groups and hazard flags, each with its reasons.
        storage_class: proposed. storage_reason: why, with warnings.
    """

    smiles: str
    formula: str
    molar_mass: float
    state: State
    boiling_point: float | None
    flash_point: float | None
    groups: dict[str, tuple[Reason, ...]]
    flags: dict[Flag, tuple[Reason, ...]]
    storage_class: StorageClass
    storage_reason: str


def classify(smiles: str, state: State | None = None) -> Inference:
    """Return the classification of a structure; every spelling of it gives the same.

    Args:
        smiles: the structure.
        state: state at room temperature, if known; otherwise it is proposed.

    Raises:
        StructureError: not a valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
    """
    original, structure = molecule(smiles), standard(smiles)
    from rdkit.Chem import rdMolDescriptors

    groups = _by_label(reasons(structure, substructures().groups))
    boiling = boiling_point(structure)
    state = state or _state(structure, boiling, groups)
    flags = _flags(structure, groups, boiling, state)
    storage, why = _storage(groups, flags, state)
    return Inference(
        smiles=canonical(smiles),
        formula=str(rdMolDescriptors.CalcMolFormula(original)),
        molar_mass=round(molar_mass(original), 2),
        state=state,
        boiling_point=boiling,
        flash_point=flash_point(boiling) if boiling is not None and burns(structure) else None,
        groups=groups,
        flags=flags,
        storage_class=storage,
        storage_reason=why,
    )


def _by_label(labels: Iterable[tuple[str, Reason]]) -> dict[str, tuple[Reason, ...]]:
    reasons_of: dict[str, tuple[Reason, ...]] = {}
    for name, reason in labels:
        reasons_of[name] = (*reasons_of.get(name, ()), reason)
    return reasons_of


def _state(structure: Any, boiling: float | None, groups: Collection[str]) -> State:
    if "aqueous" in groups:
        return "liquid"
    zwitterion = all(matches(structure, smarts) for smarts in _ZWITTERION)
    if zwitterion or parts(structure) > 1 or any(matches(structure, smarts) for smarts in _SOLIDS):
        return "solid"
    if any(matches(structure, smarts) for smarts in _GASES):
        return "gas"
    if boiling is None:
        element = structure.GetNumAtoms() == 1 and not structure.GetAtomWithIdx(0).GetTotalNumHs()
        return "solid" if element or structure.GetNumAtoms() > LIQUID_ATOMS else "liquid"
    return "gas" if boiling < REFERENCE_TEMPERATURE else "liquid" if boiling <= SOLID_ABOVE else "solid"


def _flags(
    structure: Any, groups: dict[str, tuple[Reason, ...]], boiling: float | None, state: State
) -> dict[Flag, tuple[Reason, ...]]:
    matched = _by_label(reasons(structure, substructures().flags))
    result: dict[Flag, tuple[Reason, ...]] = {}
    for flag in FLAGS:
        grouped = _of_groups(flag, groups) if flag not in _BY_STRUCTURE else []
        why = [*grouped, *matched.get(flag, ())]
        if boiling is not None and "inert" not in groups and flag in ("flammable", "volatile_or_toxic"):
            why += _of_volatility(flag, structure, boiling, state)
        if why:
            result[flag] = tuple(why)
    return result


def _of_groups(flag: Flag, groups: dict[str, tuple[Reason, ...]]) -> list[Reason]:
    return [
        Reason(why=f"reactive group {name}", confidence=max(reason.confidence for reason in groups[name]))
        for name in groups
        if name in group_flags(flag)
    ]


def _of_volatility(flag: Flag, structure: Any, boiling: float, state: State) -> list[Reason]:
    if flag == "volatile_or_toxic":
        why = f"boils near {boiling:.0f} C by estimate, at most {BOILING_LIMIT:.0f} C counts as volatile"
        return [Reason(why=why, confidence=ESTIMATED)] if state != "solid" and boiling <= BOILING_LIMIT else []
    flash = flash_point(boiling)
    if state == "solid" or flash > FLASH_LIMIT or not burns(structure):
        return []
    why = f"flash point near {flash:.0f} C by estimate, at most {FLASH_LIMIT:.0f} C counts as flammable"
    return [Reason(why=why, confidence=ESTIMATED)]


def _storage(
    groups: dict[str, tuple[Reason, ...]], flags: dict[Flag, tuple[Reason, ...]], state: State
) -> tuple[StorageClass, str]:
    """Return the first storage class whose condition holds, worst hazard first, and the reason."""
    cold = "explosive" in flags and not any(name in groups for name in _NOT_COLD)
    choices: tuple[tuple[bool, StorageClass, str], ...] = (
        (state == "gas", "Gas", "is a gas"),
        (cold, "Refrigerator", "decomposes with heat"),
        ("cyanide" in groups or "azide" in groups, "Toxic", "releases a poisonous gas with acid"),
        ("oxidizer" in flags, "Oxidizer", "oxidizes combustible substances"),
        ("water_reactive" in flags, "WaterReactive", "reacts with water"),
        ("flammable" in flags, "Flammable", "burns"),
        ("acid" in flags and (state == "liquid" or "strong_acid" in groups), "Acid", "is a liquid or strong acid"),
        ("base" in flags, "Base", "is a base"),
        ("volatile_or_toxic" in flags, "Toxic", "is volatile or toxic"),
    )
    general: tuple[bool, StorageClass, str] = (True, "General", "no flag requires a special cabinet")
    _, storage, why = next(choice for choice in (*choices, general) if choice[0])
    doubts = [EXPLOSIVE] if "explosive" in flags else []
    doubts += [PYROPHORIC] if "organometallic" in groups and "flammable" in flags else []
    return storage, "; ".join([why, *doubts])
