"""Names of products in a description, which need not be in the catalog."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from labgym.protocols.language import Mention
from labgym.protocols.synthesis.product_classes import names_a_product, trivial_end
from labgym.protocols.synthesis.unlisted import is_named_like_a_substance

Span = tuple[int, int]

_END = (
    r"(?=(?<!\s)\s+(?:from|by|via|using|with|in|at|below|above|and|under|over|through|as|which|that|was|were|is|are)\b|"
    r"[;:()\n]|,(?!\d)|\.(?!\d)|$)"
)
_OF = re.compile(r" of (?=[a-z0-9])", re.IGNORECASE)
_KIND_OF_SYNTHESIS = re.compile(
    r"\b(?:ethers?|esters?|amides?|imines?|alcohols?|ketones?|williamson|fischer|gabriel|knorr|suzuki|grignard|wittig|"
    r"indole|pyrrole|chalcone|coumarin|benzimidazole|alkene|azide|halide)\s+synthesis of\s*$",
    re.IGNORECASE,
)
_NO_VESSEL = r"(?!(?:a |an |the )?(?:[a-z]+ )?(?:solution|mixture|slurry|suspension|paste|total)\b)"
_GIVEN = re.compile(
    r"\b(?:(?:to )?(?:gives?|affords?|yields?|furnish|delivers?|forms?|obtains?|produces?|makes?|gets?)|gave|afforded|"
    r"yielded|furnished|giving|affording|yielding|furnishing|producing|make|makes|prepare|preparing|synthesi[sz]e|synthesi[sz]ing|"
    r"preparation of|synthesis of|formation of|as(?: its| an?| the)?)\s++"
    rf"{_NO_VESSEL}(.+?){_END}",
    re.IGNORECASE,
)
_AS = re.compile(r"as\b", re.IGNORECASE)
_CONVERSION = (
    r"(?:convert|turn|transform|reduc|oxidi[sz]|hydroly[sz]|hydrogenat|dehydrat|rearrang|cycli[sz]|condens|brominat|chlorinat|"
    r"iodinat|nitrat|acetylat|benzoylat|alkylat|acylat|methylat|benzylat|esterif|epoxidi|isomeri|evaporat|concentrat|heat|"
    r"tosylat|mesylat|deprotect|react|saponif|coupl)\w*"
)
_NO_VERB = r"(?!(?:give|afford|yield|furnish|deliver|form|obtain|produce|make|get)\b)"
_INTO = re.compile(
    rf"\b{_CONVERSION}\s++(?:(?:[^,;.\s]|\.(?=\d))++\s++){{0,20}}?(?:in)?to\s++{_NO_VESSEL}{_NO_VERB}(.+?){_END}",
    re.IGNORECASE,
)
_CHINESE = re.compile(
    r"(?:得到?|生成|制得|制成|制备|合成|获得|蒸出|析出|收集|"
    r"(?:氧化|还原|转化|水解|脱水|缩合|环化|转变|变|酰化)(?:成|为))"
    r"([^，。；：、,;:（(]+?)(?=[，。；：、,;:（(]|并|$)"
)
_SOURCE_ZH = re.compile(r"[由从用以将](.+)$", re.DOTALL)
_NAMED_BY = re.compile(r"\s*+(?:\([^)]*\)\s*+)?(?:from\b|by\b|via\b|[:：])", re.IGNORECASE)
_NAMED_PROCESS = re.compile(r"\s+(?:synthesis|preparation|formation)\b", re.IGNORECASE)
_CLAUSE_END = re.compile(r"[;。；]|\.(?!\d)")
_TO = re.compile(r"\bto (?:the |an? )?$", re.IGNORECASE)
_CONVERTS = re.compile(rf"\b{_CONVERSION}\b", re.IGNORECASE)
_BARE_TO = re.compile(r"^\W*+\S+(?: \S+)? to (?:the |an? )?$", re.IGNORECASE)
_ADDING = re.compile(r"\b(?:add|pour|transfer|charg|introduc|treat|drop)", re.IGNORECASE)
_ISOLATING = re.compile(
    r"\b(?:filter|collect|isolat|obtain|recover|re-?distil|distil|re-?crystalli[sz]|crystalli[sz]|precipitat|dry|purif|"
    r"separat|take)(?:l?ing|l?ed|ied|y|e[ds]?|ing|s)?(?:\s+(?:off|out|over|up))?"
    r"(?:\s+(?:the|an?|this|all|crude|pure|solid|white|dry|resulting|precipitated|product|of|its))*\s+$",
    re.IGNORECASE,
)
_ISOLATED = re.compile(
    r"\s*+(?:,?\s*+(?:which|that)\s*+)?(?:(?:was|were|is|are)\s+)?(?:then\s+)?(?:filtered|collected|isolated|obtained|"
    r"recrystalli[sz]e[ds]?|distil(?:led|s)|dried|washed|precipitate[ds]?|crystalli[sz]e[ds]?|separate[ds]?|purified|"
    r"formed|forms|comes|came|melt(?:s|ed))\b",
    re.IGNORECASE,
)
_AMOUNT_BEFORE = re.compile(r"\d\s*+(?:[mk]?g|m?l|m?mol)\s+(?:of\s+)?(?:crude\s+)?$", re.IGNORECASE)
AUXILIARY = ("organic_solvent", "solvent", "drying_agent", "adsorbent", "inorganic_salt", "gas")
"""Categories of reagents that are filtered or distilled off, never made here."""


def products(
    text: str, named: Sequence[Mention], foreign: Sequence[Span], auxiliary: frozenset[str]
) -> tuple[Span, ...]:
    """Return the spans that name a product: the wording announces or isolates one, and they contain a substance.

    Args:
        named: the mentions of the text.
        foreign: spans of substances that the catalog lacks.
        auxiliary: names of reagents that are removed rather than made, such as solvents and drying agents.
    """
    spans = [*announced(text, named, foreign)]
    for start, end in foreign:
        if not within(start, spans) and (_stands_for_product(text, start, end) or _isolated(text, start, end, named)):
            spans.append((start, end))
    for mention in named:
        elsewhere = any(other.name == mention.name and other.start != mention.start for other in named)
        makeable = mention.kind == "reagent" and mention.name not in auxiliary and not elsewhere
        if makeable and not within(mention.start, spans) and _isolated(text, mention.start, mention.end, named):
            spans.append((mention.start, mention.end))
    return tuple(sorted(spans))


def within(place: int, spans: Sequence[Span]) -> bool:
    """Return whether a place of the text lies in one of the spans."""
    return any(start <= place < end for start, end in spans)


def announced(text: str, named: Sequence[Mention], foreign: Sequence[Span]) -> Iterator[Span]:
    """Yield the spans that the wording announces as products: "to give X", "preparation of X"."""
    for pattern in (_GIVEN, _INTO, _CHINESE):
        for match in pattern.finditer(text):
            start, end = match.span(1)
            source = (_SOURCE_ZH if pattern is _CHINESE else _OF).search(match[1], trivial_end(match[1]))
            end = start + source.start() if source else end
            if pattern is _GIVEN and _KIND_OF_SYNTHESIS.search(text, 0, start):
                continue
            chemical = any(m.kind in ("reagent", "class") and start <= m.start < end for m in named)
            plausible = pattern is _GIVEN and is_named_like_a_substance(match[1])
            plausible = plausible or (not _AS.match(match[0]) and names_a_product(text[start:end]))
            if chemical or plausible or any(start <= a < end for a, _ in foreign):
                yield start, end


def _stands_for_product(text: str, start: int, end: int) -> bool:
    """Return whether a name is in the position of a product: "X from ...", "X: ...", "X synthesis", "reduce to X"."""
    if _NAMED_PROCESS.match(text, end):
        return True
    if not text[:start].strip():
        return _NAMED_BY.match(text, end) is not None
    ends = [match.end() for match in _CLAUSE_END.finditer(text, 0, start)]
    head = text[ends[-1] if ends else 0 : start]
    converts = _CONVERTS.search(head) or _BARE_TO.match(head)
    return bool(_TO.search(head) and converts and not _ADDING.search(head))


def _isolated(text: str, start: int, end: int, named: Sequence[Mention]) -> bool:
    """Return whether a name is collected in the work-up after reagents were named: "filter the dibenzalacetone"."""
    before = [m for m in named if m.kind in ("reagent", "class") and m.end <= start]
    head = text[:start]
    if not before or _AMOUNT_BEFORE.search(head):
        return False
    return _ISOLATING.search(head) is not None or _ISOLATED.match(text, end) is not None
