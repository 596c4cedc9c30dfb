"""Clauses: the operation words of a sentence, each with the tokens before and after it that belong to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from labgym.protocols.reading.lexicon import (
    AUXILIARIES,
    BATCH,
    DETERMINERS,
    MANNERS,
    PREPOSITIONS,
    QUALITIES,
    SOLUTIONS,
    VerbWord,
    is_stop,
)
from labgym.protocols.reading.tokens import Token

_PARTS = frozenset("organic aqueous organics combined precipitated ether ethereal separated collected undissolved".split())
_SKIPPED_ADVERBS = frozenset(
    "then also subsequently thus finally further again directly slowly carefully first next therein thereto thereafter quickly "
    "rapidly gradually vigorously immediately now so still thoroughly successively gently completely not initially briefly "
    "continuously evenly mainly only once twice separately being been progressively simultaneously almost".split()
) | frozenset(MANNERS)
_METHODS = frozenset(
    ("Purify", "Filter", "Concentrate", "Distill", "Chromatograph", "Recrystallize", "Crystallize", "Extract", "Triturate", "Hydrogenate", "Sublime")
)
_BY_METHOD = frozenset(
    "removed remove removing collected separated isolated recovered obtained purified purify filtered isolate eliminated "
    "concentrated subjected evaporated achieved accomplished carried".split()
)
_LET = frozenset("allowed left let leave allow allowing permitted continued left".split())
_BREAKS = frozenset(("and", ",", "then", "while", "but", "whereupon", "when", ":", "or"))
_HOLDING_NOUNS = frozenset("stirring heating cooling warming shaking agitation swirling refluxing boiling".split())


@dataclass(frozen=True)
class Head:
    """An operation word in a sentence.

    Attributes:
        place: index of its token.
        first: index of the first token of its group ("was then", "to", "by").
        passive: whether an auxiliary stands before it.
        marker: "to", "by", "after" and the like before it, or "".
        last: index of the last token of its group.
    """

    place: int
    first: int
    word: VerbWord
    low: str
    passive: bool = False
    marker: str = ""
    last: int = 0
    method: str = ""


@dataclass(frozen=True)
class Clause:
    """An operation word with the tokens before and after it that belong to it."""

    head: Head
    before: tuple[Token, ...]
    after: tuple[Token, ...]
    group: tuple[Token, ...] = ()


def clauses(tokens: Sequence[Token]) -> tuple[list[Clause], tuple[Token, ...]]:
    """Return the clauses of a sentence, and the tokens before the first if there is none."""
    heads = list(_heads(tokens))
    if not heads:
        return [], tuple(tokens)
    starts = [0]
    for earlier, later in zip(heads, heads[1:], strict=False):
        starts.append(_subject(tokens, earlier, later))
    starts.append(len(tokens))
    parts = []
    for number, head in enumerate(heads):
        before = tuple(tokens[starts[number] : head.first])
        after = tuple(tokens[head.last + 1 : starts[number + 1]])
        parts.append(Clause(head, before, after, tuple(tokens[head.first : head.last + 1])))
    return parts, ()


def _heads(tokens: Sequence[Token]) -> Iterator[Head]:
    found: list[Head] = []
    for place, token in enumerate(tokens):
        head = _head(tokens, place, token)
        if head is None:
            continue
        last = found[-1] if found else None
        if last is not None and head.low in ("addition", "adding") and head.marker == "by" and last.word.verb in ("Quench", "AdjustPH", "Crystallize"):
            continue
        if last is not None and _is_method(tokens, last, head):
            found[-1] = replace(last, word=head.word, last=head.place, method=head.low)
            continue
        if last is not None and _is_let(tokens, last, head):
            found[-1] = replace(head, first=last.first, passive=last.passive or head.passive, marker=last.marker)
            continue
        if last is not None and last.low in _HOLDING_NOUNS and head.low == "continued" and not _between(tokens, last, head, names=True):
            found[-1] = replace(last, last=head.place)
            continue
        found.append(head)
    yield from found


def _is_method(tokens: Sequence[Token], last: Head, head: Head) -> bool:
    """Return whether an operation says how another was done: "removed by filtration"."""
    between = tokens[last.place + 1 : head.place]
    lows = [token.low for token in between]
    if head.word.verb == "Chromatograph" and last.word.verb in ("Chromatograph", "Purify") and ("and" not in lows or head.low.startswith("elut")):
        return True
    if head.marker == "by" and head.low in ("addition", "adding") and last.word.verb in ("Quench", "AdjustPH", "Crystallize"):
        return False
    if last.low not in _BY_METHOD or head.word.verb not in _METHODS or len(between) > 12:
        return False
    if last.word.verb == "Yield" and head.word.verb not in ("Filter", "Chromatograph"):
        return False
    return any(low in ("by", "through", "to", "via", "under", "with", "out", "using") for low in lows) and not any(
        low in ("and", "then", "was", "were") for low in lows[-4:]
    ) and (head.word.noun or head.low.endswith("ing") or head.low in ("chromatography", "hplc"))


def _is_let(tokens: Sequence[Token], last: Head, head: Head) -> bool:
    between = [token.low for token in tokens[last.place + 1 : head.first]] + [head.marker]
    return last.low in _LET and head.marker == "to" and all(low in ("to", "") or low in _SKIPPED_ADVERBS for low in between)


def _between(tokens: Sequence[Token], last: Head, head: Head, names: bool) -> bool:
    return any(token.kind in ("name", "figure") for token in tokens[last.place + 1 : head.place]) if names else False


def _head(tokens: Sequence[Token], place: int, token: Token) -> Head | None:
    previous = tokens[place - 1].low if place else ""
    following = tokens[place + 1] if place + 1 < len(tokens) else None
    after = following.low if following is not None else ""
    if token.low == "followed" and after == "by":
        ahead = tokens[place + 2 : place + 5]
        if not any(item.kind == "verb" and item.low.endswith(("ing", "tion")) for item in ahead[:3]) and not any(
            item.low in ("tlc", "hplc", "lcms", "gc") for item in ahead
        ):
            return Head(place, place, VerbWord("Add", "theme"), "followed by", False, "followed", place + 1)
        return None
    if token.low == "reduced" and token.kind != "verb":
        first, passive, marker = _group(tokens, place)
        if passive and any(item.low in ("hydrogenation", "hydrogen") for item in tokens[place:]):
            return Head(place, first, VerbWord("Hydrogenate", "with"), token.low, passive, marker, place)
        return None
    if token.low in ("made", "make") and after in ("acid", "acidic", "basic", "alkaline", "neutral"):
        first, passive, marker = _group(tokens, place)
        return Head(place, first, VerbWord("AdjustPH", "with"), token.low, passive, marker, place + 1)
    if token.kind != "verb" or token.verb is None:
        return None
    word, low = token.verb, token.low
    first, passive, marker = _group(tokens, place)
    ed = low.endswith(("ed", "ing", "en", "ept", "eft", "eld", "ought", "ood", "ook", "ven", "ave", "ied", "put"))
    if word.noun:
        useful = marker in ("by", "after", "upon", "on", "following", "through", "via", "before", "to") or place == 0 or previous in ("flash", "column", "gel", "and", "silica", "further", "hplc", "prep", "preparative", "the", ",", "solvent", "using") or after == "of"
        if previous in ("without", "no", "for", "of", "end", "during") or after in ("was", "is", "process", "were", "apparatus", "flask", "column", "funnel", "step", "time", "rate", "solvent", "system"):
            useful = after in ("was", "is", "were") and tokens[place + 2 : place + 3] and tokens[place + 2].low in ("carried", "effected", "performed")
        if low in ("chromatographic", "addition") and after != "of" and low == "chromatographic":
            useful = False
        if low == "addition" and (after != "of" or marker not in ("by", "after", "upon", "on", "following", "with")) and previous not in ("the", "dropwise", "slow"):
            useful = False
        if low == "concentration" and after == "of":
            useful = False
        return Head(place, first, word, low, passive, marker, place) if useful else None
    if low in ("dry", "combine", "separate") and following is not None and (following.kind == "name" or following.low in BATCH) and not (place == 0 and low != "dry"):
        return None
    if low in ("sealed", "seal", "fitted", "equipped", "sealing"):
        return None
    if low in ("boiling", "boil", "boils") and not passive:
        return None
    if low in ("stand", "stands", "standing") and marker not in ("to", "on", "upon", "after", "for") and previous not in ("and",):
        return None
    if low in ("reflux",):
        return None if marker != "to" or previous in ("to", "at", "under", "gentle") and not _is_imperative(tokens, place) else Head(place, first, word, low, passive, marker, place)
    if low in ("taken",) and after == "up":
        return Head(place, first, word, low, passive, marker, place + 1)
    if low == "obtained" and (previous in ("thus", "so") or (not passive and (after in ("in", "from", "by", "as", "according", "above") or previous in BATCH))):
        return None
    if low in ("prepared",):
        return None
    if low in ("dilute", "diluted", "concentrated") and following is not None and following.kind == "name" and not passive:
        return None
    if low in _HOLDING_NOUNS:
        if after in ("continued", "was", "is"):
            return Head(place, first, word, low, passive, marker, place)
        if previous in ("with", "under", "while", "magnetic", "mechanical", "vigorous", "rapid", "constant", "efficient", "good", "gentle", "external", "oil-bath", "for", "and") and not (
            previous == "while" and after in ("at",)
        ) and not (previous in ("vigorous", "and") and marker in ("after", "by")):
            return None
        if marker == "" and previous not in ("", ",", "hours", "h", "min", "minutes") and not passive and place and tokens[place - 1].kind != "figure":
            if after not in ("was", "is", "at", "for", "continued", "in", "to"):
                return None
        return Head(place, first, word, low, passive, marker, place)
    if ed and not passive and following is not None:
        noun_next = following.kind in ("name",) or following.low in BATCH or following.low in SOLUTIONS or following.low in _PARTS or (following.kind == "word" and not is_stop(following.low) and following.low not in QUALITIES)
        before_noun = previous in DETERMINERS or previous in QUALITIES or previous == "" or previous in PREPOSITIONS or previous in ("and", ",", "resulting", "above")
        if noun_next and before_noun and not low.endswith("ing") and not (previous in ("and", ",") and following.kind == "name"):
            return None
        if low.endswith("ing") and noun_next and (previous in DETERMINERS or previous in QUALITIES):
            return None
        if previous in DETERMINERS and not low.endswith("ing"):
            return None
    if not ed:
        if low in ("yield", "yields", "extract", "extracts", "wash", "washes", "filter", "mix", "dilute", "heat", "cool", "cake", "concentrate", "add", "stir", "warm", "charge", "shake", "precipitate", "precipitates", "rise", "raise", "quench", "dry", "strip", "distill", "elute", "evaporate", "pour", "adjust", "get", "give", "gave", "gives", "afford", "affords", "provide", "provides", "put", "result", "remove", "purify", "isolate", "collect", "transfer", "dissolve", "keep", "hold", "leave", "place", "let", "treat", "react", "monitor", "separate", "introduce", "combine", "suspend", "slurry", "triturate", "crystallize", "recrystallize", "crystallise", "recrystallise", "acidify", "basify", "neutralize", "obtain", "recover", "furnish", "produce", "deliver", "stand", "age", "purge", "degas", "flush", "evacuate", "sonicate", "irradiate", "partition", "allow", "continue", "maintain", "reflux", "load", "inject", "bring", "sit", "repeat"):
            finite = low in ("gave", "gives", "affords", "provides", "yields")
            if not (marker == "to" or finite or _is_imperative(tokens, place)):
                if low in ("yield", "afford", "give", "provide", "furnish") and after not in ("of", "(", "()", ")") and previous not in DETERMINERS and tokens[place - 1].kind != "figure" and previous != "in":
                    return Head(place, first, word, low, passive, marker, place)
                return None
            if finite and previous in DETERMINERS:
                return None
            if following is not None and after in AUXILIARIES:
                return None
    return Head(place, first, word, low, passive, marker, place)


def _is_imperative(tokens: Sequence[Token], place: int) -> bool:
    """Return whether a verb begins its clause: "Add water and stir"."""
    k = place - 1
    while k >= 0 and (tokens[k].low in _SKIPPED_ADVERBS or tokens[k].low in ("please",)):
        k -= 1
    return k < 0 or tokens[k].low in ("and", ",", "then", ":")


def _group(tokens: Sequence[Token], place: int) -> tuple[int, bool, str]:
    """Return the first index of a verb's group, whether it is passive, and the word that marks it."""
    k, passive, marker = place - 1, False, ""
    while k >= 0 and place - k < 7:
        low = tokens[k].low
        if low in AUXILIARIES or low in ("being",):
            passive = True
        elif low in _SKIPPED_ADVERBS or (low in QUALITIES and low.endswith("ly")):
            pass
        else:
            break
        k -= 1
    low = tokens[k].low if k >= 0 else ""
    if low in ("to", "by", "after", "before", "upon", "on", "while", "via", "through", "without", "following", "when", "for", "until"):
        marker = low
        k -= 1
        if k >= 0 and tokens[k].low in ("followed", "so", "order"):
            k -= 1
    return k + 1, passive, marker


