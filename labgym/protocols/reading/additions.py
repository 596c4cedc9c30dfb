"""Additions: operations that put something into the mixture, or bring it together with a liquid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, takewhile

from labgym.protocols.experiments.model import Period, Portion, Verb
from labgym.protocols.reading.draft import (
    EXTRACTS,
    LAYERS,
    ActionDraft,
    PhrasedOperation,
    conditions,
    lows,
    ratios,
    substances,
    with_substances,
)
from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.heads import Head
from labgym.protocols.reading.holding import hydrogen_in
from labgym.protocols.reading.lexicon import BATCH, SOLID, SOLUTIONS
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.phrases import read_phrases
from labgym.protocols.reading.separations import collect
from labgym.protocols.reading.stated import held_at
from labgym.protocols.reading.tokens import Token

_PARTS = LAYERS | EXTRACTS | {"filtrates"}
_BATCHES = frozenset(("mixture", "solution", "reaction", "residue", "suspension", "slurry"))
_PRODUCTS = SOLID | {"product", "filtrate"}
_MIXING = ("combin", "mix", "plac", "blend", "admix", "put", "introduc")
"""Beginnings of words behind which "in" names a solvent that is added, too."""


def add(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an addition, or what follows a wash or an eluent: "washed with water, followed by brine"."""
    if operation.head.marker == "followed" and draft.last_verb in ("Wash", "Extract", "Chromatograph"):
        draft.act(draft.actions[-1].verb, operation, draft.portions(operation.after), ratios(operation.after))
        return
    if operation.head.low.startswith("bubbl") and not substances(operation.phrases):
        draft.act("Purge", operation)
        return
    gas = hydrogen_in(operation.clause.after)
    pressed = any(item.kind == "pressure" for item in operation.conditions)
    if operation.head.low.startswith("plac") and gas is not None and pressed:
        draft.act("Hydrogenate", operation, [draft.portion(SubstanceMention(gas.start, gas.end))])
        return
    operation = replace(operation, before=_behind_batch(operation))
    made = [phrase for phrase in operation.after if _is_precipitated(phrase)]
    _bring(draft, replace(operation, after=[phrase for phrase in operation.after if phrase not in made]))
    for item in substances(made):
        draft.emit("Yield", (item.start, item.end), gives=(draft.yielded(item),))


