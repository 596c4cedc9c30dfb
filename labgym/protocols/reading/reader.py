"""Reading: a procedure becomes a list of actions, sentence by sentence, operation by operation."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import pairwise, takewhile

from labgym.errors import OptionError
from labgym.protocols.experiments.model import Action, Verb
from labgym.protocols.reading.actions import MAX_TEXT, ActionList, Outcome, Unread
from labgym.protocols.reading.additions import add, crystallize, dissolve, partition, pour, treat
from labgym.protocols.reading.clauses import VerbClause, clauses, is_state
from labgym.protocols.reading.draft import (
    ASIDE,
    EXTRACTS,
    LAYERS,
    ActionDraft,
    PhrasedOperation,
    conditions,
    lows,
    substances,
)
from labgym.protocols.reading.figures import figures, plain
from labgym.protocols.reading.filtrations import KeptPart, settle_filtrations
from labgym.protocols.reading.holding import hold, hydrogen_in, is_adjusted, wait
from labgym.protocols.reading.lexicon import MANNERS, SOLUTIONS, VESSELS, Frame
from labgym.protocols.reading.mentions import SubstanceMention
from labgym.protocols.reading.phrases import STATIONARY, read_phrases
from labgym.protocols.reading.references import materials, product, refer, reference
from labgym.protocols.reading.results import complete, give, give_alone
from labgym.protocols.reading.separations import clear, over
from labgym.protocols.reading.stated import held_at
from labgym.protocols.reading.tokens import Sentence, Token, leaves, sentences
from labgym.protocols.reading.unread import unread

_MONITOR = re.compile(
    r"\b(?:LC-?/?MS|TLC|HPLC|GC|t\.l\.c\.)(?: analysis| control| monitoring)? (?:showed|shows|"
    r"indicated|indicates|revealed|confirmed)"
    r"|\bno starting material remain|\b(?:as )?(?:monitored|followed|judged|determined|indicated|"
    r"shown) by (?:TLC|HPLC|LC-?/?MS|GC|tlc)"
)
_EFFECTS = frozenset(("Quench", "Dissolve", "MakeSolution", "Add", "AdjustPH", "Crystallize"))
"""Operations that an infinitive names as the effect of another one."""
_COLD = frozenset(("cooled", "cold", "chilled", "precooled", "pre-cooled", "ice-cold", "ice-cooled"))
_ISOLATING = frozenset((
    "Chromatograph", "Concentrate", "Crystallize", "Distill", "DrySolid", "Filter", "Purify", "Recrystallize",
    "Sublime", "Triturate",
))  # fmt: skip
"""Operations with which a procedure may end: they leave a product."""
REACTING = frozenset(
    ("Cool", "Heat", "Hydrogenate", "Irradiate", "Microwave", "Reflux", "SetTemperature", "Stir", "Wait")
)
"""Operations with which a text may end before a product is isolated."""
_FILLED: frozenset[Verb] = frozenset((
    "Add", "AdjustPH", "Cool", "Dissolve", "Heat", "Hydrogenate", "Irradiate", "MakeSolution", "Microwave", "Quench",
    "Reflux", "SetTemperature", "Stir", "Transfer", "Wait",
))  # fmt: skip
"""Operations next to which an amount is of something that goes into the vessel."""
_TAKING: frozenset[Verb] = frozenset(("Dissolve", "DrySolution", "Extract", "Recrystallize", "Triturate", "Wash"))
"""Operations that need a substance."""
_GAINED = frozenset((
    "yield", "obtained", "product", "crude", "pure", "weighed", "weighing", "theory", "residual", "removed", "formed",
    "absorbed", "absorption", "uptake", "observed", "consumed", "eluted", "elutes", "collected", "precipitated",
    "separated", "recovered", "isolated",
))  # fmt: skip
"""Words of clauses in which an amount may be of a product."""
SHORTEST_HOLD_MIN = 0.5
"""Shortest time, minutes, that a sentence without an operation may state; "3.4 s" is a peak in a spectrum."""
_LASTING = frozenset(("after", "for", "run", "performed", "carried", "conducted", "reaction", "within"))
"""Words of a sentence without an operation that tells how long something is held."""
_IMPLIED: dict[str, Verb] = {"filtered": "Filter", "dried": "DrySolution"}
"""Adjectives of a liquid that say what was done to it."""
_BEGINNING = frozenset(("Add", "AdjustPH", "Dissolve", "Extract", "MakeSolution", "Partition", "Wash", "Yield"))
"""Operations behind which the batch is another liquid."""
_PREPARED = frozenset(("prepared", "made", "synthesized", "synthesised"))
_SPECTRUM = re.compile(r"[-+]?\d+(?:\.\d+)?(?:-\d+(?:\.\d+)?)? ?\(")
"""Peaks with which data go on: "3.99 (s, 3H)"."""
_ELUENTS = frozenset(("gradient", "eluent", "eluant"))
"""Words of a sentence that describes the chromatography before it."""
_FRAMES: dict[Frame, Callable[[ActionDraft, PhrasedOperation], None]] = {
    "theme": add,
    "with": treat,
    "in": dissolve,
    "onto": pour,
    "from": crystallize,
    "hold": hold,
    "over": over,
    "between": partition,
    "result": give,
    "none": clear,
}
"""How an operation is read, by where its word names its substances."""


def read_procedure(text: str) -> ActionList:
    """Return the actions that a procedure in English tells; the same text gives the same actions.

    Raises:
        OptionError: the text is longer than `MAX_TEXT` characters.
    """
    if len(text) > MAX_TEXT:
        limit = f"at most {MAX_TEXT} are read: give one procedure at a time"
        raise OptionError(f"the text has {len(text)} characters, {limit}")
    simple = plain(text)
    draft = ActionDraft(text, simple)
    parts = sentences(simple, figures(simple))
    in_data = False
    for sentence in parts:
        in_data = _read(draft, sentence, in_data)
    settle_filtrations(draft)
    missing = tuple(sorted((*unread(draft, parts), *draft.doubts), key=lambda item: item.start))
    return ActionList(
        text=text,
        actions=tuple(draft.actions),
        outcome=_outcome(draft, missing),
        unread=missing,
        product=draft.product[:500],
        result=draft.result[:300],
        roles=draft.roles,
    )


def _read(draft: ActionDraft, sentence: Sentence, in_data: bool) -> bool:
    """Read a sentence and return whether it ends in data.

    Args:
        draft: grows.
        sentence: the sentence.
        in_data: whether the sentence before it ends in data, which may go on in this one.
    """
    tokens = sentence.tokens
    parts = clauses(tokens)
    if in_data and tokens and _is_data(draft, tokens, parts):
        draft.own(tokens[0].start, tokens[-1].end, ASIDE)
        return True
    if tokens:
        _read_tokens(draft, tokens, parts)
    if sentence.data is None:
        return False
    draft.own(*sentence.data, ASIDE)
    if not complete(draft, sentence.data) and draft.last_verb not in ("", "Analyze"):
        draft.emit("Analyze", sentence.data)
    return True


def _is_data(draft: ActionDraft, tokens: Sequence[Token], parts: Sequence[VerbClause]) -> bool:
    """Return whether a sentence continues the data before it: it has peaks, or no operation and no amount."""
    if _SPECTRUM.match(draft.plain[tokens[0].start : tokens[0].start + 60]):
        return True
    kinds = {token.figure.kind for token in leaves(tokens) if token.figure is not None}
    return not parts and not kinds & {"mass", "volume"}


def _read_tokens(draft: ActionDraft, tokens: Sequence[Token], parts: Sequence[VerbClause]) -> None:
    start, end = tokens[0].start, tokens[-1].end
    first = len(draft.actions)
    _read_operations(draft, tokens, parts, (start, end))
    for token, following in pairwise(tokens):
        if token.low in _COLD and following.kind == "group" and not draft.owned[following.start + 1]:
            _cool(draft, following, first)


def _cool(draft: ActionDraft, group: Token, first: int) -> None:
    """Insert the cooling that an adjective tells, "to a cooled (0 C) solution of A", behind the making of the solution.

    Args:
        draft: grows.
        group: the parentheses.
        first: place of the first action of the sentence.
    """
    figure = group.inner[0].figure if len(group.inner) == 1 else None
    if figure is None or figure.kind != "temperature" or len(draft.actions) == first:
        return
    draft.own(group.start, group.end)
    made = draft.actions[first].verb in ("MakeSolution", "Add", "Dissolve")
    cooling = Action(verb="Cool", span=(group.start, group.end), **held_at([figure]))
    draft.actions.insert(first + made, cooling)


def _read_operations(
    draft: ActionDraft, tokens: Sequence[Token], parts: Sequence[VerbClause], place: tuple[int, int]
) -> None:
    start, end = place
    if not parts:
        give_alone(draft, tokens)
        _hold_alone(draft, tokens)
    watched = _MONITOR.search(draft.plain, start, end)
    early = watched is not None and bool(parts) and watched.start() < draft.found(parts[0])[0]
    if watched is not None and early:
        draft.emit("Monitor", watched.span())
    if not parts and draft.last_verb == "Chromatograph" and lows(tokens) & _ELUENTS:
        note = "; ".join(filter(None, (draft.actions[-1].note, draft.text[start:end])))
        draft.actions[-1] = draft.actions[-1].model_copy(update={"note": note[:400]})
        draft.own(start, end, ASIDE)
        return
    match = reference(draft.plain, start, end)
    if match is None:
        _own_prepared(draft, tokens, bool(parts))
        _operate_all(draft, tokens, parts)
    else:
        results = [clause for clause in parts if clause.head.word.verb == "Yield"]
        used = materials(draft, match, tokens, parts)
        for clause in parts:
            if clause not in results and clause.head.word.verb != "Repeat":
                _operate(draft, clause, clause is parts[0])
        refer(draft, match, end)
        for clause in results:
            _operate(draft, clause, clause is parts[0])
        if not results:
            product(draft, tokens, used)
    if watched is not None and not early and draft.last_verb != "Monitor":
        draft.emit("Monitor", watched.span())


def _hold_alone(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Append the period that a sentence without an operation tells: "After 1 h at 25 C then 17 h at 5 C: complete"."""
    phrases = read_phrases(tokens)
    held = conditions(phrases)
    if held and phrases[0].solution is not None and phrases[0].is_prepared and phrases[0].is_measured:
        draft.make(phrases[0])
    lasts = any(item.kind == "time" and item.value >= SHORTEST_HOLD_MIN for item in held)
    if draft.actions and lasts and lows(tokens) & _LASTING:
        gas = hydrogen_in(tokens)
        span = (held[0].start, held[-1].end)
        if gas is None:
            draft.emit("Wait", span, held=held, assumed=("verb",))
        else:
            taken = draft.portion(SubstanceMention(gas.start, gas.end))
            draft.emit("Hydrogenate", span, [taken], held, assumed=("verb",))


