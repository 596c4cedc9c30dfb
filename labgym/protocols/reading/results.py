"""Results: the product that an operation gives, with its name or label, its mass, its moles and its yield."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.protocols.experiments.model import Portion
from labgym.protocols.reading.draft import EXTRACTS, LAYERS, ActionDraft, PhrasedOperation, conditions, lows, substances
from labgym.protocols.reading.figures import figures
from labgym.protocols.reading.lexicon import SOLUTIONS
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.phrases import read_phrases
from labgym.protocols.reading.separations import collect
from labgym.protocols.reading.stated import mercury, single, written
from labgym.protocols.reading.tokens import Token

_RESULTS = frozenset(("mass", "substance", "percent", "volume", "parts"))
"""Kinds of figures that say how much of a product there is."""
_UNFINISHED = frozenset((
    "precipitate", "residue", "suspension", "slurry", "solution", "mixture", "phase", "layer", "layers",
))  # fmt: skip
"""What an operation leaves that is no product by itself."""
_BEFORE_RESULTS = frozenset((
    "Chromatograph", "Concentrate", "Crystallize", "Distill", "DrySolid", "Filter", "Recrystallize", "Sublime",
))  # fmt: skip
"""Operations behind which a mass with a name is that of their product."""
_LABELS = frozenset((
    "product", "compound", "products", "material", "oil", "solid", "crystals", "powder", "foam", "residue",
))  # fmt: skip
_LABEL_QUALITIES = frozenset(("title", "desired", "titled", "above", "expected", "target"))


def give(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append a result, if the text names the product or its amount."""
    head, clause = operation.head, operation.clause
    behind = [item for phrase in operation.after[:1] if not phrase.prep for item in phrase.substances]
    is_inverted = not substances(operation.before) and any(item.is_measured for item in behind)
    is_before = head.passive and not is_inverted and "there" not in lows(clause.before[-1:])
    source, tokens = (operation.before, clause.before) if is_before else (operation.after, clause.after)
    others = operation.after if is_before else []
    phrases = [*source, *others]
    named = substances(phrase for phrase in source if phrase.prep in ("", "of", "as", "for"))
    if head.low.startswith(("isolat", "recover", "separat")) and lows(clause.before) & (LAYERS | EXTRACTS):
        collect(draft, operation)
        return
    if head.low.startswith(("isolat", "recover", "separat")) and not named:
        return
    if head.passive:
        used = [item for phrase in others if phrase.prep in ("from", "by", "with") for item in phrase.substances]
        if any(item.is_measured for item in used):
            draft.put("Add", used)
        others = [phrase for phrase in others if phrase.prep not in ("from", "by", "with")]
    if not head.passive:
        draft.charge([phrase for phrase in operation.before if phrase.prep == "" and phrase.is_prepared])
    main = _named_result(source, tokens) or named[:1]
    loose = [value for phrase in phrases for value in phrase.loose if value.kind in _RESULTS]
    draft.own_all(substances(phrases))
    if not main:
        if not loose:
            return
        main = [SubstanceMention(loose[0].start, loose[0].end)]
    name = draft.plain[main[0].start : main[0].end].lower()
    if not main[0].amounts and not loose and name in _UNFINISHED:
        return
    extra = [value for item in named if item not in main for value in item.amounts]
    extra += [value for item in substances(others) for value in item.amounts]
    known = {value.start for item in main for value in item.amounts}
    more = [value for value in (*loose, *extra) if value.start not in known and value.kind in _RESULTS]
    main[0].amounts += [value for k, value in enumerate(more) if value not in more[:k]]
    held = conditions(phrases)
    draft.own_all(held)
    if draft.last_verb == "Distill" and held and draft.actions[-1].temperature is None:
        draft.actions[-1] = draft.actions[-1].model_copy(update=single(held))
    draft.own_all(ratio for phrase in phrases for ratio in phrase.ratios)
    gives = tuple(draft.yielded(item) for item in main)[:10]
    is_named = main[0].start not in {item.start for item in loose}
    draft.product, draft.result = gives[0].name if is_named else "", gives[0].amount
    start, end = operation.span
    draft.emit("Yield", (min(start, main[0].start), max(end, main[-1].end)), gives=gives)