def _bring(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an addition, after what the flask holds before it."""
    head, before = operation.head, operation.before
    layered = [phrase for phrase in operation.phrases if set(phrase.nouns) & _PARTS and not phrase.is_measured]
    draft.own_names(layered)
    after = [phrase for phrase in operation.after if phrase not in layered or phrase.prep]
    operation = replace(operation, after=after)
    subject = [
        phrase
        for phrase in before
        if (phrase.prep == "" or (phrase.prep in ("by", "after", "when", "once") and head.passive))
        and (phrase.substances or phrase.solution is not None)
        and phrase not in layered
    ]
    objects = with_substances(after, "", "of")
    theme = objects if _is_object_added(head, subject, objects) else subject
    _measure_behind(operation, theme)
    extra = with_substances(after, "with", "containing", "and", "using", "by") if head.low != "adding" else []
    if head.low in ("combined", "mixed", "combine", "mix", "combining") and not theme and not extra:
        return
    into = with_substances(operation.phrases, "to", "into", "onto", "in", "on")
    targets = [phrase for phrase in into if phrase not in theme]
    if subject and objects and not head.passive and head.marker != "followed":
        targets = [*subject, *targets]
    if head.low.startswith(("charg", "load", "flask")) and extra and not theme:
        theme, extra = extra, []
    if head.low.startswith("plac") and any(token.low in ("oven", "desiccator") for token in operation.clause.after):
        draft.act("DrySolid", operation)
        return
    if targets and not theme and not extra and head.passive:
        parted = _parted(operation.clause.before)
        if parted:
            _bring(draft, replace(operation, before=parted))
            return
    if head.low.startswith(_MIXING):
        theme = [*theme, *(phrase for phrase in targets if phrase.prep == "in")]
        targets = [phrase for phrase in targets if phrase.prep != "in"]
    if targets and not theme and not extra and _is_batch_added(draft, operation):
        draft.act("Pour", operation, draft.portions(targets))
        return
    for phrase in targets:
        draft.charge([phrase], always=not draft.actions or phrase.is_measured)
        if draft.actions and phrase.prep == "in" and not phrase.is_measured and _is_of_batch(operation):
            draft.put("Dissolve", phrase.substances)
    rest = [phrase for phrase in operation.phrases if phrase not in targets]
    cold = [item for phrase in targets for item in phrase.conditions if item.kind == "temperature"]
    if cold and not any(item.kind == "temperature" for item in conditions(rest)):
        rest = [*rest, TextPhrase("at", cold[0].start, cold[-1].end, conditions=cold)]
    _take(draft, replace(operation, before=rest, after=[]), [*theme, *extra])


def _behind_batch(operation: PhrasedOperation) -> list[TextPhrase]:
    """Return the phrases before the word of an addition, its subject as one that no comma parts from the batch.

    "To the residue water was added", "after which time ether was added", "to which water was added".
    """
    before, tokens = operation.before, operation.clause.before
    names = list(takewhile(lambda item: item.kind in ("name", "group"), reversed(tokens)))
    rest = tokens[: len(tokens) - len(names)]
    taken = any(item.kind == "name" for item in names) and not with_substances(operation.after, "", "of")
    batch = bool(rest) and rest[-1].low in BATCH | SOLUTIONS | {"which", "time"}
    if not (operation.head.passive and taken and batch) or rest[0].low not in ("to", "after", "into"):
        return before
    return [*read_phrases(rest), *read_phrases(names[::-1])]


def _measure_behind(operation: PhrasedOperation, theme: Sequence[TextPhrase]) -> None:
    """Give the only substance of an addition the amount that stands behind its word: "water was added (20 mL)"."""
    items = [item for phrase in theme for item in phrase.substances]
    behind = [phrase for phrase in operation.after[:1] if not phrase.prep and not phrase.substances and phrase.loose]
    if len(items) == 1 and not items[0].is_measured and behind:
        items[0].amounts += behind[0].loose
        behind[0].loose = []


def _is_object_added(head: Head, subject: Sequence[TextPhrase], objects: Sequence[TextPhrase]) -> bool:
    """Return whether what stands behind the word of an addition is added: "A flask was charged with A (2 g)"."""
    charged = head.low.startswith(("charg", "load")) and any(phrase.is_measured for phrase in objects)
    return bool(objects) and (charged or not (subject and head.passive))


def _is_precipitated(phrase: TextPhrase) -> bool:
    """Return whether a phrase says what an addition is done for: "ether was added to precipitate the salt (2 g)"."""
    return phrase.prep == "to" and phrase.nouns[:1] == ["precipitate"] and phrase.is_measured


def _is_of_batch(operation: PhrasedOperation) -> bool:
    """Return whether something is added to the batch, "to the residue in ether"."""
    return any(phrase.prep == "to" and set(phrase.nouns) & _BATCHES for phrase in operation.phrases)


def _parted(tokens: Sequence[Token]) -> list[TextPhrase]:
    """Return the phrases of "to A, B and C, D was added" with D as the subject, or none if no comma ends the list."""
    commas = [place for place, token in enumerate(tokens) if token.text == ","]
    joint = next((place for place, token in enumerate(tokens) if token.low == "and"), None)
    ends = [place for place in commas if joint is not None and place > joint] or (commas if len(commas) == 1 else [])
    if not ends or tokens[0].low != "to" or not any(token.kind == "name" for token in tokens[ends[0] :]):
        return []
    subject = read_phrases(tokens[ends[0] + 1 :])
    return [*read_phrases(tokens[: ends[0]]), *subject] if with_substances(subject, "") else []


def _is_batch_added(draft: ActionDraft, operation: PhrasedOperation) -> bool:
    """Return whether the batch itself is added to something: "The mixture was added to ice"."""
    head = operation.head
    if head.passive:
        nouns = {noun for phrase in operation.before if phrase.prep == "" for noun in phrase.nouns}
        elided = bool(draft.actions) and not operation.before
        measured = any(phrase.is_measured for phrase in operation.phrases)
        return bool(nouns & _BATCHES) or (not measured and (elided or bool(nouns & _PRODUCTS)))
    return head.low == "added" and not operation.before and bool(draft.actions)


def _take(
    draft: ActionDraft,
    operation: PhrasedOperation,
    theme: Sequence[TextPhrase],
    verb: Verb = "Add",
) -> None:
    """Append an operation on substances, after solutions that are made for it.

    Args:
        draft: grows.
        operation: with the phrases of its circumstances.
        theme: what is taken.
        verb: what is done with it.
    """
    held, phrases, span = operation.conditions, operation.phrases, operation.span
    takes: list[Portion] = []
    made = ""
    for phrase in theme:
        if phrase.is_prepared:
            draft.make(phrase)
            first = phrase.substances[0]
            made = phrase.solution.low if phrase.solution is not None else draft.text[first.start : first.end]
        else:
            takes += draft.portions([phrase])
    named = any("solution" in phrase.nouns for phrase in phrases if phrase.prep == "")
    if made or (verb == "Add" and not theme and (draft.solution_made or named)):
        noun = next((noun for phrase in phrases for noun in phrase.nouns if noun in SOLUTIONS), "solution")
        draft.act(verb, operation, takes, part="solution", note=made or noun)
    elif not takes and verb == "Add":
        _prolong(draft, held)
    else:
        if verb == "Add" and any(item.kind == "ph" for item in held):
            verb = "AdjustPH"
        stirred = any("stirring" in phrase.words for phrase in phrases) and any(item.kind == "time" for item in held)
        if stirred and takes:
            draft.emit(verb, span, takes, ratios=ratios(theme))
            draft.act("Stir", operation)
        else:
            draft.act(verb, operation, takes, ratios(theme))


def _prolong(draft: ActionDraft, held: Sequence[QuantitySpan]) -> None:
    """Keep conditions of a word that is no action on the last action."""
    if held and draft.actions:
        last, more = draft.actions[-1], held_at(held)
        first = Period(**{key: more[key] for key in ("temperature", "duration") if key in more})
        draft.own_all(held)
        draft.actions[-1] = last.model_copy(update={"then": (*last.then, first, *more.get("then", ()))[:20]})


def treat(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an operation with a reagent behind its word: "treated with", "washed with", "quenched by"."""
    head, verb, after = operation.head, operation.verb, operation.after
    if head.passive or head.marker == "":
        held = [phrase for phrase in operation.before if phrase.prep in ("", "to", "of", "in")]
        draft.charge(held, always=verb == "Add" and not draft.actions)
    reagents = with_substances(after, "with", "by", "using", "of", "into", "to", "")
    if verb in ("Triturate", "Quench") or head.low.startswith("dilut"):
        reagents = reagents or with_substances(after, "in", "over", "onto", "on")
    if verb == "Quench" and not reagents and head.low.startswith("terminat"):
        return
    if verb == "Hydrogenate":
        draft.own_names(with_substances(after, "as"))
        reagents = [phrase for phrase in after if phrase.substances and phrase.prep != "as"]
    if verb == "Add" and not reagents:
        if head.low.startswith(("react", "condens")) or (head.low == "subjected" and operation.conditions):
            draft.act("Wait", operation)
        return
    if head.low.startswith("convert"):
        draft.own_names(with_substances(after, "to", "into") if reagents else [])
        reagents = with_substances(after, "with", "using", "by")
    elif head.low.startswith(("react", "treat")):
        reagents = with_substances(after, "with", "in", "of", "using", "containing", "and", "")
    if head.low == "reaction" and reagents:
        draft.emit("Add", operation.span, draft.portions(reagents))
        draft.act("Stir", operation)
    elif verb in ("Wash", "Extract"):
        _wash(draft, operation)
    elif verb == "AdjustPH":
        draft.act(verb, operation, draft.portions(reagents))
    else:
        _take(draft, operation, reagents, verb)
        _fill_up(draft, operation)


def _fill_up(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Note the volume to which something is diluted: "diluted to 50 mL with water"."""
    loose = [item for phrase in operation.after if phrase.prep == "to" for item in phrase.loose]
    volumes = [item for item in loose if item.kind == "volume"]
    if operation.head.low.startswith("dilut") and volumes and draft.last_verb == "Add":
        draft.own_all(volumes)
        note = "; ".join(filter(None, (draft.actions[-1].note, f"to {volumes[0].text}")))
        draft.actions[-1] = draft.actions[-1].model_copy(update={"note": note[:400]})


def _wash(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append washes or extractions: each liquid of a list is an action, a mixed liquid is one."""
    verb = operation.verb
    liquids = with_substances(operation.after, "with", "using", "in", "into", "by", "of", "")
    results = [phrase for phrase in liquids if not phrase.prep and all(item.weak for item in phrase.substances)]
    results = [phrase for phrase in results if phrase.is_measured and phrase is operation.after[-1]]
    liquids = [phrase for phrase in liquids if phrase not in results]
    rest = [phrase for phrase in operation.phrases if phrase not in (*liquids, *results)]
    held = operation.conditions
    weighed = _weighed_behind(verb, liquids)
    first = True
    draft.last_solid = draft.last_solid or bool(lows(operation.clause.before) & SOLID)
    for phrase in liquids:
        for batch in _batches(phrase, together=verb == "Extract", first=first):
            repeats = _repeats(draft, operation, phrase, batch)
            takes = [draft.portion(item, repeats) for item in batch]
            if first:
                draft.emit(verb, operation.span, takes, held, [*rest, phrase], phrase.ratios, repeats=repeats)
            else:
                draft.emit(verb, (batch[0].start, batch[-1].end), takes, (), rest, repeats=repeats)
            first = False
    if first:
        draft.act(verb, operation)
    for item in (*substances(results), *weighed):
        draft.emit("Yield", (item.start, item.end), gives=(draft.yielded(item),))


def _weighed_behind(verb: Verb, liquids: Sequence[TextPhrase]) -> list[SubstanceMention]:
    """Take a mass with a yield from the last liquid, as a result: "washed with ether (5.29 g, 80%)"."""
    last = liquids[-1].substances[-1] if liquids else None
    if verb != "Wash" or last is None or not {"mass", "percent"} <= {item.kind for item in last.amounts}:
        return []
    amounts, last.amounts = last.amounts, []
    return [SubstanceMention(amounts[0].start, amounts[-1].end, amounts, weak=True)]


def _batches(phrase: TextPhrase, together: bool, first: bool) -> list[list[SubstanceMention]]:
    """Return the liquids of a phrase, each with all substances that it is mixed of."""
    batches: list[list[SubstanceMention]] = []
    for item in phrase.substances:
        mixed = together or item.paired or phrase.solution is not None or (item.solvent and first)
        if batches and mixed:
            batches[-1].append(item)
        else:
            batches.append([item])
    return batches


def _repeats(
    draft: ActionDraft, operation: PhrasedOperation, phrase: TextPhrase, batch: Sequence[SubstanceMention]
) -> int:
    """Return how often a liquid is used: "3 x 20 mL", "twice with water", "with water (2 x)"."""
    portions = max((value.portions for item in batch for value in item.amounts), default=1)
    if portions > 1:
        return portions
    counts = [item.repeated for item in batch if item.repeated is not None]
    counts += [token.figure for token in operation.clause.group if token.figure is not None]
    if counts:
        draft.own_all(counts)
        return max(1, int(counts[0].value))
    after = operation.after
    place = after.index(phrase)
    counted = [phrase, *(other for other in after[max(0, place - 1) : place] if not other.substances)]
    for other in counted:
        if other.repeated is not None:
            draft.own_all([other.repeated])
            return max(1, other.repeats)
    last = after[-1]
    return max(1, last.repeats) if last.repeated is not None and not last.substances else 1


def dissolve(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append the dissolution or suspension of something in a solvent."""
    head = operation.head
    into = any(phrase.is_measured for phrase in with_substances(operation.after, "into", "in"))
    if head.low == "taken" and "dryness" in lows(operation.clause.after):
        draft.act("Concentrate", operation)
        return
    if head.low == "taken" and with_substances(operation.after, "between"):
        partition(draft, operation)
        return
    if head.low == "taken" and head.last == head.place and not into:
        collect(draft, operation)
        return
    solvents = with_substances(chain(operation.after, operation.before), "in", "with", "into", "on", "onto")
    subject = ("", "of") if head.passive else ("", "of", "to")
    solutes = with_substances(operation.before, *subject) + with_substances(operation.after, "")
    used = [*solutes, *solvents]
    draft.act(operation.verb, operation, draft.portions(used), ratios(used))


def pour(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append that the batch is poured onto something."""
    onto = with_substances(operation.after, "onto", "into", "on", "to", "in", "over", "upon", "containing")
    draft.charge([phrase for phrase in operation.before if phrase.prep == "" and phrase.is_measured])
    draft.act("Pour", operation, draft.portions(onto))


def crystallize(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append a crystallization, trituration or precipitation with its solvents."""
    head = operation.head
    precipitation = head.low.startswith("precipitat")
    if precipitation and with_substances(operation.after, "into", "onto"):
        pour(draft, operation)
        return
    used = with_substances(operation.after, "from", "in", "with", "using", "of", "out", "by", "under", "")
    used = used or with_substances(operation.before, "in", "from")
    if head.passive:
        draft.charge([phrase for phrase in operation.before if phrase.prep == "" and phrase.is_measured])
    effected = head.passive or (head.word.noun and head.marker in ("by", "after", "upon", "via", "through", "on"))
    if precipitation and not used and not effected:
        return
    draft.last_solid = True
    draft.act(operation.verb, operation, draft.portions(used), ratios(used))


def partition(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append that the batch is shared between liquids."""
    used = with_substances(operation.after, "between", "with", "in", "")
    draft.act("Partition", operation, draft.portions(used))