def _own_prepared(draft: ActionDraft, tokens: Sequence[Token], operates: bool) -> None:
    """Own the product that a sentence begins with: "B was prepared in 80% yield by treating A with C".

    Without an operation its materials are combined: "B was prepared from A (1 g) and C (2 g)".
    """
    place = next((k for k, token in enumerate(tokens[:12]) if token.low in _PREPARED), None)
    if place is None or tokens[place - 1].low not in ("was", "is", "were"):
        return
    subject = substances(read_phrases(tokens[:place], True)[:1])
    for item in subject:
        if not item.is_measured:
            draft.own(item.start, item.end)
            if not lows(tokens[:place]) & SOLUTIONS:
                draft.product = draft.product or draft.text[item.start : item.end]
    used = [item for item in subject if item.is_measured]
    used += substances(read_phrases(tokens[place + 1 :]))
    if not operates and any(item.is_measured for item in used):
        draft.put("Add", used)
    near = tokens[place + 1 : place + 7]
    if "yield" in lows(near):
        shares = [token for token in near if token.figure is not None and token.figure.kind == "percent"]
        draft.own_all(shares)
        draft.result = ", ".join(token.text for token in shares)


def _operate_all(draft: ActionDraft, tokens: Sequence[Token], parts: Sequence[VerbClause]) -> None:
    """Read operations; how something is held to which another is added comes before the addition."""
    begin = len(draft.actions)
    for earlier, clause in zip([None, *parts], parts, strict=False):
        end = len(draft.actions)
        _operate(draft, clause, clause is parts[0])
        if earlier is not None and end > begin and is_state(tokens, earlier, clause):
            held, draft.actions[end:] = draft.actions[end:], []
            made = end - begin > 1 and draft.actions[begin].verb in ("MakeSolution", "Add", "Dissolve")
            draft.actions[begin + made : begin + made] = held
        begin = end


