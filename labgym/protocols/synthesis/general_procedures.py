"""General procedures of organic synthesis as data: `assets/synthesis/general_procedures.json`."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.protocols.experiments.model import Action, Role
from labgym.protocols.model import ReactionType

ANY = "ANY"
"""Class of a slot that takes every substance."""


class SubstanceClass(Record):
    """A class of substances.

    Attributes:
        words: pattern of the words that name it, at the end of a phrase.
        smarts: of which one must match.
        parts: pattern of its parts of names, anywhere in a phrase that names no structure: "hydroxymethyl thiazole".
    """

    words: str
    smarts: tuple[str, ...]
    parts: str = ""


class Slot(Record):
    """A substance that a general procedure takes.

    Attributes:
        key: name of it in the actions.
        classes: which substances fill it, "ANY" for all. accepts: names of substances that fill it.
        default: what is assumed if the wish names nothing; "" if the wish must, or a placeholder stands for it.
        in_equation: whether the equations of the procedure have it among the reactants, in the order of the slots.
    """

    key: str
    classes: tuple[str, ...] = ()
    accepts: tuple[str, ...] = ()
    default: str = ""
    role: Role
    in_equation: bool


class GeneralProcedure(Record):
    """A general procedure; its amounts are for 10 mmol of the substrate.

    Attributes:
        words: pattern of the words that name the transformation.
        named: whether the wish has to contain such a word. dry: whether a protic solvent is dangerous or spoils it.
        solvent: that is assumed; "" for a reaction without one.
        product: class of the product.
        equations: reaction SMARTS, of which the first that applies gives the product.
        retro: reaction SMARTS from the product to the substrates, if it leads back without doubt.
        losses: of a procedure for reactions without an own one: SMILES of what may be lost besides the product, which
            the wish must name; the equation must balance.
        actions: with the keys of the slots, "S" for the solvent, or names as materials.
    """

    id: Annotated[str, Field(pattern=r"^[a-z0-9_]{1,40}$")]
    name: str
    type: ReactionType | None = None
    words: str
    slots: tuple[Slot, ...]
    solvent: str = ""
    product: str
    equations: tuple[str, ...] = ()
    retro: str = ""
    losses: tuple[str, ...] | None = None
    actions: tuple[Action, ...]
    hazards: tuple[str, ...] = ()
    source: str
    named: bool = False
    dry: bool = False


class GeneralProcedures(Document):
    """The table; `fillers` are words without chemical content."""

    SCHEMA: ClassVar[str] = "labgym.general_procedures/1"

    fillers: frozenset[str]
    classes: dict[str, SubstanceClass]
    procedures: tuple[GeneralProcedure, ...]


@lru_cache(maxsize=1)
def general_procedures() -> GeneralProcedures:
    """Return the published table; it is read once per process."""
    return GeneralProcedures.load(artefacts("assets") / "synthesis" / "general_procedures.json")
