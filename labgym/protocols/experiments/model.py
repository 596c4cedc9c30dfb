"""Experiments: a reaction equation, materials and atomic actions in order, without places or instruments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Document, Record
from labgym.protocols.model import ReactionType

Verb = Literal[
    "Add",
    "AdjustPH",
    "Analyze",
    "Chromatograph",
    "CollectLayer",
    "Concentrate",
    "Cool",
    "Crystallize",
    "Dissolve",
    "Distill",
    "DrySolid",
    "DrySolution",
    "Extract",
    "Filter",
    "Heat",
    "Hydrogenate",
    "Irradiate",
    "MakeSolution",
    "Microwave",
    "Partition",
    "PhaseSeparation",
    "Purge",
    "Purify",
    "Quench",
    "Recrystallize",
    "Reflux",
    "SetTemperature",
    "Sonicate",
    "Stir",
    "Sublime",
    "Transfer",
    "Triturate",
    "Wait",
    "Wash",
    "Yield",
]
Role = Literal["reactant", "reagent", "catalyst", "solvent", "workup"]
Origin = Literal["labgym", "openexp", "chemtrans", "ord", "xdl"]
Keep = Literal["organic", "aqueous", "filtrate", "precipitate", "residue", "distillate"]
Atmosphere = Literal["nitrogen", "argon", "hydrogen", "air", "vacuum"]
Manner = Literal["dropwise", "portionwise", "slowly", "quickly"]
SubstanceName = Annotated[str, Field(min_length=1, max_length=200)]
Smiles = Annotated[str, Field(max_length=2000, pattern=r"^[\x21-\x7e]*$")]


class Material(Record):
    """A substance that an experiment uses.

    Attributes:
        name: canonical asset name in the library; as written in imported experiments.
        role: its role in the reaction.
        smiles: its structure, or "" if it is unknown or a mixture.
    """

    name: SubstanceName
    role: Role
    smiles: Smiles = ""


class Portion(Record):
    """A material of an action with its amount as written: "5.4 g (5.2 mL), 50 mmol", "3 x 30 mL", "10 mL of 2 M"."""

    name: SubstanceName
    amount: Annotated[str, Field(max_length=200)] = ""


class Action(Record):
    """One atomic action.

    Attributes:
        verb: what is done.
        takes: materials that are added.
        temperature: degrees Celsius.
        duration: minutes.
        atmosphere: gas above the mixture.
        manner: how the materials are added.
        keep: part that is kept.
        ph: target of a pH adjustment.
        pressure: bar, absolute.
        note: remark in words.
    """

    verb: Verb
    takes: Annotated[tuple[Portion, ...], Field(max_length=30)] = ()
    temperature: Annotated[float, Field(ge=-273.15, le=3000.0)] | None = None
    duration: Annotated[float, Field(ge=0.0, le=100_000.0)] | None = None
    atmosphere: Atmosphere | None = None
    manner: Manner | None = None
    keep: Keep | None = None
    ph: Annotated[float, Field(ge=-2.0, le=16.0)] | None = None
    pressure: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    note: Annotated[str, Field(max_length=400)] = ""


class Experiment(Record):
    """A reaction with its materials and actions.

    Attributes:
        reaction: reaction SMILES, reactants>agents>products.
        product: name and appearance of the product.
        synonyms: other names under which a search should find it, in English and Chinese.
        materials: all substances that its actions use.
        origin: the library, or the format from which it was imported.
        license: license of the data, or "" if it is not stated.
    """

    id: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,127}$")]
    name: Annotated[str, Field(min_length=1, max_length=300)]
    reaction_type: ReactionType | None = None
    reaction: Annotated[str, Field(max_length=10_000, pattern=r"^[\x21-\x7e]*$")] = ""
    product: Annotated[str, Field(max_length=500)] = ""
    description: Annotated[str, Field(max_length=4000)] = ""
    synonyms: Annotated[tuple[Annotated[str, Field(max_length=200)], ...], Field(max_length=30)] = ()
    materials: Annotated[tuple[Material, ...], Field(min_length=1, max_length=100)]
    actions: Annotated[tuple[Action, ...], Field(min_length=1, max_length=300)]
    origin: Origin = "labgym"
    license: Annotated[str, Field(max_length=40)] = ""

    @model_validator(mode="after")
    def _takes_only_materials(self) -> Self:
        names = {material.name for material in self.materials}
        for number, action in enumerate(self.actions, 1):
            for portion in action.takes:
                if portion.name not in names:
                    raise ValueError(f"action {number} takes {portion.name[:80]!r}, which is not among the materials")
        return self


class ExperimentFile(Document):
    """A file of experiments."""

    SCHEMA: ClassVar[str] = "labgym.experiments/1"

    experiments: Annotated[tuple[Experiment, ...], Field(max_length=5000)]


@dataclass(frozen=True)
class Rejection:
    """A record that is not a usable experiment: its place, as file:line or file:index, and the reason."""

    place: str
    reason: str