def _operate(draft: ActionDraft, clause: VerbClause, is_first: bool) -> None:
    """Read an operation: its phrases, the period before it, and what its word does."""
    head = clause.head
    is_result = head.word.verb == "Yield"
    before = read_phrases(clause.before, is_result and head.passive)
    after = read_phrases(clause.after, is_result)
    start, stop = draft.found(clause)
    stop = max([stop, *(token.end for token in clause.after if token.kind != "mark")])
    operation = PhrasedOperation(clause, before, after, (start, stop))
    for phrase in operation.phrases:
        for remark in phrase.remarks:
            draft.own(*remark)
    nouns = {noun for phrase in before if VESSELS.isdisjoint(phrase.nouns) for noun in phrase.nouns} - {"apparatus"}
    nouns = set() if any(phrase.prep == "of" and phrase.is_measured for phrase in after) else nouns
    made = head.marker in ("by", "via", "through")
    if is_first and not draft.actions and nouns and not substances(before) and not made:
        draft.started_with_batch = True
    if head.marker != "after":
        wait(draft, operation)
    if head.low == "addition" and _is_repeated(draft, substances(after), head.marker == "after"):
        draft.own_all(substances(after))
        draft.own_all(operation.conditions)
        return
    draft.own_all(token for token in clause.group[-1:] if token.kind == "name")
    draft.own_names([phrase for phrase in before if set(phrase.nouns) & (LAYERS | EXTRACTS | SOLUTIONS)])
    if _is_intended(draft, operation, is_first):
        return
    _do_implied(draft, (*clause.before, *clause.after))
    draft.manners = lows(clause.group) & MANNERS.keys()
    begin = len(draft.actions)
    weighed = [item for item in substances(before) or substances(after[:1]) if item.is_measured]
    collects = head.low == "collected" or (head.low == "separated" and not head.passive)
    if collects and any(not item.weak or "product" in _text(draft, item) for item in weighed):
        give(draft, operation)
    else:
        _FRAMES.get(head.word.frame, hold)(draft, operation)
        _add_rest(draft, operation, begin)
    draft.manners = set()


