"""Pumps, stirrers and balances do what the steps ask of them."""

from __future__ import annotations

import operator
import re
from collections.abc import Iterator
from functools import partial

from labgym.assets import Asset
from labgym.protocols.amounts import read_amount
from labgym.protocols.capability import alternative, evacuates_to, speeds, weighs
from labgym.protocols.rules.finding import Case, Finding

_PRESSURE = re.compile(r"(\d+(?:\.\d+)?)\s*(mbar|bar|hPa|kPa|Pa|mm\s?Hg|Torr)\b", re.I)
_MBAR = {"mbar": 1.0, "bar": 1000.0, "hpa": 1.0, "kpa": 10.0, "pa": 0.01, "mmhg": 1.333, "torr": 1.333}
_SPEED = re.compile(r"(\d{2,6})\s*(?:rpm|r\.p\.m\.|turns a minute|U/min)", re.I)
_VACUUM = re.compile(r"\b(?:vacuum|reduced pressure|in vacuo|evacuate)\b", re.I)
EVACUATED = ("pump", "rotavap", "lyophilizer", "manifold", "oven")
AMBIENT = 1000.0
DIVISIONS = 10.0
"""A mass is at least this many divisions of the balance, so that it is known to a tenth."""


def vacuum_is_reached(case: Case) -> Iterator[Finding]:
    """A pressure that a step states is one that its pump reaches; what is done under vacuum has a pump."""
    for situation in case.situations:
        step = situation.step
        pumps = [asset for asset in situation.devices if evacuates_to(asset) is not None]
        stated = _PRESSURE.search(step.text)
        wanted = float(stated[1]) * _MBAR[re.sub(r"\s", "", stated[2].lower())] if stated else None
        if wanted is not None and wanted < AMBIENT and pumps:
            best = min(pumps, key=lambda asset: evacuates_to(asset) or 0.0)
            reached = evacuates_to(best) or 0.0
            if reached > wanted:
                name = alternative(case.catalog, best, evacuates_to, partial(operator.ge, wanted))
                message = f"step {step.index} wants {wanted:g} mbar, {best.name} reaches {reached:g} mbar"
                suggestion = f"use {name}" if name else "distil at a higher pressure"
                yield Finding("vacuum-reach", step.index, message, suggestion)
        elif step.action in ("Distill", "DryVacuum") and (_VACUUM.search(step.text) or step.action == "DryVacuum"):
            if not any(asset.subtype in EVACUATED for asset in situation.devices):
                message = f"step {step.index} ({step.action}) works under vacuum without a pump"
                yield Finding("vacuum-source", step.index, message, "name VacuumPump or RotaryVanePump in its uses")


def speeds_are_reached(case: Case) -> Iterator[Finding]:
    """A rotation speed that a step states is one that its device turns at."""
    for situation in case.situations:
        stated = _SPEED.search(situation.step.text)
        turning = [asset for asset in situation.devices if speeds(asset) is not None]
        if stated is None or not turning:
            continue
        wanted = float(stated[1])
        if not any(_turns(asset, wanted) for asset in turning):
            slow, fast = speeds(turning[0]) or (0.0, 0.0)
            message = (
                f"step {situation.step.index} wants {wanted:g} rpm, {turning[0].name} turns at {slow:g} to {fast:g} rpm"
            )
            options = [asset.name for asset in case.catalog.of_kind("instrument") if _turns(asset, wanted)]
            near = [name for name in options if case.catalog.get(name).category == turning[0].category]
            suggestion = f"use {(near or options)[0]}" if options else "choose a speed within that range"
            yield Finding("speed-reach", situation.step.index, message, suggestion)


def balances_weigh_what_they_get(case: Case) -> Iterator[Finding]:
    """What is weighed is not too much for the balance, nor too little for its divisions."""
    amounts = {use.name: read_amount(use.amount) for use in case.protocol.reagents}
    for situation in case.situations:
        for balance in situation.devices:
            limits = weighs(balance)
            if limits is None or situation.step.action != "Weigh":
                continue
            for reagent in situation.added:
                mass = amounts[reagent.name].mass if reagent.name in amounts else None
                if mass is not None and not DIVISIONS * limits[0] <= mass <= limits[1]:
                    message = (
                        f"step {situation.step.index} weighs {mass:g} g of {reagent.name} on {balance.name} "
                        f"({limits[0]:g} to {limits[1]:g} g)"
                    )
                    yield Finding("balance-range", situation.step.index, message, _balance(case, mass), "advice")


def _turns(asset: Asset, speed: float) -> bool:
    bounds = speeds(asset)
    return bounds is not None and bounds[0] <= speed <= bounds[1]


def _balance(case: Case, mass: float) -> str:
    for asset in case.catalog.of_kind("instrument"):
        limits = weighs(asset)
        if limits is not None and DIVISIONS * limits[0] <= mass <= limits[1]:
            return f"use {asset.name}"
    return "weigh it in portions"


RULES = (vacuum_is_reached, speeds_are_reached, balances_weigh_what_they_get)
