"""Temperatures are within the limits of devices, ware, solvents and reagents."""

from __future__ import annotations

import re
from collections.abc import Iterator

from labgym.assets import Asset
from labgym.protocols.amounts import moles_of
from labgym.protocols.capability import cools_to, stands_to, withstands
from labgym.protocols.contents import STILL, VESSELS, Situation, is_vessel
from labgym.protocols.rules.finding import Finding, ProtocolCase
from labgym.quantities import ROOM_RANGE

COLD_CARRIED = ("Filter", "Wash", "PhaseSeparation", "Transfer", "Extract", "Dilute")
"""Actions that a batch from a cold bath goes through before it has warmed up."""
UNCOOLED = ("Concentrate", "DryVacuum", "Purge")
"""Actions whose evaporation cools by itself, or that only pass a gas."""
_ICE = re.compile(r"(?<!dry )\b(?:ice|iced|chill(?:s|ed|ing)?)\b(?![\s-]*(?:free|bath\s+removed))", re.I)
"""Words for a step that uses ice, whether or not it states a temperature."""
RETURNS = ("condenser", "adapter", "trap", "rotavap")
"""Subtypes of devices that return vapor or lead it away."""
SUPERHEAT_K = 15.0
"""Tolerated boiling-point elevation of a mixture by salts and products, degrees Celsius."""
VOLATILE_SHARE = 0.2
"""Share of the volume from which on a liquid that boils off counts."""
EXPLOSIVE_LIMIT_C = 60.0
"""Highest temperature of explosive reagents, degrees Celsius."""
INITIATOR_LIMIT_C = 115.0
"""Highest temperature of a dissolved radical initiator, degrees Celsius; toluene boils at 111."""
INITIATOR_LIMIT_G_PER_L = 30.0
"""Highest concentration of a heated radical initiator.

Decomposing at once, 30 g/L of AIBN (1.3 kJ/g) warm an organic solvent by 30 K.
"""
INITIATOR_EQUIVALENTS = 0.2
"""Largest catalytic amount of a radical initiator, moles per mole of the main reagent."""
RADICAL_SOURCES = frozenset({"azo", "organic_peroxide"})
"""Reactive groups that decompose to radicals."""
QUENCH_LIMIT_C = 25.0
"""Highest temperature at which a reagent of `VIOLENT_IN_WATER` is quenched, degrees Celsius."""
VIOLENT_IN_WATER = frozenset({"metal_hydride", "organometallic", "alkali_metal", "acyl_halide", "halogenating_agent"})
_MELTING = re.compile(r"\bmp\s*(\d{2,3}(?:\.\d)?)(?:\s*[-–]\s*(\d{2,3}(?:\.\d)?))?\s*(?:°\s*)?C\b")


def cold_is_reached(case: ProtocolCase) -> Iterator[Finding]:
    """A step below room temperature, or with ice, uses a device that reaches its temperature.

    A batch that comes out of a cold bath stays cold while it is filtered or separated.
    """
    carried = ROOM_RANGE[0]
    for situation in case.situations:
        step = situation.step
        temperature = ROOM_RANGE[0] if step.temperature is None else step.temperature
        limits = [lowest for asset in situation.devices if (lowest := cools_to(asset)) is not None]
        iced = step.action not in STILL and _ICE.search(step.text) is not None
        still_cold = step.action in COLD_CARRIED and carried < ROOM_RANGE[0]
        if step.action not in STILL:
            carried = min(limits) if limits else carried if still_cold else ROOM_RANGE[0]
        if step.action in UNCOOLED or still_cold or (temperature >= ROOM_RANGE[0] and (limits or not iced)):
            continue
        if not limits or min(limits) > temperature:
            what = f"its devices reach {min(limits):g} C" if limits else "none of its devices can cool"
            options = sorted(
                (asset.subtype == "bath", lowest, asset.name)
                for asset in case.catalog.of_kind("instrument")
                if (lowest := cools_to(asset)) is not None and lowest <= temperature and asset.category == "cooling"
            )
            suggestion = (
                f"use {options[-1][2]}" if options else "choose a higher temperature: the catalog has no such device"
            )
            needs = f"needs {temperature:g} C" if temperature < ROOM_RANGE[0] else "uses ice"
            message = f"step {step.index} ({step.action}) {needs}, but {what}"
            yield Finding("cooling-reach", step.index, message, suggestion)


def ware_stands_the_heat(case: ProtocolCase) -> Iterator[Finding]:
    """Vessels, stirring bars and thermometers are used within their temperature limits."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        for asset in situation.devices:
            limit = stands_to(asset)
            if temperature is not None and limit is not None and temperature > limit:
                problem = f"is at {temperature:g} C, but {asset.name} withstands {limit:g} C"
                message = f"step {step.index} ({step.action}) {problem}"
                yield Finding("temperature-limit", step.index, message, _hardier(case, asset, temperature, limit))


def solvents_stay_in_open_vessels(case: ProtocolCase) -> Iterator[Finding]:
    """A liquid is heated above its boiling point only with a condenser, a still head or a vessel built for pressure."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if temperature is None or situation.vessel is None or step.action == "Concentrate" or _kept(situation):
            continue
        for name in situation.bulk(VOLATILE_SHARE):
            boiling = case.catalog.get(name).boiling_point
            if boiling is not None and temperature > boiling:
                message = (
                    f"step {step.index} ({step.action}) is at {temperature:g} C; {name} boils at {boiling:g} C and "
                    f"{situation.vessel.name} is open"
                )
                yield Finding("boils-off", step.index, message, "fit RefluxCondenser, or stay below the boiling point")
                break