def give_alone(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Append the result that a sentence without an operation names: "The oily product (78.4 g) was pure"."""
    subject = read_phrases(tokens, True)[0]
    if subject.prep != "" or not draft.actions:
        return
    for item in subject.substances:
        kinds = {value.kind for value in item.amounts}
        if kinds & {"mass", "percent"}:
            named = draft.last_verb in _BEFORE_RESULTS and len(subject.substances) == 1
            named = named or not {"product", "residue"}.isdisjoint(subject.nouns)
            named = named or not {"used", "form", "melting"}.isdisjoint(lows(tokens))
            if item.weak or named or {"mass", "percent"} <= kinds:
                draft.emit("Yield", (item.start, item.end), gives=(draft.yielded(item),))
            return


def complete(draft: ActionDraft, span: tuple[int, int]) -> bool:
    """Return whether data belong to the last actions, and put them there: a boiling range, or the yield."""
    words = draft.plain[slice(*span)].lstrip(" ,;:(").lower().removeprefix("the ")
    values = figures(draft.plain[slice(*span)])
    actions = draft.actions
    if (
        words.startswith(("yield", "weight", "overall crude yield"))
        and draft.last_verb == "Yield"
        and actions[-1].gives
    ):
        first, *rest = actions[-1].gives
        told = {item.kind: written(item) for item in reversed(values) if item.kind in ("mass", "percent")}
        more = [
            told[kind]
            for kind, unit in (("mass", " g"), ("percent", " %"))
            if kind in told and unit not in first.amount
        ]
        if more:
            stated = ", ".join(filter(None, (first.amount, *more)))
            gives = (first.model_copy(update={"amount": stated[:200]}), *rest)
            actions[-1] = actions[-1].model_copy(update={"gives": gives})
        return True
    measured = [item for item in values if item.kind in ("mass", "percent")]
    if words.startswith(("yield", "weight")) and measured and actions and actions[-1].verb not in ("Analyze", "Refers"):
        product = Portion(name="product", amount=", ".join(map(written, measured[:2])), assumed=True)
        draft.emit("Yield", span, gives=(product,), assumed=("gives",))
        return True
    if words.startswith(("b.p", "bp", "boiling", "b. p")):
        near = range(len(actions) - 1, max(-1, len(actions) - 4), -1)
        place = next((k for k in near if actions[k].verb == "Distill"), None)
        if place is not None:
            ranges = [
                mercury(item) for item in values if item.kind in ("temperature", "pressure") or item.text.endswith("mm")
            ]
            actions[place] = actions[place].model_copy(update=single(ranges))
            return True
    return False


def _named_result(source: Sequence[TextPhrase], tokens: Sequence[Token]) -> list[SubstanceMention]:
    """Return the products that a result names: with a mass, else the first name, else its label."""
    direct = substances(phrase for phrase in source if phrase.prep in ("", "of"))
    main = [item for item in direct if any(value.kind in ("mass", "substance") for value in item.amounts)]
    main = main or direct[:1]
    label = product_label(tokens)
    if label is None:
        return main
    if not main:
        return [SubstanceMention(*label)]
    first = main[0]
    overlaps = label[0] <= first.start < label[1] or label[0] <= first.end <= label[1]
    if not overlaps and first.start < label[1]:
        return main
    between = {token.low for token in tokens if label[1] <= token.start < first.start}
    named = not first.weak and first.start >= label[1]
    if named and (first.is_measured or not between & {"as", "in", "with", "which", "from", "having"}):
        return main
    return [SubstanceMention(label[0], label[1], [value for item in main for value in item.amounts])]


def product_label(tokens: Sequence[Token]) -> tuple[int, int] | None:
    """Return the span of a product's label: "title compound", "product of formula I"."""
    for place, token in enumerate(tokens[:10]):
        if token.low in ("as", "with", "which", "in") or token.low in SOLUTIONS:
            return None
        if token.low in _LABELS:
            first, last = place, place
            ahead = [item.low for item in tokens[place + 1 : place + 3]]
            if ahead[:1] == ["of"] and ahead[1:] and ahead[1] in ("formula", "structure", "example"):
                last = min(place + 3, len(tokens) - 1)
            while first and tokens[first - 1].low in _LABEL_QUALITIES:
                first -= 1
            return tokens[first].start, tokens[last].end
        if token.kind == "name":
            return None
    return None
