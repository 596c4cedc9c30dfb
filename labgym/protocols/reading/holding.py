"""Holding: operations that keep the mixture at conditions for a time: stirring, heating, cooling, waiting, purging."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from labgym.protocols.experiments.model import Portion, Verb
from labgym.protocols.reading.draft import ActionDraft, PhrasedOperation, lows, substances, with_substances
from labgym.protocols.reading.lexicon import GASES
from labgym.protocols.reading.stated import single
from labgym.protocols.reading.tokens import Token

_REACHING = frozenset(("reach", "attain", "come", "return", "equilibrate", "adapt"))


def hold(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an operation that holds the mixture at conditions, after what goes into it."""
    head, clause, held = operation.head, operation.clause, operation.conditions
    bare = head.low in ("stirring", "heating", "cooling") and not head.passive and head.marker == ""
    if bare and not held and not clause.after:
        return
    during = head.marker != "after" and draft.last_verb in ("Add", "Quench", "Pour")
    if head.low in ("keeping", "maintaining", "holding") and held and during:
        draft.own_all(held)
        last = draft.actions[-1]
        lacking = {key: value for key, value in single(held).items() if getattr(last, key) is None}
        note = "; ".join(filter(None, (last.note, ", ".join(item.text for item in held))))
        draft.actions[-1] = last.model_copy(update={**lacking, "note": note[:400]})
        return
    _fill(draft, operation)
    if clause.before and clause.before[0].low in ("while", "whilst") and not held:
        return
    verb = _holding_verb(operation)
    if verb is None or (verb == "AdjustPH" and is_adjusted(draft, operation)):
        return
    hydrogen = hydrogen_in(clause.after)
    if verb == "Stir" and hydrogen is not None:
        span = (hydrogen.start, hydrogen.end)
        draft.own(*span)
        draft.act("Hydrogenate", operation, [Portion(name=draft.text[slice(*span)], span=span)])
        return
    fields: dict[str, Any] = {"atmosphere": _purging_gas(draft, operation)} if verb == "Purge" else {}
    if verb == "Wait" and not held and head.low in ("left", "let", "leave", "leaving", "continued"):
        return
    agents = with_substances(operation.after, "over")
    if verb == "Stir" and agents and draft.last_verb in ("Wash", "Extract", "CollectLayer"):
        draft.act("DrySolution", operation, draft.portions(agents))
        return
    _add(draft, operation, verb)
    if verb == "AdjustPH":
        fields["takes"] = draft.portions(with_substances(operation.after, "with", "by", "using", "of"))
    if lows(clause.after) & {"until", "till"}:
        draft.own_all(clause.after)
    kinds = [item.kind for item in held]
    if (
        verb == "Reflux"
        and operation.verb != verb
        and kinds[-1:] == ["time"]
        and {"temperature", "time"} <= {*kinds[:-1]}
    ):
        draft.emit(operation.verb, operation.span, held=held[:-1])
        draft.emit(verb, operation.span, held=held[-1:], phrases=operation.phrases, **fields)
    else:
        draft.act(verb, operation, **fields)


def hydrogen_in(tokens: Sequence[Token]) -> Token | None:
    """Return where tokens name hydrogen, which is no part of another name: "hydrogen chloride"."""
    free = (a for a, b in zip_longest(tokens, tokens[1:]) if b is None or b.kind != "name")
    return next((token for token in free if token is not None and token.low in ("hydrogen", "h2")), None)


