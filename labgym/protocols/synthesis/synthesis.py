"""Synthesis: from a description in English or Chinese to a protocol that passes every check."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from labgym.assets import Catalog
from labgym.protocols.errors import RefusalError
from labgym.protocols.language import language_of, unified
from labgym.protocols.language.vocabulary import unknown_measures, unmeasured
from labgym.protocols.model import Protocol
from labgym.protocols.refusals import (
    refusals,
    refuse_mixture,
    refuse_product,
    refuse_solvent,
    refuse_structures,
    refuse_wish,
)
from labgym.protocols.retrieval import SearchResults
from labgym.protocols.synthesis.conditions import context_of
from labgym.protocols.synthesis.fidelity import refuse_unfaithful
from labgym.protocols.synthesis.reading import ParsedDescription, read
from labgym.protocols.synthesis.template import TemplateWriter
from labgym.protocols.synthesis.transformations import transformations
from labgym.protocols.synthesis.unlisted import chemical_names
from labgym.protocols.synthesis.writer import Commission, Writer
from labgym.protocols.validate import ProtocolError, examine, faults

MAX_TEXT = 4000
_CHEMICAL_ENDING = re.compile(r"(?:ol|ine|one|al|ate|ide|ene|ane|yl|acid|amine|nitrile)s?$|\d", re.IGNORECASE)
_FLAME = re.compile(
    r"\b(?:bunsen(?: burner)?|(?:open|naked|free|direct|gas) flame|alcohol lamp|spirit lamp|blow ?torch)\b|明火|酒精灯"
    r"|本生灯|煤气灯",
    re.IGNORECASE,
)
_GRIGNARD = re.compile(r"grignard|magnesium (?:bromide|chloride|iodide)|格氏|格利雅", re.IGNORECASE)
INCOMPATIBLE = (
    *("violent-mixture", "peracid-in-ketone", "hydride-in-protic", "borohydride-in-acid", "grignard-in-protic"),
    "quench-order",
)
"""Rules whose findings explain a refusal best."""
ALKALI_METALS = ("Sodium", "Potassium", "Lithium")
MISSPELLING_SIMILARITY = 0.88
"""Similarity from which a name is taken for a misspelling of another."""
LEAST_PARENT_CHARACTERS = 6
"""Characters of a reagent's name that another name must end with to count as its derivative."""
_NO_AMOUNT = re.compile(
    r"(?<![\w.,-])(?:[-−]\s?\d+(?:\.\d+)?|0+(?:\.0+)?)\s?(?:[mkμµu]?g|m?mol|[mμµu]?l|equiv)\b", re.IGNORECASE
)


@dataclass(frozen=True)
class Synthesis:
    """A protocol without faults, with the writer's assumptions and the advice of the examination.

    Attributes:
        notes: assumptions, one sentence each.
        advice: advice of the examination, one sentence each.
        context: the nearest fragments of the library.
    """

    protocol: Protocol
    notes: tuple[str, ...]
    advice: tuple[str, ...]
    context: SearchResults


def synthesize(
    text: str, writer: Writer | None = None, keyword_only: bool = False, catalog: Catalog | None = None
) -> Synthesis:
    """Write a protocol for a description.

    Args:
        text: the procedure in English or Chinese.
        writer: the writer; by default templates, which give the same protocol for the same text.
        keyword_only: search the library without embeddings.
        catalog: the assets that the protocol may use; the default catalog if None.

    Raises:
        RefusalError: the text is in another language, contains no chemistry or no known reaction, names a substance
            that the catalog lacks, or asks for something dangerous.
        ProtocolError: the protocol has faults.
        LabgymError: other errors of the writer.
    """
    assets = catalog if catalog is not None else Catalog.load()
    text = unified(text)
    description = _parse(text, assets)
    context = context_of(text, keyword_only, assets)
    commission = Commission(text, description, context, assets)
    result = (writer if writer is not None else TemplateWriter()).write(commission)
    protocol = result.protocol
    findings = examine(protocol, assets)
    found = sorted(faults(findings), key=lambda finding: finding.rule not in INCOMPATIBLE)
    refuse_mixture(use.name for use in protocol.reagents)
    refuse_unfaithful(description, protocol, assets)
    if found:
        raise ProtocolError(protocol.id, found)
    advice = tuple(f"{finding.message}; {finding.suggestion}" for finding in findings)
    return Synthesis(protocol, result.notes, advice, context)