def _subject(tokens: Sequence[Token], earlier: Head, later: Head) -> int:
    """Return where the tokens that belong to the later of two operations begin."""
    stop = earlier.last + 1
    if later.marker in ("after", "before", "when", "while", "upon", "on", "to", "by", "through", "via", "followed", "until"):
        return _without_break(tokens, max(stop, later.first), stop)
    k = later.first
    segment = _break_before(tokens, k, stop)
    if not later.passive:
        inside = [token for token in tokens[segment:k] if token.kind != "mark"]
        own = inside and inside[0].kind != "verb" and not any(token.low in PREPOSITIONS and token.low not in ("of",) for token in inside[:1])
        subject = own and segment > stop and (inside[0].low in DETERMINERS or inside[0].low in BATCH or inside[0].low in SOLUTIONS or inside[-1].low in BATCH)
        if subject:
            return _without_break(tokens, segment, stop)
        if later.low.endswith("ing") or later.first != later.place:
            return _without_break(tokens, max(stop, k), stop)
        return _without_break(tokens, max(stop, k), stop)
    while segment > stop:
        previous = _break_before(tokens, segment - 1, stop)
        item = tokens[previous:segment]
        lows = [token.low for token in item]
        plain = bool(item) and previous > stop and not any(
            token.figure is not None and token.figure.kind in ("time", "temperature", "ph") for token in item
        )
        prepositions = [k for k, low in enumerate(lows) if low in PREPOSITIONS and low not in ("of", "in")]
        governed = prepositions or (
            "in" in lows and not any(low in SOLUTIONS for low in lows) and not any(t.kind == "name" for t in item[: lows.index("in")])
        )
        if plain and not governed and any(token.kind in ("name", "figure", "group") for token in item):
            segment = previous
        else:
            break
    if segment <= stop and not any(low in _BREAKS for low in (token.low for token in tokens[stop:k])):
        # No break between two verbs: the subject is the last noun phrase before the auxiliary.
        return k
    return segment


def _break_before(tokens: Sequence[Token], k: int, stop: int) -> int:
    """Return the index behind the last break before a place, or `stop`."""
    place = k - 1
    while place >= stop:
        if tokens[place].low in _BREAKS:
            return place + 1
        place -= 1
    return stop


def _without_break(tokens: Sequence[Token], k: int, stop: int) -> int:
    while k - 1 >= stop and tokens[k - 1].low in ("and", ",", "then", "thus", "followed", ";"):
        k -= 1
    return k
