"""Vessels are large enough, fit their heater, and withstand the pressure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from labgym.assets import Asset
from labgym.protocols.capability import alternative, capacity, evacuates_to, withstands
from labgym.protocols.contents import Situation, is_vessel
from labgym.protocols.portions import EVAPORATOR, FILLING, in_words, portions, portions_for
from labgym.protocols.rules.finding import Finding, ProtocolCase

HEADROOM = {"Heat": 2.0 / 3.0, "Reflux": 2.0 / 3.0, "Distill": 2.0 / 3.0, "Concentrate": FILLING}
"""Largest filling of a heated vessel: two thirds, and half on the rotary evaporator."""
FLAT = ("ErlenmeyerFlask", "Beaker", "VolumetricFlask", "CrystallizingDish")
"""Thin flat-bottomed glassware, which vacuum can crush."""
SPECIAL = ("FilterFlask", "VolumetricFlask")
"""Flasks that cannot replace another flask."""
WORKING = ("Stir", "Heat", "Reflux", "Cool", "Distill")
"""Actions in which the mixture in a reactor has to reach its stirrer and its sensor."""
CLOSED = re.compile(r"\b(?:stopper(?:ed)?|seal(?:ed)?|closed|cap(?:ped)?|screw\s+cap)\b", re.I)
OPENED = re.compile(
    r"\b(?:unstoppered|unsealed|not\s+(?:sealed|closed|stoppered)|closed\s+bottle|vent(?:ing|ed)?)\b", re.I
)
PRESSURE_FROM_C = 50.0
"""Temperature below which the pressure in a closed vessel is negligible, degrees Celsius."""
TROUTON, TROUTON_ASSOCIATED = 10.6, 13.1
"""Entropy of vaporization over the gas constant: of most liquids by Trouton's rule (88 J/(mol K)), and of water and
alcohols (109 J/(mol K))."""


def vessels_hold_their_contents(case: ProtocolCase) -> Iterator[Finding]:
    """No vessel holds more than its capacity; heated vessels have headroom."""
    worst: set[tuple[str, str]] = set()
    for situation in case.situations:
        step, vessel = situation.step, situation.vessel
        holds = None if vessel is None else capacity(vessel)
        if vessel is None or holds is None or ("vessel-volume", vessel.name) in worst:
            continue
        subject = f"step {step.index} ({step.action})"
        limit = HEADROOM.get(step.action, 1.0) * holds
        need = situation.volume / HEADROOM.get(step.action, 1.0)
        filling = situation.volume / portions(step)
        if filling > holds:
            worst.add(("vessel-volume", vessel.name))
            message = f"{subject} has about {filling:.0f} mL in {vessel.name} of {holds:g} mL"
            yield Finding("vessel-volume", step.index, message, _remedy(case, situation, vessel, need))
        elif filling > limit and ("vessel-headroom", vessel.name) not in worst:
            worst.add(("vessel-headroom", vessel.name))
            message = (
                f"{subject} heats about {filling:.0f} mL in {vessel.name} of {holds:g} mL; "
                f"fill it to {limit:.0f} mL at most"
            )
            yield Finding("vessel-headroom", step.index, message, _remedy(case, situation, vessel, need), "advice")


def vessels_are_filled_enough(case: ProtocolCase) -> Iterator[Finding]:
    """A vessel with a smallest working volume, such as a stirred reactor, holds it when it is stirred or heated."""
    for situation in case.situations:
        step, vessel = situation.step, situation.vessel
        working = None if vessel is None else vessel.specs.working_mL
        if vessel is None or working is None or step.action not in WORKING or vessel not in situation.devices:
            continue
        if _all_known(case, situation) and 0.0 < situation.volume < working[0]:
            message = (
                f"step {step.index} ({step.action}) has about {situation.volume:.0f} mL in {vessel.name}, which works "
                f"with {working[0]:g} to {working[1]:g} mL"
            )
            yield Finding("vessel-working", step.index, message, _smaller(case, situation.volume), "advice")


def additions_fit_the_funnel(case: ProtocolCase) -> Iterator[Finding]:
    """An addition fits the dropping funnel, or the text says that it is in portions."""
    for situation in case.situations:
        for funnel in situation.devices:
            holds = capacity(funnel)
            if "Dropping" not in funnel.name or holds is None or "portion" in situation.step.text.lower():
                continue
            poured = sum(situation.contents.get(reagent.name, 0.0) for reagent in situation.added)
            if poured > holds:
                message = f"step {situation.step.index} adds about {poured:.0f} mL from {funnel.name} of {holds:g} mL"
                suggestion = "add the liquid in portions and state it in the text"
                yield Finding("funnel-volume", situation.step.index, message, suggestion, "advice")


def vessels_fit_their_heater(case: ProtocolCase) -> Iterator[Finding]:
    """A heating mantle holds round flasks of its size."""
    for situation in case.situations:
        for mantle in situation.devices:
            takes = capacity(mantle) if mantle.subtype == "mantle" else None
            vessel = situation.vessel
            holds = capacity(vessel) if vessel is not None and vessel in situation.devices else None
            if takes is None or holds is None or vessel is None:
                continue
            if vessel.family in FLAT:
                message = f"step {situation.step.index} heats {vessel.name}, which has a flat bottom, in {mantle.name}"
                yield Finding(
                    "vessel-fits-heater", situation.step.index, message, "use a hotplate, or RoundBottomFlask"
                )
            elif holds > takes:
                message = (
                    f"step {situation.step.index} heats {vessel.name} of {holds:g} mL in {mantle.name} for {takes:g} mL"
                )
                yield Finding("vessel-fits-heater", situation.step.index, message, "use a bath, such as OilBath")


def closed_vessels_stand_the_pressure(case: ProtocolCase) -> Iterator[Finding]:
    """A vessel that is heated closed has a pressure rating, and the vapor pressure stays below it."""
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if temperature is None or temperature < PRESSURE_FROM_C or situation.vessel is None:
            continue
        vessels = [asset for asset in situation.devices if withstands(asset) is not None]
        if vessels:
            limit = max(withstands(asset) or 0.0 for asset in vessels)
            liquids = [case.catalog.get(name) for name in situation.bulk()]
            pressures = [(vapor_pressure(asset, temperature), asset.name) for asset in liquids]
            pressure, liquid = max(pressures, default=(0.0, ""))
            if pressure - 1.0 > limit:
                message = (
                    f"step {step.index} heats {liquid} to {temperature:g} C in {vessels[0].name}: about "
                    f"{pressure:.0f} bar of vapor; it is rated for {limit:g} bar"
                )
                suggestion = _stronger(case, vessels[0], pressure)
                yield Finding("vessel-pressure", step.index, message, suggestion)
        elif CLOSED.search(step.text) and not OPENED.search(step.text) and situation.volume > 0.0:
            name = situation.vessel.name
            message = f"step {step.index} heats {name} closed to {temperature:g} C; it has no pressure rating"
            suggestion = "heat it open under RefluxCondenser, or closed in PressureTube"
            yield Finding("sealed-vessel", step.index, message, suggestion)


def vacuum_spares_flat_glass(case: ProtocolCase) -> Iterator[Finding]:
    """Thin flat-bottomed glassware is not evacuated."""
    for situation in case.situations:
        pumps = [asset for asset in situation.devices if evacuates_to(asset) is not None and asset.category == "vacuum"]
        flat = [asset for asset in situation.devices if asset.family in FLAT]
        filters = any(asset.family in ("FilterFlask", "Desiccator") for asset in situation.devices)
        if pumps and flat and not filters:
            message = f"step {situation.step.index} evacuates {flat[0].name}, whose flat bottom vacuum can crush"
            yield Finding("vacuum-glass", situation.step.index, message, "use RoundBottomFlask or SchlenkFlask")


def vapour_pressure(boiling_point: float, temperature: float, associated: bool) -> float:
    """Return the vapor pressure of a liquid in bar by the Clausius-Clapeyron equation with Trouton's entropy.

    Args:
        boiling_point: at 1.013 bar, degrees Celsius.
        temperature: degrees Celsius.
        associated: whether the liquid has hydrogen bonds, as water and alcohols do.
    """
    entropy = TROUTON_ASSOCIATED if associated else TROUTON
    return 1.013 * math.exp(entropy * (1.0 - (boiling_point + 273.15) / (temperature + 273.15)))


def vapor_pressure(reagent: Asset, temperature: float) -> float:
    """Return the vapor pressure of a reagent in bar, 0 if its boiling point is not known.

    Args:
        temperature: degrees Celsius.
    """
    if reagent.boiling_point is None:
        return 0.0
    associated = not {"alcohol", "aqueous"}.isdisjoint(reagent.groups)
    return vapour_pressure(reagent.boiling_point, temperature, associated)


def _all_known(case: ProtocolCase, situation: Situation) -> bool:
    """Return whether the amount of every liquid in the vessel is stated, so that its volume is not an underestimate."""
    chemistry = {name: case.catalog.get(name).chemistry for name in situation.contents}
    return all(
        part > 0.0
        for name, part in situation.contents.items()
        if (item := chemistry[name]) is not None and item.state == "liquid"
    )


def _remedy(case: ProtocolCase, situation: Situation, vessel: Asset, need: float) -> str:
    """Return how a batch fits: in portions on the rotary evaporator, else in a larger vessel."""
    evaporator = next((asset for asset in situation.devices if asset.family == EVAPORATOR), None)
    if evaporator is None or situation.step.action != "Concentrate":
        return _larger(case, vessel, need)
    return f"evaporate it {in_words(portions_for(situation.volume, vessel), vessel)}, and say so in the step"


def _larger(case: ProtocolCase, vessel: Asset, volume: float) -> str:
    names = [
        asset.name
        for asset in case.catalog
        if is_vessel(asset)
        and (asset.subtype == "funnel") == (vessel.subtype == "funnel")
        and (asset.family in FLAT) == (vessel.family in FLAT)
        and (asset.family == vessel.family or not {asset.family, vessel.family}.intersection(SPECIAL))
    ]
    name = alternative(case.catalog, vessel, capacity, lambda value: value >= volume, names)
    return f"use {name}" if name else f"no vessel of the catalog holds {volume:.0f} mL; halve the batch"


def _smaller(case: ProtocolCase, volume: float) -> str:
    """Return the smallest flask that a volume does not overfill."""
    flasks = sorted(
        (capacity(asset) or 0.0, asset.name)
        for asset in case.catalog.of_kind("instrument")
        if asset.subtype == "flask" and asset.family not in (*FLAT, *SPECIAL)
    )
    fit = next((name for holds, name in flasks if volume <= HEADROOM["Heat"] * holds), None)
    return f"use {fit}" if fit else "make a larger batch"


def _stronger(case: ProtocolCase, vessel: Asset, pressure: float) -> str:
    others = sorted(
        (withstands(a) or 0.0, a.name) for a in case.catalog.of_kind("instrument") if a.subtype == "reactor"
    )
    fit = next((name for limit, name in others if limit >= pressure - 1.0 and name != vessel.name), None)
    return f"use {fit}" if fit else "lower the temperature, or use a solvent with a higher boiling point"


RULES = (
    vessels_hold_their_contents,
    vessels_are_filled_enough,
    additions_fit_the_funnel,
    vessels_fit_their_heater,
    closed_vessels_stand_the_pressure,
    vacuum_spares_flat_glass,
)