def reflux_is_as_hot_as_it_can_be(case: ProtocolCase) -> Iterator[Finding]:
    """The temperature of a reflux is not above the boiling points of the liquids."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        boils = step.action == "Reflux" or any(asset.subtype == "condenser" for asset in situation.devices)
        if not boils or step.action == "Distill" or temperature is None:
            continue
        if any(withstands(asset) for asset in situation.devices):
            continue
        boiling = [case.catalog.get(name).boiling_point for name in situation.bulk()]
        points = [point for point in boiling if point is not None]
        if points and len(points) == len(boiling) and temperature > max(points) + SUPERHEAT_K:
            message = (
                f"step {step.index} is at {temperature:g} C under a condenser, above {max(points):g} C, where it boils"
            )
            suggestion = "heat it closed in PressureTube, or use a solvent with a higher boiling point"
            yield Finding("reflux-temperature", step.index, message, suggestion)


def products_dry_below_melting(case: ProtocolCase) -> Iterator[Finding]:
    """A product is dried below its melting point, if the protocol states one."""
    melting = _MELTING.search(case.protocol.product)
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if melting and step.action == "DrySolid" and temperature is not None and temperature >= float(melting[1]):
            message = f"step {step.index} dries at {temperature:g} C a product that melts at {melting[1]} C"
            yield Finding(
                "dries-above-melting", step.index, message, f"dry at {float(melting[1]) - 20.0:g} C or under vacuum"
            )


def explosives_stay_cool(case: ProtocolCase) -> Iterator[Finding]:
    """Explosive reagents are not heated, except a catalytic amount of a radical initiator in a solvent."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        for name in situation.contents:
            if temperature is None or not case.catalog.get(name).hazards.explosive:
                continue
            limit = INITIATOR_LIMIT_C if _is_dilute_initiator(case, situation, name) else EXPLOSIVE_LIMIT_C
            if temperature > limit:
                message = f"step {step.index} ({step.action}) heats {name}, which can explode, to {temperature:g} C"
                suggestion = f"stay below {limit:g} C, or destroy its residue first"
                yield Finding("explosive-heated", step.index, message, suggestion)


def quenches_are_cold(case: ProtocolCase) -> Iterator[Finding]:
    """Reagents that react violently with water are quenched cold."""
    for before, situation in zip(case.situations, case.situations[1:], strict=False):
        step = situation.step
        if step.action != "Quench":
            continue
        names = [name for name in {**before.contents, **situation.contents} if _is_violent(case, name)]
        if names and (step.temperature is None or step.temperature > QUENCH_LIMIT_C):
            stated = "no temperature" if step.temperature is None else f"{step.temperature:g} C"
            message = f"step {step.index} quenches {names[0]}, which reacts violently, at {stated}"
            yield Finding("quench-cold", step.index, message, "quench at 0 to 10 C in IceBath, slowly")


def _is_dilute_initiator(case: ProtocolCase, situation: Situation, name: str) -> bool:
    """Return whether a reagent is a source of radicals in a catalytic amount, dissolved in a solvent."""
    chemistry = case.catalog.get(name).chemistry
    uses = {use.name: use for use in case.protocol.reagents if use.name in situation.contents}
    if chemistry is None or chemistry.molar_mass is None or RADICAL_SOURCES.isdisjoint(chemistry.groups):
        return False
    solvents = {item for item in situation.contents if item not in uses or "solvent" in uses[item].role.lower()}
    moles = {item: moles_of(case.catalog.get(item), use.amount) or 0.0 for item, use in uses.items()}
    main = max((amount for item, amount in moles.items() if item not in solvents | {name}), default=0.0)
    volume = sum(situation.contents[item] for item in solvents - {name})
    catalytic = 0.0 < moles.get(name, 0.0) <= INITIATOR_EQUIVALENTS * main
    dissolved = 2.0 * volume >= situation.volume and (
        1000.0 * moles.get(name, 0.0) * chemistry.molar_mass <= INITIATOR_LIMIT_G_PER_L * volume
    )
    return catalytic and dissolved


def _hardier(case: ProtocolCase, asset: Asset, temperature: float, limit: float) -> str:
    """Return a vessel that withstands the temperature, or advice to leave the asset out."""
    vessels = [other for other in case.catalog.of_kind("instrument") if is_vessel(asset) and other.subtype in VESSELS]
    fit = sorted((stands_to(other) or 0.0, other.name) for other in vessels)
    chosen = next((name for most, name in fit if most >= temperature), None)
    return f"use {chosen}" if chosen else f"leave {asset.name} out, or stay below {limit:g} C"


def _kept(situation: Situation) -> bool:
    devices = situation.devices
    return any(asset.subtype in RETURNS or withstands(asset) is not None for asset in devices)


def _is_violent(case: ProtocolCase, name: str) -> bool:
    return not VIOLENT_IN_WATER.isdisjoint(case.catalog.get(name).groups)


RULES = (
    cold_is_reached,
    ware_stands_the_heat,
    solvents_stay_in_open_vessels,
    reflux_is_as_hot_as_it_can_be,
    products_dry_below_melting,
    explosives_stay_cool,
    quenches_are_cold,
)
