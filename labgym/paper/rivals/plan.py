"""The design plan: large objects with constraints and what stands on them, as a language model would list them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from labgym.assets import Asset
from labgym.layouts.request import Request
from labgym.paper.rivals import household
from labgym.paper.rivals.household import Choice, Hanging, Relation, Top
from labgym.paper.rivals.reading import assets_in, description

SHARE_OF_SECOND = 0.5
"""Probability that the second request adds a kind of object that the first one left out."""


@dataclass(frozen=True)
class Constraint:
    """A constraint on an object: its relation, and the object that it refers to ("" for edge and middle)."""

    relation: Relation
    target: str = ""


@dataclass(frozen=True)
class Large:
    """One large object of a plan.

    Attributes:
        name: unique in the plan, in Holodeck's style: LabBench1800-0.
        constraints: the first is global (edge or middle); targets are names of earlier objects.
        tops: small objects on it.
        wish: rank of the request that listed it: 0 for what must be there, 1 for the first answer, 2 for the second.
    """

    name: str
    asset: Asset
    constraints: tuple[Constraint, ...]
    tops: tuple[Asset, ...] = ()
    wish: int = 1


@dataclass(frozen=True)
class Hung:
    """A wall object of a plan: its asset, the large object that it hangs above ("" for any place), and its height."""

    asset: Asset
    above: str
    height: float


@dataclass(frozen=True)
class DesignPlan:
    """Everything that a designer lists for a room: large objects in order, and objects on walls."""

    large: tuple[Large, ...]
    hung: tuple[Hung, ...] = ()


Grade = Literal["description", "stations", "list"]
"""What a designer knows: name and description of the protocol; in addition its places of work; or all its lists."""
Designer = Callable[[Request, np.random.Generator], DesignPlan]
"""Lists objects and constraints for a request."""


def household_plan(request: Request, generator: np.random.Generator, grade: Grade = "description") -> DesignPlan:
    """Draw the plan of a designer who knows nothing of the protocol but the names that the grade gives."""
    large = listed(request, household.FLOOR, generator)
    named = named_to(request, grade)
    large = _with_named(large, named, generator)
    return DesignPlan(tuple(large), tuple(hung(request, household.WALL, large, generator)))


def named_to(request: Request, grade: Grade) -> tuple[Asset, ...]:
    """Return the assets that a designer of a grade knows by name, each once."""
    protocol, catalog = request.protocol, request.catalog
    names: list[str] = [asset.name for asset in assets_in(description(protocol), catalog)]
    if grade != "description":
        names += [catalog.find(name).name for name in protocol.locations]
    if grade == "list":
        listed_names = (*protocol.instruments, *(use.name for use in protocol.reagents))
        names += [catalog.find(name).name for name in listed_names]
    return tuple(catalog.get(name) for name in dict.fromkeys(names))


def listed(
    request: Request, choices: Sequence[Choice], generator: np.random.Generator, absent: Iterable[str] = ()
) -> list[Large]:
    """Draw large objects from a table, those of the second request last; kinds in `absent` are left out."""
    first: list[tuple[Choice, int, int]] = []
    second: list[tuple[Choice, int, int]] = []
    left_out = set(absent)
    for choice in choices:
        drawn, extra = generator.random(2)
        count = int(generator.integers(choice.least, choice.most + 1)) if drawn < choice.chance else 0
        if choice.asset in left_out:
            continue
        if count:
            first.append((choice, 0, count))
        if extra < SHARE_OF_SECOND:
            second.append((choice, count, count + 1))
    objects: list[Large] = []
    for wish, batch in ((1, first), (2, second)):
        for choice, start, stop in batch:
            for number in range(start, stop):
                objects.append(_large(request, choice, number, wish, objects, generator))
    return objects


def hung(
    request: Request, table: Sequence[Hanging], large: Sequence[Large], generator: np.random.Generator
) -> list[Hung]:
    """Draw wall objects from a table."""
    result = []
    for entry in table:
        if generator.random() < entry.chance:
            above = next((one.name for one in large if one.asset.name == entry.above), "")
            result.append(Hung(request.catalog.get(entry.asset), above, entry.height))
    return result


def _large(
    request: Request, choice: Choice, number: int, wish: int, earlier: Sequence[Large], generator: np.random.Generator
) -> Large:
    constraints = []
    for relation, kind in choice.relations:
        targets = [one.name for one in earlier if one.asset.name == kind]
        if not kind or targets:
            constraints.append(Constraint(relation, targets[number % len(targets)] if targets else ""))
    if choice.aligned and number:
        constraints.append(Constraint("center aligned", f"{choice.asset}-0"))
    return Large(
        f"{choice.asset}-{number}",
        request.catalog.get(choice.asset),
        tuple(constraints),
        _drawn(request, choice.tops, generator),
        wish,
    )


def _drawn(request: Request, tops: Sequence[Top], generator: np.random.Generator) -> tuple[Asset, ...]:
    assets: list[Asset] = []
    for top in tops:
        if generator.random() < top.chance:
            assets += [request.catalog.get(top.asset)] * int(generator.integers(top.least, top.most + 1))
    return tuple(assets)


def _with_named(large: Sequence[Large], named: Sequence[Asset], generator: np.random.Generator) -> list[Large]:
    """Add what the description names: furniture as large objects, reagents and instruments on top of them."""
    objects = list(large)
    for asset in named:
        if asset.placing == "desktop":
            kind = household.BENCH
            if asset.kind == "reagent":
                stored = generator.random() < household.IN_CABINET
                kind = household.CABINET if stored else str(generator.choice(household.REAGENT_HOMES))
            objects = with_top(objects, kind, asset)
        elif asset.placing == "floor" and all(one.asset.role != asset.role for one in objects):
            objects.append(Large(f"{asset.name}-0", asset, (Constraint("edge"),)))
    return objects


def with_top(large: Sequence[Large], kind: str, asset: Asset) -> list[Large]:
    """Return the objects with a small one added to the first of a kind, or to the first that carries things."""
    order = sorted(range(len(large)), key=lambda k: large[k].asset.name != kind)
    at = next((k for k in order if large[k].asset.surfaces), None)
    return [replace(one, tops=(*one.tops, asset)) if k == at else one for k, one in enumerate(large)]
