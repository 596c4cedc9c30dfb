"""A catalog entry for a substance with a known structure only: a standard pack, every field inferred."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from labgym.assets.inference.classify import Inference, State, classify
from labgym.assets.model import Asset, Chemistry, Hazards, Shape, Size
from labgym.errors import OptionError

MAX_NAME = 200
DENSITY_RANGE_G_ML = (1e-4, 25.0)
"""Least and greatest density of a substance, g/mL: hydrogen gas to osmium."""
CATEGORY = "inferred_reagent"
INFERRED_NOTE = "inferred from structure"
"""Beginning of the notes of an inferred entry."""
STATED_NOTE = "stated by the user"

PACKS: dict[State, dict[str, Any]] = {
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
"""The most frequent packs of the catalog's reagents."""


def infer(
    smiles: str,
    name: str = "",
    synonyms: Sequence[str] = (),
    state: State | None = None,
    density: float | None = None,
) -> Asset:
    """Return a reagent for a structure, in a standard pack; its chemistry has low confidence and a note says why.

    Args:
        smiles: the structure.
        name: name of the substance, free text; its formula by default.
        synonyms: other names.
        state: solid, liquid or gas, if known; otherwise proposed from the structure.
        density: g/mL, if known.

    Raises:
        StructureError: not a valid SMILES, or too large.
        MissingDependencyError: RDKit is not installed.
        OptionError: a name is too long, or the density is not within 0.0001 and 25 g/mL.
    """
    if any(len(text) > MAX_NAME for text in (name, *synonyms)):
        raise OptionError(f"a name has {max(map(len, (name, *synonyms)))} characters, expected at most {MAX_NAME}")
    if density is not None and not DENSITY_RANGE_G_ML[0] <= density <= DENSITY_RANGE_G_ML[1]:
        raise OptionError(
            f"density is {density:g} g/mL, expected {DENSITY_RANGE_G_ML[0]:g} to {DENSITY_RANGE_G_ML[1]:g} g/mL"
        )
    inference = classify(smiles, state)
    title = _printable(name) or inference.formula
    flags: dict[str, bool] = dict.fromkeys(inference.flags, True)
    chemical = {"water_reactive", "pyrophoric", "peroxide_former"}
    facts = "; ".join(
        f"{key} {STATED_NOTE}" for key, value in (("state", state), ("density", density)) if value is not None
    )
    chemistry = Chemistry(
        smiles=inference.smiles,
        formula=inference.formula,
        molar_mass=inference.molar_mass,
        state=inference.state,
        density=density,
        groups=tuple(inference.groups),
        storage_class=inference.storage_class,
        confidence="low",
        notes="; ".join(filter(None, (_notes(inference), facts)))[:1000],
        **{flag: value for flag, value in flags.items() if flag in chemical},
    )
    return Asset(
        name=canonical_name(title),
        kind="reagent",
        category=CATEGORY,
        subtype=next(iter(inference.groups), "unknown"),
        synonyms_zh=(f"推断试剂 {title}",),
        synonyms_en=tuple(dict.fromkeys((title, *filter(None, map(_printable, synonyms))))),
        description=f"{title} ({inference.formula}), classified from its structure by rules; nothing was measured.",
        caption=f"Read the safety data sheet first. Stored as {inference.storage_class}: {inference.storage_reason}.",
        placing="desktop",
        hazards=Hazards(**{flag: value for flag, value in flags.items() if flag not in chemical}),
        chemistry=chemistry,
        **PACKS[inference.state],
    )


def _printable(text: str) -> str:
    return " ".join("".join(char if char.isprintable() else " " for char in text).split())


def canonical_name(text: str) -> str:
    """Return a CamelCase name for free text: its ASCII letters and digits, at most 64 of them."""
    words = re.findall(r"[A-Za-z0-9]+", text)
    joined = "".join(word[0].upper() + word[1:] for word in words)
    return (joined if joined[:1].isalpha() and len(joined) > 1 else f"Reagent{joined}")[:64]


def _notes(inference: Inference) -> str:
    groups = "; ".join(f"{name}: {', '.join(reason.why for reason in why)}" for name, why in inference.groups.items())
    return f"{INFERRED_NOTE}: {groups or 'no known group'}"
