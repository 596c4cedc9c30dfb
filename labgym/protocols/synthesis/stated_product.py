"""Stated products: whether the product that a text names is one that the reaction gives of its reagents."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

from labgym.assets import Asset
from labgym.protocols.errors import RefusalError
from labgym.protocols.synthesis.product_classes import TrivialName, has, product_classes, trivial_name
from labgym.protocols.synthesis.roles import Participant
from labgym.protocols.synthesis.transformations import Transformation, transformations
from labgym.protocols.synthesis.unlisted import is_named_like_a_substance

_LEADING = re.compile(
    r"^(?:(?:to|give[sn]?|afford(?:s|ed)?|yields?|crude|pure|the|an?|its|this|some|title|white|solid)\s+)+",
    re.IGNORECASE,
)
_SALT_OF = re.compile(r"\b(?:hydrochloride|hydrobromide|hydroiodide|sulfate|phosphate|triflate|salt)s?$")
_ESTER = re.compile(r"([a-z0-9,()'-]{0,40}?)([a-z]{2,4})yl ([a-z0-9,()'-]{0,60}?)([a-z]{4,5})ate\b")
"""An ester by name: the last letters of the stems of its alkyl and acyl parts are groups 2 and 4."""
_HELPER = re.compile(
    r"^solvent|^(?:solvent|base|catalyst|additive|initiator)|catalyst$|Lewis|condensing|deprotecting|"
    r"coupling agent|proton source|radical|protective|drying|medium"
)
"""Roles of reagents no part of which is in the product."""
_SUBSTRATE = re.compile(r"substrate|carbonyl|alcohol|active methylene")
_HALOGENS = ("F", "Cl", "Br", "I")
_SYMBOL = re.compile(r"[A-Z][a-z]?")


def stated_product(kind: Transformation, name: str, requested: bool, parts: Sequence[Participant]) -> str:
    """Return the product under the name of the text, or that of the kind of reaction if the text names none.

    A name fits if it belongs to a class that the reaction makes of these reagents, has no ring system but those of
    the reaction and its reagents, and contains no element that the reagents lack. What is only collected, as the urea
    of a coupling, is not the product if it does not fit.

    Args:
        name: as written, or "".
        requested: whether the text asks for it.

    Raises:
        RefusalError: the text asks for a product that the reaction does not give, or names a solvent that destroys it.
    """
    _refuse_destroyer(kind, parts)
    stated = _LEADING.sub("", name.strip())
    plain = stated.lower()
    if not re.search(r"[a-z]{2}|[\u3400-\u9fff]", plain):
        return kind.product
    table = product_classes()
    reacting = [part for part in parts if not _HELPER.search(part.role)]
    own = _names(part.asset for part in parts)
    made = _made(kind, parts)
    trivial = trivial_name(plain)
    rings = [ring for ring in table.rings if has(plain, ring.english, ring.chinese)]
    foreign = [ring for ring in rings if ring.english not in made and not has(own, ring.english, ring.chinese)]
    classes = [each.name for each in table.classes if has(plain, each.english, each.chinese)]
    names = {*classes, *(ring.english for ring in rings), *([trivial.name] if trivial is not None else [])}
    reason = _missing_element(kind, plain, reacting) or _missing_precursor(kind, plain, trivial, own)
    if not foreign and not reason and not names.isdisjoint(made):
        return stated
    unknown = not classes and not rings and trivial is None
    vague = unknown and (re.search(rf"\b(?:{table.generic})\b", plain) or not _is_chemical(plain))
    if requested and not vague and table.intermediates.isdisjoint(names & set(table.gives[kind.id])):
        label = reason or (classes[0] if classes and not foreign else "")
        what = f"{stated[:60]!r}" + (f" ({label})" if label else "")
        message = f"the text asks for {what}, but {kind.name} gives {kind.product}: name the reaction that makes it"
        raise RefusalError("no-reaction", message)
    return kind.product


def _refuse_destroyer(kind: Transformation, parts: Iterable[Participant]) -> None:
    """Raise an error if a solvent destroys what a kind of reaction makes, as an alcohol does an acid chloride.

    Raises:
        RefusalError: names the solvent and the product.
    """
    groups = product_classes().destroyers.get(kind.id, ())
    for part in parts:
        if part.when == "medium" and not set(groups).isdisjoint(part.asset.groups):
            message = f"{part.asset.name} destroys {kind.product}, which {kind.name} gives: name another solvent"
            raise RefusalError("no-reaction", message)


def _made(kind: Transformation, parts: Iterable[Participant]) -> frozenset[str]:
    """Return the classes and rings that a kind of reaction makes of its reagents.

    A reagent that is in no slot of the table, as one of the user, may have any group.
    """
    table = product_classes()
    needs = table.needs.get(kind.id, {})
    assets = [part.asset for part in parts]
    groups = {group for asset in assets for group in asset.groups}
    groups |= {asset.name for asset in assets}
    if any(part.role in {slot.role for slot in kind.slots} and part.asset.name not in _listed() for part in parts):
        needs = {}
    return frozenset(each for each in table.gives[kind.id] if each not in needs or not groups.isdisjoint(needs[each]))


@lru_cache(maxsize=1)
def _listed() -> frozenset[str]:
    slots = (slot for kind in transformations().transformations for slot in kind.slots)
    return frozenset(name for slot in slots for name in (slot.asset, *slot.accepts))


def _missing_element(kind: Transformation, name: str, reacting: Sequence[Participant]) -> str:
    """Return what a name contains and no reagent brings, such as "Br", or "".

    The halogen of a halide comes from the reagent that introduces it, not from the substrate.
    """
    table = product_classes()
    name = _SALT_OF.sub("", name)
    shown = [symbol for symbol, pattern in table.elements.items() if re.search(pattern, name)]
    here = _elements(reacting)
    lacking = [symbol for symbol in shown if symbol not in here]
    if not lacking and not {"halide", "acid chloride"}.isdisjoint(table.gives[kind.id]):
        halogens = [symbol for symbol in shown if symbol in _HALOGENS]
        new = _elements(part for part in reacting if not _SUBSTRATE.search(part.role))
        lacking = halogens if halogens and new.isdisjoint(halogens) else []
    return f"no reagent brings {lacking[0]}" if lacking else ""


def _elements(parts: Iterable[Participant]) -> frozenset[str]:
    return frozenset(symbol for part in parts for symbol in _SYMBOL.findall(part.asset.formula))


def _missing_precursor(kind: Transformation, name: str, trivial: TrivialName | None, own: str) -> str:
    """Return which precursor of a product the reagents lack, or "": of a trivial name, or a part of an ester."""
    if trivial is not None:
        lacking = [pattern for pattern in trivial.of if re.search(pattern, own) is None]
        return f"no reagent has {lacking[0].split('|')[0]!r}" if lacking else ""
    if kind.id not in product_classes().acyl_transfers:
        return ""
    return next((f"no reagent has {stem!r}" for stem in _stems(name) if not re.search(_stem(stem), own)), "")


def _stems(name: str) -> Iterator[str]:
    """Yield the ends of the stems of an ester's name: "benz" and "benzo" of benzyl benzoate."""
    match = _ESTER.search(name)
    if match is not None:
        yield from (match[2], match[4])


def _stem(stem: str) -> str:
    """Return the pattern of a stem in the names of reagents; "eth" is not the end of "meth"."""
    return "(?<!m)eth" if stem == "eth" else re.escape(stem)


def _names(assets: Iterable[Asset]) -> str:
    """Return all names of some assets in lower case, one a line."""
    return "\n".join(form.lower() for asset in assets for form in (asset.name, *asset.synonyms_en, *asset.synonyms_zh))


def _is_chemical(name: str) -> bool:
    return name.isascii() and is_named_like_a_substance(name)
