"""Heads: which words of a sentence name an operation that is done, and which are adjectives, nouns or manners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

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

_PARTS = frozenset((
    "organic", "aqueous", "organics", "combined", "precipitated", "ether", "ethereal", "separated", "collected",
    "undissolved",
))  # fmt: skip
_SKIPPED_ADVERBS = frozenset((
    "then", "also", "subsequently", "thus", "finally", "further", "again", "directly", "slowly", "carefully",
    "first", "next", "therein", "thereto", "thereafter", "quickly", "rapidly", "gradually", "vigorously",
    "immediately", "now", "so", "still", "thoroughly", "successively", "gently", "completely", "not", "initially",
    "briefly", "continuously", "evenly", "mainly", "only", "once", "twice", "separately", "being", "been",
    "progressively", "simultaneously", "almost",
)) | frozenset(MANNERS)  # fmt: skip
_METHODS = frozenset((
    "Purify", "Filter", "Concentrate", "Distill", "Chromatograph", "Recrystallize", "Crystallize", "Extract",
    "Triturate", "Hydrogenate", "Sublime",
))  # fmt: skip
_BY_METHOD = frozenset((
    "removed", "remove", "removing", "removal", "collected", "separated", "isolated", "recovered", "obtained",
    "purified", "purify", "filtered", "isolate", "eliminated", "concentrated", "subjected", "evaporated", "achieved",
    "accomplished", "carried",
))  # fmt: skip
_OBTAINED = frozenset(("obtained", "given", "produced", "generated"))
_SUPPLIERS = frozenset((
    "aldrich", "sigma", "sigma-aldrich", "fluka", "merck", "tci", "acros", "alfa", "commercial", "commercially",
    "supplier", "suppliers",
))  # fmt: skip
_FORMING = frozenset(("Dissolve", "MakeSolution", "Crystallize", "PhaseSeparation"))
"""Operations whose words also say what happens by itself."""
_LET = frozenset(["allowed", "left", "let", "leave", "allow", "allowing", "permitted", "continued", "left"])
_HOLDING_NOUNS = frozenset(
    ["stirring", "heating", "cooling", "warming", "shaking", "agitation", "swirling", "refluxing", "boiling"]
)

_PARTICIPLES = ("ed", "ing", "en", "ept", "eft", "eld", "ought", "ood", "ook", "ven", "ave", "ied", "put")
_RUN = ("run", "carried", "conducted", "performed")
"""Words that say that a reaction goes on."""
_PAIRS = {
    ("reaction", "of"): VerbWord("Add", "with", True),
    ("dropped", "into"): VerbWord("Add", "theme"),
    **{("weighed", word): VerbWord("Add", "theme") for word in ("out", "in", "into")},
}
"""Words that name an operation by the word behind them; nouns at the begin of a sentence."""
_PADS = frozenset((
    "pad", "plug", "bed", "silica", "celite", "celite®", "alumina", "filter", "frit", "cotton", "norite", "florisil",
))  # fmt: skip
_DRIED_IN = frozenset(("air", "vacuum", "oven", "suction"))
"""Words before "dried" that say how."""
_STANDS = frozenset(("stand", "stands", "standing"))
_NOUN_PARTNERS = frozenset((
    "was", "is", "process", "were", "apparatus", "flask", "column", "funnel", "step", "time", "rate", "solvent",
    "system",
))  # fmt: skip
_NOUN_QUALIFIERS = frozenset((
    "flash", "column", "gel", "and", "silica", "further", "hplc", "prep", "preparative", "the", ",", "solvent",
    "using",
))  # fmt: skip
_MARKERS = frozenset((
    "to", "by", "after", "before", "upon", "on", "while", "via", "through", "without", "following", "when", "for",
    "until",
))  # fmt: skip
"""Words before an operation word that say how it stands to the rest of the sentence."""
_MANNER_WORDS = frozenset((
    "with", "under", "while", "magnetic", "mechanical", "vigorous", "rapid", "constant", "efficient", "good",
    "gentle", "external", "oil-bath", "for", "and",
))  # fmt: skip


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


def heads(tokens: Sequence[Token]) -> list[Head]:
    """Return the operation words of a sentence; words that describe one operation are one head."""
    found: list[Head] = []
    for place, token in enumerate(tokens):
        head = _head(tokens, place, token)
        if head is None:
            continue
        last = found[-1] if found else None
        if (
            last is not None
            and head.low in ("addition", "adding", "treatment")
            and head.marker == "by"
            and last.word.verb in ("Quench", "AdjustPH", "Crystallize")
        ):
            continue
        if last is not None and last.word.verb == "Purge" and head.marker == "by":
            continue
        if last is not None and last.word.verb in ("Extract", "Wash") and head.low == "shaking" and head.marker == "by":
            found[-1] = replace(last, last=head.place)
            continue
        if last is not None and last.low == "separated" and head.low == "purified" and head.place == last.place + 2:
            found[-1] = replace(head, first=last.first, passive=last.passive)
            continue
        if last is not None and _is_method(tokens, last, head):
            found[-1] = replace(last, word=head.word, last=head.place, method=head.low)
            continue
        if last is not None and _is_let(tokens, last, head):
            found[-1] = replace(head, first=last.first, passive=last.passive or head.passive, marker=last.marker)
            continue
        if (
            last is not None
            and last.low in _HOLDING_NOUNS
            and head.low == "continued"
            and not any(item.kind in ("name", "figure") for item in tokens[last.place + 1 : head.place])
        ):
            found[-1] = replace(last, last=head.place)
            continue
        found.append(head)
    return found


def _is_method(tokens: Sequence[Token], last: Head, head: Head) -> bool:
    """Return whether an operation says how another was done: "removed by filtration"."""
    between = tokens[last.place + 1 : head.place]
    lows = [token.low for token in between]
    if (
        head.word.verb == "Chromatograph"
        and last.word.verb in ("Chromatograph", "Purify")
        and ("and" not in lows or head.low.startswith("elut"))
    ):
        return True
    if last.low not in _BY_METHOD or head.word.verb not in _METHODS or len(between) > 12:
        return False
    if last.word.verb == "Yield" and head.word.verb not in ("Filter", "Chromatograph"):
        return False
    return (
        any(low in ("by", "through", "to", "via", "under", "with", "out", "using") for low in lows)
        and not any(low in ("and", "then", "was", "were") for low in lows[-4:])
        and (head.word.noun or head.low.endswith("ing") or head.low in ("chromatography", "hplc"))
    )


def _is_let(tokens: Sequence[Token], last: Head, head: Head) -> bool:
    between = [token.low for token in tokens[last.place + 1 : head.first]] + [head.marker]
    return (
        last.low in _LET
        and head.marker == "to"
        and all(low in ("to", "") or low in _SKIPPED_ADVERBS for low in between)
    )


@dataclass(frozen=True)
class _Place:
    """An operation word with its neighbors in lower case."""

    tokens: Sequence[Token]
    place: int
    token: Token
    previous: str
    after: str
    following: Token | None
    first: int
    passive: bool
    marker: str

    @property
    def low(self) -> str:
        return self.token.low

    def head(self, word: VerbWord, last: int | None = None) -> Head:
        return Head(
            self.place, self.first, word, self.low, self.passive, self.marker, self.place if last is None else last
        )


def _head(tokens: Sequence[Token], place: int, token: Token) -> Head | None:
    """Return the head that a token is, or None if it names no operation here."""
    if token.kind not in ("verb", "figure") and token.low not in (
        "followed",
        "reduced",
        "made",
        "make",
        "rendered",
        "reaction",
        "dropped",
        *_RUN,
    ):
        return None
    first, passive, marker = _group(tokens, place)
    at = _Place(
        tokens,
        place,
        token,
        tokens[place - 1].low if place else "",
        tokens[place + 1].low if place + 1 < len(tokens) else "",
        tokens[place + 1] if place + 1 < len(tokens) else None,
        first,
        passive,
        marker,
    )
    special = _special(at)
    if special is not None:
        return special
    if token.kind != "verb" or token.verb is None or token.low == "followed":
        return None
    if token.verb.noun:
        return at.head(token.verb) if _is_useful_noun(at) else None
    if _is_idle(at):
        return None
    if token.low in _HOLDING_NOUNS:
        return at.head(token.verb) if _is_holding(at) else None
    ed = token.low.endswith(_PARTICIPLES) and token.low != "yield"
    if (_is_adjective(at, token.verb) if ed else _is_noun(at)) and not _gives(at):
        return None
    return at.head(token.verb, place + 1 if token.low in ("take", "taken", "taking") and at.after == "up" else None)


def _special(at: _Place) -> Head | None:
    """Return the head of words that are no verbs by themselves: "followed by", "made acid", "pH adjusted to 7"."""
    token, rest = at.token, at.tokens[at.place + 1 :]
    goes_on = token.low in _RUN and at.passive and _lasts(at)
    pair = VerbWord("Wait", "hold") if goes_on else _PAIRS.get((token.low, at.after))
    if pair is not None and (at.place == 0 or not pair.noun):
        return at.head(pair)
    if token.low == "followed" and at.after == "by":
        if not any(item.kind == "verb" for item in at.tokens[: at.place]) and any(
            item.low == "added" and earlier.low in AUXILIARIES for earlier, item in pairwise(rest)
        ):
            return None
        verbs = any(item.kind == "verb" and item.low.endswith(("ing", "tion")) for item in rest[1:4])
        if verbs or any(item.low in ("tlc", "hplc", "lcms", "gc") for item in rest[1:4]):
            return None
        add = VerbWord("Add", "theme")
        return Head(at.place, at.place, add, "followed by", False, "followed", at.place + 1)
    if token.low in ("pass", "passed", "passing") and at.after in ("through", "over"):
        ahead = {item.low for item in rest[1:7]}
        if ahead & {"column", "cartridge"}:
            return at.head(VerbWord("Chromatograph", "over"))
        return at.head(VerbWord("Filter", "over")) if ahead & _PADS else None
    if token.low in ("leaving", "leave", "left") and not at.passive and _leaves(at):
        return at.head(VerbWord("Yield", "result"))
    figure = token.figure
    if (
        figure is not None
        and figure.kind == "ph"
        and (
            any(word in token.low for word in ("adjusted", "brought", "made"))
            or at.previous == "made"
            or (at.previous == "to" and at.tokens[at.place - 2].low in ("taken", "brought"))
        )
    ):
        return Head(at.place, at.place, VerbWord("AdjustPH", "with"), "adjusted", True, "", at.place - 1)
    if token.low == "reduced" and at.passive and any(item.low in ("hydrogenation", "hydrogen") for item in rest):
        return at.head(VerbWord("Hydrogenate", "with"))
    if token.low in ("made", "make", "rendered") and at.after in ("acid", "acidic", "basic", "alkaline", "neutral"):
        return at.head(VerbWord("AdjustPH", "with"), at.place + 1)
    if token.low == "chromatography" and at.previous in ("thin-layer", "layer"):
        return Head(at.place, at.place, VerbWord("Monitor", "none", True), token.low, False, "", at.place)
    return None


def _lasts(at: _Place) -> bool:
    """Return whether a reaction is said to last at a place or a temperature: "was run in a microwave for 1 h"."""
    ahead = at.tokens[at.place + 1 : at.place + 12]
    stop = next((k for k, item in enumerate(ahead) if item.kind == "verb" or item.text in ",;"), len(ahead))
    times = [item for item in ahead[:stop] if item.figure is not None and item.figure.kind == "time"]
    begins = next((item.low for item in ahead if item.low != "out"), "")
    noun = any(item.kind == "verb" for item in at.tokens[max(0, at.first - 2) : at.first])
    return bool(times) and begins in ("at", "for", "in", "under", "over") and not noun


def _leaves(at: _Place) -> bool:
    """Return whether a mass of what an operation leaves follows: "leaving 2 g of an oil"."""
    for item in at.tokens[at.place + 1 : at.place + 9]:
        parts = item.inner if item.kind == "group" else (item,)
        if any(part.figure is not None and part.figure.kind == "mass" for part in parts):
            return True
        if item.kind in ("mark", "figure", "verb") or (item.low in PREPOSITIONS and item.low not in ("of", "as")):
            return False
    return False


def _is_useful_noun(at: _Place) -> bool:
    """Return whether a noun stands for an operation that is done: "by filtration", not "without purification"."""
    low = at.low
    if at.previous in ("without", "no", "for", "of", "end", "during") or at.after in _NOUN_PARTNERS:
        ahead = [item.low for item in at.tokens[at.place + 2 : at.place + 4] if item.low not in _SKIPPED_ADVERBS]
        done = ahead[:1] in (["carried"], ["effected"], ["performed"])
        return at.after in ("was", "is", "were") and done and low not in ("chromatographic", "addition")
    before = [item.low for item in at.tokens[max(0, at.place - 3) : at.place]]
    if "without" in before or before[1:] == ["no", "further"]:
        return False
    if before[1:] == ["of", "the"] and before[0] in ("completion", "end", "course", "conclusion"):
        return False
    if low == "chromatographic" or (low == "concentration" and at.after == "of" and at.marker != "after"):
        return False
    if low == "addition":
        earlier = at.tokens[at.place - 2].low if at.place > 1 else ""
        if at.previous in ("the", "a", "dropwise", "slow") and earlier in ("for", "of", "during", "throughout"):
            return False
        begun = at.after == "of" and at.marker in ("by", "after", "upon", "on", "following", "with")
        return begun or at.previous in ("the", "dropwise", "slow") or (at.place == 0 and at.after == "of")
    near = [item.low for item in at.tokens[max(0, at.place - 5) : at.place]]
    return (
        _gives_product(at)
        or any(word in ("by", "via", "through") for word in near)
        or at.marker in ("by", "after", "upon", "on", "following", "through", "via", "before", "to")
        or at.place == 0
        or at.previous in _NOUN_QUALIFIERS
        or at.after == "of"
    )


def _gives_product(at: _Place) -> bool:
    """Return whether a noun is the subject of a result: "bulb-to-bulb distillation (80 C) afforded"."""
    for item in at.tokens[at.place + 1 : at.place + 12]:
        if item.kind == "verb" or item.text == "," or item.low in AUXILIARIES:
            return item.verb is not None and item.verb.verb == "Yield" and not item.low.endswith("ing")
    return False


def _is_idle(at: _Place) -> bool:
    """Return whether an operation word names no operation here, whatever its form."""
    low, following = at.low, at.following
    named = following is not None and following.kind == "name"
    batch = following is not None and following.low in BATCH
    return (
        (low in ("dry", "combine", "separate") and (named or batch) and not (at.place == 0 and low != "dry"))
        or (low == "provided" and at.after == "with")
        or (low.startswith("weigh") and at.passive)
        or (low in ("take", "taking") and not any(item.low == "up" for item in at.tokens[at.place : at.place + 9]))
        or (low in ("absorbed", "adsorbed") and at.after not in ("on", "onto", "in", "into"))
        or (low.startswith("pass") and at.after not in ("into", "in", "through"))
        or low in ("sealed", "seal", "fitted", "equipped", "sealing", "prepared")
        or (low in ("boiling", "boil", "boils") and not at.passive)
        or (low == "separating" and (at.previous == "phase" or at.after in ("funnel", "paper", "cartridge")))
        or (low in _STANDS and at.marker not in ("to", "on", "upon", "after", "for") and at.previous != "and")
        or (low == "reflux" and not _is_refluxed(at))
        or (low in _OBTAINED and (_is_attribute(at) or _is_bought(at)))
        or (((at.token.verb is not None and at.token.verb.verb in _FORMING) or low == "collected") and _is_observed(at))
        or (low == "dried" and following is not None and following.text.endswith("%"))
        or (low == "saturated" and at.after not in ("with", "by"))
        or (low in ("dilute", "diluted", "concentrated") and named and not at.passive)
    )


def _is_refluxed(at: _Place) -> bool:
    attribute = at.previous in ("to", "at", "under", "gentle") and not _is_imperative(at.tokens, at.place)
    return at.marker == "to" and not attribute


def _is_attribute(at: _Place) -> bool:
    """Return whether "obtained" belongs to a noun: "the residue thus obtained", "the solid obtained in Step A"."""
    source = at.after in ("in", "from", "by", "as", "according", "above") or at.previous in BATCH
    if at.low != "obtained":
        ahead = at.tokens[at.place + 2].low if at.place + 2 < len(at.tokens) else ""
        elsewhere = at.after == "in" and ahead in ("example", "step", "preparation", "reference")
        source = elsewhere or at.after in ("above", "previously", "earlier")
    return at.previous in ("thus", "so") or (not at.passive and source)


def _is_bought(at: _Place) -> bool:
    """Return whether "obtained" says where a material was bought: "was obtained from Aldrich"."""
    ahead = [item.low for item in at.tokens[at.place + 1 : at.place + 5]]
    return bool(ahead) and ahead[0] in ("from", "commercially") and bool(_SUPPLIERS & set(ahead))


def _is_observed(at: _Place) -> bool:
    """Return whether words say what happens by itself: "the oil which separated", "until the sodium dissolved"."""
    near = [item.low for item in at.tokens[max(0, at.first - 8) : at.first]]
    if near and near[-1] in ("observed", "found", "seen"):
        return True
    if near and near[-1] in ("which", "that"):
        return at.after not in ("from", "in", "with", "by")
    for low in reversed(near):
        if low in (",", "and"):
            return False
        if low in ("until", "till"):
            return True
    return False


def _is_holding(at: _Place) -> bool:
    """Return whether "stirring" and the like are an operation, not the manner of another one."""
    if at.after in ("continued", "was", "is"):
        return True
    if at.after in ("mantle", "bath", "jacket", "plate"):
        return False
    after_time = at.previous in ("vigorous", "and") and at.marker in ("after", "by")
    if at.previous in _MANNER_WORDS and not (at.previous == "while" and at.after == "at") and not after_time:
        return False
    alone = at.previous not in ("", ",", "hours", "h", "min", "minutes") and at.place > 0
    if at.marker == "" and alone and not at.passive and at.tokens[at.place - 1].kind != "figure":
        return at.after in ("was", "is", "at", "for", "continued", "in", "to")
    return True


def _is_adjective(at: _Place, word: VerbWord) -> bool:
    """Return whether a participle belongs to the noun after it: "the combined organic layers"."""
    following = at.following
    if at.passive or following is None:
        return False
    if at.place == 0 and not any(item.low in AUXILIARIES for item in at.tokens):
        return False
    noun = (
        following.kind == "name"
        or following.low in BATCH
        or following.low in SOLUTIONS
        or following.low in _PARTS
        or (following.kind == "word" and not is_stop(following.low) and following.low not in QUALITIES)
    )
    determined = at.previous in DETERMINERS or at.previous in QUALITIES
    if at.low.endswith("ing"):
        return noun and (at.previous in DETERMINERS or (determined and word.verb != "Yield"))
    listed = at.previous in ("and", ",")
    begun = (
        determined
        or at.previous == ""
        or at.previous in PREPOSITIONS
        or listed
        or at.previous in ("resulting", "above", "added")
        or (
            following.kind == "name"
            and any(t.kind == "figure" for t in at.tokens[max(0, at.place - 2) : at.place] if t.text != ",")
        )
    )
    if noun and begun and not (listed and following.kind == "name"):
        return True
    return at.previous in DETERMINERS and word.verb != "Yield"


def _is_noun(at: _Place) -> bool:
    """Return whether a word without an ending is a noun: "the extract", not "Extract with ether"."""
    finite = at.low in ("gave", "gives", "affords", "provides", "yields", "raises", "rises", "rose", "dissolves")
    if not (at.marker == "to" or finite or _is_imperative(at.tokens, at.place)):
        return True
    return (finite and at.previous in DETERMINERS) or (at.following is not None and at.after in AUXILIARIES)


def _gives(at: _Place) -> bool:
    """Return whether a present tense names a result: "which afford the amine"."""
    noun = at.after in ("of", "(", "()", ")") or at.previous in DETERMINERS or at.previous == "in"
    present = at.low in ("yield", "afford", "give", "provide", "furnish")
    finite = at.marker == "to" or _is_imperative(at.tokens, at.place)
    return present and not finite and not noun and at.tokens[at.place - 1].kind != "figure"


def _is_imperative(tokens: Sequence[Token], place: int) -> bool:
    """Return whether a verb begins its clause: "Add water and stir"."""
    k = place - 1
    if k >= 0 and tokens[k].low == "then":
        return True
    while k >= 0 and (tokens[k].low in _SKIPPED_ADVERBS or tokens[k].low in ("please",)):
        k -= 1
    if k >= 1 and tokens[k].low in ("it", "this", "which") and tokens[k - 1].low == "to":
        return True
    return k < 0 or tokens[k].low in ("and", ",", "then", ":")


def _group(tokens: Sequence[Token], place: int) -> tuple[int, bool, str]:
    """Return the first index of a verb's group, whether it is passive, and the word that marks it."""
    k, passive, marker = place - 1, False, ""
    while k >= 0 and place - k < 7:
        low = tokens[k].low
        if low in AUXILIARIES or low in ("being",):
            passive = True
        elif not (
            low in _SKIPPED_ADVERBS
            or (low in QUALITIES and low.endswith("ly"))
            or (low in _DRIED_IN and tokens[k + 1].low == "dried")
        ):
            break
        k -= 1
    low = tokens[k].low if k >= 0 else ""
    verb = tokens[place].verb
    if low == "the" and k and verb is not None and verb.noun and tokens[k - 1].low in ("after", "before", "following"):
        k -= 1
        low = tokens[k].low
    if low in _MARKERS:
        marker = low
        k -= 1
        if k >= 0 and tokens[k].low in ("followed", "so", "order"):
            k -= 1
    return k + 1, passive, marker
