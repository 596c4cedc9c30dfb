"""A language model as the designer: it lists objects and constraints, and the catalog supplies the assets.

The forms of its answers are here: the list of objects, and the step that a planner chooses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from labgym.assets import Asset, Catalog
from labgym.documents import Record
from labgym.layouts.request import Request
from labgym.llm.client import LanguageModel
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import ask_with_repairs
from labgym.paper.rivals.household import Relation
from labgym.paper.rivals.plan import Constraint, DesignPlan, Hung, Large
from labgym.paper.rivals.reading import description
from labgym.paper.rivals.sceneweaver.policy import Tool

Name = Annotated[str, Field(max_length=80)]


class RelatedTo(Record):
    """A constraint with an object that is listed earlier."""

    relation: Relation
    target: Name


class OnTop(Record):
    """Small objects on each object of a kind."""

    name: Name
    quantity: Annotated[int, Field(ge=1, le=5)]


class ListedObject(Record):
    """A kind of large object."""

    name: Name
    quantity: Annotated[int, Field(ge=1, le=10)]
    location: Literal["floor", "wall"]
    height: Annotated[float, Field(ge=0.0, le=5.0)]
    place: Literal["edge", "middle"]
    relations: Annotated[list[RelatedTo], Field(max_length=8)]
    on_top: Annotated[list[OnTop], Field(max_length=20)]


class ListedSurface(Record):
    """Small objects for a piece of furniture."""

    objects: Annotated[list[OnTop], Field(max_length=20)]


class ListedRoom(Record):
    """Everything that is listed for a room."""

    objects: Annotated[list[ListedObject], Field(max_length=60)]


class ChosenStep(Record):
    """A step of SceneWeaver: the number of a problem, and a tool."""

    stop: bool
    problem: Annotated[int, Field(ge=0, le=1000)]
    tool: Tool


PROMPTS = Path(__file__).resolve().parent / "prompts"
SEEDS = 2**31
"""Number of random seeds that a server accepts."""


@dataclass(frozen=True)
class ModelDesigner:
    """Asks a language model for the plan of a room.

    Attributes:
        model: the client.
        structured: whether the model gets the structured protocol, as for Holodeck+.
    """

    model: LanguageModel
    structured: bool = False

    def __call__(self, request: Request, generator: np.random.Generator) -> DesignPlan:
        """Return the plan that the model lists; names without an asset are left out, as a retrieval without result.

        Raises:
            LanguageModelError: no reply, or still none of the form after the repairs.
        """
        del generator
        prompt = load_prompt(PROMPTS / "design_room.md")
        x0, y0, x1, y1 = request.floor.bounds
        messages = prompt.fill(
            purpose=description(request.protocol),
            room={"width": round(x1 - x0, 2), "depth": round(y1 - y0, 2)},
            requirements=_requirements(request) if self.structured else "none",
        )
        reply = ask_with_repairs(self.model, prompt.label, messages, ListedRoom, seed=request.seed % SEEDS)
        return plan_of(reply.answer, request.catalog)


def plan_of(answer: ListedRoom, catalog: Catalog) -> DesignPlan:
    """Return the plan that an answer describes, with assets of the catalog."""
    large: list[Large] = []
    hung: list[Hung] = []
    first: dict[str, str] = {}
    for listed in answer.objects:
        asset = _retrieved(listed.name, catalog)
        if asset is None or asset.placing != listed.location:
            continue
        if asset.placing == "wall":
            targets = [first.get(one.target, "") for one in listed.relations]
            hung += [Hung(asset, targets[0] if targets else "", listed.height)] * listed.quantity
            continue
        number = sum(one.asset.name == asset.name for one in large)
        for index in range(number, number + listed.quantity):
            large.append(_large(listed, asset, index, first, catalog))
            first.setdefault(listed.name, large[-1].name)
    return DesignPlan(tuple(large), tuple(hung))


def _large(listed: ListedObject, asset: Asset, index: int, first: dict[str, str], catalog: Catalog) -> Large:
    constraints = [Constraint(listed.place)]
    constraints += [
        Constraint(one.relation, first[one.target])
        for one in listed.relations
        if one.target in first and one.relation not in ("edge", "middle")
    ]
    return Large(f"{asset.name}-{index}", asset, tuple(constraints), tuple(small_assets(listed.on_top, catalog)))


def small_assets(listed: Sequence[OnTop], catalog: Catalog) -> list[Asset]:
    """Return the assets that stand on furniture, each as often as it is listed; unknown names are left out."""
    found = [(_retrieved(top.name, catalog), top.quantity) for top in listed]
    return [asset for asset, count in found if asset is not None and asset.placing == "desktop" for _ in range(count)]


def _retrieved(name: str, catalog: Catalog) -> Asset | None:
    """The asset that a name means, without doors, windows and robots."""
    match = catalog.match(name)
    asset = None if match is None else catalog.get(match.name)
    return None if asset is None or asset.category in ("opening", "robot") else asset


def _requirements(request: Request) -> dict[str, Any]:
    """The structured protocol: required assets, constraints, and where each step takes place."""
    protocol = request.protocol
    return {
        "reagents": [use.name for use in protocol.reagents],
        "instruments": list(protocol.instruments),
        "furniture": list(protocol.locations),
        "chemical constraints": [[rule.kind, rule.subject, rule.object] for rule in protocol.chemical_constraints],
        "spatial constraints": [[rule.kind, rule.subject, rule.object] for rule in protocol.spatial_constraints],
        "steps": [[step.location, *step.uses] for step in protocol.steps],
    }
