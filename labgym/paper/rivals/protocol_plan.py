"""The design plan of Holodeck+: the protocol's assets and constraints first, then what a household designer lists.

LabBuilder (section 4): Holodeck+ gets "the same structured protocol information as LabBuilder, including required
assets and chemical safety constraints". It can use what its constraint vocabulary expresses: which object stands on or
in which, near and far. Reach, navigation and distances in meters are not in that vocabulary.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from labgym.assets import Asset
from labgym.layouts.request import Request
from labgym.paper.rivals import household
from labgym.paper.rivals.household import Relation
from labgym.paper.rivals.plan import Constraint, DesignPlan, Large, hung, listed


def protocol_plan(request: Request, generator: np.random.Generator) -> DesignPlan:
    """Draw the plan of a designer who has the structured protocol."""
    homes = _homes(request)
    required = [_constrained(request, one, homes) for one in required_pieces(request)]
    kinds = {one.asset.role for one in required}
    further = listed(request, household.FLOOR, generator, absent=kinds)
    present = {one.name for one in (*required, *further)}
    known = [
        replace(one, constraints=tuple(c for c in one.constraints if c.target in {"", *present})) for one in further
    ]
    large = (*required, *known)
    return DesignPlan(large, tuple(hung(request, household.WALL, large, generator)))


def required_pieces(request: Request) -> list[Large]:
    """Return what the protocol requires as furniture with the objects on it, larger pieces first."""
    return _ordered(_required(request, _homes(request)))


def _homes(request: Request) -> dict[str, str]:
    """Kind of furniture of every reagent and bench instrument of the protocol, by canonical name."""
    protocol, catalog = request.protocol, request.catalog
    usual = request.habits.default_home
    homes: dict[str, str] = {}
    for step in reversed(protocol.steps):
        homes.update({catalog.find(name).name: step.location for name in step.uses})
    for rule in protocol.spatial_constraints:
        if rule.kind == "on":
            homes[catalog.find(rule.subject).name] = catalog.find(rule.object).name
    for constraint in protocol.chemical_constraints:
        if constraint.kind == "store" and constraint.object in request.habits.cabinets:
            cabinet = request.habits.cabinets[constraint.object]
            homes[catalog.find(constraint.subject).name] = cabinet.asset
    small = [catalog.find(name) for name in _small_names(request)]
    return {
        asset.name: catalog.find(homes.get(asset.name, usual)).name for asset in small if asset.placing == "desktop"
    }


def _small_names(request: Request) -> Iterator[str]:
    yield from (use.name for use in request.protocol.reagents)
    yield from request.protocol.instruments


def _required(request: Request, homes: dict[str, str]) -> Iterator[Large]:
    """Furniture that the protocol names or that its objects stand on, with these objects."""
    catalog = request.catalog
    tops: dict[str, list[Asset]] = {}
    floor: list[Asset] = [catalog.find(name) for name in request.protocol.locations]
    for name in _small_names(request):
        asset = catalog.find(name)
        if asset.placing == "desktop":
            tops.setdefault(homes[asset.name], []).append(asset)
        else:
            floor.append(asset)
    counts: Counter[str] = Counter()
    for asset in [*floor, *(catalog.get(name) for name in tops if all(one.name != name for one in floor))]:
        number = counts[asset.name]
        counts[asset.name] += 1
        carried = tuple(tops.get(asset.name, ())) if number == 0 else ()
        yield Large(f"{asset.name}-{number}", asset, (Constraint("edge"),), carried, wish=0)


def _ordered(large: Iterator[Large]) -> list[Large]:
    """Larger objects first, as Holodeck's prompt asks."""
    return sorted(large, key=lambda one: -one.asset.size.width * one.asset.size.depth)


def _constrained(request: Request, large: Large, homes: dict[str, str]) -> Large:
    """Add "far" from furniture whose contents must be kept apart, and "near" to furniture that belongs close."""
    constraints = list(large.constraints)
    for relation, first, second in _relations(request):
        for one, other in ((first, second), (second, first)):
            own, target = homes.get(one, one), homes.get(other, other)
            if own == large.asset.name != target and request.catalog.get(target).placing == "floor":
                constraint = Constraint(relation, f"{target}-0")
                if constraint not in constraints:
                    constraints.append(constraint)
    return replace(large, constraints=tuple(constraints))


def _relations(request: Request) -> Iterator[tuple[Relation, str, str]]:
    """Pairs of the protocol's objects that belong near each other or far apart."""
    protocol, catalog = request.protocol, request.catalog
    for rule in protocol.chemical_constraints:
        if rule.kind in ("separate_heat", "separate_incompatible"):
            yield "far", catalog.find(rule.subject).name, catalog.find(rule.object).name
    for spatial in protocol.spatial_constraints:
        if spatial.kind == "near":
            yield "near", catalog.find(spatial.subject).name, catalog.find(spatial.object).name
