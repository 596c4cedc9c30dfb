"""Classification of a substance by structure: reactive groups, hazard flags, storage class, each with its reasons."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any, Literal

from labgym.assets.flags import BOILING_LIMIT_C, FLAGS, FLASH_LIMIT_C, Flag, group_flags
from labgym.assets.inference.prohibited import refuse_weapon
from labgym.assets.inference.substructures import Reason, matches, reasons, substructures
from labgym.assets.inference.volatility import (
    boiling_point,
    burns,
    flash_point,
    measured_boiling_points,
    molar_mass,
    parts,
)
from labgym.assets.model import StorageClass
from labgym.assets.structures import canonical, molecule, standard
from labgym.documents import Record
from labgym.quantities import ROOM_TEMPERATURE

State = Literal["solid", "liquid", "gas"]
SOLID_ABOVE_C = 230.0
"""Estimated boiling point above which an organic substance is proposed to be a solid, degrees Celsius."""
LIQUID_ATOMS = 10
"""Heavy atoms above which a molecule without an estimated boiling point is proposed to be a solid."""
ESTIMATED_CONFIDENCE = 0.6
"""Confidence in a flag that follows from an estimated boiling or flash point."""
_BY_STRUCTURE = ("explosive",)
"""Flags that depend on the structure rather than on the group: few azides of long chains explode."""
_NOT_COLD = ("azide", "oxidizing_acid", "halogenating_agent", "nitro", "energetic_heterocycle")
"""Groups whose explosives are not made safer by a refrigerator: salts, mixtures, and nitro and nitrogen-rich ones."""
EXPLOSIVE = "may explode: no ordinary cabinet suffices, follow its safety data sheet"
PYROPHORIC = "may ignite in air: store under inert gas"
"""Additions to the reason of a storage class."""
WHITE_PHOSPHORUS = "white phosphorus"
"""Reason of the one pyrophoric substance that water protects."""
_NOBLE_GAS = "[He,Ne,Ar,Kr,Xe,Rn;D0]"
_LIQUIDS = (
    "[CX3-;$([CH3-]),$([CH2-][CX4])].[CX3-;$([CH3-]),$([CH2-][CX4])].[Zn+2,Al+3,AlH+2]",
    "[PX4](=O)([OX2][CX4])([OX2][CX4])[OX2,CX4]",
    "[PX3;+0]([CX4;!R])([CX4;!R])[CX4;!R]",
)
"""Alkyls of zinc and aluminium, drawn as ions; trialkyl phosphates, phosphonates and phosphines."""
_ZWITTERION = (
    "[$([CX3](=O)[OX2H]),$([#6]S(=O)(=O)[OX2H]),$([#6]P(=O)[OX2H])]",
    "[NX3;+0;!$(N-[!#6]);!$(N-[#6]=,#,:[!#6;!#1]);!$(N-a);!$(N-C=C)]-[CX4]",
)
"""Acid and alkylamine: the proton of the one is on the other, in a crystal of ions."""
_SOLIDS = (
    "[CX3;!H1](=O)[NH2]",
    "[nH]1cncc1",
    "[nH]1nncc1",
    "[nH]1nnnc1",
    "[nH]1cccn1",
    "[BX3]([OX2H])[OX2H]",
    "p12p3p1p23",
)
"""Primary amides, azoles and boronic acids, solids because of hydrogen bonds, however small; white phosphorus."""


class Inference(Record):
    """Classification of a structure; nothing in it was measured but the boiling points of small molecules.

    Attributes:
        smiles: canonical. formula: in Hill order, all parts together. molar_mass: g/mol.
        state: proposed.
        boiling_point: degrees Celsius; None if it was not measured and the method of estimation lacks a group.
        measured: whether the boiling point is a measured one.
        flash_point: estimate in degrees Celsius; None without a boiling point.
        groups, flags: reactive groups and hazard flags, each with its reasons.
        storage_class: proposed. storage_reason: why, with warnings.
    """

    smiles: str
    formula: str
    molar_mass: float
    state: State
    boiling_point: float | None
    measured: bool
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
        ProhibitedSubstanceError: a chemical weapon.
        MissingDependencyError: RDKit is not installed.
    """
    original, structure = molecule(smiles), standard(smiles)
    refuse_weapon(structure, smiles)
    from rdkit.Chem import rdMolDescriptors

    groups = _by_label(reasons(structure, substructures().groups))
    measured = measured_boiling_points().get(canonical(smiles))
    boiling = measured if measured is not None else boiling_point(structure)
    if state is None:
        state = _phase(measured) if measured is not None else _state(structure, boiling, groups)
    flags = _flags(structure, groups, boiling, state)
    phosphorus = any(reason.why == WHITE_PHOSPHORUS for reason in flags.get("pyrophoric", ()))
    storage, why = storage_of(groups, flags, state, phosphorus)
    return Inference(
        smiles=canonical(smiles),
        formula=str(rdMolDescriptors.CalcMolFormula(original)),
        molar_mass=round(molar_mass(original), 2),
        state=state,
        boiling_point=boiling,
        measured=measured is not None,
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
    if any(matches(structure, smarts) for smarts in _LIQUIDS):
        return "liquid"
    if zwitterion or parts(structure) > 1 or any(matches(structure, smarts) for smarts in _SOLIDS):
        return "solid"
    if matches(structure, _NOBLE_GAS):
        return "gas"
    if boiling is None:
        element = structure.GetNumAtoms() == 1 and not structure.GetAtomWithIdx(0).GetTotalNumHs()
        return "solid" if element or structure.GetNumAtoms() > LIQUID_ATOMS else "liquid"
    return _phase(boiling)


def _phase(boiling: float) -> State:
    return "gas" if boiling < ROOM_TEMPERATURE else "liquid" if boiling <= SOLID_ABOVE_C else "solid"


def _flags(
    structure: Any, groups: dict[str, tuple[Reason, ...]], boiling: float | None, state: State
) -> dict[Flag, tuple[Reason, ...]]:
    matched = _by_label(reasons(structure, substructures().flags))
    result: dict[Flag, tuple[Reason, ...]] = {}
    for flag in FLAGS:
        grouped = _of_groups(flag, groups) if flag not in _BY_STRUCTURE else []
        why = [*grouped, *matched.get(flag, ())]
        organic = "inert" not in groups and bool(matches(structure, "[#6;!$(C(=O)=O)]"))
        if boiling is not None and organic and flag in ("flammable", "volatile_or_toxic"):
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
        why = f"boils near {boiling:.0f} C, at most {BOILING_LIMIT_C:.0f} C counts as volatile"
        return (
            [Reason(why=why, confidence=ESTIMATED_CONFIDENCE)]
            if state != "solid" and boiling <= BOILING_LIMIT_C
            else []
        )
    flash = flash_point(boiling)
    if state == "solid" or flash > FLASH_LIMIT_C or not burns(structure):
        return []
    why = f"flash point near {flash:.0f} C by estimate, at most {FLASH_LIMIT_C:.0f} C counts as flammable"
    return [Reason(why=why, confidence=ESTIMATED_CONFIDENCE)]


def storage_of(
    groups: Collection[str], flags: Collection[str], state: State, phosphorus: bool = False
) -> tuple[StorageClass, str]:
    """Return the first storage class whose condition holds, worst hazard first, and the reason.

    Args:
        groups, flags: names of the reactive groups and hazard flags.
        state: at room temperature.
        phosphorus: whether it is white phosphorus, which is kept under water.
    """
    cold = "explosive" in flags and not any(name in groups for name in _NOT_COLD)
    choices: tuple[tuple[bool, StorageClass, str], ...] = (
        (state == "gas", "Gas", "is a gas"),
        (cold, "Refrigerator", "decomposes with heat"),
        ("cyanide" in groups or "azide" in groups, "Toxic", "releases a poisonous gas with acid"),
        ("oxidizer" in flags, "Oxidizer", "oxidizes combustible substances"),
        (phosphorus, "Flammable", "burns in air: kept under water"),
        ("water_reactive" in flags, "WaterReactive", "reacts with water"),
        ("pyrophoric" in flags, "WaterReactive", "must not meet air, nor the damp that other cabinets admit"),
        ("flammable" in flags, "Flammable", "burns"),
        ("explosive" in flags, "Flammable", "is an explosive, kept wetted as a flammable solid (UN class 4.1)"),
        ("acid" in flags and (state == "liquid" or "strong_acid" in groups), "Acid", "is a liquid or strong acid"),
        ("base" in flags, "Base", "is a base"),
        ("volatile_or_toxic" in flags, "Toxic", "is volatile or toxic"),
    )
    general: tuple[bool, StorageClass, str] = (True, "General", "no flag requires a special cabinet")
    _, storage, why = next(choice for choice in (*choices, general) if choice[0])
    doubts = [EXPLOSIVE] if "explosive" in flags else []
    burning = "pyrophoric" in flags or ("organometallic" in groups and "flammable" in flags)
    doubts += [PYROPHORIC] if burning and not phosphorus else []
    return storage, "; ".join([why, *doubts])