def _parse(text: str, catalog: Catalog) -> ParsedDescription:
    """Return the parsed description if a protocol may be written for it.

    Raises:
        RefusalError: the description is refused.
    """
    if not text.isprintable() and any("\ud800" <= char <= "\udfff" for char in text):
        raise RefusalError("language", "the description is not UTF-8 text: save it as UTF-8")
    if not text.strip() or len(text) > MAX_TEXT:
        raise RefusalError("no-chemistry", f"the description has {len(text)} characters; it needs 1 to {MAX_TEXT}")
    refuse_wish(text)
    refuse_structures(text)
    if language_of(text) == "unknown":
        raise RefusalError("language", "the description is neither English nor Chinese: write it in one of them")
    nothing = _NO_AMOUNT.search(text)
    if nothing:
        raise RefusalError("no-chemistry", f"{nothing[0].strip()!r} is not an amount: give one above 0")
    description = read(text, catalog)
    _refuse_products(description, catalog)
    substances = [m for clause in description.clauses for m in clause.mentions if m.kind in ("reagent", "class")]
    named = any(not name.isascii() or _CHEMICAL_ENDING.search(name) for name in description.unlisted)
    if not substances and not named and not chemical_names(text):
        raise RefusalError("no-chemistry", "the text names no substance of the catalog: say what reacts with what")
    homeless = [m.text for m in substances if m.kind == "class" and m.name not in transformations().stand_ins]
    if homeless:
        raise RefusalError("unlisted", _lacking(homeless, catalog))
    portions = unmeasured(text)
    if portions:
        message = f"{portions[0]!r} has no defined size: give it in grams, milliliters or moles"
        raise RefusalError("unaccounted", message)
    foreign = unknown_measures(text)
    if foreign:
        raise RefusalError(
            "unaccounted", f"{foreign[0]!r} has a unit that is not known: use one such as g, mL, mmol or h"
        )
    if description.unlisted:
        raise RefusalError("unlisted", _lacking(description.unlisted, catalog))
    _refuse_flame(description, catalog)
    _refuse_water(description)
    refuse_mixture(mention.name for clause in description.clauses for mention in clause.mentions)
    return description


def _refuse_products(description: ParsedDescription, catalog: Catalog) -> None:
    """Raise an error if a description asks for a dangerous product, by the grammar of its name or as a reagent.

    Raises:
        RefusalError: names the product and the reason.
    """
    used = [m for clause in description.clauses for m in clause.mentions if m.kind == "reagent"]
    refuse_product(description.text, [(mention.start, mention.end) for mention in used])
    for start, end in description.products:
        name = description.text[start:end]
        match = catalog.match(name)
        asset = catalog.get(match.name) if match is not None else None
        if asset is not None and asset.kind == "reagent" and asset.hazards.explosive:
            raise RefusalError("unsafe", f"no protocol makes {asset.name} ({name[:60]!r}): it is explosive")
        distills = any(clause.operation and clause.operation.action == "Distill" for clause in description.clauses)
        if "azide" in name.lower() and distills:
            raise RefusalError("unsafe", f"{name[:60]!r} must not be distilled: azides explode when hot")


def _refuse_flame(description: ParsedDescription, catalog: Catalog) -> None:
    """Raise an error if a description heats something flammable with a flame.

    Raises:
        RefusalError: names the flame and the flammable reagent.
    """
    flame = _FLAME.search(description.text)
    if flame is None:
        return
    names = [name for clause in description.clauses for name in clause.names("reagent")]
    burning = [name for name in names if catalog.get(name).hazards.flammable]
    if burning:
        message = f"a flame ({flame[0]!r}) must not be used with {burning[0]}, which is flammable: name a bath"
        raise RefusalError("unsafe", message)


def _refuse_water(description: ParsedDescription) -> None:
    """Raise an error if a reagent meets water, alcohol or acid that destroys it violently.

    Raises:
        RefusalError: names both.
    """
    for clause in description.clauses:
        if clause.operation is not None and clause.operation.phase != "reaction":
            return
        names = clause.names("reagent")
        refuse_solvent(names, clause.media())
        if _GRIGNARD.search(description.text):
            protic = [name for name in names if name in refusals().protic]
            if protic:
                raise RefusalError(
                    "unsafe", f"{protic[0]} destroys a Grignard reagent: name a dry ether as the solvent"
                )
        metals = [name for name in names if name in ALKALI_METALS]
        if metals and "DeionizedWater" in names:
            raise RefusalError(
                "unsafe", f"{metals[0]} and DeionizedWater must not meet: the metal ignites the hydrogen"
            )


def _lacking(names: Sequence[str], catalog: Catalog) -> str:
    """Return the message about substances that the catalog lacks, with the nearest reagents."""
    listed = ", ".join(repr(name[:60]) for name in names[:5])
    near = dict.fromkeys(name for text in names for name in near_reagents(text, catalog))
    hint = f" (nearest: {', '.join(near)})" if near else ""
    return f"the catalog has no {listed}{hint}; name a reagent that it has, or add this one: labgym assets add-reagent"


def near_reagents(text: str, catalog: Catalog) -> tuple[str, ...]:
    """Return up to two reagents that a name misspells, or of which it names a derivative."""
    reagents = catalog.of_kind("reagent")
    forms = {form.lower(): asset.name for asset in reagents for form in (asset.name, *asset.synonyms_en)}
    lowered = text.lower()
    parents = sorted(
        (f for f in forms if len(f) >= LEAST_PARENT_CHARACTERS and lowered.endswith(f) and f != lowered), key=len
    )
    close = get_close_matches(lowered, forms, 2, MISSPELLING_SIMILARITY) or parents[-1:]
    return tuple(dict.fromkeys(forms[form] for form in close))
