"""Hazardous steps take place at suitable locations with suitable devices (paper, appendix B, check iii)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from labgym.assets import Asset, incompatible
from labgym.assets.reactivity import reactions
from labgym.protocols.capability import heats_to, is_ventilated, needs_ventilation
from labgym.protocols.model import Step
from labgym.protocols.rules.finding import Finding, ProtocolCase
from labgym.protocols.rules.sequence import PREPARATION

HEATED_ACTIONS = ("Heat", "Reflux", "Distill", "Recrystallize", "DrySolid")
REMEDY = "move the step to FumeHood, GloveBox or a bench with local exhaust"


def vapours_are_carried_off(case: ProtocolCase) -> Iterator[Finding]:
    """Volatile, toxic or flammable reagents are opened only at ventilated places; solids may be weighed anywhere."""
    for step, reagents in _open_steps(case):
        for reagent in reagents:
            weighed = step.action in PREPARATION and reagent.phase == "solid"
            if needs_ventilation(reagent) and not weighed:
                what = "volatile or toxic" if reagent.hazards.volatile_or_toxic else "flammable"
                message = (
                    f"step {step.index} handles {reagent.name} ({what}) at {step.location}, which is not ventilated"
                )
                yield Finding("location-safe", step.index, message, REMEDY)


def incompatible_reagents_meet_in_the_hood(case: ProtocolCase) -> Iterator[Finding]:
    """Reagents that react violently are combined only at ventilated places; weighing does not combine them."""
    for step, reagents in _open_steps(case):
        distinct = {asset.name: asset for asset in reagents}
        for a, b in combinations(sorted(distinct), 2) if step.action not in PREPARATION else ():
            danger = _danger(distinct[a], distinct[b])
            if danger is not None:
                message = f"step {step.index} brings {a} and {b} together at {step.location} ({danger})"
                yield Finding("location-safe", step.index, message, REMEDY)


def heat_has_a_source(case: ProtocolCase) -> Iterator[Finding]:
    """A heated step uses a heat source, and each of its heat sources reaches the temperature."""
    for step in case.protocol.steps:
        used = [asset for name in step.uses if (asset := case.asset(name)) is not None]
        sources = [asset for asset in used if asset.hazards.heat_source]
        if step.action in HEATED_ACTIONS and not sources:
            message = f"step {step.index} ({step.action}) uses no heat source"
            yield Finding("heat-source", step.index, message, "add a bath, mantle, hotplate or oven to its uses")
        limits = [limit for asset in sources if (limit := heats_to(asset)) is not None]
        if step.temperature is not None and limits and step.temperature > min(limits):
            message = f"step {step.index} needs {step.temperature:g} C, but its heat source reaches {min(limits):g} C"
            yield Finding("heat-source", step.index, message, _hotter(case, step.temperature))


def _hotter(case: ProtocolCase, temperature: float) -> str:
    devices = [asset for asset in case.catalog.of_kind("instrument") if asset.category == "heating"]
    reaching = [
        (limit, asset.name)
        for asset in devices
        if asset.heat_class in ("bath", "hot_surface") and asset.subtype != "gun"
        if (limit := heats_to(asset)) is not None and limit >= temperature
    ]
    return f"use {min(reaching)[1]}, or a lower temperature" if reaching else "choose a lower temperature"


def _danger(a: Asset, b: Asset) -> str | None:
    """Return the rule or the reaction that makes two reagents dangerous together, or None."""
    rule = incompatible(a, b)
    if rule is not None:
        return rule.kind
    worst = next(iter(reactions(a, b)), None)
    return worst.cell.hazard if worst is not None and worst.cell.severity == "dangerous" else None


def _open_steps(case: ProtocolCase) -> Iterator[tuple[Step, list[Asset]]]:
    """Yield the steps at places without ventilation, with their reagents."""
    for step in case.protocol.steps:
        place = case.asset(step.location)
        if place is not None and not is_ventilated(place):
            used = [asset for name in step.uses if (asset := case.asset(name)) is not None]
            yield step, [asset for asset in used if asset.kind == "reagent"]


RULES = (vapours_are_carried_off, incompatible_reagents_meet_in_the_hood, heat_has_a_source)
