"""Observed: what a text tells of the batch besides the operations: its mass, what it reaches by itself, its gas.

What no operation took is given to the action that stands before it, so that the protocol carries it: a mass behind a
word for the batch is what that action yields, a temperature that the mixture reaches is its note.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile

from labgym.protocols.experiments.model import Action, Portion, Verb
from labgym.protocols.reading.draft import ASIDE, ActionDraft
from labgym.protocols.reading.lexicon import BATCH, GASES, SOLID, VESSELS
from labgym.protocols.reading.mentions import CONDITIONS, MEASURES
from labgym.protocols.reading.stated import written
from labgym.protocols.reading.tokens import Token, leaves

_RESULTS = ("mass", "substance", "percent")
_LEAVING: frozenset[Verb] = frozenset((
    "Chromatograph", "Concentrate", "Crystallize", "Distill", "DrySolid", "DrySolution", "Filter", "Purify",
    "Recrystallize", "Sublime", "Triturate", "Wash", "Yield",
))  # fmt: skip
"""Operations behind which the batch may be weighed."""
_FORMS = (BATCH | SOLID | {"form", "material"}) - VESSELS - {"catalyst", "phase", "layer", "solvent", "reaction"}
_GAS_WORDS = frozenset(("of", "with", "under", "for", "through", "passing", "by", "in", "slow", "an", "the", "dry"))
"""Words before a gas that stands above the mixture."""
_WEIGHED = frozenset(("yield", "yields", "yielded", "wgt.", "wgt", "wt.", "weight", "crop", "collected", "weighed"))
"""Words in whose reach a mass is of the product."""
_REACHED = re.compile(
    r"increas|ris(?:e|es|ing)$|rose|reach|exceed|exotherm|f[ea]ll|drop(?:s|ped)$|maxim|subsid|solidif|occur|complet"
    r"|melt|decompos|crystalli|uptake|evol|absor|turn|becam|becom|appear|lighten"
)
"""Words for what a mixture does by itself."""
_MIXING: frozenset[Verb] = frozenset(("Chromatograph", "Crystallize", "Recrystallize"))
"""Operations of which a bracket names a liquid or a solid that they use."""
_ELUTING = frozenset(("with", "using", "by", "then", "and", "/", ":", "-", "", "eluent", "eluant", "of", "in", "("))
"""Words before an eluent."""
_SHARE = re.compile(r"[\d.]+(?:[:/-][\d.]+)*%?$")
_STRONG = re.compile(r"[\d.]+ ?[mn]$")
_GIVEN = frozenset((
    "obtained", "leaving", "leaves", "leave", "left", "crystallizes", "crystallises", "crystallized", "separates",
    "remains", "form", "formed", "isolated", "precipitates", "results", "had", "recovered",
))  # fmt: skip
"""Words with which a text names its product."""
_SOURCES = frozenset(("by", "from", "with", "in", "and", "after", "using", "to"))
"""Words behind which a name is no product."""
REACH = 12
"""Tokens over which a word for what happens governs a figure."""


def place_observed(draft: ActionDraft, tokens: Sequence[Token], token: Token) -> bool:
    """Give what no operation states to the action before it, and return whether it belongs there.

    Args:
        draft: its actions change.
        tokens: of the sentence.
        token: a figure or a name that no action owns.
    """
    before = [k for k, action in enumerate(draft.actions) if action.span is not None and action.span[0] <= token.start]
    if token.kind == "name" and draft.actions and _prewash(draft, tokens, token):
        return True
    if not before:
        return False
    if token.low in GASES and token.low not in ("hydrogen", "h2", "air"):
        return _cover(draft, before[-1], tokens, token)
    if token.figure is None:
        return token.kind == "name" and any(rule(draft, before[-1], tokens, token) for rule in _NAMES)
    if token.figure.kind in CONDITIONS:
        return _note(draft, before[-1], tokens, token)
    return token.figure.kind in _RESULTS and _weigh(draft, before[-1], tokens, token)


def _cover(draft: ActionDraft, place: int, tokens: Sequence[Token], token: Token) -> bool:
    """Set the gas above the mixture, "in a stream of nitrogen", unless it is one of several names."""
    at = next((k for k, item in enumerate(tokens) if item is token), 0)
    beside = {item.kind for item in tokens[at + 1 : at + 2]}
    if not at or tokens[at - 1].low not in _GAS_WORDS or beside & {"name", "figure", "group"}:
        return False
    if draft.actions[place].atmosphere is None:
        draft.actions[place] = draft.actions[place].model_copy(update={"atmosphere": GASES[token.low]})
    draft.own(token.start, token.end)
    return True


def _run(tokens: Sequence[Token], token: Token) -> tuple[str, int, int, list[Token]]:
    """Return the word before the name that a token begins, its span, and the tokens behind it."""
    flat = list(leaves(tokens))
    at = next(k for k, item in enumerate(flat) if item is token)
    stop = next((k for k in range(at, len(flat)) if flat[k].kind != "name"), len(flat))
    return (flat[at - 1].low if at else ""), token.start, flat[stop - 1].end, flat[stop:]


def _take(draft: ActionDraft, place: int, start: int, end: int) -> Portion:
    draft.own(start, end)
    name = draft.text[start:end][:200]
    draft.roles.setdefault(name, "solvent" if draft.actions[place].verb == "Add" else "workup")
    return Portion(name=name, span=(start, end))


def _elute(draft: ActionDraft, place: int, tokens: Sequence[Token], token: Token) -> bool:
    """Add an eluent to the chromatography before it, a liquid to a list of washes, a solvent to its stock solution."""
    last = draft.actions[place]
    before, start, end, rest = _run(tokens, token)
    measured = bool(rest) and rest[0].figure is not None and rest[0].figure.kind in ("mass", "substance")
    inside = last.span is not None and last.span[0] >= tokens[0].start
    if measured or not inside:
        return False
    bracketed = last.verb in _MIXING and any(token in item.inner for item in tokens)
    if bracketed or (last.verb == "Chromatograph" and (before in _ELUTING or _SHARE.match(before))):
        more = (*last.takes, _take(draft, place, start, end))
        draft.actions[place] = last.model_copy(update={"takes": more[:30]})
    elif last.verb == "Wash" and before == "and":
        again = Action(verb="Wash", takes=(_take(draft, place, start, end),), span=(start, end), part=last.part)
        draft.actions.insert(place + 1, again)
    elif (
        (before == "in" or _STRONG.match(before))
        and last.takes
        and re.search(r" of (?:a )?[\d.]+ [M%]", last.takes[-1].amount)
    ):
        more = (*last.takes, _take(draft, place, start, end))
        draft.actions[place] = last.model_copy(update={"takes": more[:30]})
    else:
        return False
    return True


def _prewash(draft: ActionDraft, tokens: Sequence[Token], token: Token) -> bool:
    """Insert the wash of a solid before it is used: "sodium hydride (80 mg, prewashed with hexane)"."""
    group = next((item for item in tokens if token in item.inner), None)
    if group is None or not any(item.low.startswith(("prewash", "pre-wash")) for item in group.inner):
        return False
    _, start, end, _ = _run(tokens, token)
    spans = [[part.span for part in action.takes if part.span] for action in draft.actions]
    near = [(group.start - span[1], k) for k, part in enumerate(spans) for span in part if span[1] <= group.start]
    if not near:
        return False
    at = min(near)[1]
    solid = draft.actions[at].takes[0].name
    washed = Action(verb="Wash", takes=(_take(draft, at, start, end),), span=(start, end), note=f"of {solid} alone")
    draft.actions.insert(at, washed)
    return True


def _result(draft: ActionDraft, place: int, tokens: Sequence[Token], token: Token) -> bool:
    """Append the product that a sentence without its amount names at its end: "evaporated, leaving the ester"."""
    _, start, end, rest = _run(tokens, token)
    ahead = list(takewhile(lambda item: item.low not in _SOURCES, rest))
    earlier = takewhile(lambda item: item.low not in _SOURCES, reversed([item for item in tokens if item.end < start]))
    giving = next((item.low for item in (*earlier, *ahead) if item.kind == "verb" or item.low in _GIVEN), "")
    measured = any(item.figure is not None and item.figure.kind in MEASURES for item in leaves(rest))
    if draft.actions[place].verb not in _LEAVING or measured or giving not in _GIVEN:
        return False
    gives = (Portion(name=draft.text[start:end][:200], span=(start, end)),)
    draft.actions.insert(place + 1, Action(verb="Yield", gives=gives, span=(start, end)))
    draft.product = draft.product or gives[0].name
    draft.own(start, end)
    return True


def _note(draft: ActionDraft, place: int, tokens: Sequence[Token], token: Token) -> bool:
    """Note what a mixture reaches by itself: "the temperature rises to 45 C", "solidified slowly at -20 C"."""
    flat = list(leaves(tokens))
    at = next((k for k, item in enumerate(flat) if item is token), 0)
    words: list[Token] = []
    for item in reversed(flat[max(0, at - REACH) : at]):
        words.append(item)
        if _REACHED.match(item.low):
            start = words[-1].start
            text = " ".join(draft.text[start : token.end].split())
            _annotate(draft, place, text)
            draft.own(token.start, token.end, ASIDE)
            return True
        if item.kind == "verb" or item.text in ",;":
            break
    return False


def _annotate(draft: ActionDraft, place: int, text: str) -> None:
    action = draft.actions[place]
    note = "; ".join(filter(None, (action.note, text)))
    draft.actions[place] = action.model_copy(update={"note": note[:400]})


def _weigh(draft: ActionDraft, place: int, tokens: Sequence[Token], token: Token) -> bool:
    """Append the result that a mass behind a word for the batch tells: "in the form of a white solid (3.4 g, 80%)"."""
    coming = draft.actions[place + 1].verb if place + 1 < len(draft.actions) else ""
    if draft.actions[place].verb not in _LEAVING and coming != "Filter":
        return False
    at = next((k for k, item in enumerate(tokens) if item.start <= token.start < item.end), 0)
    inner = tokens[at].inner if tokens[at].kind == "group" else (tokens[at], *leaves(tokens[at + 1 : at + 2]))
    words = [item.low for item in tokens[max(0, at - 4) : at]]
    batch = tokens[at].kind == "group" and words[-1:] and words[-1] in _FORMS | _GIVEN
    weighed = not _WEIGHED.isdisjoint(words) and not any(item.kind == "name" for item in tokens[at + 1 : at + 4])
    if not (batch or weighed) or not {"portion", "aliquot", "part", "sample"}.isdisjoint(words):
        return False
    figures = [item.figure for item in inner if item.figure is not None and item.figure.kind in _RESULTS]
    if not any(figure.kind == "mass" for figure in figures):
        return False
    name = next((item for item in reversed(tokens[:at]) if item.low in _FORMS), tokens[at])
    stated = ", ".join(dict.fromkeys(map(written, figures)))
    portion = Portion(name=draft.text[name.start : name.end][:200], amount=stated[:200], span=(name.start, name.end))
    span = (min(name.start, figures[0].start), figures[-1].end)
    draft.actions.insert(place + 1, Action(verb="Yield", gives=(portion,), span=span))
    for figure in figures:
        draft.own(figure.start, figure.end, ASIDE)
    return True


_NAMES = (_elute, _result)
"""What a name without an amount may be; the first that knows it decides."""
