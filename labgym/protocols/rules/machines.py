"""Pumps, stirrers, lamps, balances and benches are used within their limits."""

from __future__ import annotations

import operator
import re
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from labgym.assets import Asset
from labgym.protocols.amounts import read_amount
from labgym.protocols.capability import (
    Span,
    alternative,
    delivers,
    evacuates_to,
    flows,
    forces,
    shines,
    speeds,
    stirs,
    weighs,
    withstands,
)
from labgym.protocols.contents import STILL
from labgym.protocols.rules.finding import Finding, ProtocolCase
from labgym.quantities import pressure

_VACUUM = re.compile(r"\b(?:vacuum|reduced pressure|in vacuo|evacuate)\b", re.I)
EVACUATED = ("pump", "rotavap", "lyophilizer", "manifold", "oven")
VACUUM_BELOW_MBAR, PRESSURE_ABOVE_MBAR = 1000.0, 1500.0
"""Pressures in mbar: below the first is a vacuum; above the second, a vessel needs a pressure rating."""
READABLE = 10.0
"""Smallest mass that is weighed to within 10 %, as a multiple of the balance's resolution."""


def vacuum_is_reached(case: ProtocolCase) -> Iterator[Finding]:
    """A step under vacuum has a pump, which reaches the stated pressure."""
    for situation in case.situations:
        step = situation.step
        pumps = [asset for asset in situation.devices if evacuates_to(asset) is not None]
        stated = _stated_mbar(step.text)
        if stated is not None and stated < VACUUM_BELOW_MBAR and pumps:
            best = min(pumps, key=lambda asset: evacuates_to(asset) or 0.0)
            limit = evacuates_to(best) or 0.0
            if limit > stated:
                name = alternative(case.catalog, best, evacuates_to, partial(operator.ge, stated))
                message = f"step {step.index} needs {stated:g} mbar, but {best.name} reaches {limit:g} mbar"
                suggestion = f"use {name}" if name else "distil at a higher pressure"
                yield Finding("vacuum-reach", step.index, message, suggestion)
        elif step.action in ("Distill", "DryVacuum") and (_VACUUM.search(step.text) or step.action == "DryVacuum"):
            if not any(asset.subtype in EVACUATED for asset in situation.devices):
                message = f"step {step.index} ({step.action}) works under vacuum without a pump"
                yield Finding("vacuum-source", step.index, message, "add VacuumPump or RotaryVanePump to its uses")


def pressures_are_withstood(case: ProtocolCase) -> Iterator[Finding]:
    """A stated pressure above ambient is within the rating of the vessel or of the pump."""
    for situation in case.situations:
        step, stated = situation.step, _stated_mbar(situation.step.text)
        limits = [
            (limit, asset.name)
            for asset in situation.devices
            if (limit := withstands(asset) or delivers(asset)) is not None
        ]
        if stated is None or stated <= PRESSURE_ABOVE_MBAR:
            continue
        vessel = situation.vessel.name if situation.vessel is not None else "its apparatus"
        balloon = next((asset.name for asset in situation.devices if asset.subtype == "gas"), "")
        bar, (limit, name) = stated / 1000.0, max(limits, default=(0.0, balloon or vessel))
        if bar - 1.0 > limit:
            message = f"step {step.index} needs {bar:.3g} bar, but {name} is rated for {limit:g} bar above ambient"
            others = sorted((withstands(a) or 0.0, a.name) for a in case.catalog.of_kind("instrument"))
            fit = next((other for most, other in others if most >= bar - 1.0), None)
            yield Finding("pressure-reach", step.index, message, f"use {fit}" if fit else "work at a lower pressure")


@dataclass(frozen=True)
class DeviceSetting:
    """A setting of a device that a step's text can state.

    Attributes:
        rule: name of the finding.
        unit: as messages show it.
        stated: pattern of the number in a text.
        spans: ranges that a device can be set to; empty if it has no such setting.
    """

    rule: str
    unit: str
    stated: re.Pattern[str]
    spans: Callable[[Asset], tuple[Span, ...]]


SETTINGS = (
    DeviceSetting(
        "speed-reach", "rpm", re.compile(r"(\d[\d,]{1,6})\s*(?:rpm|r\.p\.m\.|turns a minute|U/min)", re.I), speeds
    ),
    DeviceSetting("force-reach", "x g", re.compile(r"(\d[\d,]{1,6})\s*(?:[x×]\s*g|rcf)\b", re.I), forces),
    DeviceSetting("flow-reach", "mL/min", re.compile(r"(\d{1,5}(?:\.\d{1,4})?)\s*mL\s*(?:/\s*min|min-1)", re.I), flows),
    DeviceSetting("wavelength-reach", "nm", re.compile(r"(\d{3,4})\s*nm\b"), shines),
)


