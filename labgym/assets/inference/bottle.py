"""A catalogue entry for a substance that is known by its structure alone: a standard pack, every field inferred."""

from __future__ import annotations

import re
from typing import Any

from labgym.assets.inference.classify import Inference, State, classify
from labgym.assets.model import Asset, Chemistry, Hazards, Shape, Size
from labgym.errors import OptionError

MAX_NAME = 200
INFERRED = "inferred from structure"
"""How the notes of an inferred entry begin."""

_PACKS: dict[State, dict[str, Any]] = {
    "liquid": {
        "size": Size(width=0.08, depth=0.08, height=0.18),
        "mass": 0.9,
        "shape": Shape(name="bottle", parameters={"glass": "amber", "liquid": True, "volume": 500}),
        "specs": {"container": "500 mL amber glass bottle", "pack_mL": 500},
    },
    "solid": {
        "size": Size(width=0.075, depth=0.075, height=0.14),
        "mass": 0.58,
        "shape": Shape(name="jar", parameters={"glass": "plastic"}),
        "specs": {"container": "500 g plastic jar", "pack_g": 500},
    },
    "gas": {
        "size": Size(width=0.23, depth=0.23, height=1.55),
        "mass": 70.0,
        "shape": Shape(name="gas_cylinder", parameters={"colour": "white"}),
        "specs": {"container": "47 L steel cylinder", "filling_bar": 150},
    },
}
"""The packs that the catalogue's reagents come in most."""


def infer(smiles: str, name: str = "") -> Asset:
    """Return a reagent for a structure, in a standard pack; its chemistry is of low confidence and says so.

    Args:
        name: what the substance is called, free text; its formula by default.

    Raises:
        StructureError: no valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
        OptionError: the name is too long.
    """
    if len(name) > MAX_NAME:
        raise OptionError(f"name of {len(name)} characters; at most {MAX_NAME} are taken")
    found = classify(smiles)
    called = " ".join("".join(char if char.isprintable() else " " for char in name).split()) or found.formula
    flags: dict[str, bool] = dict.fromkeys(found.flags, True)
    mine = {"water_reactive", "peroxide_former"}
    chemistry = Chemistry(
        smiles=found.smiles,
        formula=found.formula,
        molar_mass=found.molar_mass,
        state=found.state,
        groups=tuple(found.groups),
        storage_class=found.storage_class,
        confidence="low",
        notes=_notes(found),
        **{flag: value for flag, value in flags.items() if flag in mine},
    )
    return Asset(
        name=canonical_name(called),
        kind="reagent",
        category="inferred_reagent",
        subtype=next(iter(found.groups), "unknown"),
        synonyms_en=(called,),
        description=f"{called} ({found.formula}), classified from its structure by rules; nothing of it was measured.",
        caption=f"Check the safety data sheet first. Kept as {found.storage_class}: {found.storage_reason}.",
        placing="desktop",
        hazards=Hazards(**{flag: value for flag, value in flags.items() if flag not in mine}),
        chemistry=chemistry,
        **_PACKS[found.state],
    )


def canonical_name(text: str) -> str:
    """Return a CamelCase name for free text: its ASCII letters and digits, at most 64 of them."""
    words = re.findall(r"[A-Za-z0-9]+", text)
    joined = "".join(word[0].upper() + word[1:] for word in words)
    return (joined if joined[:1].isalpha() and len(joined) > 1 else f"Reagent{joined}")[:64]


def _notes(found: Inference) -> str:
    said = "; ".join(f"{name}: {', '.join(reason.why for reason in why)}" for name, why in found.groups.items())
    return f"{INFERRED}: {said or 'no known group'}"[:1000]
