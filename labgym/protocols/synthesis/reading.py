"""Parsing of descriptions: clauses with their operation, substances, amounts, temperature and duration."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from labgym.assets import Catalog
from labgym.protocols.language import Mention, concepts, language_of, mentions, without_chinese_names
from labgym.protocols.language.scripts import Language
from labgym.protocols.synthesis.operations import Operation, Phase, main_operation, operations
from labgym.protocols.synthesis.products import AUXILIARY, products, within
from labgym.protocols.synthesis.unlisted import unlisted
from labgym.quantities import Quantity, amounts, duration, temperature

_BREAK = re.compile(
    r"[;；。，、\n]|,(?!\d)|\.(?=\s|$)|\b(?:and )?then\b|\bfollowed by\b|\bafter which\b|\band (?=[a-z])|"
    r"然后|随后|接着|再|最后"
)
_STATE = r"dry|hot|cold|warm|conc\.?|concentrated|glacial|boiling|refluxing|aqueous|aq\.?|\d+ ?%|\d+ ?mL(?: of)?"
_IN = re.compile(rf"\bin (?:(?:{_STATE}) ){{0,2}}$", re.IGNORECASE)
_WEAK = re.compile(r"and ")
_AWAY = re.compile(
    r"\b(?:removal|loss|exclusion|absence|evolution) of (?:the )?$|\bremov(?:e|ing) (?:the )?$", re.IGNORECASE
)
"""Text before the name of a substance that is removed or formed, not taken."""


@dataclass(frozen=True)
class Clause:
    """A part of a description about one operation.

    Attributes:
        text: the clause as written.
        operation: its action and phase, or None if the text only names substances or devices.
        mentions: the names in it.
        amounts: by asset name, as "2.07 g, 10 mmol".
        temperature: degrees Celsius.
        duration: minutes.
    """

    text: str
    operation: Operation | None
    mentions: tuple[Mention, ...]
    amounts: dict[str, str] = field(default_factory=dict)
    temperature: float | None = None
    duration: float | None = None

    def names(self, *kinds: str) -> tuple[str, ...]:
        """Return the distinct names of some kinds of mention."""
        return tuple(dict.fromkeys(mention.name for mention in self.mentions if mention.kind in kinds))

    def media(self) -> tuple[str, ...]:
        """Return the reagents that serve as a medium: "in acetic acid", 在乙酸中."""
        names = []
        for mention in self.mentions:
            at = self.text.find(mention.text)
            before, after = self.text[:at], self.text[at + len(mention.text) :]
            if mention.kind == "reagent" and (_IN.search(before) or after.startswith("中")):
                names.append(mention.name)
        return tuple(names)


@dataclass(frozen=True)
class ParsedDescription:
    """A description, parsed.

    Attributes:
        text: the description as written.
        language: its language.
        clauses: its clauses in order.
        product: name of the product as written, or "".
        unlisted: substances that it names and the catalogue lacks, as written.
        spoken_of: assets, classes of substances and concepts that it mentions.
    """

    text: str
    language: Language
    clauses: tuple[Clause, ...]
    product: str
    unlisted: tuple[str, ...]
    spoken_of: frozenset[str]


def read(text: str, catalog: Catalog | None = None) -> ParsedDescription:
    """Parse a description; the result depends on the text and the catalogue only.

    Args:
        text: English or Chinese.
        catalog: the assets that the text may name; the default catalogue if None.
    """
    assets = catalog if catalog is not None else Catalog.load()
    named = mentions(text, assets)
    foreign = unlisted(text, named)
    named = tuple(m for m in named if not any(a <= m.start and m.end <= b for a, b in foreign))
    named = tuple(m for m in named if not _AWAY.search(text[: m.start]))
    auxiliary = frozenset(asset.name for asset in assets if asset.category in AUXILIARY)
    spans = products(text, named, foreign, auxiliary)
    strange = [text[a:b] for a, b in foreign if not within(a, spans)]
    names = [text[a:b].strip() for a, b in spans]
    reagents = [m for m in named if not within(m.start, spans)]
    clauses = tuple(_clauses(text, reagents))
    topics = {mention.name for clause in clauses for mention in clause.mentions}
    topics |= set(concepts(without_chinese_names(text, assets)))
    return ParsedDescription(
        text=text,
        language=language_of(text),
        clauses=clauses,
        product=names[0] if names else "",
        unlisted=tuple(dict.fromkeys(strange)),
        spoken_of=frozenset(topics),
    )


def _clauses(text: str, named: Sequence[Mention]) -> Iterator[Clause]:
    quantities = _assign(text, named)
    bounds = _bounds(text, named)
    for start, end in bounds:
        piece = text[start:end].strip()
        inside = tuple(m for m in named if start <= m.start < end)
        parts: dict[str, list[str]] = {}
        for quantity, mention in quantities:
            if start <= mention.start < end:
                parts.setdefault(mention.name, []).append(quantity.text)
        stated = {name: ", ".join(dict.fromkeys(texts)) for name, texts in parts.items()}
        operation = main_operation(piece) or _implied(inside)
        yield Clause(piece, operation, inside, stated, temperature(piece), duration(piece))


def _bounds(text: str, named: Sequence[Mention]) -> list[tuple[int, int]]:
    """Return the spans of clauses: split at punctuation and conjunctions, merged if a piece has no operation."""
    cuts = [0]
    for match in _BREAK.finditer(text):
        inside_name = any(m.start < match.start() < m.end for m in named)
        weak = _WEAK.match(match[0]) is not None
        if not inside_name and not (weak and not _starts_operation(text[match.end() :])):
            cuts.append(match.end())
    pieces = list(zip(cuts, [*cuts[1:], len(text)], strict=True))
    joined: list[tuple[int, int]] = []
    for start, end in pieces:
        alone = main_operation(text[start:end]) is None and not _implied([m for m in named if start <= m.start < end])
        if joined and alone and not _second_stretch(text[slice(*joined[-1])], text[start:end]):
            joined[-1] = (joined[-1][0], end)
        elif text[start:end].strip():
            joined.append((start, end))
    return joined


def _starts_operation(rest: str) -> bool:
    head = " ".join(rest.split()[:3])
    return any(operation.start < 12 for operation in operations(head))


def _second_stretch(before: str, piece: str) -> bool:
    """Return whether a piece without an operation continues at another temperature, as ", room temperature 2 h"."""
    return temperature(before) is not None and temperature(piece) is not None


def _implied(named: Sequence[Mention]) -> Operation | None:
    """Return the operation that an instrument implies without a verb: "LC" means to analyze."""
    for mention in named:
        for names, action, phase in _IMPLIED:
            if mention.name in names:
                return Operation(action, phase, 0)
    return None


_ANALYTICAL = (
    *("LiquidChromatograph", "GasChromatograph", "NMRSpectrometer", "BenchtopNMR", "FTIRSpectrometer", "LCMS", "GCMS"),
    *("MeltingPointApparatus", "Polarimeter", "Refractometer", "UVVisSpectrophotometer"),
)
_IMPLIED: tuple[tuple[tuple[str, ...], str, Phase], ...] = (
    (_ANALYTICAL, "Analyze", "analysis"),
    (("RotaryEvaporator",), "Concentrate", "workup"),
    (("ChromatographyColumn", "FlashChromatographySystem"), "Chromatograph", "purification"),
)


def _assign(text: str, named: Sequence[Mention]) -> list[tuple[Quantity, Mention]]:
    """Assign each amount to the substance after it ("5 mL of TFA") or before it ("TFA (5 mL, 65 mmol)")."""
    substances = [m for m in named if m.kind in ("reagent", "class")]
    assigned: list[tuple[Quantity, Mention]] = []
    for quantity in amounts(text):
        after = next((m for m in substances if m.start >= quantity.end), None)
        before = next((m for m in reversed(substances) if m.end <= quantity.start), None)
        gap_after = text[quantity.end : after.start] if after else None
        gap_before = text[before.end : quantity.start] if before else None
        behind = gap_before is not None and re.fullmatch(r"[\s(（:：]*(?:[^()（）;；。]*?[,，/;]\s*)?", gap_before)
        ahead = gap_after is not None and re.fullmatch(r"\s*(?:of |的)?(?:[\w.%\s-]{0,18}?)", gap_after)
        if before and behind and (("(" in (gap_before or "") or "（" in (gap_before or "")) or not ahead):
            assigned.append((quantity, before))
        elif after and ahead:
            assigned.append((quantity, after))
    return assigned