def _do_implied(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Append what an adjective says was done to a liquid, unless an action did it: "the filtered solution"."""
    for place, token in enumerate(tokens):
        verb = _IMPLIED.get(token.low)
        ahead = tokens[place + 1 : place + 3]
        agents = [item for group in ahead[:1] for part in read_phrases(group.inner) for item in part.substances]
        noun = ahead[-1] if agents else ahead[0] if ahead else token
        if verb is None or noun.low not in LAYERS | EXTRACTS | SOLUTIONS or not draft.actions:
            continue
        since = takewhile(lambda item: item.verb not in _BEGINNING, reversed(draft.actions))
        if all(action.verb != verb for action in since):
            keep: KeptPart | None = "filtrate" if verb == "Filter" else None
            draft.emit(verb, (token.start, noun.end), [draft.portion(item) for item in agents], keep=keep)


def _add_rest(draft: ActionDraft, operation: PhrasedOperation, begin: int) -> None:
    """Let an operation take substances that it names and that no rule gives to it, which is assumed.

    Substances with an amount are added first: "in the presence of PtO2 (0.6 g)", "a suspension prepared from 14 g of
    NaH". If the operation takes nothing else, it takes the object of a preposition: "dried by passage through sodium
    sulfate".

    Args:
        draft: grows.
        operation: has been read.
        begin: place of its first action.
    """
    tokens = (*operation.clause.before, *operation.clause.group, *operation.clause.after)
    rest = [item for item in substances(operation.phrases) if not draft.owned[item.start]]
    filled = [item for item in rest if item.is_measured and _text(draft, item).split()[0] not in STATIONARY]
    measured = [
        item
        for before, item in zip([None, *rest], rest, strict=False)
        if item in filled or (item.solvent and before in filled)
    ]
    named = [item for phrase in operation.after if phrase.prep for item in phrase.substances if item in rest]
    if operation.verb in _FILLED and measured and not lows(tokens) & _GAINED:
        takes = tuple(draft.portion(item) for item in measured)[:30]
        span = (measured[0].start, measured[-1].end)
        draft.insert(begin, Action(verb="Add", takes=takes, span=span, assumed=("verb",)))
    elif operation.verb in _TAKING and named and len(draft.actions) > begin and not draft.actions[-1].takes:
        takes = tuple(draft.portion(item) for item in named)[:30]
        assumed = (*draft.actions[-1].assumed, "takes")
        taking = draft.actions.pop().model_copy(update={"takes": takes, "assumed": assumed})
        draft.insert(len(draft.actions), taking)


def _text(draft: ActionDraft, item: SubstanceMention) -> str:
    return draft.plain[item.start : item.end].lower()


def _is_intended(draft: ActionDraft, operation: PhrasedOperation, is_first: bool) -> bool:
    """Return whether an infinitive says what another operation is done for, and merge it: "to destroy excess A".

    An acidity is a target of the addition before it: "HCl was added to adjust the pH to 3".
    """
    head = operation.head
    if head.marker != "to" or head.passive or head.word.verb not in _EFFECTS:
        return False
    is_alone = is_first and not any(token.kind == "mark" for token in operation.clause.after)
    if is_alone or any(phrase.is_measured for phrase in operation.phrases):
        return False
    if head.word.verb == "AdjustPH" and (is_first or not is_adjusted(draft, operation)):
        return False
    if operation.conditions and head.word.verb != "AdjustPH":
        return False
    draft.own_names(operation.phrases)
    return True


def _is_repeated(draft: ActionDraft, names: Sequence[SubstanceMention], over: bool) -> bool:
    """Return whether all names are of substances that were taken, without an amount: "after the addition of AlCl3".

    Args:
        draft: the actions before.
        names: in lower case, of what is added.
        over: whether the text says that the addition is over; otherwise only the last word of a name, with "the",
            repeats it: "the addition of the phosphine" behind "tributyl phosphine".
    """
    taken = {portion.name.lower() for action in draft.actions for portion in action.takes}
    last = {name.split()[-1] for name in taken if " " in name}
    for item in names:
        name = draft.text[item.start : item.end].lower()
        the = draft.plain[: item.start].endswith("the ") and name in last
        if item.is_measured or not (the or (over and name in taken)):
            return False
    return bool(names)


def _outcome(draft: ActionDraft, missing: Sequence[Unread]) -> Outcome:
    verbs = [action.verb for action in draft.actions]
    if "Refers" in verbs:
        return "refers"
    before = [action for action in draft.actions if action.verb in ("Add", "MakeSolution", "Dissolve", "Hydrogenate")]
    measured = any(_is_measured(portion.amount) for action in before for portion in action.takes)
    quantities = any(item.why.startswith(("amount", "number", "unit")) for item in missing)
    last = next((verb for verb in reversed(verbs) if verb not in ("Analyze", "Wash", "Monitor")), "")
    ends = "Yield" in verbs or last in _ISOLATING or last in REACTING
    is_clear = not (draft.started_with_batch or quantities or draft.doubts)
    return "complete" if measured and ends and is_clear else "partial"


def _is_measured(amount: str) -> bool:
    return bool(re.search(r"\d (?:g|mL|mol|mmol|mg|equiv|parts)\b", amount))
