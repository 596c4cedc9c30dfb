"""Phrases: the parts of a clause that a preposition begins, with their substances, amounts and conditions."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import (
    BATCH,
    GASES,
    QUALITIES,
    SOLUTIONS,
    SOLVENT_ADJECTIVES,
    VESSELS,
    WORDS_OF_AMOUNT,
)
from labgym.protocols.reading.mentions import CONDITIONS, STRENGTHS, PhraseDraft, SubstanceMention, TextPhrase
from labgym.protocols.reading.tokens import Token
from labgym.protocols.reading.words import DEVICES, read_word

_LISTING = frozenset(
    ("", "to", "with", "of", "in", "from", "between", "into", "over", "by", "using", "onto", "through")
)
"""Prepositions behind which a list of substances may follow."""
_STATES = frozenset(("0", "i", "ii", "iii", "iv", "vi"))
"""Oxidation states in brackets, which are parts of names: "palladium (II) acetate"."""
STATIONARY = frozenset(("silica", "silica gel", "sio2", "alumina", "al2o3", "celite"))


def read_phrases(tokens: Sequence[Token], is_result: bool = False) -> list[TextPhrase]:
    """Return the phrases of a sequence of tokens in order; each token is looked at once.

    Args:
        tokens: the part of a clause before or after its operation word, or the inside of a bracket.
        is_result: whether the tokens name a product.
    """
    if not tokens:
        return []
    draft = PhraseDraft(tokens, is_result)
    draft.open("", tokens[0].start)
    for place, token in enumerate(tokens):
        _READERS[token.kind](draft, place, token)
        draft.phrase.end = token.end
    draft.close()
    return draft.phrases


def _figure(draft: PhraseDraft, place: int, token: Token) -> None:
    figure = token.figure
    assert figure is not None
    if figure.kind == "repeats":
        _count(draft, place, figure)
    elif figure.kind in CONDITIONS:
        draft.phrase.conditions.append(figure)
    elif figure.kind in ("ratio", "other", "length") or (
        figure.kind == "percent"
        and any(t.low in ("pure", "purity", "ee", "conversion") for t in draft.tokens[place + 1 : place + 4])
    ):
        draft.phrase.ratios.append(figure)
    elif figure.kind == "volume" and _is_vessel(draft, place):
        draft.phrase.vessels.append(figure)
    elif draft.is_ended():
        draft.open("", token.start)
        draft.pending.append(figure)
    elif _attaches_back(draft, place):
        assert draft.last is not None
        draft.last.amounts.append(figure)
    else:
        draft.pending.append(figure)
    draft.adjacent = False


def _count(draft: PhraseDraft, place: int, figure: QuantitySpan) -> None:
    """Note how often something is used: what follows "twice with", the name before "twice, ", or all of the phrase."""
    after = draft.after(place)
    if after in ("with", "using") and draft.phrase.substances:
        draft.ahead = figure
    elif draft.last is not None and not draft.separated and after in (",", "and") and _goes_on(draft, place + 1):
        draft.last.repeated = figure
    else:
        draft.phrase.repeats, draft.phrase.repeated = int(figure.value), figure


def _is_vessel(draft: PhraseDraft, place: int) -> bool:
    """Return whether an amount is the size of a vessel: "a 250 mL round-bottomed flask"."""
    for token in draft.tokens[place + 1 : place + 7]:
        if token.low.rstrip(".") in VESSELS or token.low in ("bottom", "round-bottom"):
            return True
        necked = token.figure is not None and token.figure.kind == "other"
        if token.kind not in ("word", "verb") and token.low not in (".", ",") and not necked:
            return False
        if token.low == "of" and token is not draft.tokens[place + 1]:
            return False
    return False


def _attaches_back(draft: PhraseDraft, place: int) -> bool:
    """Return whether an amount belongs to the name before it: "n-BuLi 2.5 M in hexane"."""
    following = next((token for token in draft.tokens[place + 1 : place + 3] if token.low != "."), None)
    if draft.last is not None and not draft.last.amounts and not draft.pending and draft.tokens[place - 1].text == ",":
        return following is None or following.text == ","
    if draft.last is None or draft.separated or not draft.adjacent:
        return False
    if following is None:
        return True
    return not (following.kind == "name" or following.low in ("of", "aqueous") or following.low in SOLUTIONS)


def _name(draft: PhraseDraft, place: int, token: Token) -> None:
    if place <= draft.skip:
        return
    after = draft.after(place)
    if token.low in GASES and _is_atmosphere(draft, after):
        draft.phrase.words.append(GASES[token.low])
        draft.phrase.remarks.append((token.start, token.end))
        draft.adjacent = False
    elif (
        (token.low in GASES and after in ("inlet", "line", "bubbler", "balloon"))
        or (token.low == "ice" and after in ("bath", "cooling"))
        or (after in DEVICES and draft.is_separate(place))
        or (token.low in ("mineral", "paraffin") and after == "oil" and not draft.pending)
    ):
        draft.phrase.remarks.append((token.start, token.end))
    elif token.low in SOLVENT_ADJECTIVES or token.low in QUALITIES:
        read_word(draft, place, token)
    else:
        draft.name(place, token, weak=False)
        draft.refers_back(place)


def _is_atmosphere(draft: PhraseDraft, after: str) -> bool:
    """Return whether a gas is the one above the mixture, not a substance that is taken."""
    phrase = draft.phrase
    if after == "atmosphere":
        return True
    if draft.pending or phrase.prep not in ("under", "with", "by", "in", "of"):
        return False
    return phrase.prep == "under" or "atmosphere" in phrase.words or after in ("atmosphere", "gas", "inlet")


def _verb(draft: PhraseDraft, place: int, token: Token) -> None:
    """Pass a word for an operation that is used as an adjective or a noun."""
    if place <= draft.skip:
        return
    fitted = token.low in ("equipped", "fitted") or (token.low == "provided" and draft.after(place) == "with")
    if fitted or token.low in BATCH:
        read_word(draft, place, token)
        return
    if token.low in WORDS_OF_AMOUNT:
        draft.quality.append(WORDS_OF_AMOUNT[token.low])
    else:
        draft.refers_back(place)
        draft.phrase.words.append(token.low)
    draft.adjacent = False


def _mark(draft: PhraseDraft, place: int, token: Token) -> None:
    if token.text == "," and _is_between_adjectives(draft, place):
        return
    if token.text == ",":
        if _ends_phrase(draft):
            draft.open("", token.start)
        subject = draft.phrase.prep == "" and draft.phrase.solution is not None
        if draft.in_solvent and draft.phrase.prep in ("", "to", "with") and not subject and _goes_on(draft, place):
            draft.open("", token.start)
        draft.separate()
    elif token.text == ":" and _weighs(draft.tokens[place + 1 : place + 2]):
        draft.open("", token.start)
    elif token.text in "/:-":
        draft.separate()
        draft.paired = True


def _weighs(tokens: Sequence[Token]) -> bool:
    """Return whether tokens begin with a mass: "was washed with water: 2 g of the product"."""
    return any(token.figure is not None and token.figure.kind == "mass" for token in tokens[:1])


def _is_between_adjectives(draft: PhraseDraft, place: int) -> bool:
    """Return whether a comma parts adjectives of one name: "in dry, degassed DMF"."""
    before = draft.tokens[place - 1].low if place else ""
    after = draft.tokens[place + 1 : place + 3]
    adjective = len(after) == 2 and (after[0].low in QUALITIES or after[0].low.endswith("ed"))
    return before in QUALITIES and adjective and after[1].kind == "name"


def _ends_phrase(draft: PhraseDraft) -> bool:
    """Return whether a comma ends the phrase: a circumstance, or the solution to which something is added."""
    phrase = draft.phrase
    if phrase.prep in ("after", "when", "once", "while"):
        return True
    if not phrase.substances:
        if phrase.prep not in _LISTING:
            return True
        return bool(phrase.prep and (phrase.conditions or phrase.nouns) and not draft.pending)
    solvent = any(item.solvent for item in phrase.substances)
    return phrase.prep == "to" and phrase.solution is not None and not draft.in_solvent and solvent


def _goes_on(draft: PhraseDraft, place: int) -> bool:
    """Return whether new substances follow the comma after a solvent, not more of its phrase."""
    return any(token.kind in ("name", "figure") for token in draft.tokens[place + 1 : place + 5])


def _bracket(draft: PhraseDraft, place: int, token: Token) -> None:
    """Read a bracket: an oxidation state, which is a part of the name before it, a source, or anything else."""
    if place <= draft.skip:
        return
    if place == 0 and token.inner and token.inner[0].low == "from":
        draft.open("from", token.start)
        draft.phrase.substances += [item for part in read_phrases(token.inner) for item in part.substances]
        return
    state = len(token.inner) == 1 and token.inner[0].low in _STATES
    if state and draft.last is not None and draft.adjacent:
        draft.last.end = token.end
    else:
        _group(draft, place, token)


def _group(draft: PhraseDraft, place: int, token: Token) -> None:
    """Read a bracket: amounts of the name before it, conditions, a remark, or substances."""
    del place
    inner, phrase = token.inner, draft.phrase
    values = [item.figure for item in inner if item.figure is not None]
    amounts = [figure for figure in values if figure.is_amount]
    names = any(item.kind == "name" for item in inner)
    if _is_remark(inner, bool(amounts) or any(figure.kind in CONDITIONS for figure in values)):
        phrase.remarks.append((token.start, token.end))
        if not values:
            return
    phrase.conditions += [figure for figure in values if figure.kind in CONDITIONS]
    phrase.ratios += [figure for figure in values if figure.kind in ("ratio", "other", "length")]
    last = draft.last
    for figure in values:
        if figure.kind == "repeats" and last is not None and phrase.substances:
            last.repeated = figure
        elif figure.kind == "repeats":
            phrase.repeats, phrase.repeated = int(figure.value), figure
    if draft.pending and amounts and not names:
        draft.pending += amounts
    elif names and inner[0].low == "containing":
        for part in read_phrases(inner):
            phrase.substances += part.substances
    elif names and draft.paired:
        for part in read_phrases(inner):
            phrase.substances += part.substances
        draft.paired, draft.last = False, None
    elif last is None or (names and _stands_alone(draft, last, bool(amounts))):
        _free_group(draft, inner, names, amounts)
    else:
        _measure(draft, last, inner, names, amounts)


def _is_remark(inner: Sequence[Token], is_measured: bool) -> bool:
    verbs = any(item.kind == "verb" for item in inner)
    words = ("mw", "mw=", "prepared", "example", "from", "see", "or")
    formula = any(item.low in ("r", "r1", "r2", "wherein") for item in inner)
    said = any(item.low in words or item.low.startswith("mw=") for item in inner[:3])
    return said or ((verbs or formula) and not is_measured)


def _stands_alone(draft: PhraseDraft, last: SubstanceMention, has_amounts: bool) -> bool:
    """Return whether the names in a bracket are further substances: eluents after silica gel, a drying agent."""
    named = " ".join(token.low for token in draft.tokens if last.start <= token.start and token.end <= last.end)
    return named in STATIONARY or (not has_amounts and not last.is_measured and last.weak)


def _free_group(draft: PhraseDraft, inner: Sequence[Token], names: bool, amounts: list[QuantitySpan]) -> None:
    phrase = draft.phrase
    if names:
        for part in read_phrases(inner):
            if len(part.substances) == 1 and not part.is_measured:
                part.substances[0].amounts += part.loose
                part.loose = []
            phrase.substances += part.substances
            phrase.ratios += part.ratios
            phrase.loose += part.loose
    elif phrase.substances:
        phrase.substances[-1].amounts += amounts
    else:
        phrase.loose += amounts


def _measure(
    draft: PhraseDraft, last: SubstanceMention, inner: Sequence[Token], names: bool, amounts: list[QuantitySpan]
) -> None:
    """Give the amounts of a bracket to the name before it: "HCl (2 M in ether, 5 mL)"."""
    phrase = draft.phrase
    measured = [figure for figure in amounts if not (figure.kind == "percent" and _is_purity(inner, figure))]
    phrase.ratios += [figure for figure in amounts if figure not in measured]
    strong = any(figure.kind in STRENGTHS for figure in measured)
    words = [item.low for item in inner]
    dissolved = "in" in words
    if names and "oil" not in words and (dissolved or (strong and not SOLUTIONS.isdisjoint(words))):
        parts = [part for part in read_phrases(inner) if part.substances]
        solvent = next((part for part in parts if part.prep == "in" or not dissolved), None)
        stock = strong and not {"dispersion", "suspension"} & set(words)
        if solvent is not None and (stock or (not strong and solvent.is_measured)):
            dissolving = solvent.substances[0]
            dissolving.solvent = True
            if stock:
                dissolving.amounts = []
            measured = [figure for figure in measured if figure not in dissolving.amounts]
            phrase.substances.append(dissolving)
    mixed = phrase.mixed_with(last)
    if len(measured) == len(mixed) > 1 and len({figure.kind for figure in measured}) == 1:
        for item, figure in zip(mixed, measured, strict=True):
            item.amounts.append(figure)
    elif "each" in words:
        for item in phrase.substances:
            item.amounts += measured if item is last or not item.is_measured else []
    else:
        (last if mixed[0].is_measured else mixed[0]).amounts += measured
    draft.closed = bool(measured)
    last.words += [WORDS_OF_AMOUNT[word] for word in words if word in ("excess", "catalytic", "saturated")]
    draft.adjacent = True


def _is_purity(inner: Sequence[Token], figure: QuantitySpan) -> bool:
    words = [token.low for token in inner]
    place = next((k for k, token in enumerate(inner) if token.figure is figure), 0)
    after = words[place + 1] if place + 1 < len(words) else ""
    return "purity" in words[max(0, place - 2) : place] or after in ("ee", "pure", "purity")


_READERS = {
    "figure": _figure, "name": _name, "word": read_word, "verb": _verb, "mark": _mark, "group": _bracket,
}  # fmt: skip
