"""Every name in the protocol is an asset of the right kind, listed once and used (paper, appendix B, check i)."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.protocols.places import is_workplace
from labgym.protocols.rules.finding import Case, Finding


def assets_exist(case: Case) -> Iterator[Finding]:
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


def locations_are_workplaces(case: Case) -> Iterator[Finding]:
    """Each step takes place at a bench, hood or glove box (check iii)."""
    for step in case.protocol.steps:
        asset = case.asset(step.location)
        if asset is not None and asset.kind == "facility" and not is_workplace(asset):
            places = ", ".join(item.name for item in case.catalog if is_workplace(item))
            message = f"step {step.index} takes place at {step.location!r}, which is not a workplace"
            yield Finding("location-legal", step.index, message, f"choose one of: {places}")


def reagents_are_distinct(case: Case) -> Iterator[Finding]:
    """A reagent is listed once, with all its roles and amounts."""
    names = [use.name for use in case.protocol.reagents]
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        message = f"reagent {name!r} is listed {names.count(name)} times"
        yield Finding("reagent-distinct", None, message, "list it once with all its roles and amounts")


def uses_are_listed(case: Case) -> Iterator[Finding]:
    """Steps use only listed reagents and instruments."""
    listed = {use.name for use in case.protocol.reagents} | set(case.protocol.instruments)
    for step in case.protocol.steps:
        for name in step.uses:
            if name not in listed:
                message = f"step {step.index} uses {name!r}, which is neither reagent nor instrument of the protocol"
                yield Finding("use-listed", step.index, message, "add it to the list, or remove it from the step")


def everything_is_used(case: Case) -> Iterator[Finding]:
    """Each reagent and instrument is used by a step."""
    used = {name for step in case.protocol.steps for name in step.uses}
    for name in dict.fromkeys([*(use.name for use in case.protocol.reagents), *case.protocol.instruments]):
        if name not in used:
            message = f"{name!r} is listed but no step uses it"
            yield Finding("all-used", None, message, "name it in the step that uses it, or remove it from the list")


def _nearest(name: str, case: Case) -> str:
    near = case.catalog.nearest(name)
    return f"nearest: {', '.join(near)}" if near else "choose an asset of the catalog"


RULES = (assets_exist, locations_are_workplaces, reagents_are_distinct, uses_are_listed, everything_is_used)
