"""Parsing of descriptions: clauses with their operation, substances, amounts, temperature and duration."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from labgym.assets import Catalog
from labgym.protocols.amounts import figure
from labgym.protocols.language import Mention, concepts, language_of, mentions, unified, without_chinese_names
from labgym.protocols.language.concepts import Language
from labgym.protocols.synthesis.mixtures import mixtures, solutions, without_ratio
from labgym.protocols.synthesis.operations import Operation, Phase, main_operation, operations
from labgym.protocols.synthesis.products import AUXILIARY, announced, products, within
from labgym.protocols.synthesis.unlisted import unlisted
from labgym.quantities import Quantity, StatedCondition, amounts, duration, pressures, strength, temperature

_BREAK = re.compile(
    r"[;；。，、\n]|,(?!\d)|\.(?=\s|$)|\b(?:and )?then\b|\bfollowed by\b|\bafter which\b|\band (?=[a-z])|"
    r"然后|随后|接着|再|最后"
)
VERB_WITHIN = 16
"""Characters after "and" within which an operation begins a new clause: "and the residue distilled"."""
NOT_METRIC = frozenset({"ounce", "pound", "fluid_ounce", "pint", "quart", "gallon"})
_STATE = r"dry|hot|cold|warm|conc\.?|concentrated|glacial|boiling|refluxing|aqueous|aq\.?|\d+ ?%|\d+ ?mL(?: of)?"
_IN = re.compile(rf"\bin (?:(?:{_STATE}) ){{0,2}}$", re.IGNORECASE)
_WARMED = re.compile(
    r"(?:\bto|→|->|\binto|\bthen|至|到|升至|升到)\s*(?:warm(?:ed|ing)?\s+(?:up\s+)?to\s+)?(?:reach\s+)?"
    r"(?:r\.?t\b|room temp|ambient|室温|常温)|恢复.{0,2}室温|"
    r"\bwarm(?:s|ed|ing)?\s+(?:up\s+)?to\s+(?:r\.?t\b|room|ambient)",
    re.IGNORECASE,
)
"""A mixture that warms to room temperature: "0 C to rt", 升至室温."""
_REMOVED = re.compile(
    r"\b(?:evaporat\w*|remov\w*|strip\w*|distil\w* off|boil\w* off|concentrat(?:e|ing))\s+(?:off\s+)?(?:the\s+|all\s+|"
    r"most of the\s+|excess\s+)*$|(?:蒸去|蒸除|除去|旋干|旋去|蒸干)$",
    re.IGNORECASE,
)
_REMOVED_AFTER = re.compile(
    r"\s*(?:was|is|were|are)\s+(?:then\s+)?(?:evaporated|removed|stripped|distilled off)", re.IGNORECASE
)
_CATALYTIC = re.compile(
    r"(?:\bcat\.?|\bcatalytic(?: amount of| quantity of)?|催化量的?)\s*$|"
    r"^\s*+(?:[(（,]\s*+)?(?:cat\.|catalytic|催化量)",
    re.IGNORECASE,
)
_WEAK = re.compile(r"and ")
_AFTER = re.compile(r"\s*(?:and\s+)?(?:after|following)\b", re.IGNORECASE)
_AFTER_ZH = re.compile(r"[^，。；,;]*?(?:小时|分钟|min|h|天)(?:之后|以后|后)", re.IGNORECASE)
"""A piece that begins with the period before its operation."""
_SUBJECT = re.compile(r"\b(?:the|it|this|all)\b")
_AWAY = re.compile(
    r"\b(?:removal|loss|exclusion|absence|evolution) of (?:the )?$|\bremov(?:e|ing) (?:the )?$", re.IGNORECASE
)
"""Text before the name of a substance that is removed or formed, not taken."""

_SPECTRUM = re.compile(
    r"(?:\bNMR|\b(?:FT-?)?IR|\bLC-?MS|\bGC-?MS|\bHRMS|\bMS|\bUV(?:-Vis)?|\bR_?f|\[[aα]\]\^?_?D?|核磁(?:共振)?|红外|质谱)"
    r"(?:[^()（）.;。；\n]|(?<=\d)\.(?=\d)){0,30}[(（][^()（）\n]{0,80}(?:\([^()\n]{0,20}\)[^()\n]{0,40})?[)）]",
)
"""Conditions of a spectrum or of an optical rotation in brackets: "1H NMR (400 MHz, D2O)"."""
_DEUTERATED = re.compile(
    r"\b(?:NMR|spectr(?:um|a|oscopy))\b[^.;。；\n]{0,40}?\b(?:in|with)\s+"
    r"(?:deuterated\s+[a-z]+|C_?D_?(?:Cl_?3|3OD|3CN|2Cl_?2)|C6D6|D2O|[A-Za-z]{2,12}-d\d?\d?)(?:\s+with\s+TMS\b)?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Clause:
    """A part of a description about one operation.

    Attributes:
        text: the clause as written.
        operation: its action and phase, or None if the text only names substances or devices.
        mentions: the names in it.
        amounts: by asset name, as "2.07 g, 10 mmol".
        strengths: concentrations by asset name, as "10 %", "2 M" or "1 M in hexane".
        catalytic: names of reagents that the text calls catalytic.
        removed: names of reagents that are evaporated or distilled off.
        temperature: degrees Celsius.
        duration: minutes.
        pressure: as written, in bar.
        warmed: whether the mixture then warms to room temperature.
        mixtures: liquids that are mixed in a ratio, by asset name with their shares of the volume.
        start: position of the clause in the description.
    """

    text: str
    operation: Operation | None
    mentions: tuple[Mention, ...]
    amounts: dict[str, str] = field(default_factory=dict)
    strengths: dict[str, str] = field(default_factory=dict)
    catalytic: frozenset[str] = frozenset()
    removed: frozenset[str] = frozenset()
    temperature: float | None = None
    duration: float | None = None
    pressure: StatedCondition | None = None
    warmed: bool = False
    mixtures: tuple[tuple[tuple[str, float], ...], ...] = ()
    start: int = 0

    def names(self, *kinds: str) -> tuple[str, ...]:
        """Return the distinct names of some kinds of mention."""
        return tuple(dict.fromkeys(mention.name for mention in self.mentions if mention.kind in kinds))

    def media(self) -> tuple[str, ...]:
        """Return the reagents that serve as a medium: "in acetic acid", 在乙酸中."""
        names = []
        for mention in self.mentions:
            at = mention.start - self.start
            before, after = self.text[:at], self.text[at + len(mention.text) :]
            if mention.kind == "reagent" and (_IN.search(before) or after.startswith("中")):
                names.append(mention.name)
        return tuple(names)


@dataclass(frozen=True)
class ParsedDescription:
    """A description, parsed.

    Attributes:
        text: the description with unified characters.
        language: its language.
        clauses: its clauses in order.
        product: name of the product as written, or "".
        requested: whether the wording announces that product, as "to give X" does.
        unlisted: substances that it names and the catalog lacks, as written.
        spoken_of: assets, classes of substances and concepts that it mentions.
        reacting: those of `spoken_of` outside the names of products.
        products: the spans that name products.
        unassigned: amounts that belong to no substance, as written.
    """

    text: str
    language: Language
    clauses: tuple[Clause, ...]
    product: str
    unlisted: tuple[str, ...]
    spoken_of: frozenset[str]
    reacting: frozenset[str]
    products: tuple[tuple[int, int], ...] = ()
    requested: bool = False
    unassigned: tuple[str, ...] = ()

    @property
    def reagents(self) -> tuple[str, ...]:
        """Distinct names of the reagents in their order."""
        return tuple(dict.fromkeys(name for clause in self.clauses for name in clause.names("reagent")))


def read(text: str, catalog: Catalog | None = None) -> ParsedDescription:
    """Parse a description; the result depends on the text and the catalog only.

    Its characters are unified first; positions are those in the unified text, which the result holds.

    Args:
        text: English or Chinese.
        catalog: the assets that the text may name; the default catalog if None.
    """
    assets = catalog if catalog is not None else Catalog.load()
    text = unified(text)
    spectra = [match.span() for pattern in (_SPECTRUM, _DEUTERATED) for match in pattern.finditer(text)]
    named = tuple(m for m in mentions(text, assets) if m.kind == "instrument" or not within(m.start, spectra))
    foreign = tuple(span for span in unlisted(text, named) if not within(span[0], spectra))
    named = tuple(m for m in named if not any(a <= m.start and m.end <= b for a, b in foreign))
    named = tuple(m for m in named if not _AWAY.search(text[: m.start]))
    auxiliary = frozenset(asset.name for asset in assets if asset.category in AUXILIARY)
    spans = products(text, named, foreign, auxiliary)
    strange = [text[a:b] for a, b in foreign if not within(a, spans)]
    names = [text[a:b].strip() for a, b in spans]
    reagents = [m for m in named if not within(m.start, spans)]
    assigned, unassigned = _assign(text, reagents, spans)
    sold = solutions(text, reagents)
    dissolved = {solute: solvent for solvent, solute in sold.items()}
    reagents = [mention for mention in reagents if mention not in sold]
    clauses = tuple(_clauses(text, reagents, assigned, dissolved))
    topics = {mention.name for clause in clauses for mention in clause.mentions}
    unnamed = without_chinese_names(text, assets)
    return ParsedDescription(
        text=text,
        language=language_of(text),
        clauses=clauses,
        product=names[0] if names else "",
        unlisted=tuple(dict.fromkeys(strange)),
        spoken_of=frozenset(topics.union(concepts(unnamed))),
        reacting=frozenset(topics.union(concepts(_without(unnamed, spans)))),
        products=spans,
        requested=bool(spans) and spans[0] in announced(text, named, foreign),
        unassigned=unassigned,
    )


def _without(text: str, spans: Sequence[tuple[int, int]]) -> str:
    """Return a text with some spans blank."""
    for start, end in spans:
        text = text[:start] + " " * (end - start) + text[end:]
    return text


def _clauses(
    text: str,
    named: Sequence[Mention],
    assigned: Sequence[tuple[Quantity, Mention]],
    dissolved: Mapping[Mention, Mention],
) -> Iterator[Clause]:
    mixed = mixtures(text, named)
    for start, end in _bounds(text, named):
        piece = text[start:end].strip()
        inside = tuple(m for m in named if start <= m.start < end)
        parts: dict[str, list[Quantity]] = {}
        for quantity, mention in assigned:
            if start <= mention.start < end:
                parts.setdefault(mention.name, []).append(quantity)
        strengths = {m.name: text_ for m in inside if (text_ := strength(text, m.start, m.end))}
        for m in inside:
            if m in dissolved and m.name in strengths:
                strengths[m.name] += f" in {dissolved[m].text}"
        yield Clause(
            piece,
            main_operation(piece) or _implied(inside),
            inside,
            {name: _stated(quantities, strengths.get(name, "")) for name, quantities in parts.items()},
            strengths,
            frozenset(m.name for m in inside if _is_catalytic(text, m)),
            frozenset(m.name for m in inside if _is_removed(text, m)),
            temperature(piece),
            duration(piece),
            next(iter(pressures(piece)), None),
            _WARMED.search(piece) is not None,
            tuple(mixture.names() for mixture in mixed if start <= mixture.start < end),
            end - len(text[start:end].lstrip()),
        )


def _metric(quantity: Quantity) -> str:
    """Return an amount in metric units: "1/2 oz" as "14.2 g"."""
    if quantity.unit not in NOT_METRIC:
        return quantity.text
    portions = f"{quantity.portions} x " if quantity.portions > 1 else ""
    return f"{portions}{figure(quantity.base)} {'g' if quantity.dimension == 'mass' else 'mL'}"


def _stated(quantities: Sequence[Quantity], concentration: str) -> str:
    """Return the amounts of a reagent as one text, the concentration with the first: "20 mL of 10 %, 50 mmol".

    A mass percentage is the purity where another amount is given: "(77 wt%, 2.7 g)" is 2.7 g of 77 %.
    """
    measured = [quantity for quantity in quantities if quantity.unit != "weight_percent"]
    parts = list(dict.fromkeys(_metric(q) for q in (measured if measured and concentration else quantities)))
    if concentration:
        parts[0] = f"{parts[0]} of {concentration}"
    return ", ".join(parts)


def _is_catalytic(text: str, mention: Mention) -> bool:
    return bool(
        _CATALYTIC.search(text[: mention.start][-30:]) or _CATALYTIC.match(text[mention.end : mention.end + 14])
    )


def _is_removed(text: str, mention: Mention) -> bool:
    return bool(_REMOVED.search(text, 0, mention.start) or _REMOVED_AFTER.match(text, mention.end))


def _bounds(text: str, named: Sequence[Mention]) -> list[tuple[int, int]]:
    """Return the spans of clauses: split at punctuation and conjunctions, merged if a piece has no operation."""
    cuts = [0]
    for match in _BREAK.finditer(text):
        inside_name = any(m.start < match.start() < m.end for m in named)
        weak = _WEAK.match(match[0]) is not None
        inside_name = inside_name or (match[0] in ",;，；、" and _is_bracketed(text, match.start()))
        if not inside_name and not (weak and not _starts_operation(text[match.end() :])):
            cuts.append(match.end())
    bounds = list(zip(cuts, [*cuts[1:], len(text)], strict=True))
    pieces = [part for start, end in bounds for part in _parted_after(text, start, end)]
    joined: list[tuple[int, int]] = []
    for start, end in pieces:
        alone = main_operation(text[start:end]) is None and not _implied([m for m in named if start <= m.start < end])
        if joined and alone and not _second_stretch(text[slice(*joined[-1])], text[start:end]):
            joined[-1] = (joined[-1][0], end)
        elif text[start:end].strip():
            joined.append((start, end))
    return joined


def _is_bracketed(text: str, place: int) -> bool:
    """Return whether a place is inside round brackets of its sentence."""
    sentence = re.split(r"[.。;；\n](?:\s|$)", text[:place])[-1]
    opened = max(sentence.rfind("("), sentence.rfind("（"))
    return opened > max(sentence.rfind(")"), sentence.rfind("）"))


def _parted_after(text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Yield the span of a piece, parted where a period ends: "after 30 min | add acid", 反应30分钟后|加水淬灭."""
    piece = text[start:end]
    operation = main_operation(piece)
    if operation is not None and operation.phase != "reaction":
        head = piece[: operation.start]
        chinese = _AFTER_ZH.match(head)
        cut = chinese.end() if chinese is not None else _verb(head) if _AFTER.match(head) else 0
        if cut and duration(piece[:cut]) is not None:
            yield start, start + cut
            start += cut
    yield start, end


