"""Words of file, prim and material names."""

from __future__ import annotations

import re

_NOISE = """
    model mesh object obj geo geom geometry default root world scene untitled final copy export exported low
    lowpoly high highpoly poly lod lod0 usd usda stl glb asset sm free lab laboratory the a an of with and new
    old test node group xform material mat looks v1 v2 v3 v4 part body mm cm inch
"""
NOISE = frozenset(_NOISE.split())
"""Words that tell nothing about what a thing is."""
CONTAINERS = frozenset(
    ("bottle", "jar", "flask", "can", "drum", "vial", "canister", "container", "pack", "reagent", "chemical", "solvent")
)
"""What a reagent may be said to be in."""
AMOUNT = re.compile(r"\d+(?:\.\d+)?(?:ml|l|g|kg|mg|m|mm|cm|um|pc|percent|n|x)?", re.IGNORECASE)
_BREAKS = re.compile(
    r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|(?<!\d)\.|\.(?!\d)|[^\w.]+|_+|(?<=[^\x00-\x7f])(?=[\x00-\x7f])"
)
_AMOUNT_PARTS = re.compile(r"^(\d+(?:\.\d+)?)([a-z]*)$", re.IGNORECASE)
MAX_WORDS = 16
_MILLILITRES = re.compile(r"(?<![A-Za-z])mL(?![A-Za-z])")
UNITS = frozenset({"ml", "l", "g", "kg", "mg", "mm", "cm"})
"""Units that belong to a number before them."""


def words(text: str) -> list[str]:
    """Return the words of a name: split at separators and where capitals begin; at most 16.

    "acetone_2.5 L" gives ["acetone", "2.5L"], "RoundBottomFlask" gives ["Round", "Bottom", "Flask"].
    """
    found: list[str] = []
    for word in _BREAKS.split(_MILLILITRES.sub("ml", text[:200])):
        if found and re.fullmatch(r"\d+(\.\d+)?", found[-1]) and word.casefold() in UNITS:
            found[-1] += word
        elif word:
            found.append(word)
    return found[:MAX_WORDS]


def telling(text: str) -> list[str]:
    """Return the words of a name without those that tell nothing; all of them where none would be left."""
    found = words(text)
    kept = [word for word in found if word.casefold() not in NOISE]
    return kept or found


def is_amount(word: str) -> bool:
    """Say whether a word is a number with or without a unit, such as 500ml."""
    return AMOUNT.fullmatch(word) is not None


def camel(parts: list[str]) -> str:
    """Return words as one CamelCase name of ASCII letters and digits, at most 60 characters; "" where none are left."""
    plain = [re.sub(r"[^A-Za-z0-9]", "", part.replace(".", "p")) for part in parts]
    name = "".join(part[0].upper() + part[1:] for part in plain if part)[:60]
    return re.sub(r"^[^A-Za-z]+", "", name)


def spoken(name: str) -> str:
    """Return a CamelCase name as lower-case words."""
    return re.sub(r"(?<=[A-Za-z])(?=\d)", " ", " ".join(words(name))).lower()


def number_of(word: str) -> tuple[float, str] | None:
    """Return value and unit of a word such as 500ml; None where it is none."""
    found = _AMOUNT_PARTS.match(word)
    return (float(found[1]), found[2].lower()) if found else None
