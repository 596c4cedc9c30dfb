"""Classes of products: whether the product that a text states is one that a kind of reaction gives."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.assets import Asset
from labgym.documents import Document, Record
from labgym.protocols.errors import RefusalError
from labgym.protocols.synthesis.transformations import Transformation
from labgym.protocols.synthesis.unlisted import is_named_like_a_substance

_LEADING = re.compile(
    r"^(?:(?:to|give[sn]?|afford(?:s|ed)?|yields?|crude|pure|the|an?|its|this|some|title|white|solid)\s+)+",
    re.IGNORECASE,
)


class ProductClass(Record):
    """A class of substances, with the words and endings that name it in English and Chinese."""

    name: str
    english: str
    chinese: tuple[str, ...]


class Ring(Record):
    """A ring system with the part of names that it has; the part is also its name in `gives`."""

    english: str
    chinese: tuple[str, ...]


class ProductClasses(Document):
    """The table.

    Attributes:
        classes: functional classes. rings: ring systems.
        generic: words that name any product.
        gives: classes and rings that each kind of reaction makes, by its id.
    """

    SCHEMA: ClassVar[str] = "labgym.product_classes/1"

    classes: tuple[ProductClass, ...]
    rings: tuple[Ring, ...]
    generic: str
    gives: dict[str, tuple[str, ...]]


@lru_cache(maxsize=1)
def product_classes() -> ProductClasses:
    """Return the published table; it is read once per process."""
    return ProductClasses.load(artefacts("assets") / "synthesis" / "product_classes.json")


def stated_product(kind: Transformation, name: str, requested: bool, reagents: Iterable[Asset]) -> str:
    """Return the product under the name of the text, or that of the kind of reaction if the text names none.

    A name fits if it belongs to a class that the reaction makes and has no ring system but those of the reaction and
    its reagents. What is only collected, as the urea of a coupling, is not the product if it does not fit.

    Args:
        name: as written, or "".
        requested: whether the text asks for it.

    Raises:
        RefusalError: the text asks for a product that the reaction does not give; names both.
    """
    plain = _LEADING.sub("", name.strip().lower())
    if not re.search(r"[a-z]{2}|[\u3400-\u9fff]", plain):
        return kind.product
    table = product_classes()
    made = table.gives[kind.id]
    own = " ".join(form.lower() for asset in reagents for form in (asset.name, *asset.synonyms_en, *asset.synonyms_zh))
    rings = [ring for ring in table.rings if _has(plain, ring.english, ring.chinese)]
    foreign = [ring for ring in rings if ring.english not in made and not _has(own, ring.english, ring.chinese)]
    classes = [each.name for each in table.classes if _has(plain, each.english, each.chinese)]
    names = {*classes, *(ring.english for ring in rings)}
    if not foreign and not names.isdisjoint(made):
        return _LEADING.sub("", name.strip())
    unknown = not classes and not rings
    if requested and not (unknown and (re.search(rf"\b(?:{table.generic})\b", plain) or not _is_chemical(plain))):
        what = f"{_LEADING.sub('', name.strip())[:60]!r}" + (f" ({classes[0]})" if classes and not foreign else "")
        message = f"the text asks for {what}, but {kind.name} gives {kind.product}: name the reaction that makes it"
        raise RefusalError("no-reaction", message)
    return kind.product


def _is_chemical(name: str) -> bool:
    return name.isascii() and is_named_like_a_substance(name)


def _has(text: str, english: str, chinese: Iterable[str]) -> bool:
    return re.search(english, text) is not None or any(word in text for word in chinese)
