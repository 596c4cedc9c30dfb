"""Refusals: dangerous products, and reagents that must not be part of one experiment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.protocols.errors import RefusalError


class Wish(Record):
    """A kind of product that is refused, with the words that name it.

    Attributes:
        english: pattern of the words.
        followed_by: pattern of words of which one must come later in the text for those of `english` to count.
    """

    what: str
    english: str
    followed_by: str = ""
    chinese: tuple[str, ...]


class HazardousProduct(Record):
    """A kind of substance that no protocol makes, with the grammar of its names.

    Attributes:
        english: pattern of names in lower case. chinese: parts of names.
        why: what it does.
    """

    what: str
    english: str
    chinese: tuple[str, ...]
    why: str


class HazardousMixture(Record):
    """Two or three sets of reagents; one of each set in the same experiment is a hazard."""

    a: frozenset[str]
    b: frozenset[str]
    c: frozenset[str] = frozenset()
    hazard: str

    def reagents_in(self, names: frozenset[str]) -> tuple[str, ...]:
        """Return one reagent of each set if all sets are represented among the names, else an empty tuple."""
        sides = [side for side in (self.a, self.b, self.c) if side]
        if all(side & names for side in sides):
            return tuple(min(side & names) for side in sides)
        return ()


class Refusals(Document):
    """The table.

    Attributes:
        products: kinds of substance that are refused as products by the grammar of their names. Azides of alkyl and
            benzyl groups with at least four carbon atoms are not among them: the library makes two, cold, undistilled
            and without chlorinated solvents, which rules of the validation suite enforce.
        protic: protic solvents.
        destroyed_by_protic: reagents that react violently with a protic solvent.
    """

    SCHEMA: ClassVar[str] = "labgym.refusals/1"

    wishes: tuple[Wish, ...]
    products: tuple[HazardousProduct, ...]
    mixtures: tuple[HazardousMixture, ...]
    protic: frozenset[str]
    destroyed_by_protic: frozenset[str]


@lru_cache(maxsize=1)
def refusals() -> Refusals:
    """Return the published table; it is read once per process."""
    return Refusals.load(artefacts("assets") / "synthesis" / "refusals.json")


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[Wish, re.Pattern[str], re.Pattern[str]], ...]:
    """Return each kind of product with the patterns of its words and of those that must follow."""
    return tuple(
        (
            wish,
            re.compile(rf"\b(?:{wish.english})(?![a-z])", re.IGNORECASE),
            re.compile(wish.followed_by, re.IGNORECASE),
        )
        for wish in refusals().wishes
    )


def refuse_wish(text: str) -> None:
    """Raise an error if a text asks for a dangerous product.

    Raises:
        RefusalError: the text names an explosive, a chemical weapon, a controlled drug or a nitration.
    """
    for wish, pattern, following in _patterns():
        match = pattern.search(text)
        if match is not None and following.search(text, match.end()) is None:
            match = None
        phrase = match[0] if match else next((word for word in wish.chinese if _asks_for(text.lower(), word)), None)
        if phrase is not None:
            raise RefusalError("unsafe", f"no protocol is written for {wish.what} ({phrase[:60]!r})")


def _asks_for(text: str, word: str) -> bool:
    """Return whether a text has a Chinese word that is neither denied nor the end of another: 无毒品, 剧毒品."""
    return re.search(rf"(?<![剧无非不]){re.escape(word)}", text) is not None


@lru_cache(maxsize=1)
def _product_patterns() -> tuple[tuple[HazardousProduct, re.Pattern[str]], ...]:
    return tuple(
        (product, re.compile(rf"(?<![a-z])(?:{product.english})(?![a-z])", re.IGNORECASE))
        for product in refusals().products
    )


def refuse_product(text: str, reagents: Iterable[tuple[int, int]] = ()) -> None:
    """Raise an error if a text names a substance that must not be made.

    Args:
        text: a description, or the name of a product.
        reagents: spans of the text that name reagents of the catalog, which are not made.

    Raises:
        RefusalError: names the substance, its kind and the reason.
    """
    spans = tuple(reagents)
    for product, pattern in _product_patterns():
        for match in pattern.finditer(text):
            if not any(start < match.end() and match.start() < end for start, end in spans):
                _refuse(product, match[0])
        for word in product.chinese:
            place = text.find(word)
            if place >= 0 and not any(start <= place < end for start, end in spans):
                _refuse(product, word)


def _refuse(product: HazardousProduct, name: str) -> None:
    raise RefusalError("unsafe", f"no protocol makes {product.what} ({name.strip()[:60]!r}): {product.why}")


def refuse_mixture(reagents: Iterable[str]) -> None:
    """Raise an error if reagents must not be part of one experiment.

    Args:
        reagents: canonical asset names.

    Raises:
        RefusalError: some of them must never meet; the error names them and the hazard.
    """
    names = frozenset(reagents)
    for mixture in refusals().mixtures:
        hazardous = mixture.reagents_in(names)
        if hazardous:
            raise RefusalError(
                "unsafe", f"{' and '.join(hazardous)} must not be part of one experiment: {mixture.hazard}"
            )


def refuse_solvent(reagents: Iterable[str], solvents: Iterable[str]) -> None:
    """Raise an error if a solvent of a reaction destroys one of its reagents.

    Args:
        reagents, solvents: canonical asset names.

    Raises:
        RefusalError: a protic solvent would destroy a hydride or organometallic reagent violently.
    """
    table = refusals()
    reactive = sorted(table.destroyed_by_protic.intersection(reagents))
    protic = sorted(table.protic.intersection(solvents))
    if reactive and protic:
        raise RefusalError("unsafe", f"{reactive[0]} reacts violently with {protic[0]}: name an aprotic solvent")
