"""Unread: what of a text no action states: names, amounts and conditions.

One rule for all sentences: a quantity is stated by an action, set aside as the size of a vessel or as data, or unread.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

from labgym.protocols.experiments.model import Action
from labgym.protocols.reading.actions import Unread
from labgym.protocols.reading.clauses import clauses
from labgym.protocols.reading.draft import ASIDE, EXTRACTS, LAYERS, ActionDraft, lows
from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import QUALITIES, SOLUTIONS, is_code, is_stop
from labgym.protocols.reading.mentions import CONDITIONS, MEASURES
from labgym.protocols.reading.observed import place_observed
from labgym.protocols.reading.stated import written
from labgym.protocols.reading.tokens import Sentence, Token, leaves

_NUMBERED = frozenset((
    "example", "examples", "step", "steps", "scheme", "preparation", "compound", "formula", "intermediate",
    "reference", "section", "table", "method", "part", "procedure", "figure", "no.", "no", "vol.", "page",
    "claim", "structure", "number", "product", "ref", "entry", "gave", "give", "afforded", "afford",
    "yielded", "yield", "yields", "affords", "gives", "provide", "whatman", "gel", "fraction", "fractions", "peak",
    "isomer", "lot", "run", "all", "these", "precursor", "column", "sequence", "merck",
))  # fmt: skip
_NUMBER = re.compile(r"^\d{1,6}(?:[.,]\d{1,6})?$")
_CLASSES = frozenset((
    "acid", "alcohol", "aldehyde", "amide", "amine", "anhydride", "bromide", "chloride", "ester", "hydrazide",
    "hydrochloride", "ketone", "salt", "alkoxide", "anion", "enolate", "phenoxide",
))  # fmt: skip
"""Classes of substances by which a text calls its batch."""
_RESULTING = frozenset((
    "resulting", "resultant", "residual", "desired", "crude", "corresponding", "formed", "title", "obtained",
))  # fmt: skip
_REMAINING = frozenset(("excess", "unreacted", "remaining", "residual", "any", "unconsumed"))
"""Words before the name of what was taken before."""
_BATHS = frozenset((
    "bath", "baths", "addition", "evolution", "uptake", "absorption", "derivative", "tube", "foil", "chest", "tower",
    "trap", "separator", "condenser", "funnel", "balloon", "stream", "blanket", "line", "lamp", "aspirator",
))  # fmt: skip
"""Nouns before which a name says what a bath or a device holds, repeats what was added, or is a gas or a class."""
MAX_ABBREVIATION = 8
"""Longest name in parentheses that repeats the name before them."""
_CHECKED = MEASURES | CONDITIONS
"""Kinds of figures that an action must state."""
_AMOUNT_PARTS = re.compile(r", | of | x ")
_WAITED = ("evolution", "uptake", "absorption", "generation", "consumption")
_GASES = frozenset(("hydrogen", "h2"))
_BARE_UNIT = re.compile(r"^(?:g|grams?|[km]g|m[lL]|milliliters?|millilitres?|m?mol(?:es?)?)$")
_SHARES = frozenset((
    "yield", "yield)", "theory", "theoretical", "conversion", "converted", "purity", "pure", "ee", "de", "complete",
    "reaction", "completion", "product",
))  # fmt: skip
"""Words behind a percentage of a yield, a conversion or a purity."""
_HAPPENING = frozenset((
    "evolved", "formed", "liberated", "precipitated", "precipitates", "separated", "separates", "remained", "remains",
    "observed", "crystallizes", "crystallises", "crystallized", "crystallised", "melts", "melted", "deposited",
    "developed", "generated", "absorbed",
))  # fmt: skip
"""Words for what happens by itself to what stands before them."""
_BETWEEN = frozenset(("so", "thus", "then", "was", "is", "were", "are", "which", "that", "of", "the"))
"""Words between a name and what happens to it: "the salt of the amine, which then precipitated"."""
_ADSORBENTS = frozenset(("darco", "norit", "norite"))
_TAKING = frozenset(("solvent", "eluent", "eluant", "some", "containing", "with", "plus", "using", "few"))
"""Words with which a bracket begins that holds something that is used."""
_ADDED = frozenset(("added", "introduced", "poured", "used", "with"))
"""Words behind a name that goes into the vessel."""
_REMOVED = frozenset(("removed", "replaced", "withdrawn"))
_COLUMNS = ("column", "columns", "cartridge")


def unread(draft: ActionDraft, parts: Iterable[Sentence]) -> Iterator[Unread]:
    """Yield the spans of a text that no action states, in no order."""
    taken = {portion.name.lower() for action in draft.actions for portion in action.takes}
    stated = _statements(draft.actions)
    yield from _doubled(draft)
    for sentence in parts:
        if _is_remark(draft, sentence.tokens):
            draft.own_all(token for token in leaves(sentence.tokens) if token.kind == "name")
        _own_descriptions(draft, sentence.tokens, taken)
        before = {token.start: sentence.tokens[k - 1] for k, token in enumerate(sentence.tokens) if k}
        before |= {item.start: token for token in sentence.tokens if _measures(token) for item in token.inner}
        for token in leaves(sentence.tokens):
            why = _lack(draft, before.get(token.start), token, stated)
            if why and not place_observed(draft, sentence.tokens, token):
                text = draft.text[token.start : token.end][:1000]
                yield Unread(start=token.start, end=token.end, text=text, why=why)


def _is_remark(draft: ActionDraft, tokens: Sequence[Token]) -> bool:
    """Return whether a sentence before or behind all actions only names or describes the product.

    It has no operation, no participle of one and no quantity; the title before the actions has nothing but names.
    """
    spans = [action.span for action in draft.actions if action.span is not None and action.verb != "Analyze"]
    if not spans or not tokens or clauses(tokens):
        return False
    if any(item.figure is not None and item.figure.kind in _CHECKED for item in leaves(tokens)):
        return False
    if tokens[0].start < spans[0][0]:
        return all(token.kind in ("name", "mark", "group") or is_code(token.text) for token in tokens)
    given = any(action.verb == "Yield" for action in draft.actions)
    done = any(token.low.endswith("ed") and not is_stop(token.low) for token in tokens if token.kind == "word")
    return given and not done and tokens[0].start > max(end for _, end in spans)


def _doubled(draft: ActionDraft) -> Iterator[Unread]:
    """Yield names with two masses or volumes, of which one belongs to something else; liquids may be used in turn."""
    for action in draft.actions:
        for portion in action.takes if action.verb not in ("Extract", "Wash") else ():
            parts = (part.split(" of ")[0].split() for part in portion.amount.split(", ") if part[:1].isdigit())
            units = [part[-1] for part in parts]
            if portion.span is not None and max(units.count("g"), units.count("mL")) > 1:
                start, end = portion.span
                why = f"amount of another substance: {portion.amount[:100]} stand with one name"
                yield Unread(start=start, end=end, text=portion.name, why=why)


def _lack(draft: ActionDraft, before: Token | None, token: Token, stated: set[str | float]) -> str:
    """Return why a token is unread, or ""; `before` is the token before it, or the bracket that it begins."""
    figure = token.figure
    owned = max(draft.owned[token.start : token.end], default=0)
    if figure is not None:
        lost = figure.kind in _CHECKED and owned != ASIDE and not _is_stated(draft, figure, stated)
        if lost or not (owned or figure.kind in ("other", "length", "ratio") or _is_once(figure)):
            return f"amount or condition ({figure.kind}) that no action owns"
    elif owned:
        return ""
    elif token.kind == "word" and _NUMBER.match(token.text) and not _is_numbering(before, token):
        return "number without a unit that is known"
    elif token.kind == "word" and _BARE_UNIT.match(token.text) and draft.plain[token.start - 1] != "(":
        return "unit of an amount without a number that is known"
    elif token.kind == "name" and len(token.text) > 2 and token.low not in QUALITIES:
        return "name that no action owns"
    return ""


def _statements(actions: Iterable[Action]) -> set[str | float]:
    """Return the amounts, notes and conditions that actions state."""
    stated: set[str | float] = set()
    for action in actions:
        amounts = [portion.amount for portion in (*action.takes, *action.gives)]
        stated |= {part for amount in amounts for part in _AMOUNT_PARTS.split(amount)}
        notes = action.note.replace(";", ",").split(", ")
        stated |= {part.removeprefix("to ").removesuffix(" in all") for part in notes}
        held = [action.temperature, action.duration, action.pressure, action.ph]
        held += [value for period in action.then for value in (period.temperature, period.duration)]
        stated |= {value for value in held if value is not None}
    return stated


def _is_stated(draft: ActionDraft, figure: QuantitySpan, stated: set[str | float]) -> bool:
    """Return whether an action states a figure: as an amount, as a condition, or as written in its note."""
    if figure.kind in CONDITIONS:
        return figure.value in stated
    return written(figure).split(" x ")[-1] in stated or draft.text[figure.start : figure.end] in stated


def _is_once(figure: QuantitySpan) -> bool:
    return figure.kind == "repeats" and figure.value == 1.0


def _own_descriptions(draft: ActionDraft, tokens: Sequence[Token], taken: set[str]) -> None:
    """Own names that describe the batch or repeat a name: "the ether solution", "N-chlorosuccinimide (NCS)"."""
    for before, run, following in _name_runs(tokens):
        describes = following is not None and following.low in LAYERS | EXTRACTS | _BATHS
        describes = describes or _happens(draft, tokens, before, run) or _is_batch(draft, tokens, before, run)
        if describes or _is_class(before, run, following) or _is_named_again(draft, before, run, following, taken):
            draft.own(_bath_start(tokens, run) if describes else run[0].start, run[-1].end)
    _own_observed(draft, tokens)
    _own_shares(draft, tokens)
    for token, following in pairwise(tokens):
        if token.figure is not None and following.low in _COLUMNS:
            draft.own(token.start, token.end, ASIDE)
        if following.kind == "group" and (_is_comment(following) or _is_converted(token, following)):
            draft.own(following.start, following.end, ASIDE)
        is_column = token.low in ("silica", "gel", "alumina") and following.low in _COLUMNS
        if is_column and any(action.verb == "Chromatograph" for action in draft.actions):
            _own_column(draft, tokens, token)
        inner = [item for item in following.inner if item.kind != "mark"]
        alone = len(inner) == 1 or (_weighs(following) and all(item.figure is not None for item in inner[1:]))
        abbreviates = bool(inner) and alone and inner[0].kind == "name" and len(inner[0].text) <= MAX_ABBREVIATION
        abbreviates = abbreviates and not inner[0].text.islower() and inner[0].low not in _ADSORBENTS
        if following.kind == "group" and abbreviates and draft.owned[token.end - 1]:
            draft.own(inner[0].start, inner[0].end)


def _is_comment(group: Token) -> bool:
    """Return whether a bracket without a figure comments on what stands before it: "(gummy in ether)"."""
    first, *rest = group.inner or (group,)
    names = [item for item in rest if item.kind == "name"]
    comments = first.kind == "word" and first.low not in QUALITIES | _TAKING and not first.low.startswith("prewash")
    return bool(names) and comments and all(item.figure is None for item in leaves(group.inner))


def _is_converted(token: Token, group: Token) -> bool:
    """Return whether a bracket gives a figure in another unit: "800 psi (5517 kPa)"."""
    first, second = token.figure, group.inner[0].figure if len(group.inner) == 1 else None
    if first is None or second is None or first.kind != second.kind:
        return False
    return abs(first.value - second.value) <= 0.05 * abs(first.value)


def _bath_start(tokens: Sequence[Token], run: Sequence[Token]) -> int:
    """Return where a name begins with those that it is mixed with: "dry ice:acetone bath"."""
    place = next(k for k, token in enumerate(tokens) if token is run[0])
    while place > 1 and tokens[place - 1].text in ("/", ":", "-") and tokens[place - 2].kind == "name":
        place -= 2
        while place and tokens[place - 1].kind == "name":
            place -= 1
    return tokens[place].start


def _happens(draft: ActionDraft, tokens: Sequence[Token], before: Sequence[str], run: Sequence[Token]) -> bool:
    """Return whether a name without an amount is of the batch, or of what comes out of it by itself.

    "The crude amine thus obtained was filtered", "dimethylamine was evolved", "The salt precipitated".
    """
    place = next(k for k, token in enumerate(tokens) if token is run[-1])
    ahead = tokens[place + 1 : place + 6]
    if not draft.actions or (ahead and (ahead[0].figure is not None or _measures(ahead[0]))):
        return False
    words = [token.low for token in ahead if token.kind != "name"]
    if (set(before) & _RESULTING and "added" not in words) or words[:1] in (["obtained"], ["thus"]):
        return True
    return next((word for word in words if word not in _BETWEEN), "") in _HAPPENING


def _is_batch(draft: ActionDraft, tokens: Sequence[Token], before: Sequence[str], run: Sequence[Token]) -> bool:
    """Return whether a name without an amount is of the batch: "the CH2Cl2 solution", "excess A was destroyed"."""
    place = next(k for k, token in enumerate(tokens) if token is run[-1])
    ahead = [token.low for token in tokens[place + 1 : place + 5]]
    definite = bool({"the", "this"} & {token.low for token in tokens[max(0, place - len(run) - 4) : place]})
    solved = definite and ahead[:1] in (["solution"], ["mixture"], ["suspension"])
    rest = before[-1:] in (["excess"], ["unreacted"]) and ahead[:1] in (["was"], ["is"], ["were"])
    return bool(draft.actions) and (solved or rest) and not _ADDED & set(ahead) | {"of", "()"} & set(ahead[:2])


def _own_shares(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Set yields, purities and conversions aside, and own an ice bath that is taken away."""
    flat = list(leaves(tokens))
    for place, token in enumerate(flat):
        ahead = [item.low for item in flat[place + 1 : place + 4]]
        near = {"yield", "purity", "conversion"}.intersection(item.low for item in flat[max(0, place - 2) : place])
        if token.figure is not None and token.figure.kind == "percent" and (near or not _SHARES.isdisjoint(ahead)):
            draft.own(token.start, token.end, ASIDE)
        if token.figure is not None and token.low.endswith("bath") and not _REMOVED.isdisjoint(ahead):
            draft.own(token.start, token.end, ASIDE)


