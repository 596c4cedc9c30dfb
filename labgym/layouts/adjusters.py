"""Adjusters by name."""

from __future__ import annotations

import typing
from pkgutil import resolve_name

from labgym.errors import UnknownNameError
from labgym.layouts.adjust import Adjuster

RULES = "rules"
"""Name of the default: rules and search."""
ADJUSTERS: dict[str, str] = {
    RULES: "labgym.layouts.adjust:RuleAdjuster",
    "llm": "labgym.layouts.language:LanguageAdjuster",
}
"""Module and class of each adjuster; the class is made without arguments, and its module imported only then."""


def check_adjuster(name: str) -> None:
    """Check that an adjuster exists, without importing it.

    Raises:
        UnknownNameError: no adjuster has that name; lists all.
    """
    if name not in ADJUSTERS:
        raise UnknownNameError("adjuster", name, ADJUSTERS)


def make_adjuster(name: str) -> Adjuster:
    """Return the adjuster of a name.

    Raises:
        UnknownNameError: no adjuster has that name; lists all.
    """
    check_adjuster(name)
    return typing.cast(Adjuster, resolve_name(ADJUSTERS[name])())
