"""Clauses: the operation words of a sentence, each with the tokens before and after it that belong to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from labgym.protocols.reading.heads import Head, heads
from labgym.protocols.reading.lexicon import BATCH, DETERMINERS, PREPOSITIONS, SOLUTIONS, WORDS_OF_AMOUNT
from labgym.protocols.reading.tokens import Token

_BREAKS = frozenset(("and", ",", "then", "while", "but", "whereupon", "whereby", "when", "before", ":", "or"))
_NOMINAL = frozenset(("name", "figure", "group"))
"""Kinds of tokens of which a subject with a substance consists."""
_SUBORDINATES = frozenset((
    "after", "before", "when", "while", "upon", "on", "to", "by", "through", "via", "followed", "until",
))  # fmt: skip
"""Markers of an operation that begins its own clause; nothing before it is its subject."""


@dataclass(frozen=True)
class VerbClause:
    """An operation word with the tokens before and after it that belong to it."""

    head: Head
    before: tuple[Token, ...]
    after: tuple[Token, ...]
    group: tuple[Token, ...] = ()


def clauses(tokens: Sequence[Token]) -> list[VerbClause]:
    """Return the clauses of a sentence, in the order in which they are done."""
    operations = heads(tokens)
    starts = [0, *(_start(tokens, earlier, later) for earlier, later in pairwise(operations)), len(tokens)]
    parts = []
    for head, start, stop in zip(operations, starts, starts[1:], strict=False):
        before, after = tuple(tokens[start : head.first]), tuple(tokens[head.last + 1 : stop])
        parts.append(VerbClause(head, before, after, tuple(tokens[head.first : head.last + 1])))
    return _with_results_last(_with_earlier_first(_reordered(parts), tokens))


def _reordered(parts: list[VerbClause]) -> list[VerbClause]:
    """Return clauses with what is done before a result put before it: "to give, after evaporation, 3 g of X"."""
    for k in range(len(parts) - 1):
        result, insert = parts[k], parts[k + 1]
        empty = all(token.kind == "mark" for token in result.after)
        if (
            result.head.word.verb == "Yield"
            and not result.head.passive
            and empty
            and insert.head.marker in ("after", "upon")
        ):
            cut = next((n for n, token in enumerate(insert.after) if token.text == ","), None)
            if cut is not None:
                parts[k] = replace(insert, after=insert.after[:cut])
                parts[k + 1] = replace(result, after=insert.after[cut + 1 :])
    return parts


def _with_earlier_first(parts: list[VerbClause], tokens: Sequence[Token]) -> list[VerbClause]:
    """Return clauses with what is done first put first: "before adding A, it was cooled", "A was added after B".

    What is added while something is stirred comes before the stirring.
    """
    if len(parts) < 2:
        return parts
    begin = [token.low for token in tokens[: parts[0].head.place]]
    if begin[:1] == ["before"] or begin[:2] == ["prior", "to"]:
        return [parts[1], parts[0], *parts[2:]]
    for k in range(len(parts) - 1):
        head, made = parts[k + 1].head, any(token.figure is not None for token in parts[k].before)
        if head.low == "adding" and head.marker == "while" and parts[k].head.word.frame == "hold" and not made:
            parts[k : k + 2] = [parts[k + 1], parts[k]]
    head = parts[-1].head
    joint = tokens[head.first - 1].low if head.first else ""
    if head.marker in ("after", "following") and joint not in ("and", "then", ";", "but"):
        return [*parts[:-2], parts[-1], parts[-2]]
    return parts


def _with_results_last(parts: list[VerbClause]) -> list[VerbClause]:
    """Return clauses with a product behind what makes it: "B was obtained from A (2 g) by treatment with C"."""
    for k in range(len(parts) - 1):
        result, making = parts[k], parts[k + 1]
        if result.head.word.verb == "Yield" and result.head.passive and making.head.marker in ("by", "via", "through"):
            source = result.after
            if source and source[0].low == "from":
                making = replace(making, head=replace(making.head, marker=""), before=source[1:])
                source = ()
            parts[k : k + 2] = [making, replace(result, after=source)]
    return parts


def is_state(tokens: Sequence[Token], earlier: VerbClause, later: VerbClause) -> bool:
    """Return whether a clause says how what something is added to is held: "A was added to B, previously cooled"."""
    head = later.head
    before = tokens[head.first - 1] if head.first else None
    return (
        before is not None
        and head.word.verb in ("Cool", "Heat", "Stir", "SetTemperature", "Wait")
        and head.low.endswith(("ed", "held", "kept"))
        and not head.passive
        and head.marker == ""
        and (before.kind in _NOMINAL or before.low in ("previously", "already", "beforehand"))
        and earlier.head.word.frame == "theme"
        and any(token.low == "to" for token in earlier.after)
    )


def _start(tokens: Sequence[Token], earlier: Head, later: Head) -> int:
    """Return where the tokens that belong to the later of two operations begin."""
    stop = earlier.last + 1
    if later.marker in _SUBORDINATES:
        return _without_break(tokens, max(stop, later.first), stop)
    segment = _break_before(tokens, later.first, stop)
    if later.passive:
        start = _passive_start(tokens, segment, stop, later.first)
        first = tokens[stop]
        taken = first.kind == "name" or (first.figure is not None and first.figure.is_amount)
        return stop if start == later.first > stop and earlier.low == "cooling" and taken else start
    if later.low in ("added", "introduced", "obtained") and _is_elided(tokens, segment, stop, later):
        return _passive_start(tokens, segment, stop, later.first)
    own = segment > stop and _is_subject([token for token in tokens[segment : later.first] if token.kind != "mark"])
    return _without_break(tokens, segment if own else max(stop, later.first), stop)


def _is_elided(tokens: Sequence[Token], segment: int, stop: int, later: Head) -> bool:
    """Return whether a participle has a subject and lacks its auxiliary: "and 20 mL of water added"."""
    behind = tokens[later.last + 1] if later.last + 1 < len(tokens) else None
    subject = [token for token in tokens[segment : later.first] if token.kind != "mark"]
    closed = behind is None or behind.kind == "mark" or behind.low in ("and", "dropwise") or behind.low in PREPOSITIONS
    begins = bool(subject) and (subject[0].kind in _NOMINAL or subject[0].low in WORDS_OF_AMOUNT)
    return segment > stop and closed and begins


def _is_subject(item: Sequence[Token]) -> bool:
    """Return whether the tokens between a break and an active verb are its subject: "the solid precipitates"."""
    if not item or item[0].kind == "verb" or (item[0].low in PREPOSITIONS and item[0].low != "of"):
        return False
    first = item[0].low
    return first in DETERMINERS or first in BATCH or first in SOLUTIONS or item[-1].low in BATCH


def _passive_start(tokens: Sequence[Token], segment: int, stop: int, place: int) -> int:
    """Return where the subjects of a passive verb begin: "A, B and C were added"."""
    if segment == place and tokens[place - 1].low in ("and", "then"):
        return place
    while segment > stop:
        current = [token for token in tokens[segment:place] if token.kind != "mark"]
        if current and not any(token.kind in _NOMINAL for token in current):
            break
        previous = _break_before(tokens, segment - 1, stop)
        if previous > stop and all(token.low in ("and", "then") for token in tokens[previous:segment]):
            segment = previous
            continue
        if previous <= stop or not _is_listed(tokens[previous:segment]):
            break
        segment = previous
    if segment <= stop and not any(token.low in _BREAKS for token in tokens[stop:place]):
        # No break between two verbs: the subject is the last noun phrase before the auxiliary.
        return place
    return segment


def _is_listed(item: Sequence[Token]) -> bool:
    """Return whether tokens between two breaks are a further subject, not a circumstance of the verb before."""
    if any(token.figure is not None and token.figure.kind in ("time", "temperature", "ph") for token in item):
        return False
    lows = [token.low for token in item]
    if any(low in PREPOSITIONS and low not in ("of", "in") for low in lows):
        return False
    if "in" in lows and not any(low in SOLUTIONS for low in lows):
        if not any(token.kind == "name" for token in item[: lows.index("in")]):
            return False
    return any(token.kind in _NOMINAL for token in item)


def _break_before(tokens: Sequence[Token], k: int, stop: int) -> int:
    """Return the index behind the last break before a place, or `stop`."""
    place = k - 1
    while place >= stop:
        figure = tokens[place].figure
        held = figure is not None and figure.kind in ("temperature", "time") and place + 1 < len(tokens)
        if held and tokens[place + 1].low in DETERMINERS:
            return place + 1
        if tokens[place].low in _BREAKS and not _joins(tokens, place):
            return place + 1
        place -= 1
    return stop


def _joins(tokens: Sequence[Token], place: int) -> bool:
    """Return whether a colon stands between two liquids of a mixture: "dichloromethane:methanol"."""
    token, following = tokens[place], tokens[place + 1] if place + 1 < len(tokens) else None
    return (
        token.low == ":"
        and following is not None
        and place > 0
        and (tokens[place - 1].end == token.start and following.start == token.end)
    )


def _without_break(tokens: Sequence[Token], k: int, stop: int) -> int:
    while k - 1 >= stop and tokens[k - 1].low in ("and", ",", "then", "thus", "followed", ";"):
        k -= 1
    return k
