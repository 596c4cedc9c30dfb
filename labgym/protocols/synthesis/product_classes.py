"""Classes of products and the names that belong to them: functional classes, ring systems, trivial names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record


class ProductClass(Record):
    """A class of substances, with the words and endings that name it in English and Chinese."""

    name: str
    english: str
    chinese: tuple[str, ...]


class TrivialName(ProductClass):
    """A name that does not show the structure of a substance: its class or ring, and patterns of its precursors.

    Attributes:
        of: patterns of names, each of which one of the reagents must match.
    """

    of: tuple[str, ...]


class Ring(Record):
    """A ring system with the part of names that it has; the part is also its name in `gives`."""

    english: str
    chinese: tuple[str, ...]


class ProductClasses(Document):
    """The table.

    Attributes:
        classes: functional classes. rings: ring systems. trivial: trivial names.
        generic: words that name any product.
        elements: patterns of the parts of names that show an element, by its symbol.
        gives: classes and rings that each kind of reaction makes, by its id.
        needs: reactive groups or names of reagents of which a kind of reaction needs one to make a class.
        destroyers: reactive groups of solvents that destroy what a kind of reaction makes.
        acyl_transfers: kinds of reaction that leave the carbon skeletons of acid and alcohol intact.
        intermediates: classes that one reaction makes and uses up.
    """

    SCHEMA: ClassVar[str] = "labgym.product_classes/1"

    classes: tuple[ProductClass, ...]
    rings: tuple[Ring, ...]
    trivial: tuple[TrivialName, ...]
    generic: str
    elements: dict[str, str]
    gives: dict[str, tuple[str, ...]]
    needs: dict[str, dict[str, tuple[str, ...]]]
    destroyers: dict[str, tuple[str, ...]]
    acyl_transfers: frozenset[str]
    intermediates: frozenset[str]


@lru_cache(maxsize=1)
def product_classes() -> ProductClasses:
    """Return the published table; it is read once per process."""
    return ProductClasses.load(artefacts("assets") / "synthesis" / "product_classes.json")


def names_a_product(phrase: str) -> bool:
    """Return whether a phrase is a trivial name or ends in the name of a class of substances."""
    plain = phrase.strip().lower()
    if trivial_name(plain) is not None:
        return True
    table = product_classes()
    return any(
        match.end() == len(plain)
        for each in table.classes
        if each.name not in table.intermediates
        for match in re.finditer(each.english, plain)
    )


def trivial_name(text: str) -> TrivialName | None:
    """Return the entry of the trivial name in a lower-case text, or None."""
    return next((name for name, pattern in _trivial() if pattern.search(text) or _has_any(text, name.chinese)), None)


def trivial_end(text: str) -> int:
    """Return the place after the trivial name with which a phrase begins, as "oil of wintergreen", or 0."""
    matches = (pattern.match(text.lower()) for _, pattern in _trivial())
    return max((match.end() for match in matches if match is not None), default=0)


@lru_cache(maxsize=1)
def _trivial() -> tuple[tuple[TrivialName, re.Pattern[str]], ...]:
    return tuple((name, re.compile(rf"\b(?:{name.english})(?![\w-])")) for name in product_classes().trivial)


def has(text: str, english: str, chinese: Iterable[str]) -> bool:
    """Return whether a lower-case text has a match of an English pattern or one of some Chinese words."""
    return re.search(english, text) is not None or _has_any(text, chinese)


def _has_any(text: str, words: Iterable[str]) -> bool:
    return any(word in text for word in words)
