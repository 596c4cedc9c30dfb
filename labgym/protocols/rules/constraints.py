"""Constraints speak of what the protocol has, and say what the catalogue says (paper, appendix B, check iv)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from labgym.assets import StorageClass
from labgym.protocols.model import ChemicalConstraint
from labgym.protocols.places import is_ventilated
from labgym.protocols.rules.finding import Case, Finding


def chemical_constraints_refer(case: Case) -> Iterator[Finding]:
    """A chemical constraint's subject is a reagent of the protocol and its object exists and makes sense."""
    reagents = [use.name for use in case.protocol.reagents]
    for constraint in case.protocol.chemical_constraints:
        if constraint.subject not in reagents:
            message = f"{constraint.kind} names {constraint.subject!r}, which is no reagent of the protocol"
            yield Finding("constraint-refers", None, message, f"choose one of: {', '.join(reagents)}")
        problem = _object_problem(constraint, case)
        if problem is not None:
            message = f"{constraint.kind} of {constraint.subject!r} {problem[0]}"
            yield Finding("constraint-refers", None, message, problem[1])


def spatial_constraints_refer(case: Case) -> Iterator[Finding]:
    """A spatial constraint speaks of instruments, reagents and locations; things stand on locations."""
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
    """Return what is wrong with a chemical constraint's object and how to mend it, or None."""
    given = constraint.object
    if constraint.kind == "separate_heat":
        asset = case.asset(given)
        if given not in case.protocol.instruments or asset is None or not asset.hazards.heat_source:
            return f"from {given!r}: no heat source of the protocol", "name one of its heating instruments"
    elif constraint.kind == "separate_incompatible":
        if given not in [use.name for use in case.protocol.reagents] or given == constraint.subject:
            return f"from {given!r}: no other reagent of the protocol", "name another reagent of the protocol"
    elif constraint.kind == "store":
        return _storage_problem(constraint, case)
    elif given not in case.protocol.locations or (place := case.asset(given)) is None or not is_ventilated(place):
        return f"at {given!r}: no ventilated location of the protocol", "name a hood, glove box or exhausted bench"
    return None


def _storage_problem(constraint: ChemicalConstraint, case: Case) -> tuple[str, str] | None:
    given = constraint.object
    if given not in get_args(StorageClass):
        return f"in {given!r}: no storage class", f"choose one of: {', '.join(get_args(StorageClass))}"
    asset = case.asset(constraint.subject)
    if asset is not None and asset.chemistry is not None and asset.chemistry.storage_class != given:
        return f"in {given!r} contradicts the catalogue", f"store it in {asset.chemistry.storage_class!r}"
    return None


RULES = (chemical_constraints_refer, spatial_constraints_refer)
