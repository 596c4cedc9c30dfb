"""Stated: figures and words of a text as the fields of an action, and amounts as they are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from labgym.protocols.amounts import figure as number
from labgym.protocols.experiments.model import Period
from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import GASES, MANNERS

_UNITS = {"mass": "g", "volume": "mL", "equivalents": "equiv", "molarity": "M", "percent": "%", "parts": "parts"}
_STOCK_WORDS = frozenset(("saturated", "concentrated", "dilute", "aqueous", "half-saturated", "glacial"))
_BAR_PER_MM_HG = 0.00133322


def stated_by(words: set[str]) -> dict[str, Any]:
    """Return how something is added, and the gas above it, as words say."""
    values: dict[str, Any] = {}
    manner = next((MANNERS[word] for word in sorted(words) if MANNERS.get(word)), None)
    if manner is None and "portions" in words and words & {"small", "several"}:
        manner = "portionwise"
    if manner:
        values["manner"] = manner
    gas = next((word for word in sorted(words) if word in GASES.values()), None)
    gas = gas or next((GASES[word] for word in sorted(words) if word in GASES), None)
    if words & {"vacuo", "vacuum"} or {"reduced", "pressure"} <= words:
        gas = gas or "vacuum"
    if gas:
        values["atmosphere"] = gas
    return values


def held_at(conditions: Sequence[QuantitySpan]) -> dict[str, Any]:
    """Return the first period with the pressure and the pH that conditions make; the other periods are "then"."""
    periods: list[dict[str, float]] = []
    values: dict[str, Any] = {}
    for item in conditions:
        if item.kind == "ph":
            values.setdefault("ph", min(16.0, item.value))
        elif item.kind == "pressure":
            values.setdefault("pressure", min(1000.0, item.value))
        else:
            key = "temperature" if item.kind == "temperature" else "duration"
            value = max(-273.15, min(3000.0, item.value)) if key == "temperature" else min(100_000.0, item.value)
            if not periods or key in periods[-1]:
                periods.append({})
            periods[-1][key] = value
    if periods:
        values.update(periods[0])
        values["then"] = tuple(Period(**period) for period in periods[1:])[:20]
    return values


def single(conditions: Sequence[QuantitySpan]) -> dict[str, Any]:
    """Return what conditions say of one period."""
    return {key: value for key, value in held_at(conditions).items() if key != "then"}


def mercury(item: QuantitySpan) -> QuantitySpan:
    """Return a length of mercury as the pressure that it means: "0.2 mm"."""
    if item.kind != "other":
        return item
    return replace(item, kind="pressure", value=round(item.value * _BAR_PER_MM_HG, 9))


def written(value: QuantitySpan, repeats: int = 1) -> str:
    """Return an amount in base units as amounts are written: "3 x 30 mL"."""
    if value.kind == "substance":
        if value.value < 0.1:
            return f"{number(value.value * 1000.0, 6)} mmol"
        return f"{number(value.value, 6)} mol"
    text = f"{number(value.value, 6)} {_UNITS[value.kind]}"
    portions = value.portions if value.portions > 1 else repeats if value.kind in ("mass", "volume") else 1
    return f"{portions} x {text}" if portions > 1 else text


def amount(figures: Sequence[QuantitySpan], words: Sequence[str], repeats: int = 1) -> str:
    """Return figures and words of a substance as one amount: "20 mL of 2 M, excess"."""
    parts: list[str] = []
    stock: list[str] = []
    for value in figures:
        text = written(value, repeats)
        if value.kind in ("molarity", "percent"):
            stock.append(text)
        elif text and text not in parts:
            parts.append(text)
    words = list(dict.fromkeys(words))
    if stock or len(words) > 1:
        words = [word for word in words if word != "aqueous"]
    stock += [word for word in words if word in _STOCK_WORDS]
    for strength in stock:
        if parts and " of " not in parts[0]:
            parts[0] = f"{parts[0]} of {strength}"
        else:
            parts.append(strength if not strength[0].isdigit() else f"of {strength}")
    return ", ".join([*parts, *(word for word in words if word not in _STOCK_WORDS)])[:200]