def _verb(head: str) -> int:
    """Return where the words about the period end in a text before the verb: the verb itself, or its subject."""
    clause = head.rfind(",") + 1
    subject = _SUBJECT.search(head, clause)
    return subject.start() if subject is not None else len(head)


def _starts_operation(rest: str) -> bool:
    head = " ".join(rest.split()[:3])
    return any(operation.start < VERB_WITHIN for operation in operations(head))


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


def _assign(
    text: str, named: Sequence[Mention], spans: Sequence[tuple[int, int]]
) -> tuple[list[tuple[Quantity, Mention]], tuple[str, ...]]:
    """Assign each amount to the substance after it ("5 mL of TFA") or before it ("TFA (5 mL, 65 mmol)").

    Returns:
        The amounts with their substances, and the texts of those that have none; yields of products are left out.
    """
    substances = [m for m in named if m.kind in ("reagent", "class")]
    assigned: list[tuple[Quantity, Mention]] = []
    unassigned: list[str] = []
    mixed = mixtures(text, named)
    sold = solutions(text, named)
    for quantity in amounts(text):
        shares = next((parts for mixture in mixed if (parts := mixture.parts(text, quantity))), ())
        if shares:
            assigned.extend(shares)
            continue
        if without_ratio(text, named, quantity):
            unassigned.append(f"{text[quantity.start : quantity.end].strip()} of a mixture without a ratio")
            continue
        after = next((m for m in substances if m.start >= quantity.end), None)
        before = next((m for m in reversed(substances) if m.end <= quantity.start), None)
        gap_after = text[quantity.end : after.start] if after else None
        gap_before = text[before.end : quantity.start] if before else None
        behind = gap_before is not None and _BEHIND.fullmatch(gap_before)
        ahead = gap_after is not None and _AHEAD.fullmatch(gap_after) and not _JOINED.search(gap_after)
        adjacent = gap_before is not None and not gap_before.strip() and (gap_after or "").strip() not in ("of", "的")
        if adjacent and (gap_after is None or gap_after.strip() or _names_first(text, substances)):
            ahead = None
        of_product = any(b <= quantity.start <= b + 12 or 0 <= a - quantity.end <= 6 for a, b in spans)
        if within(quantity.start, spans) or (of_product and not ahead and not behind):
            continue
        solute = (sold.get(before) or _solute(text, before, substances)) if before and behind else None
        if _ICE.match(text, quantity.end):
            continue
        if solute is not None:
            assigned.append((quantity, solute))
        elif before and behind and (("(" in (gap_before or "") or "（" in (gap_before or "")) or not ahead):
            assigned.append((quantity, before))
        elif after and ahead:
            assigned.append((quantity, after))
        elif (
            not _PERCENT_YIELD.match(text, quantity.end)
            and not _OF_VESSEL.match(text, quantity.end)
            and not _YIELD.search(text, 0, quantity.start)
        ):
            unassigned.append(text[quantity.start : quantity.end].strip())
    return assigned, tuple(dict.fromkeys(unassigned))


