"""Names and constraints of a protocol refer to the catalog and to its own assets (paper, appendix B, i and iv)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from labgym.assets import StorageClass
from labgym.protocols.capability import is_ventilated, is_workplace
from labgym.protocols.model import ChemicalConstraint
from labgym.protocols.rules.finding import Finding, ProtocolCase


def assets_exist(case: ProtocolCase) -> Iterator[Finding]:
    """Reagents, instruments and locations are catalog entries of their kind."""
    named: list[tuple[str, str, int | None]] = [(use.name, "reagent", None) for use in case.protocol.reagents]
    named += [(name, "instrument", None) for name in dict.fromkeys(case.protocol.instruments)]
    named += [(step.location, "facility", step.index) for step in case.protocol.steps]
    for name, kind, step in named:
        asset = case.asset(name)
        if asset is None:
            yield Finding("asset-exists", step, f"{kind} {name!r} is not in the catalog", _nearest(name, case))
        elif asset.kind != kind:
            message = f"{name!r} is listed as {kind} but is a {asset.kind}"
            yield Finding("asset-kind", step, message, f"name a {kind}, or list it among the {asset.kind}s")


def locations_are_workplaces(case: ProtocolCase) -> Iterator[Finding]:
    """Each step takes place at a bench, hood or glove box (check iii)."""
    for step in case.protocol.steps:
        asset = case.asset(step.location)
        if asset is not None and asset.kind == "facility" and not is_workplace(asset):
            places = ", ".join(item.name for item in case.catalog if is_workplace(item))
            message = f"step {step.index} takes place at {step.location!r}, which is not a workplace"
            yield Finding("location-legal", step.index, message, f"choose one of: {places}")


def reagents_are_distinct(case: ProtocolCase) -> Iterator[Finding]:
    """A reagent is listed once, with all its roles and amounts."""
    names = [use.name for use in case.protocol.reagents]
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        message = f"reagent {name!r} is listed {names.count(name)} times"
        yield Finding("reagent-distinct", None, message, "list it once with all its roles and amounts")


def uses_are_listed(case: ProtocolCase) -> Iterator[Finding]:
    """Steps use only listed reagents and instruments."""
    listed = {use.name for use in case.protocol.reagents} | set(case.protocol.instruments)
    for step in case.protocol.steps:
        for name in step.uses:
            if name not in listed:
                message = f"step {step.index} uses {name!r}, which is neither reagent nor instrument of the protocol"
                yield Finding("use-listed", step.index, message, "add it to the list, or remove it from the step")


def everything_is_used(case: ProtocolCase) -> Iterator[Finding]:
    """Each reagent and instrument is used by a step."""
    used = {name for step in case.protocol.steps for name in step.uses}
    for name in dict.fromkeys([*(use.name for use in case.protocol.reagents), *case.protocol.instruments]):
        if name not in used:
            message = f"{name!r} is listed but no step uses it"
            yield Finding("all-used", None, message, "name it in the step that uses it, or remove it from the list")


def _nearest(name: str, case: ProtocolCase) -> str:
    near = case.catalog.nearest(name)
    return f"nearest: {', '.join(near)}" if near else "choose an asset of the catalog"


RULES = (assets_exist, locations_are_workplaces, reagents_are_distinct, uses_are_listed, everything_is_used)


def chemical_constraints_refer(case: ProtocolCase) -> Iterator[Finding]:
    """The subject of a chemical constraint is a reagent of the protocol, and its object exists and fits its kind."""
    reagents = [use.name for use in case.protocol.reagents]
    for constraint in case.protocol.chemical_constraints:
        if constraint.subject not in reagents:
            message = f"{constraint.kind} names {constraint.subject!r}, which is not a reagent of the protocol"
            yield Finding("constraint-refers", None, message, f"choose one of: {', '.join(reagents)}")
        problem = _object_problem(constraint, case)
        if problem is not None:
            message = f"{constraint.kind} of {constraint.subject!r} {problem[0]}"
            yield Finding("constraint-refers", None, message, problem[1])


def spatial_constraints_refer(case: ProtocolCase) -> Iterator[Finding]:
    """A spatial constraint names instruments, reagents and locations of the protocol; objects stand on locations."""
    things = {use.name for use in case.protocol.reagents} | set(case.protocol.instruments)
    places = set(case.protocol.locations)
    for constraint in case.protocol.spatial_constraints:
        objects = places if constraint.kind == "on" else things | places
        for role, name, allowed in (
            ("subject", constraint.subject, things | places),
            ("object", constraint.object, objects),
        ):
            if name not in allowed:
                message = f"{role} {name!r} of a constraint {constraint.kind!r} is not in the protocol"
                yield Finding("constraint-refers", None, message, f"choose one of: {', '.join(sorted(allowed))}")
        if constraint.subject == constraint.object:
            message = f"{constraint.subject!r} cannot be {constraint.kind} itself"
            yield Finding("constraint-refers", None, message, "name two different things")


def _object_problem(constraint: ChemicalConstraint, case: ProtocolCase) -> tuple[str, str] | None:
    """Return the problem with a chemical constraint's object and its remedy, or None."""
    name = constraint.object
    if constraint.kind == "separate_heat":
        asset = case.asset(name)
        if name not in case.protocol.instruments or asset is None or not asset.hazards.heat_source:
            return f"from {name!r}, which is not a heat source of the protocol", "name one of its heating instruments"
    elif constraint.kind == "separate_incompatible":
        if name not in [use.name for use in case.protocol.reagents] or name == constraint.subject:
            return (
                f"from {name!r}, which is not another reagent of the protocol",
                "name another reagent of the protocol",
            )
    elif constraint.kind == "store":
        return _storage_problem(constraint, case)
    elif name not in case.protocol.locations or (place := case.asset(name)) is None or not is_ventilated(place):
        return (
            f"at {name!r}, which is not a ventilated location of the protocol",
            "name a hood, glove box or exhausted bench",
        )
    return None


def _storage_problem(constraint: ChemicalConstraint, case: ProtocolCase) -> tuple[str, str] | None:
    storage = constraint.object
    if storage not in get_args(StorageClass):
        return f"in {storage!r}, which is not a storage class", f"choose one of: {', '.join(get_args(StorageClass))}"
    asset = case.asset(constraint.subject)
    if asset is not None and asset.chemistry is not None and asset.chemistry.storage_class != storage:
        return f"in {storage!r} contradicts the catalog", f"store it in {asset.chemistry.storage_class!r}"
    return None


CONSTRAINT_RULES = (chemical_constraints_refer, spatial_constraints_refer)