def _is_named_again(
    draft: ActionDraft, before: Sequence[str], run: Sequence[Token], following: Token | None, taken: set[str]
) -> bool:
    """Return whether a definite name without an amount repeats one that was taken or made: "the ester was stirred".

    The last word of a name repeats it, too: "the ether solution" behind "diethyl ether".
    """
    names = taken | {portion.name.lower() for action in draft.actions for portion in action.gives}
    name = draft.text[run[0].start : run[-1].end].lower()
    known = name == "catalyst" or name in names or name in {item.split()[-1] for item in names if item}
    solved = following is not None and following.low in SOLUTIONS
    measured = following is not None and (following.figure is not None or (following.kind == "group" and not solved))
    definite = bool({"the", "this", "all"} & set(before)) or bool(_REMAINING & set(before[-1:]))
    return known and not measured and (solved or definite or name == "catalyst")


def _own_observed(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Own the names of what is waited for, "until the uptake of hydrogen ceased", and the oil of a dispersion."""
    waits, previous = False, ""
    for token in tokens:
        waits = (waits or token.low in ("until", "till")) and token.kind != "mark"
        waits = waits or (token.low == "of" and previous in _WAITED)
        previous = token.low
        if waits and token.kind == "name":
            draft.own(token.start, token.end)
        elif waits and token.figure is not None and token.figure.kind in MEASURES and lows(tokens) & _GASES:
            draft.own(token.start, token.end, ASIDE)
        if token.kind == "group" and lows(token.inner) & {"dispersion", "suspension", "oil"}:
            draft.own_all(item for item in token.inner if item.low in ("mineral", "paraffin"))


def _name_runs(tokens: Sequence[Token]) -> Iterable[tuple[list[str], list[Token], Token | None]]:
    """Yield the names of a sentence, each with the two words before it, in lower case, and the token behind it."""
    run: list[Token] = []
    for place, token in enumerate((*tokens, None)):
        if token is not None and token.kind == "name":
            run.append(token)
            continue
        if run:
            first = place - len(run)
            yield [each.low for each in tokens[max(0, first - 2) : first]], run, token
        run = []


def _is_class(before: Sequence[str], run: Sequence[Token], following: Token | None) -> bool:
    """Return whether a name is a class that stands for the batch: "the resulting acid chloride"."""
    named = bool(set(before) & _RESULTING) or ("the" in before and len(run) > 1) or before[-1:] == ["this"]
    named = named or list(before) == ["to", "the"]
    measured = following is not None and (following.kind == "group" or following.figure is not None)
    return named and not measured and all(token.low in _CLASSES for token in run)


def _own_column(draft: ActionDraft, tokens: Sequence[Token], last: Token) -> None:
    """Own the size and the packing of a column: "a 40 g silica gel column"."""
    place = next(k for k, token in enumerate(tokens) if token is last)
    for token in reversed(tokens[max(0, place - 2) : place + 1]):
        if token.low not in ("silica", "gel", "alumina") and (token.figure is None or token.figure.kind != "mass"):
            break
        draft.own(token.start, token.end, ASIDE)


def _is_numbering(before: Token | None, number: Token) -> bool:
    """Return whether a number behind a token counts something or numbers it: "Example 3", "compound 12"."""
    named = before is not None and (before.low in _NUMBERED or before.text.endswith("®"))
    inside = before is not None and before.end > number.start
    closed = before is not None and before.kind == "group" and not (inside and "." in number.text)
    return before is None or before.kind in ("name", "mark") or closed or named


def _weighs(token: Token) -> bool:
    """Return whether a bracket has a mass or an amount of substance."""
    return any(item.figure is not None and item.figure.kind in ("mass", "substance") for item in token.inner)


def _measures(token: Token) -> bool:
    """Return whether a bracket has a mass, a volume or an amount of substance."""
    return any(item.figure is not None and item.figure.kind in MEASURES for item in token.inner)