def _names_first(text: str, substances: Sequence[Mention]) -> bool:
    """Return whether a text gives names before amounts, "benzaldehyde 10.6 g", by its first amount."""
    first = next(iter(amounts(text)), None)
    return first is not None and bool(substances) and substances[0].end <= first.start


_JOINED = re.compile(r"\b(?:and|with|in|to|or|then|plus|into|from)\b")


def _solute(text: str, solvent: Mention, substances: Sequence[Mention]) -> Mention | None:
    """Return what a solution is of whose solvent an amount follows: HCl in "4 M HCl in dioxane (10 mL)"."""
    before = next((m for m in reversed(substances) if m.end <= solvent.start), None)
    if before is None or not re.fullmatch(r"\s+in\s+", text[before.end : solvent.start]):
        return None
    return before if strength(text, before.start, before.end) else None


_ICE = re.compile(
    r"\s*(?:of\s+)?(?:crushed\s+|cracked\s+)?(?:ice\b(?![- ]*(?:cold|water|cooled))|碎?冰(?!水|醋|乙))", re.IGNORECASE
)
_BEHIND = re.compile(r"[\s(（:：]*+(?:[^()（）;；。]*[,，/;])?\s*+(?:约|ca\.?|about)?\s*")
_AHEAD = re.compile(r"\s*+(?:\(?(?:each|aq\.?)\)? )?[\w.%\s-]*")
_OF_VESSEL = re.compile(
    r"\s*(?:three-necked? |two-necked? |round-?bottom(?:ed)? |single-neck |conical |Erlenmeyer |separat(?:ing|ory) )*"
    r"(?:flask|beaker|vial|funnel|tube|cylinder|RBF|column|syringe|balloon|reactor)|(?:三口|圆底|单口)?(?:烧瓶|烧杯|分液漏斗|试管)",
    re.IGNORECASE,
)
"""A vessel's size is not an amount of a substance."""
_PERCENT_YIELD = re.compile(r"\s*[,;]\s*\d{1,3}(?:\.\d+)?\s*%\s*+(?:yield\s*+)?[)）]", re.IGNORECASE)
"""A percentage after an amount without a substance: "a colorless oil (1.1 g, 90 %)"."""
_YIELD = re.compile(r"(?:yield|gave|afford|obtain|收率|得|产量)[^;.。；]{0,40}$", re.IGNORECASE)