def settings_are_reached(case: ProtocolCase) -> Iterator[Finding]:
    """A stated speed, force, flow or wavelength is within the range of a device of the step."""
    for situation in case.situations:
        for setting in SETTINGS:
            stated = setting.stated.search(situation.step.text)
            devices = [asset for asset in situation.devices if setting.spans(asset)]
            if stated is None or not devices:
                continue
            value = float(stated[1].replace(",", ""))
            if not any(_has(setting, asset, value) for asset in devices):
                spans = " or ".join(f"{low:g} to {high:g}" for low, high in setting.spans(devices[0]))
                unit, index = setting.unit, situation.step.index
                message = f"step {index} needs {value:g} {unit}, but {devices[0].name} has {spans} {unit}"
                options = [asset for asset in case.catalog.of_kind("instrument") if _has(setting, asset, value)]
                near = [asset.name for asset in options if asset.category == devices[0].category]
                suggestion = (
                    f"use {[*near, *(a.name for a in options)][0]}" if options else "choose a value in its range"
                )
                yield Finding(setting.rule, index, message, suggestion)


def stirrers_move_the_batch(case: ProtocolCase) -> Iterator[Finding]:
    """A batch is not too large for its stirrer."""
    for situation in case.situations:
        stirring = [(most, asset.name) for asset in situation.devices if (most := stirs(asset)) is not None]
        if situation.step.action in STILL or not stirring or situation.volume <= max(stirring)[0]:
            continue
        most, name = max(stirring)
        message = (
            f"step {situation.step.index} stirs about {situation.volume:.0f} mL, but {name} moves at most {most:g} mL"
        )
        options = sorted((stirs(a) or 0.0, a.name) for a in case.catalog.of_kind("instrument"))
        fit = next((other for moved, other in options if moved >= situation.volume), None)
        yield Finding(
            "stirring-volume", situation.step.index, message, f"use {fit}" if fit else "divide the batch", "advice"
        )


def balances_weigh_what_they_get(case: ProtocolCase) -> Iterator[Finding]:
    """A mass is within the capacity of its balance and can be weighed to within 10 %."""
    amounts = {use.name: read_amount(use.amount) for use in case.protocol.reagents}
    for situation in case.situations:
        for balance in situation.devices:
            limits = weighs(balance)
            if limits is None or situation.step.action != "Weigh":
                continue
            for reagent in situation.added:
                mass = amounts[reagent.name].mass if reagent.name in amounts else None
                if mass is not None and not READABLE * limits[0] <= mass <= limits[1]:
                    message = (
                        f"step {situation.step.index} weighs {mass:g} g of {reagent.name} on {balance.name} "
                        f"({limits[0]:g} to {limits[1]:g} g)"
                    )
                    yield Finding("balance-range", situation.step.index, message, _balance(case, mass), "advice")


def benches_carry_their_load(case: ProtocolCase) -> Iterator[Finding]:
    """The instruments on a bench are within its load limit."""
    loads: dict[str, dict[str, float]] = defaultdict(dict)
    for situation in case.situations:
        place = situation.place
        if place is None or place.specs.load_kg is None:
            continue
        load = loads[place.name]
        before = sum(load.values())
        load |= {asset.name: asset.mass for asset in situation.devices if asset.placing == "desktop"}
        after, most = sum(load.values()), place.specs.load_kg
        if before <= most < after:
            heaviest = max(load, key=lambda name: load[name])
            message = f"at step {situation.step.index}, {place.name} carries {after:.0f} kg; its limit is {most:g} kg"
            suggestion = f"use {heaviest} ({load[heaviest]:g} kg) at another bench"
            yield Finding("bench-load", situation.step.index, message, suggestion, "advice")


def _stated_mbar(text: str) -> float | None:
    bar = pressure(text)
    return None if bar is None else 1000.0 * bar


def _has(setting: DeviceSetting, asset: Asset, value: float) -> bool:
    return any(low <= value <= high for low, high in setting.spans(asset))


def _balance(case: ProtocolCase, mass: float) -> str:
    balances = [(limits, asset.name) for asset in case.catalog.of_kind("instrument") if (limits := weighs(asset))]
    for limits, name in balances:
        if READABLE * limits[0] <= mass <= limits[1]:
            return f"use {name}"
    too_little = all(mass < READABLE * limits[0] for limits, _ in balances)
    return "measure it out as a solution" if too_little else "weigh it in portions"


RULES = (
    vacuum_is_reached,
    pressures_are_withstood,
    settings_are_reached,
    stirrers_move_the_batch,
    balances_weigh_what_they_get,
    benches_carry_their_load,
)
