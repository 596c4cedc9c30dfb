"""Words: what a word that is no name means for the phrase in which it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from labgym.protocols.reading.lexicon import (
    BATCH,
    DETERMINERS,
    MANNERS,
    PREPOSITIONS,
    QUALITIES,
    SOLUTIONS,
    SOLVENT_ADJECTIVES,
    VESSELS,
    WORDS_OF_AMOUNT,
    is_code,
    is_stop,
)
from labgym.protocols.reading.mentions import STRENGTHS, PhraseDraft, SubstanceMention
from labgym.protocols.reading.tokens import Token

_ORIGINS = frozenset(("example", "step", "stage", "formula", "preparation", "structure", "intermediate"))
_CIRCUMSTANCES = frozenset(("vacuo", "vacuum", "reflux", "reduced", "high", "pressure"))
_METALS = frozenset(("palladium", "platinum", "rhodium", "ruthenium", "pd", "pt", "rh", "ru", "hydroxide", "catalyst"))
_SUPPORTS = frozenset(
    ("carbon", "charcoal", "activated", "alumina", "barium", "calcium", "c", "silica", "powdered", "caco3", "baso4")
)
_NAME_TAILS = frozenset(("gel", "earth", "ester", "salt", "dust", "reagent", "sieves"))
_LEAD_SALTS = frozenset(("acetate", "azide", "carbonate", "chloride", "iodide", "nitrate", "oxide", "sulfate"))
DEVICES = frozenset((
    "condenser", "funnel", "inlet", "mantle", "separator", "stirrer", "syringe", "thermometer", "trap", "tube",
))  # fmt: skip
_HOLDING = (["of"], ["containing"])
"""What stands behind the volume of a solution: "a solution (4 mL) of HCl in ether"."""
_TAILS = _NAME_TAILS | frozenset(
    ("example", "step", "formula", "free", "base", "charcoal", "catalyst", "oil", "powder", "solid")
)
"""Words behind a name: those that are a part of it, and others."""


@dataclass(frozen=True)
class Word:
    """A word at its place, in lower case without a full stop, with the word after it."""

    place: int
    token: Token
    low: str
    after: str


def read_word(draft: PhraseDraft, place: int, token: Token) -> None:
    """Read a word that is no name: the first rule that knows it decides."""
    if place <= draft.skip:
        return
    low = token.low if token.low in WORDS_OF_AMOUNT else token.low.rstrip(".")
    word = Word(place, token, low, draft.after(place))
    if not any(rule(draft, word) for rule in _RULES):
        draft.phrase.words.append(low)
        draft.adjacent = draft.adjacent and token.text[:1].isupper()


def _acid(draft: PhraseDraft, word: Word) -> bool:
    """Read a word that is a name before another one: "acetic acid", "lead nitrate"."""
    known = word.low.endswith("ic") and word.after in ("acid", "anhydride")
    known = known or (word.low == "lead" and word.after in _LEAD_SALTS)
    if known:
        draft.name(word.place, word.token, weak=False)
    return known


def _of(draft: PhraseDraft, word: Word) -> bool:
    if word.low != "of":
        return False
    last = draft.last
    following = draft.tokens[word.place + 1 : word.place + 3]
    joined = last is not None and not draft.separated
    if last is not None and joined and last.weak and len(following) == 2 and following[0].low in _ORIGINS:
        last.end = following[1].end
        draft.skip = word.place + 2
    elif joined and draft.adjacent and draft.phrase.solution is None and not draft.pending:
        draft.phrase.words.append("of")
    else:
        draft.adjacent = False
    return True


def _in(draft: PhraseDraft, word: Word) -> bool:
    """Read "in": what follows dissolves what the phrase has, unless it is a vessel or a bath."""
    phrase = draft.phrase
    if word.low != "in":
        return False
    if phrase.solution is not None and phrase.substances:
        draft.in_solvent = True
        draft.separate()
        return True
    if word.after in ("portions", "solution", "suspension"):
        if word.after == "portions":
            phrase.words.append("portionwise")
        draft.adjacent = False
        return True
    if phrase.substances and phrase.prep in ("", "to", "with", "of"):
        ahead = draft.tokens[word.place + 1 : word.place + 7]
        following = [item for item in ahead if item.low not in QUALITIES and item.low not in DETERMINERS]
        solvent = any(item.kind == "name" or item.low in SOLUTIONS for item in following[:5])
        if solvent and not any(item.low in VESSELS for item in following[:4]):
            draft.in_solvent = True
            draft.separate()
            return True
    return False


def _equipment(draft: PhraseDraft, word: Word) -> bool:
    if word.low not in ("equipped", "fitted", "provided"):
        return False
    breaks = [k for k in range(word.place, len(draft.tokens)) if draft.tokens[k].text in (",", ";")]
    ends = zip(breaks, [*breaks[1:], len(draft.tokens)], strict=False)
    end = next((first for first, last in ends if not _is_device(draft.tokens[first + 1 : last])), len(draft.tokens))
    draft.skip = end - 1
    draft.phrase.remarks.append((word.token.start, draft.tokens[end - 1].end))
    return True


def _is_device(tokens: Sequence[Token]) -> bool:
    """Return whether tokens name a further part of an apparatus: "and a water separator"."""
    named = any(token.kind == "name" for token in tokens) and not DEVICES & {token.low for token in tokens}
    return bool(tokens) and not named and not any(token.kind in ("figure", "group") for token in tokens)


def _such_as(draft: PhraseDraft, word: Word) -> bool:
    """Read "such as": the example takes the place of the class before it."""
    previous = draft.tokens[word.place - 1].low if word.place else ""
    if word.low == "such" and word.after == "as":
        draft.instead = draft.last is not None and (previous == "," or not draft.separated)
        return True
    return word.low == "as" and previous == "such"


def _conjunction(draft: PhraseDraft, word: Word) -> bool:
    if word.low in DETERMINERS and draft.is_ended():
        draft.open("", word.token.start)
    if word.low not in ("and", "or", "plus"):
        return False
    draft.separate()
    if word.low == "or":
        draft.phrase.words.append("or")
    return True


def _supported(draft: PhraseDraft, word: Word) -> bool:
    """Read "on" between a metal and its support as a part of the name: "palladium on carbon"."""
    previous = draft.tokens[word.place - 1].low if word.place else ""
    if word.low != "on" or previous not in _METALS or word.after not in _SUPPORTS:
        return False
    if draft.last is None or not draft.adjacent:
        return False
    draft.last.end, draft.skip = draft.tokens[word.place + 1].end, word.place + 1
    return True


def _preposition(draft: PhraseDraft, word: Word) -> bool:
    if word.low not in PREPOSITIONS:
        return False
    previous = draft.tokens[word.place - 1].low if word.place else ""
    if word.low == "from" and word.after in _ORIGINS and draft.last is not None:
        draft.skip = word.place + 2
        return True
    joins = word.low == "with" and previous in ("together", "along")
    if joins or (word.low == "containing" and (draft.phrase.solution is not None or draft.phrase.substances)):
        draft.separate()
    else:
        draft.open(word.low, word.token.start)
    return True


def _salt_solution(draft: PhraseDraft, word: Word) -> bool:
    """Read "solution" behind "salt" as a part of the name: brine."""
    known = word.low == "solution" and draft.last is not None and draft.adjacent
    if not known or draft.tokens[word.place - 1].low != "salt":
        return False
    assert draft.last is not None
    draft.last.end = word.token.end
    return True


def _solution_noun(draft: PhraseDraft, word: Word) -> bool:
    """Read "solution" and the like: it holds what follows "of", or it is a word for the batch."""
    phrase = draft.phrase
    if word.low not in SOLUTIONS:
        return False
    if draft.last is not None and draft.pending and {figure.kind for figure in draft.pending} == {"percent"}:
        if word.low in ("dispersion", "suspension") and word.after != "of":
            draft.last.amounts += draft.pending
            draft.pending = []
            return True
    if word.after in ("of", "containing", "obtained", "from") and (
        phrase.solution is None or draft.in_solvent or not phrase.substances
    ):
        if draft.last is not None and phrase.solution is None and not draft.separated:
            draft.last.solvent = True
        if not draft.in_solvent:
            phrase.solution = word.token
            strong = any(figure.kind in STRENGTHS for figure in draft.pending)
            phrase.is_stock = strong or "saturated" in draft.quality
            draft.solution_amounts += draft.pending
            draft.pending = []
        draft.separate()
        return True
    ahead = draft.tokens[word.place + 1 : word.place + 3]
    if draft.last is not None and phrase.solution is None and [item.low for item in ahead] == ["()", "of"]:
        if not draft.separated and not draft.last.is_measured:
            draft.last.solvent, phrase.solution = True, word.token
            return True
    if draft.last is None and phrase.solution is None and ahead and [item.low for item in ahead[1:]] in _HOLDING:
        volumes = [item.figure for item in ahead[0].inner if item.figure is not None]
        if len(volumes) == len(ahead[0].inner) == 1 and volumes[0].kind == "volume":
            phrase.solution, draft.skip = word.token, word.place + 1
            draft.solution_amounts += volumes
            return True
    if (word.after == "()" and phrase.solution is None and not phrase.substances) or draft.last is None:
        phrase.nouns.append(word.token.low)
    draft.adjacent = False
    return True


def _solvent_adjective(draft: PhraseDraft, word: Word) -> bool:
    if word.low not in SOLVENT_ADJECTIVES:
        return False
    following = draft.tokens[word.place + 1 : word.place + 2]
    if following and (following[0].low in SOLUTIONS or following[0].kind == "name"):
        adjective = SubstanceMention(word.token.start, word.token.end, [], [], False, True)
        if following[0].kind == "name":
            draft.adjective = adjective
        else:
            draft.phrase.substances.append(adjective)
    return True


def _strength(draft: PhraseDraft, word: Word) -> bool:
    if word.low not in WORDS_OF_AMOUNT:
        return False
    trailing = draft.last is not None and not draft.separated and word.after in SOLUTIONS
    if not (word.low in ("aqueous", "aq", "aq.") and trailing):
        draft.quality.append(WORDS_OF_AMOUNT[word.low])
        draft.adjacent = False
    return True


def _each(draft: PhraseDraft, word: Word) -> bool:
    """Read "each" behind an amount, which is then that of each name of the phrase."""
    if word.low != "each" or not draft.pending:
        return False
    draft.each, draft.adjacent = draft.pending[-1], False
    return True


def _batch(draft: PhraseDraft, word: Word) -> bool:
    if word.low not in BATCH and word.low not in VESSELS:
        return False
    if word.low != "volume" and draft.is_label(word.place):
        draft.name(word.place, word.token, weak=True)
    else:
        draft.phrase.nouns.append(word.low)
        draft.adjacent = False
    return True


def _quality_word(draft: PhraseDraft, word: Word) -> bool:
    known = word.low in MANNERS or word.low in _CIRCUMSTANCES or word.low in DETERMINERS or word.low in QUALITIES
    if known:
        draft.phrase.words.append(word.low)
        draft.adjacent = False
    return known


def _name_tail(draft: PhraseDraft, word: Word) -> bool:
    """Read a word or number behind a name: a part of it ("silica gel") or its number ("amine 12b")."""
    if draft.last is None or not draft.adjacent:
        return False
    if not (is_code(word.token.text) or word.low in _TAILS or word.token.text[:1].isdigit()):
        return False
    if word.low in _NAME_TAILS:
        draft.last.end = word.token.end
    return True


def _stop(draft: PhraseDraft, word: Word) -> bool:
    if not is_stop(word.low):
        return False
    draft.phrase.words.append(word.low)
    draft.adjacent = False
    if word.low in ("title", "desired", "titled") and word.after in BATCH and draft.is_result:
        draft.name(word.place, word.token, weak=True)
        draft.separated = False
    return True


def _unknown(draft: PhraseDraft, word: Word) -> bool:
    if draft.is_label(word.place):
        draft.name(word.place, word.token, weak=True)
        return True
    if draft.last is not None and draft.adjacent and not draft.separated and _ends_name(draft, word.place):
        draft.last.end = word.token.end
        return True
    return False


def _ends_name(draft: PhraseDraft, place: int) -> bool:
    """Return whether an unknown word after a name is its last one: "glycerol formal (5 g)"."""
    word = draft.tokens[place].text
    after = draft.tokens[place + 1] if place + 1 < len(draft.tokens) else None
    if draft.tokens[place - 1].kind != "name":
        return False
    closed = after is None or after.kind in ("group", "mark") or after.low in ("and", "or") or after.low in PREPOSITIONS
    return closed and len(word) > 3 and word.isalpha() and word.islower() and not word.endswith("ed")


_RULES = (
    _acid,
    _of,
    _in,
    _equipment,
    _such_as,
    _conjunction,
    _supported,
    _preposition,
    _salt_solution,
    _solution_noun,
    _solvent_adjective,
    _strength,
    _each,
    _batch,
    _quality_word,
    _name_tail,
    _stop,
    _unknown,
)
"""In order: the first that knows a word decides."""
