"""Names in files: the words of file, object and material names, amounts in them, and CamelCase names from them."""

from __future__ import annotations

import re

_NOISE = """
    model mesh object obj geo geom geometry default root world scene untitled final copy export exported low
    lowpoly high highpoly poly lod lod0 usd usda stl glb asset sm free lab laboratory the a an of with and new
    old test node group xform material mat looks v1 v2 v3 v4 part body mm cm inch vis visual collision col mesh
"""
NOISE = frozenset(_NOISE.split())
"""Words that do not describe an object."""
CONTAINERS = frozenset(
    ("bottle", "jar", "flask", "can", "drum", "vial", "canister", "container", "pack", "reagent", "chemical", "solvent")
)
"""Words for containers of reagents."""
AMOUNT = re.compile(r"\d+(?:\.\d+)?(?:ml|l|g|kg|mg|m|mm|cm|um|pc|percent|n|x)?", re.IGNORECASE)
_BREAKS = re.compile(
    r"(?<=[a-z])(?=[A-Z])|(?<=\d)(?=[a-z]{4})|(?<=[a-z]{3})(?=\d)|(?<=[A-Z])(?=[A-Z][a-z])|(?<!\d)\.|\.(?!\d)|[^\w.]+|_+|(?<=[^\x00-\x7f])(?=[\x00-\x7f])"
)
_AMOUNT_PARTS = re.compile(r"^(\d+(?:\.\d+)?)([a-z]*)$", re.IGNORECASE)
MAX_WORDS = 16
_ML = re.compile(r"(?<![A-Za-z])mL(?![A-Za-z])")
_MILLILITRES = {"ml": 1.0, "l": 1000.0}
UNITS = frozenset({"ml", "l", "g", "kg", "mg", "mm", "cm"})
"""Units that belong to a number before them."""


def name_words(text: str) -> list[str]:
    """Return the words of a name, at most 16: split at separators, at capitals, and between words and numbers.

    "acetone_2.5 L" gives ["acetone", "2.5L"], "RoundBottomFlask" gives ["Round", "Bottom", "Flask"], and
    "blueP1000micropipette" gives ["blue", "P1000", "micropipette"].
    """
    parts: list[str] = []
    for word in _BREAKS.split(_ML.sub("ml", text[:200])):
        if parts and re.fullmatch(r"\d+(\.\d+)?", parts[-1]) and word.casefold() in UNITS:
            parts[-1] += word
        elif word:
            parts.append(word)
    return parts[:MAX_WORDS]


def telling(text: str) -> list[str]:
    """Return the words of a name without `NOISE`, or all of them if none would be left."""
    words = name_words(text)
    return [word for word in words if word.casefold() not in NOISE] or words


def is_amount(word: str) -> bool:
    """Return whether a word is a number with or without a unit, such as 500ml."""
    return AMOUNT.fullmatch(word) is not None


def camel(parts: list[str]) -> str:
    """Return words as one CamelCase name of ASCII letters and digits, at most 60 characters; "" if none are left."""
    plain = [re.sub(r"[^A-Za-z0-9]", "", part.replace(".", "p")) for part in parts]
    name = "".join(part[0].upper() + part[1:] for part in plain if part)[:60]
    return re.sub(r"^[^A-Za-z]+", "", name)


def as_words(name: str) -> str:
    """Return a CamelCase name as lower-case words."""
    return re.sub(r"(?<=[A-Za-z])(?=\d)", " ", " ".join(name_words(name))).lower()


def number_of(word: str) -> tuple[float, str] | None:
    """Return the value and unit of a word such as 500ml, or None if it is not an amount."""
    match = _AMOUNT_PARTS.match(word)
    return (float(match[1]), match[2].lower()) if match else None


def volume_of(text: str) -> float | None:
    """Return the first volume in a name, in mL, or None."""
    amounts = filter(None, map(number_of, telling(text)))
    return next((value * _MILLILITRES[unit] for value, unit in amounts if unit in _MILLILITRES), None)
