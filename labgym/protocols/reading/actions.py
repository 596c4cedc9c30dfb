"""Action lists: what a text tells to do, where it says so, and what of the text no action owns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from labgym.assets import Catalog
from labgym.documents import Record
from labgym.protocols.experiments.grounding import SOLVENTS, Grounder
from labgym.protocols.experiments.model import Action, Experiment, Material, Role, Span
from labgym.protocols.stoichiometry import Use

Outcome = Literal["complete", "partial", "refers"]
"""Whether the actions are all that the text says, some of it, or lean on another procedure."""
MAX_TEXT = 20_000
"""Longest text that is read, characters."""


class Unread(Record):
    """A span of a text that no action owns: a quantity, a substance or an operation, with what is wrong."""

    start: Annotated[int, Field(ge=0)]
    end: Annotated[int, Field(ge=0)]
    text: Annotated[str, Field(max_length=1000)]
    why: Annotated[str, Field(max_length=200)]


class ActionList(Record):
    """The actions of a procedure, in the order in which they are done.

    Attributes:
        text: the procedure; spans count its characters.
        actions: with the spans that they come from; what the text does not state is named in their `assumed`.
        outcome: "partial" if something is unread, "refers" if it leans on another procedure.
        unread: spans that no action owns.
        product: name of the product, or "".
        result: the stated yield of the product, as written.
        roles: role of each material by name.
    """

    text: Annotated[str, Field(max_length=MAX_TEXT)]
    actions: Annotated[tuple[Action, ...], Field(max_length=5000)]
    outcome: Outcome
    unread: Annotated[tuple[Unread, ...], Field(max_length=MAX_TEXT)] = ()
    product: Annotated[str, Field(max_length=500)] = ""
    result: Annotated[str, Field(max_length=300)] = ""
    roles: Annotated[dict[str, Role], Field(default_factory=dict)]

    @model_validator(mode="after")
    def _spans_lie_in_the_text(self) -> Self:
        spans: Iterator[Span | None] = (
            span for action in self.actions for span in (action.span, *(portion.span for portion in action.takes))
        )
        for span in spans:
            if span is not None and not 0 <= span[0] < span[1] <= len(self.text):
                raise ValueError(f"the span {span} does not lie in the text of {len(self.text)} characters")
        return self

    def uses(self, catalog: Catalog) -> list[Use]:
        """Return the substances that the actions take, with their roles and their entries in a catalog, if any."""
        grounder = Grounder(catalog)
        found = []
        for action in self.actions:
            aside = action.verb in (
                "Wash",
                "Extract",
                "Quench",
                "Partition",
                "DrySolution",
                "Recrystallize",
                "Triturate",
            )
            for portion in action.takes:
                role = self.roles.get(portion.name, "reagent")
                name = grounder.find(Material(name=portion.name, role=role))
                asset = catalog.get(name) if name is not None else None
                solvent = asset is not None and asset.category in SOLVENTS and role == "reactant"
                shown = "work-up" if aside or role == "workup" else "solvent" if solvent else role
                found.append(Use(portion.name, portion.amount, shown, asset))
        return found

    def experiment(self, id: str, name: str = "", reaction: str = "") -> Experiment:  # noqa: A002
        """Return the actions as an experiment; its materials have the names that the text gives them.

        Args:
            id: of the experiment.
            name: the product's by default.
            reaction: reaction SMILES, if it is known.

        Raises:
            ValidationError: no action takes a material.
        """
        portions = {portion.name: portion for action in self.actions for portion in action.takes}
        return Experiment(
            id=id,
            name=name or self.product or id,
            reaction=reaction,
            product=self.product,
            description=self.text[:4000],
            materials=tuple(Material(name=part, role=self.roles.get(part, "reagent")) for part in portions),
            actions=self.actions,
            origin="text",
        )
