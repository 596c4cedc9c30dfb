"""Reading: a procedure becomes a list of actions, sentence by sentence, operation by operation."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from labgym.errors import OptionError
from labgym.protocols.experiments.model import Action
from labgym.protocols.reading.actions import MAX_TEXT, ActionList, Outcome, Unread
from labgym.protocols.reading.additions import add, crystallize, dissolve, partition, pour, treat
from labgym.protocols.reading.clauses import VerbClause, clauses, is_state
from labgym.protocols.reading.draft import EXTRACTS, LAYERS, ActionDraft, PhrasedOperation, lows, substances
from labgym.protocols.reading.figures import figures, plain
from labgym.protocols.reading.filtrations import settle_filtrations
from labgym.protocols.reading.holding import hold, is_adjusted, wait
from labgym.protocols.reading.lexicon import MANNERS, QUALITIES, SOLUTIONS, VESSELS, Frame
from labgym.protocols.reading.mentions import SubstanceMention
from labgym.protocols.reading.phrases import read_phrases
from labgym.protocols.reading.references import materials, product, refer, reference
from labgym.protocols.reading.results import complete, give, give_alone
from labgym.protocols.reading.separations import clear, over
from labgym.protocols.reading.stated import held_at
from labgym.protocols.reading.tokens import Sentence, Token, sentences

_MONITOR = re.compile(
    r"\b(?:LC-?/?MS|TLC|HPLC|GC|t\.l\.c\.)(?: analysis| control| monitoring)? (?:showed|shows|"
    r"indicated|indicates|revealed|confirmed)"
    r"|\bno starting material remain|\b(?:as )?(?:monitored|followed|judged|determined|indicated|"
    r"shown) by (?:TLC|HPLC|LC-?/?MS|GC|tlc)"
)
_NUMBERED = frozenset((
    "example", "examples", "step", "steps", "scheme", "preparation", "compound", "formula", "intermediate",
    "reference", "section", "table", "method", "part", "procedure", "figure", "no.", "no", "vol.", "page",
    "claim", "structure", "number", "product", "ref", "entry", "gave", "give", "afforded", "afford",
    "yielded", "yield", "yields", "affords", "gives", "provide", "whatman", "gel",
))  # fmt: skip
_NUMBER = re.compile(r"^\d{1,6}(?:[.,]\d{1,6})?$")
_EFFECTS = frozenset(("Quench", "Dissolve", "MakeSolution", "Add", "AdjustPH", "Crystallize"))
"""Operations that an infinitive names as the effect of another one."""
_COLD = frozenset(("cooled", "cold", "chilled", "precooled", "pre-cooled", "ice-cold", "ice-cooled"))
_ISOLATING = frozenset((
    "Chromatograph", "Concentrate", "Crystallize", "Distill", "DrySolid", "Filter", "Purify", "Recrystallize",
    "Sublime", "Triturate",
))  # fmt: skip
"""Operations with which a procedure may end: they leave a product."""
_CLASSES = frozenset((
    "acid", "alcohol", "aldehyde", "amide", "amine", "anhydride", "bromide", "chloride", "ester", "hydrazide",
    "hydrochloride", "ketone", "salt",
))  # fmt: skip
"""Classes of substances by which a text calls its batch."""
_PREPARED = frozenset(("prepared", "made", "synthesized", "synthesised"))
_RESULTING = frozenset(("resulting", "resultant", "desired", "crude", "corresponding", "formed", "title", "obtained"))
_BATHS = frozenset(("bath", "baths", "addition", "evolution"))
"""Nouns before which a name says what a bath holds, repeats what was added, or is a gas that escapes."""
MAX_ABBREVIATION = 8
"""Longest name in parentheses that repeats the name before them."""
_SPECTRUM = re.compile(r"[-+]?\d+(?:\.\d+)?(?:-\d+(?:\.\d+)?)? ?\(")
"""Peaks with which data go on: "3.99 (s, 3H)"."""
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
    unread = tuple(sorted((*_unread(draft, parts), *draft.doubts), key=lambda item: item.start))
    return ActionList(
        text=text,
        actions=tuple(draft.actions),
        outcome=_outcome(draft, unread),
        unread=unread,
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
        draft.own(tokens[0].start, tokens[-1].end)
        return True
    if tokens:
        _read_tokens(draft, tokens, parts)
    if sentence.data is None:
        return False
    draft.own(*sentence.data)
    if not complete(draft, sentence.data) and draft.last_verb not in ("", "Analyze"):
        draft.emit("Analyze", sentence.data)
    return True


def _is_data(draft: ActionDraft, tokens: Sequence[Token], parts: Sequence[VerbClause]) -> bool:
    """Return whether a sentence continues the data before it: it has peaks, or no operation and no amount."""
    if _SPECTRUM.match(draft.plain[tokens[0].start : tokens[0].start + 60]):
        return True
    kinds = {token.figure.kind for token in _leaves(tokens) if token.figure is not None}
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
    watched = _MONITOR.search(draft.plain, start, end)
    early = watched is not None and bool(parts) and watched.start() < draft.found(parts[0])[0]
    if watched is not None and early:
        draft.emit("Monitor", watched.span())
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


def _own_prepared(draft: ActionDraft, tokens: Sequence[Token], operates: bool) -> None:
    """Own the product that a sentence begins with: "B was prepared in 80% yield by treating A with C".

    Without an operation its materials are combined: "B was prepared from A (1 g) and C (2 g)".
    """
    place = next((k for k, token in enumerate(tokens[:12]) if token.low in _PREPARED), None)
    if place is None or tokens[place - 1].low not in ("was", "is", "were") or lows(tokens[:place]) & {"solution"}:
        return
    for item in substances(read_phrases(tokens[:place], True)[:1]):
        if not item.is_measured:
            draft.own(item.start, item.end)
            draft.product = draft.product or draft.text[item.start : item.end]
    used = substances(read_phrases(tokens[place + 1 :])) if not operates else []
    if any(item.is_measured for item in used):
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
    nouns = {noun for phrase in before for noun in phrase.nouns} - VESSELS
    made = head.marker in ("by", "via", "through")
    if is_first and not draft.actions and nouns and not substances(before) and not made:
        draft.started_with_batch = True
    if head.marker != "after":
        wait(draft, operation)
    if head.low == "addition" and _is_repeated(draft, substances(after), head.marker == "after"):
        draft.own_all(substances(after))
        draft.own_all(operation.conditions)
        return
    draft.own_names([phrase for phrase in before if set(phrase.nouns) & (LAYERS | EXTRACTS | SOLUTIONS)])
    if _is_intended(draft, operation, is_first):
        return
    draft.manners = lows(clause.group) & MANNERS.keys()
    weighed = [item for item in substances(before) if item.is_measured]
    if head.low == "collected" and any(not item.weak or "product" in _text(draft, item) for item in weighed):
        give(draft, operation)
    else:
        _FRAMES.get(head.word.frame, hold)(draft, operation)
    draft.manners = set()


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


def _outcome(draft: ActionDraft, unread: Sequence[Unread]) -> Outcome:
    verbs = [action.verb for action in draft.actions]
    if "Refers" in verbs:
        return "refers"
    before = [action for action in draft.actions if action.verb in ("Add", "MakeSolution", "Dissolve", "Hydrogenate")]
    measured = any(_is_measured(portion.amount) for action in before for portion in action.takes)
    quantities = any(item.why.startswith("amount") for item in unread)
    last = next((verb for verb in reversed(verbs) if verb not in ("Analyze", "Wash", "Monitor")), "")
    ends = "Yield" in verbs or last in _ISOLATING
    is_clear = not (draft.started_with_batch or quantities or draft.doubts)
    return "complete" if measured and ends and is_clear else "partial"


def _is_measured(amount: str) -> bool:
    return bool(re.search(r"\d (?:g|mL|mol|mmol|mg|equiv|parts)\b", amount))


def _unread(draft: ActionDraft, parts: Iterable[Sentence]) -> Iterable[Unread]:
    taken = {portion.name.lower() for action in draft.actions for portion in action.takes}
    for sentence in parts:
        _own_descriptions(draft, sentence.tokens, taken)
        before = {token.start: sentence.tokens[k - 1] for k, token in enumerate(sentence.tokens) if k}
        for token in _leaves(sentence.tokens):
            if any(draft.owned[token.start : token.end]):
                continue
            kind = token.figure.kind if token.figure is not None else None
            if kind is not None and kind not in ("other", "length", "ratio") and not _is_once(token):
                yield Unread(
                    start=token.start,
                    end=token.end,
                    text=draft.text[token.start : token.end],
                    why=f"amount or condition ({kind}) that no action owns",
                )
            elif token.kind == "word" and _NUMBER.match(token.text) and not _is_numbering(before.get(token.start)):
                yield Unread(
                    start=token.start, end=token.end, text=token.text, why="number without a unit that is known"
                )
            elif token.kind == "name" and len(token.text) > 2 and token.low not in QUALITIES:
                yield Unread(
                    start=token.start,
                    end=token.end,
                    text=draft.text[token.start : token.end][:1000],
                    why="name that no action owns",
                )


def _is_once(token: Token) -> bool:
    return token.figure is not None and token.figure.kind == "repeats" and token.figure.value == 1.0


def _own_descriptions(draft: ActionDraft, tokens: Sequence[Token], taken: set[str]) -> None:
    """Own names that describe the batch or repeat a name: "the ether solution", "N-chlorosuccinimide (NCS)"."""
    for before, run, following in _name_runs(tokens):
        describes = following is not None and following.low in LAYERS | EXTRACTS | _BATHS
        if describes or _is_class(before, run, following) or _is_named_again(draft, before, run, following, taken):
            draft.own(run[0].start, run[-1].end)
    _own_observed(draft, tokens)
    for token, following in pairwise(tokens):
        if token.figure is not None and following.low in ("column", "columns", "cartridge"):
            draft.own(token.start, token.end)
        is_column = token.low in ("silica", "gel", "alumina") and following.low in ("column", "columns", "cartridge")
        if is_column and any(action.verb == "Chromatograph" for action in draft.actions):
            _own_column(draft, tokens, token)
        inner = [item for item in following.inner if item.kind not in ("mark", "figure")]
        abbreviates = len(inner) == 1 and inner[0].kind == "name" and len(inner[0].text) <= MAX_ABBREVIATION
        if following.kind == "group" and abbreviates and draft.owned[token.end - 1]:
            draft.own(inner[0].start, inner[0].end)


def _is_named_again(
    draft: ActionDraft, before: Sequence[str], run: Sequence[Token], following: Token | None, taken: set[str]
) -> bool:
    """Return whether a definite name without an amount repeats one that was taken or made: "the ester was stirred".

    The last word of a name repeats it, too: "the ether solution" behind "diethyl ether".
    """
    names = taken | {portion.name.lower() for action in draft.actions for portion in action.gives}
    name = draft.text[run[0].start : run[-1].end].lower()
    known = name in names or name in {item.split()[-1] for item in names if item}
    solved = following is not None and following.low in SOLUTIONS
    measured = following is not None and (following.figure is not None or (following.kind == "group" and not solved))
    return known and not measured and (solved or bool({"the", "this", "all"} & set(before)))


def _own_observed(draft: ActionDraft, tokens: Sequence[Token]) -> None:
    """Own the names of what is waited for, "until the uptake of hydrogen ceased", and the oil of a dispersion."""
    waits = False
    for token in tokens:
        waits = (waits or token.low in ("until", "till")) and token.kind != "mark"
        if waits and token.kind == "name":
            draft.own(token.start, token.end)
        if token.kind == "group" and lows(token.inner) & {"dispersion", "suspension"}:
            draft.own_all(item for item in token.inner if item.low in ("mineral", "paraffin"))


def _name_runs(tokens: Sequence[Token]) -> Iterable[tuple[list[str], list[Token], Token | None]]:
    """Yield the names of a sentence, each with the two words before it, in lower case, and the token behind it."""
    run: list[Token] = []
    for place, token in enumerate((*tokens, None)):
        if token is not None and token.kind == "name":
            run.append(token)
            continue
        if run:
            first = place - len(run)
            yield [each.low for each in tokens[max(0, first - 2) : first]], run, token
        run = []


def _is_class(before: Sequence[str], run: Sequence[Token], following: Token | None) -> bool:
    """Return whether a name is a class that stands for the batch: "the resulting acid chloride"."""
    named = bool(set(before) & _RESULTING) or ("the" in before and len(run) > 1) or before[-1:] == ["this"]
    measured = following is not None and (following.kind == "group" or following.figure is not None)
    return named and not measured and all(token.low in _CLASSES for token in run)


def _own_column(draft: ActionDraft, tokens: Sequence[Token], last: Token) -> None:
    """Own the size and the packing of a column: "a 40 g silica gel column"."""
    place = next(k for k, token in enumerate(tokens) if token is last)
    for token in reversed(tokens[max(0, place - 2) : place + 1]):
        if token.low not in ("silica", "gel", "alumina") and (token.figure is None or token.figure.kind != "mass"):
            break
        draft.own(token.start, token.end)


def _is_numbering(before: Token | None) -> bool:
    """Return whether a number behind a token counts something or numbers it: "Example 3", "compound 12"."""
    named = before is not None and (before.low in _NUMBERED or before.text.endswith("®"))
    return before is None or before.kind in ("name", "mark", "group") or named


def _leaves(tokens: Iterable[Token]) -> Iterable[Token]:
    for token in tokens:
        if token.kind == "group":
            yield from _leaves(token.inner)
        else:
            yield token
