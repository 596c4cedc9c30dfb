"""Temperatures can be reached, and what they are meant for stands them."""

from __future__ import annotations

import re
from collections.abc import Iterator

from labgym.assets import Asset
from labgym.protocols.capability import cools_to, stands_to, withstands
from labgym.protocols.contents import VESSELS, Situation, is_vessel
from labgym.protocols.rules.finding import Case, Finding

COLD = 0.0
"""Below this a step needs a device that cools; down to it ice will do, degrees Celsius."""
RETURNS = ("condenser", "adapter", "trap", "rotavap")
"""Subtypes that bring vapour back or carry it on."""
SUPERHEAT = 15.0
"""How much a mixture may boil above the highest of its boiling points: salts and products raise it, degrees Celsius."""
VOLATILE_SHARE = 0.2
"""A liquid that boils off counts where it is at least this share of the volume."""
EXPLOSIVE_LIMIT = 60.0
"""Reagents that can explode are not heated above this, degrees Celsius."""
QUENCH_LIMIT = 25.0
VIOLENT = frozenset({"metal_hydride", "organometallic", "alkali_metal", "acyl_halide", "halogenating_agent"})
_MELTING = re.compile(r"\bmp\s*(\d{2,3}(?:\.\d)?)(?:\s*[-–]\s*(\d{2,3}(?:\.\d)?))?\s*(?:°\s*)?C\b")


def cold_is_reached(case: Case) -> Iterator[Finding]:
    """A step below the freezing point names a device that gets there."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if temperature is None or temperature >= COLD:
            continue
        reached = [lowest for asset in situation.devices if (lowest := cools_to(asset)) is not None]
        if not reached or min(reached) > temperature:
            what = f"its devices reach {min(reached):g} C" if reached else "no device of it cools"
            options = sorted(
                (lowest, asset.name)
                for asset in case.catalog.of_kind("instrument")
                if (lowest := cools_to(asset)) is not None and lowest <= temperature and asset.category == "cooling"
            )
            suggestion = f"use {options[-1][1]}" if options else "choose a temperature above what the inventory reaches"
            message = f"step {step.index} ({step.action}) wants {temperature:g} C, {what}"
            yield Finding("cooling-reach", step.index, message, suggestion)


def ware_stands_the_heat(case: Case) -> Iterator[Finding]:
    """Vessels, stirring bars and thermometers are used within their limits."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        for asset in situation.devices:
            limit = stands_to(asset)
            if temperature is not None and limit is not None and temperature > limit:
                message = f"step {step.index} ({step.action}) is at {temperature:g} C, {asset.name} ends at {limit:g} C"
                yield Finding("temperature-limit", step.index, message, _hardier(case, asset, temperature, limit))


def solvents_stay_in_open_vessels(case: Case) -> Iterator[Finding]:
    """What is heated above a liquid's boiling point has a condenser, a still head or a closed vessel built for it."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if temperature is None or situation.vessel is None or step.action == "Concentrate" or _kept(situation):
            continue
        for name in situation.bulk(VOLATILE_SHARE):
            boiling = _boiling_point(case, name)
            if boiling is not None and temperature > boiling:
                message = (
                    f"step {step.index} ({step.action}) is at {temperature:g} C; {name} boils at {boiling:g} C and "
                    f"nothing holds it back in {situation.vessel.name}"
                )
                yield Finding("boils-off", step.index, message, "fit RefluxCondenser, or stay below the boiling point")
                break


def reflux_is_as_hot_as_it_can_be(case: Case) -> Iterator[Finding]:
    """Boiling under a condenser is no hotter than the liquids boil."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        boils = step.action == "Reflux" or any(asset.subtype == "condenser" for asset in situation.devices)
        if not boils or step.action == "Distill" or temperature is None:
            continue
        if any(withstands(asset) for asset in situation.devices):
            continue
        known = [_boiling_point(case, name) for name in situation.bulk()]
        points = [point for point in known if point is not None]
        if points and len(points) == len(known) and temperature > max(points) + SUPERHEAT:
            message = (
                f"step {step.index} is at {temperature:g} C under a condenser, above {max(points):g} C, where it boils"
            )
            suggestion = "heat closed in PressureTube, or take a solvent that boils higher"
            yield Finding("reflux-temperature", step.index, message, suggestion)


def products_dry_below_melting(case: Case) -> Iterator[Finding]:
    """A product is dried below its melting point where the protocol states one."""
    found = _MELTING.search(case.protocol.product)
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if found and step.action == "DrySolid" and temperature is not None and temperature >= float(found[1]):
            message = f"step {step.index} dries at {temperature:g} C a product that melts at {found[1]} C"
            yield Finding(
                "dries-above-melting", step.index, message, f"dry at {float(found[1]) - 20.0:g} C or under vacuum"
            )


def explosives_stay_cool(case: Case) -> Iterator[Finding]:
    """Reagents that can explode are not heated."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        for name in situation.contents:
            if case.catalog.get(name).hazards.explosive and temperature is not None and temperature > EXPLOSIVE_LIMIT:
                message = f"step {step.index} ({step.action}) heats {name}, which can explode, to {temperature:g} C"
                suggestion = f"stay below {EXPLOSIVE_LIMIT:g} C, or destroy what is left of it first"
                yield Finding("explosive-heated", step.index, message, suggestion)


def quenches_are_cold(case: Case) -> Iterator[Finding]:
    """What reacts violently with water is quenched cold."""
    for before, situation in zip(case.situations, case.situations[1:], strict=False):
        step = situation.step
        if step.action != "Quench":
            continue
        names = [name for name in {**before.contents, **situation.contents} if _is_violent(case, name)]
        if names and (step.temperature is None or step.temperature > QUENCH_LIMIT):
            told = "no temperature" if step.temperature is None else f"{step.temperature:g} C"
            message = f"step {step.index} quenches {names[0]}, which reacts violently, at {told}"
            yield Finding("quench-cold", step.index, message, "quench at 0 to 10 C in IceBath, slowly")


def _hardier(case: Case, asset: Asset, temperature: float, limit: float) -> str:
    """Return what to use instead: for a vessel one that withstands the heat, for anything else nothing."""
    vessels = [other for other in case.catalog.of_kind("instrument") if is_vessel(asset) and other.subtype in VESSELS]
    fit = sorted((stands_to(other) or 0.0, other.name) for other in vessels)
    chosen = next((name for most, name in fit if most >= temperature), None)
    return f"use {chosen}" if chosen else f"leave {asset.name} out, or stay below {limit:g} C"


def _kept(situation: Situation) -> bool:
    devices = situation.devices
    return any(asset.subtype in RETURNS or withstands(asset) is not None for asset in devices)


def _boiling_point(case: Case, name: str) -> float | None:
    chemistry = case.catalog.get(name).chemistry
    return None if chemistry is None else chemistry.boiling_point


def _is_violent(case: Case, name: str) -> bool:
    chemistry = case.catalog.get(name).chemistry
    return chemistry is not None and not VIOLENT.isdisjoint(chemistry.groups)


RULES = (
    cold_is_reached,
    ware_stands_the_heat,
    solvents_stay_in_open_vessels,
    reflux_is_as_hot_as_it_can_be,
    products_dry_below_melting,
    explosives_stay_cool,
    quenches_are_cold,
)
