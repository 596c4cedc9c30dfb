"""What is never written down: wishes for dangerous products, and reagents that must not meet in one experiment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.protocols.synthesis.errors import RefusalError


class Wish(Record):
    """A kind of product that is refused, with the words for it."""

    what: str
    english: str
    chinese: tuple[str, ...]


class Mixture(Record):
    """Reagents of which one of each side, all in one experiment, make a hazard."""

    a: frozenset[str]
    b: frozenset[str]
    c: frozenset[str] = frozenset()
    hazard: str

    def found(self, names: frozenset[str]) -> tuple[str, ...]:
        """Return one reagent of each side where all sides are there, else nothing."""
        sides = [side for side in (self.a, self.b, self.c) if side]
        if all(side & names for side in sides):
            return tuple(min(side & names) for side in sides)
        return ()


class Refusals(Document):
    """The table.

    Attributes:
        destroyed_by_protic: reagents that a protic solvent destroys violently.
    """

    SCHEMA: ClassVar[str] = "labgym.refusals/1"

    wishes: tuple[Wish, ...]
    mixtures: tuple[Mixture, ...]
    protic: frozenset[str]
    destroyed_by_protic: frozenset[str]


@lru_cache(maxsize=1)
def refusals() -> Refusals:
    """Return the published table; read once a process."""
    return Refusals.load(artefacts("assets") / "synthesis" / "refusals.json")


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[Wish, re.Pattern[str]], ...]:
    return tuple((wish, re.compile(rf"\b(?:{wish.english})(?![a-z])", re.IGNORECASE)) for wish in refusals().wishes)


def refuse_wish(text: str) -> None:
    """Pass a text that asks for nothing dangerous.

    Raises:
        RefusalError: it names an explosive, a chemical weapon, a controlled drug or a nitration.
    """
    for wish, pattern in _patterns():
        match = pattern.search(text)
        named = match[0] if match else next((word for word in wish.chinese if word in text.lower()), None)
        if named is not None:
            raise RefusalError("unsafe", f"no protocol is written for {wish.what} ({named[:60]!r})")


def refuse_mixture(reagents: Iterable[str]) -> None:
    """Pass reagents that may be part of one experiment.

    Raises:
        RefusalError: some of them must never meet; names them and what would happen.
    """
    names = frozenset(reagents)
    for mixture in refusals().mixtures:
        met = mixture.found(names)
        if met:
            raise RefusalError("unsafe", f"{' and '.join(met)} must not be part of one experiment: {mixture.hazard}")


def refuse_solvent(reagents: Iterable[str], solvents: Iterable[str]) -> None:
    """Pass a reaction whose solvents its reagents bear.

    Raises:
        RefusalError: a protic solvent would destroy a hydride or organometallic reagent violently.
    """
    table = refusals()
    reactive = sorted(table.destroyed_by_protic.intersection(reagents))
    protic = sorted(table.protic.intersection(solvents))
    if reactive and protic:
        raise RefusalError("unsafe", f"{reactive[0]} reacts violently with {protic[0]}: name an aprotic solvent")
