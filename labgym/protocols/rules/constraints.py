"""Constraints refer to the protocol's own assets and agree with the catalog (paper, appendix B, check iv)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from labgym.assets import StorageClass
from labgym.protocols.model import ChemicalConstraint
from labgym.protocols.places import is_ventilated
from labgym.protocols.rules.finding import Case, Finding


def chemical_constraints_refer(case: Case) -> Iterator[Finding]:
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


def spatial_constraints_refer(case: Case) -> Iterator[Finding]:
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


def _object_problem(constraint: ChemicalConstraint, case: Case) -> tuple[str, str] | None:
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


def _storage_problem(constraint: ChemicalConstraint, case: Case) -> tuple[str, str] | None:
    storage = constraint.object
    if storage not in get_args(StorageClass):
        return f"in {storage!r}, which is not a storage class", f"choose one of: {', '.join(get_args(StorageClass))}"
    asset = case.asset(constraint.subject)
    if asset is not None and asset.chemistry is not None and asset.chemistry.storage_class != storage:
        return f"in {storage!r} contradicts the catalog", f"store it in {asset.chemistry.storage_class!r}"
    return None


RULES = (chemical_constraints_refer, spatial_constraints_refer)
