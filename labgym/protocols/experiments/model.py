"""Experiments: a reaction equation, materials and atomic actions in order, without places or instruments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Document, Record
from labgym.protocols.model import ReactionType
from labgym.quantities import ROOM_RANGE

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
    "Monitor",
    "Note",
    "Partition",
    "PhaseSeparation",
    "Pour",
    "Purge",
    "Purify",
    "Quench",
    "Recrystallize",
    "Refers",
    "Reflux",
    "Repeat",
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
Origin = Literal["labgym", "openexp", "chemtrans", "ord", "text", "xdl"]
Keep = Literal["organic", "aqueous", "filtrate", "precipitate", "residue", "distillate"]
Part = Literal["organic", "aqueous", "filtrate", "precipitate", "residue", "distillate", "solution"]
Atmosphere = Literal["nitrogen", "argon", "hydrogen", "air", "vacuum"]
Manner = Literal["dropwise", "portionwise", "slowly", "quickly"]
SubstanceName = Annotated[str, Field(min_length=1, max_length=200)]
Temperature = Annotated[float, Field(ge=-273.15, le=3000.0)]
Minutes = Annotated[float, Field(ge=0.0, le=100_000.0)]
Span = tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]]
"""Start and end, in characters, in the text that an action was read from."""
Smiles = Annotated[str, Field(max_length=2000, pattern=r"^[\x21-\x7e]*$")]


HOLDING: frozenset[Verb] = frozenset(
    ("Cool", "Heat", "Irradiate", "Microwave", "Reflux", "SetTemperature", "Sonicate", "Stir")
)
"""Verbs that keep a mixture at conditions."""


def holding(temperature: float | None) -> Verb:
    """Return the verb for holding a mixture at a temperature in degrees Celsius."""
    if temperature is None or ROOM_RANGE[0] <= temperature <= ROOM_RANGE[1]:
        return "Stir"
    return "Heat" if temperature > ROOM_RANGE[1] else "Cool"


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
    """A material of an action.

    Attributes:
        name: of the material.
        amount: as written: "5.4 g (5.2 mL), 50 mmol", "3 x 30 mL", "10 mL of 2 M", "1.2 equiv"; `read_amount` gives the
            values in base units.
        solvent: what it is dissolved in, if the text names it without an amount ("1 M in THF").
        span: of its name in the text.
        assumed: whether the text does not name it.
    """

    name: SubstanceName
    amount: Annotated[str, Field(max_length=200)] = ""
    solvent: Annotated[str, Field(max_length=200)] = ""
    span: Span | None = None
    assumed: bool = False


class Period(Record):
    """A period at one temperature.

    Attributes:
        temperature: degrees Celsius, at its beginning.
        final_temperature: degrees Celsius, at its end, if the temperature changes during it.
        duration: minutes.
    """

    temperature: Temperature | None = None
    final_temperature: Temperature | None = None
    duration: Minutes | None = None


class Action(Record):
    """One atomic action; its temperature and duration are those of its first period.

    Attributes:
        verb: what is done; "Note" for a step of a record that no verb expresses, which the note tells.
        takes: materials that are added.
        gives: products that are isolated, with their amounts ("3.6 g, 84 %"); they are no materials.
        temperature, final_temperature, duration: of the first period, as `Period`.
        then: further periods, in order ("50 C for 1 h, then 10 C for 2 h").
        atmosphere: gas above the mixture.
        manner: how the materials are added.
        rate: of an addition or a change of temperature, as written.
        part: part of the batch that the action is done to, or "solution" if a solution made aside is added.
        keep: part that is kept.
        vessel: what the mixture is in, as written.
        repeats: how often it is done; the amounts of the materials are of all times ("3 x 30 mL").
        ph: target of a pH adjustment.
        pressure: bar, absolute.
        note: remark in words.
        span: of the action in the text that it was read from.
        assumed: names of the fields that the text does not state; "verb" if it does not name the action.
    """

    verb: Verb
    takes: Annotated[tuple[Portion, ...], Field(max_length=30)] = ()
    gives: Annotated[tuple[Portion, ...], Field(max_length=10)] = ()
    temperature: Temperature | None = None
    final_temperature: Temperature | None = None
    duration: Minutes | None = None
    then: Annotated[tuple[Period, ...], Field(max_length=20)] = ()
    atmosphere: Atmosphere | None = None
    manner: Manner | None = None
    rate: Annotated[str, Field(max_length=80)] = ""
    part: Part | None = None
    keep: Keep | None = None
    vessel: Annotated[str, Field(max_length=80)] = ""
    repeats: Annotated[int, Field(ge=1, le=100)] = 1
    ph: Annotated[float, Field(ge=-2.0, le=16.0)] | None = None
    pressure: Annotated[float, Field(ge=0.0, le=1000.0)] | None = None
    note: Annotated[str, Field(max_length=400)] = ""
    span: Span | None = None
    assumed: Annotated[tuple[Annotated[str, Field(max_length=40)], ...], Field(max_length=20)] = ()

    @property
    def periods(self) -> tuple[Period, ...]:
        """All periods, in order; empty if neither a temperature nor a duration is known."""
        first = Period(temperature=self.temperature, final_temperature=self.final_temperature, duration=self.duration)
        return (first, *self.then) if first != Period() or self.then else ()


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

    def unrolled(self) -> Self:
        """Return the experiment with one action per period: an action with further periods is followed by holding."""
        if not any(action.then for action in self.actions):
            return self
        return self.model_copy(update={"actions": tuple(part for action in self.actions for part in _parts(action))})

    @model_validator(mode="after")
    def _takes_only_materials(self) -> Self:
        names = {material.name for material in self.materials}
        for number, action in enumerate(self.actions, 1):
            for portion in action.takes:
                if portion.name not in names:
                    raise ValueError(f"action {number} takes {portion.name[:80]!r}, which is not among the materials")
        return self


def _parts(action: Action) -> Iterator[Action]:
    yield action.model_copy(update={"then": ()}) if action.then else action
    for stretch in action.then:
        verb: Verb = action.verb if action.verb in HOLDING else "Stir"
        yield Action(
            verb=verb, atmosphere=action.atmosphere, vessel=action.vessel, span=action.span, **stretch.model_dump()
        )


class ExperimentFile(Document):
    """A file of experiments."""

    SCHEMA: ClassVar[str] = "labgym.experiments/1"

    experiments: Annotated[tuple[Experiment, ...], Field(max_length=5000)]


@dataclass(frozen=True)
class Rejection:
    """A record that is not a usable experiment: its place, as file:line or file:index, and the reason."""

    place: str
    reason: str
