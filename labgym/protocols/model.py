"""Protocols: steps in order, with reagents, instruments, places and constraints."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.assets import Catalog, Substance
from labgym.documents import Document, Growing, Record

ReactionType = Literal[
    "substitution",
    "protection_deprotection",
    "condensation",
    "cyclization",
    "redox",
    "functional_group_transformation",
    "alkylation_acylation",
]
Name = Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]


class ReagentUse(Record):
    """A reagent of a protocol: asset name, role, and the amount as written."""

    name: Name
    role: str
    amount: str = ""


class Step(Record):
    """One operation at one location.

    Attributes:
        location: asset name of the furniture or hood where the step happens.
        uses: asset names of the reagents and instruments that the step uses.
        temperature: degrees Celsius.
        duration: minutes.
    """

    index: Annotated[int, Field(ge=1, le=200)]
    location: Name
    action: str
    text: str
    uses: tuple[Name, ...] = ()
    temperature: Annotated[float, Field(ge=-273.15, le=3000.0)] | None = None
    duration: Annotated[float, Field(ge=0.0, le=100_000.0)] | None = None


class ChemicalConstraint(Record):
    """A chemical rule that the layout must respect.

    Attributes:
        kind: separate_heat (subject from object), separate_incompatible, store (subject in storage class object),
            or ventilate (subject is handled at location object).
    """

    kind: Literal["separate_heat", "separate_incompatible", "store", "ventilate"]
    subject: str
    object: str
    reason: str = ""


class SpatialConstraint(Record):
    """A spatial rule: `near` (subject should be close to object) or `on` (subject stands on object)."""

    kind: Literal["near", "on"]
    subject: str
    object: str
    reason: str = ""


class Protocol(Document, Growing):
    """A complete protocol. All names are asset names of the catalog, or of the substances that it embeds.

    Attributes:
        reaction_type: None if it is not one of the types.
        reaction: reaction SMILES.
        instruments: a multiset of asset names.
        synonyms: other names under which a search should find it, in English and Chinese.
        substances: reagents that the catalog lacks, complete.
        partial: what is not known or not carried over, one sentence each; empty for a complete protocol.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"substances", "partial"})
    SCHEMA: ClassVar[str] = "labgym.protocol/1"

    id: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}$")]
    name: str
    reaction_type: ReactionType | None = None
    reaction: str = ""
    product: str = ""
    description: str = ""
    synonyms: tuple[str, ...] = ()
    reagents: Annotated[tuple[ReagentUse, ...], Field(min_length=1, max_length=60)]
    instruments: Annotated[tuple[Name, ...], Field(min_length=1, max_length=100)]
    steps: Annotated[tuple[Step, ...], Field(min_length=1, max_length=100)]
    chemical_constraints: Annotated[tuple[ChemicalConstraint, ...], Field(max_length=2000)] = ()
    spatial_constraints: Annotated[tuple[SpatialConstraint, ...], Field(max_length=2000)] = ()
    substances: Annotated[tuple[Substance, ...], Field(max_length=60)] = ()
    partial: Annotated[tuple[Annotated[str, Field(max_length=500)], ...], Field(max_length=100)] = ()

    @model_validator(mode="after")
    def _uses_its_substances(self) -> Self:
        names = [substance.name for substance in self.substances]
        used = {use.name for use in self.reagents}
        wrong = next((name for name in names if name not in used or names.count(name) > 1), None)
        if wrong is not None:
            raise ValueError(f"substance {wrong!r} is embedded twice or is not among the reagents")
        return self

    def assets(self, catalog: Catalog | None = None) -> Catalog:
        """Return a catalog, by default the loaded one, with the substances that the protocol embeds.

        Raises:
            LabgymError: a substance clashes with a reagent of the catalog.
        """
        return (Catalog.load() if catalog is None else catalog).including(self.substances)

    @property
    def route(self) -> tuple[str, ...]:
        """Locations in the order in which they are visited, repeats in a row merged."""
        stops: list[str] = []
        for step in self.steps:
            if not stops or stops[-1] != step.location:
                stops.append(step.location)
        return tuple(stops)

    @property
    def moves(self) -> int:
        """Number of moves from one location to another."""
        return len(self.route) - 1

    @property
    def locations(self) -> tuple[str, ...]:
        """Distinct locations in the order of their first visit."""
        return tuple(dict.fromkeys(step.location for step in self.steps))

    def required_assets(self) -> tuple[str, ...]:
        """Return the multiset of asset names that a layout must hold: reagents, instruments, locations."""
        return tuple(reagent.name for reagent in self.reagents) + self.instruments + self.locations
