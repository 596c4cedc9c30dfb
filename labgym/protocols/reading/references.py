"""References: sentences that lean on another procedure: "prepared as described in Example 1, from 2 g of the amine"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from labgym.protocols.experiments.model import Portion
from labgym.protocols.reading.clauses import VerbClause
from labgym.protocols.reading.draft import ActionDraft, lows, substances, with_substances
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.phrases import read_phrases
from labgym.protocols.reading.results import product_label
from labgym.protocols.reading.tokens import Token

_REFERS = re.compile(
    r"\b(?:(?:as|that|those|conditions|procedures?|methods?|manner|way|process|"
    r"steps?) (?:described|set forth|set out|given|outlined|detailed|indicated|used|reported|in)"
    r"(?: (?:above|earlier|previously|for|in|by|under|the|preparation|synthesis|of|"
    r"general))* ?(?:part|Part|Example|Ex\.|EXAMPLE|example|Step|step|Preparation|Procedure|procedure|"
    r"Method|method|Scheme|Intermediate|Reference|reference)"
    r"|[Aa]ccording to (?:the )?(?:\w+ )?(?:general )?(?:procedures?|methods?|conditions|process|Example|"
    r"EXAMPLE|example|protocols?|Scheme|manner)"
    r"|(?:[Aa]nalogous|[Ss]imilar)(?:ly)? (?:procedure |manner |fashion |way )?(?:to|as)\b"
    r"|(?:procedure|method|process) (?:was|is) the same as\b"
    r"|identical (?:procedure|manner|fashion|way) (?:to|as)\b|(?:procedure|manner|fashion|way) identical to\b"
    r"|[Ii]n an? (?:analogous|similar|identical) (?:manner|fashion|way)|[Ii]n the same (?:manner|way|"
    r"fashion) (?:as|of)|[Ii]n a manner (?:analogous|similar|identical)"
    r"|^As (?:for|in) (?:Example|Step|Preparation)|(?:made|prepared|synthesi[sz]ed) as above\b"
    r"|(?:[Ff]ollowing|[Bb]y|[Uu]sing|[Uu]nder|from) "
    r"(?!(?:\w+ ){0,2}(?:conditions (?:for|in (?!an? example)[\da])|procedure in which))(?:essentially )?(?:the |"
    r"a )?(?:\w+ )?(?:general )?(?:procedures?|methods?|conditions|process) (?:of|in|described|"
    r"as|detailed|from|outlined|above|given|similar|analogous|for|that)"
    r"|(?:[Gg]eneral|[Ss]tandard) (?:[Pp]rocedure|[Mm]ethod)s? [A-Z\d]\b|"
    r"by (?:the )?(?:general )?(?:procedure|method|Procedure|Method) [A-Z\d]|"
    r"Prepared by Procedure"
    r"|(?:procedure|method|process|reaction|preparation|synthesis) (?:of|in) (?:Example|EXAMPLE|example|Step|"
    r"Preparation) [A-Z\d]\w{0,6} (?:was|is) repeated"
    r"|(?:Example|EXAMPLE|Preparation) [A-Z\d]\w{0,6} (?:was|is) repeated"
    r"|in (?:the )?(?:procedure|process|method) of (?:Example|example)|"
    r"[Ii]n accordance with (?:the )?(?:process|procedure|method|general|Example))"
    r"|as (?:is |was )?(?:described|reported) (?:in|by) [A-Z]\w{2,20}"
    r"|as described in the (?:preparation|synthesis|procedure) (?:of|for)\b"
)
_REFERRED = re.compile(
    r"(?:Example|EXAMPLE|Ex\.|example|Step|Preparation|Procedure|Method|Scheme|"
    r"Intermediate)s? [A-Z\d][\w.-]*|general procedure(?: [A-Z\d]\w*)?"
)
_MADE = re.compile(
    r"\b(?:prepar(?:ed?|ing)|Following|followed|added|obtained|synthesi[sz]ed|made|produced|converted|carried out|"
    r"reacted|performed|gave|yielded|treated|isolated|substituting|repeated|purified|working up|"
    r"methylated|oxidi[sz]ed|condensation|affords|"
    r"worked up|conducted|given|gives|afforded|get|substituted|interacted|coupled|react|reacting|leads|"
    r"provide[sd]|alkylated|hydrogenated|hydroly[sz]ed|"
    r"Reaction)\b",
    re.IGNORECASE,
)
_ORIGIN = re.compile(
    r"(?<!was )(?<!were )(?<!is )(?<!are )(?<!be )(?<=\S )"
    r"(?:prepared|obtained|synthesi[sz]ed|produced|made|manufactured|equipped)(?: (?:in|by) (?:the|a))? $"
)
_APPARATUS = re.compile(r"\b(?:apparatus|bomb|reactor|vessel|equipment|flask|autoclave)s?(?: \w+){0,4} $")
"""Words before a reference that is to the apparatus of another procedure."""
_APPOSED = re.compile(r"\), (?:prepared|obtained|synthesi[sz]ed|produced|made) $")
"""The origin of what has its amount in a bracket: "anisole (2 g), prepared according to the method of"."""
_MAKES = re.compile(r"(?:made|prepared|synthesi[sz]ed) ")
_GOES_ON = re.compile(r"\b(?:was|were|is|are)\b")
"""A sentence goes on behind the words on where its material came from: "X, prepared as in Example 1, was heated"."""
CUT_DATA = 120
"""Characters behind a sentence that is cut at its data in which its verb may stand."""
_SOURCES = frozenset(("from", "with", "using", "substituting", "of", "and"))
"""Prepositions before the materials of a procedure that is repeated."""
_MAKING = frozenset(("prepared", "obtained", "synthesized", "synthesised", "made"))


def reference(text: str, start: int, end: int) -> re.Match[str] | None:
    """Return where a sentence says that something is made as elsewhere, outside brackets."""
    if not _MADE.search(text, start, end + CUT_DATA):
        return None
    for match in _REFERS.finditer(text, start, end):
        made = _MAKES.match(match[0])
        before = text[start : match.start() + (made.end() if made is not None else 0)]
        goes_on = _GOES_ON.search(text, match.end(), end) or _GOES_ON.search(text, start, match.start())
        is_origin = _ORIGIN.search(before) is not None and goes_on is not None
        is_origin = is_origin or _APPOSED.search(before) is not None or _APPARATUS.search(before) is not None
        inside = sum(map(before.count, "([")) > sum(map(before.count, ")]"))
        if not is_origin and not inside:
            return match
    return None


def materials(
    draft: ActionDraft, match: re.Match[str], tokens: Sequence[Token], parts: Sequence[VerbClause]
) -> list[SubstanceMention]:
    """Append the addition of what a repeated procedure takes, unless an operation takes it, and return it."""
    phrases = read_phrases(tokens, True)
    results = [clause for clause in parts if clause.head.word.verb == "Yield"]
    end = draft.found(results[0])[0] if results and not results[0].head.passive else len(draft.text)
    sources = _sources(tokens, [phrase for phrase in phrases if phrase.start < end])
    used = [item for item in substances(sources) if not match.start() <= item.start < match.end()]
    used += [item for item in substances(phrases) if item.is_measured]
    found: dict[int, SubstanceMention] = {}
    for item in used:
        if item.start < end:
            found.setdefault(item.start, item)
    used = list(found.values())
    if used and not any(clause.head.word.verb in ("Add", "Dissolve", "MakeSolution") for clause in parts):
        draft.put("Add", used)
    return used


def _sources(tokens: Sequence[Token], phrases: Sequence[TextPhrase]) -> list[TextPhrase]:
    """Return the phrases that name materials: what replaces another one, else all behind "from" and the like."""
    for place in range(len(tokens) - 1, -1, -1):
        if tokens[place].low in ("substituting", "employing", "replacing"):
            return with_substances(read_phrases(tokens[place + 1 :]), "")[:1]
    return [phrase for phrase in phrases if phrase.prep in _SOURCES]


def refer(draft: ActionDraft, match: re.Match[str], end: int) -> None:
    """Append the reference itself, by the label of the other procedure if it has one."""
    label = _REFERRED.search(draft.plain, match.start(), min(end, match.end() + 60))
    draft.emit("Refers", match.span(), note=draft.text[slice(*(label or match).span())][:400])
    for found in filter(None, (match, label)):
        draft.own(*found.span())


def product(draft: ActionDraft, tokens: Sequence[Token], used: Sequence[SubstanceMention]) -> None:
    """Append the product that a reference without a result names: "Compound 3 was prepared as in Example 1"."""
    span = product_label(tokens) if tokens[0].low in ("the", "this") else None
    subject = read_phrases(tokens, True)[0]
    named = [item for item in subject.substances if subject.prep == "" and item not in used]
    if span is None and named and lows(tokens) & _MAKING:
        span = (named[0].start, named[0].end)
    if span is not None:
        draft.own(*span)
        draft.emit("Yield", span, gives=(Portion(name=draft.text[slice(*span)][:200], span=span),))