def wait(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append the period that a clause begins with: "After 30 min, water was added"."""
    head, before = operation.head, operation.before
    if head.word.frame == "hold" and head.low.endswith("ing"):
        return
    later = any(word in ("later", "after") for phrase in before for word in phrase.words)
    for phrase in before:
        timed = any(item.kind == "time" for item in phrase.conditions)
        if timed and (phrase.prep == "after" or (phrase.prep == "" and later)):
            near = [
                other for other in before if other is phrase or (other.prep in ("at", "under") and other.conditions)
            ]
            words = {*phrase.words, *phrase.nouns}
            verb: Verb = "Reflux" if words & {"reflux", "refluxing"} else "Stir" if "stirring" in words else "Wait"
            draft.emit(verb, (phrase.start, phrase.end), held=[item for other in near for item in other.conditions])
            for other in near:
                other.conditions = []


def _fill(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append what the mixture is made of, if the text names it with the operation."""
    head = operation.head
    medium = [phrase for phrase in operation.after if phrase.prep in ("with", "in") and phrase.is_measured]
    subject = [phrase for phrase in operation.before if phrase.prep == "" and phrase.is_measured]
    if medium and subject and head.passive and all(phrase.solution is None for phrase in (*medium, *subject)):
        items = substances((*subject, *medium))
        for phrase in medium:
            phrase.substances = []
        draft.put("MakeSolution", items)
    elif head.marker in ("by", "upon", "on") and any(item.is_measured for item in operation.after):
        stirred = [item for item in operation.after if item.prep in ("", "in") and item.substances]
        draft.charge(stirred)
        for phrase in stirred:
            phrase.substances = []
    elif head.passive or head.marker not in ("by", "after", "upon", "on", "to", "while"):
        held = [phrase for phrase in operation.before if phrase.prep in ("", "of", "to", "in", "into")]
        draft.charge(held, always=not draft.actions)


def _holding_verb(operation: PhrasedOperation) -> Verb | None:
    """Return the verb that a holding word means with its conditions, or None if it is no operation."""
    verb, low, after = operation.verb, operation.head.low, operation.clause.after
    held = {item.kind for item in operation.conditions}
    named = any("reflux" in (*phrase.words, *phrase.nouns) for phrase in operation.after)
    reflux = named or bool(lows((*operation.clause.group, *after[:5])) & {"reflux", "refluxing"})
    ahead = lows(after[:6])
    if verb in ("Heat", "Wait", "SetTemperature", "Stir") and reflux:
        return "Reflux"
    if verb == "Wait" and ahead & {"stirring", "agitation", "shaking"}:
        return "Stir"
    if verb == "Wait" and low in ("allowed", "left", "let", "allow") and "temperature" in held and ahead & _REACHING:
        return "SetTemperature"
    if verb == "SetTemperature" and "ph" in held:
        return "AdjustPH"
    near = (*operation.clause.before, *after)
    if (verb == "Irradiate" or low == "run") and any("microwave" in token.low for token in near):
        return "Microwave"
    return None if verb == "SetTemperature" and "temperature" not in held else verb


def is_adjusted(draft: ActionDraft, operation: PhrasedOperation) -> bool:
    """Merge a pH with the addition before it, and return whether there is one: "was added to bring the pH to 6"."""
    if operation.head.marker != "to" or draft.last_verb != "Add":
        return False
    held = operation.conditions
    draft.own_all(held)
    draft.actions[-1] = draft.actions[-1].model_copy(update={**single(held), "verb": "AdjustPH"})
    return True


def _purging_gas(draft: ActionDraft, operation: PhrasedOperation) -> str | None:
    names = [token for token in operation.clause.after if token.low in GASES]
    draft.own_all(names)
    return GASES[names[0].low] if names else "vacuum" if operation.head.low.startswith("evac") else None


def _add(draft: ActionDraft, operation: PhrasedOperation, verb: Verb) -> None:
    """Append what is added with a holding word: "shaken with water"."""
    if verb not in ("Stir", "Heat", "Wait", "Reflux", "Irradiate", "Cool"):
        return
    shaken = operation.head.low.startswith(("shak", "stir", "agitat", "heat", "reflux", "boil", "swirl"))
    takes: list[Portion] = []
    for phrase in operation.after:
        named = bool(phrase.substances) and shaken and phrase.prep == "with" and not phrase.substances[0].weak
        medium = (
            phrase.prep == "in" and bool(phrase.substances) and "bath" not in phrase.words and "ice" not in phrase.words
        )
        medium = medium and shaken and not any(item.weak for item in phrase.substances)
        if phrase.prep not in ("with", "in") or not (phrase.is_measured or named or medium):
            continue
        if phrase.is_prepared:
            draft.make(phrase)
        else:
            takes += draft.portions([phrase])
    if takes and takes[0].span is not None and takes[-1].span is not None:
        draft.emit("Add", (takes[0].span[0], takes[-1].span[1]), takes)
