"""Reading: a procedure becomes a list of actions; each sentence in turn, each operation word with what belongs to it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from labgym.protocols.amounts import figure as number
from labgym.protocols.experiments.model import Action, Portion, Role, Stretch, Verb
from labgym.protocols.reading.actions import MAX_TEXT, ActionList, Outcome, Unread
from labgym.protocols.reading.clauses import Clause, clauses
from labgym.protocols.reading.figures import Figure, figures, plain
from labgym.protocols.reading.lexicon import GASES, MANNERS, SOLID, SOLUTIONS
from labgym.protocols.reading.phrases import Phrase, PhraseReader, Substance
from labgym.protocols.reading.tokens import Sentence, Token, sentences

_REFERS = re.compile(
    r"\b(?:(?:as|that|those|conditions|procedures?|methods?|manner|way|process|steps?) (?:described|set forth|set out|given|outlined|indicated|used|reported|in)"
    r"(?: (?:above|earlier|previously|for|in|by|under|the|preparation|synthesis|of|general))* ?(?:Example|Ex\.|EXAMPLE|example|Step|step|Preparation|Procedure|procedure|Method|method|Scheme|Intermediate|Reference|reference)"
    r"|according to (?:the )?(?:\w+ )?(?:general )?(?:procedures?|methods?|process|Example|EXAMPLE|example|protocols?|Scheme|manner)"
    r"|(?:analogous|similar|identical)(?:ly)? (?:procedure |manner |fashion |way )?(?:to|as)\b"
    r"|in an? (?:analogous|similar|identical) (?:manner|fashion|way)|in the same (?:manner|way|fashion) (?:as|of)|in a manner (?:analogous|similar|identical)"
    r"|(?:following|by|using|under|from) (?:the |a )?(?:\w+ )?(?:general )?(?:procedures?|methods?|conditions|process) (?:of|in|described|as|from|outlined|above|given|similar|analogous|for|that)"
    r"|(?:general|standard) (?:procedure|method)s? [A-Z\d]\b|by (?:the )?(?:general )?(?:procedure|method|Procedure|Method) [A-Z\d]|Prepared by Procedure"
    r"|in (?:the )?(?:procedure|process|method) of (?:Example|example)|in accordance with (?:the )?(?:process|procedure|method|general))"
)
_REFERRED = re.compile(r"(?:Example|EXAMPLE|Ex\.|example|Step|Preparation|Procedure|Method|Scheme|Intermediate)s? [A-Z\d][\w.-]*|general procedure(?: [A-Z\d]\w*)?")
_MADE = re.compile(r"\b(?:prepared|obtained|synthesi[sz]ed|made|produced|converted|carried out|reacted|performed|gave|yielded|treated|isolated|substituting|repeated|purified|working up|worked up|conducted|given|afforded|get|substituted|Reaction)\b", re.IGNORECASE)
_UNTIL = frozenset(("until", "till"))
_CIRCUMSTANCE = frozenset(("at", "under", "in", "for", "over", "during", "within", "after", "while", "with", "to", "below", "between", "until", "into", "on", "by", "from", "before", "", "through", "without", "using", "since", "when", "once", "of", "than", "against", "as"))
_SOLVENTS = frozenset("solvent solvents volatiles solution liquor components excess thf ether ethanol methanol toluene dmf water acetone dichloromethane pyridine benzene chloroform dioxane acetonitrile reagent tfa chloride".split())
_NOT_SOLVENT = frozenset("bath catalyst insolubles solid solids precipitate material salts salt crystals agent desiccant sulfate celite impurities carbon".split())
_INTERMEDIATES = frozenset("residue oil solid product crystals precipitate material foam liquid powder".split())
_MONITOR = re.compile(
    r"\b(?:LC-?/?MS|TLC|HPLC|GC|t\.l\.c\.)(?: analysis| control| monitoring)? (?:showed|shows|indicated|indicates|revealed|confirmed)"
    r"|\bno starting material remain|\b(?:as )?(?:monitored|followed|judged|determined|indicated|shown) by (?:TLC|HPLC|LC-?/?MS|GC|tlc)"
)
_LAYERS = frozenset("layer layers phase phases".split())
_STOCK_WORDS = frozenset(("saturated", "concentrated", "dilute", "aqueous", "half-saturated", "glacial"))
_WATERY = frozenset(("organic", "aqueous"))
_COLUMN = re.compile(r"\b(?:column|silica|chromatograph\w*|hplc|biotage|flash|tlc|spe|combiflash|isco|alumina|sio2)\b", re.IGNORECASE)


@dataclass
class _Draft:
    """What has been read so far.

    Attributes:
        owned: 1 for each character that an action owns or that is remark or data.
        last_solid: whether the batch is a solid.
        analyzed: whether the last action is an analysis.
    """

    text: str
    actions: list[Action] = field(default_factory=list)
    owned: bytearray = field(default_factory=bytearray)
    last_solid: bool = False
    roles: dict[str, Role] = field(default_factory=dict)
    started_with_batch: bool = False
    product: str = ""
    result: str = ""

    def own(self, start: int, end: int) -> None:
        self.owned[start:end] = b"\1" * (end - start)


def read_procedure(text: str) -> ActionList:
    """Return the actions that a procedure in English tells; the same text gives the same actions.

    Raises:
        ValueError: the text is longer than `MAX_TEXT` characters.
    """
    if len(text) > MAX_TEXT:
        raise ValueError(f"the text has {len(text)} characters, at most {MAX_TEXT} are read: give one procedure at a time")
    simple = plain(text)
    numbers = figures(simple)
    draft = _Draft(text, owned=bytearray(len(text)))
    reader = _Reader(draft, simple)
    parts = sentences(simple, numbers)
    for sentence in parts:
        reader.sentence(sentence)
    unread = tuple(_unread(draft, parts))
    actions = tuple(draft.actions)
    return ActionList(
        text=text,
        actions=actions,
        outcome=_outcome(draft, unread),
        unread=unread,
        product=draft.product[:500],
        result=draft.result[:300],
        roles=draft.roles,
    )


def _outcome(draft: _Draft, unread: Sequence[Unread]) -> Outcome:
    verbs = [action.verb for action in draft.actions]
    if "Refers" in verbs:
        return "refers"
    before = [action for action in draft.actions if action.verb in ("Add", "MakeSolution", "Dissolve", "Hydrogenate")]
    measured = any(_is_measured(portion.amount) for action in before for portion in action.takes)
    quantities = any(item.why.startswith("amount") for item in unread)
    ends = "Yield" in verbs
    return "complete" if measured and ends and not draft.started_with_batch and not quantities else "partial"


def _is_measured(amount: str) -> bool:
    return bool(re.search(r"\d (?:g|mL|mol|mmol|mg|equiv|parts)\b", amount))


def _unread(draft: _Draft, parts: Iterable[Sentence]) -> Iterable[Unread]:
    for sentence in parts:
        for token in _leaves(sentence.tokens):
            if any(draft.owned[token.start : token.end]):
                continue
            kind = token.figure.kind if token.figure is not None else None
            if kind is not None and kind not in ("other", "length", "ratio", "repeats"):
                yield Unread(start=token.start, end=token.end, text=draft.text[token.start : token.end], why=f"amount or condition ({kind}) that no action owns")
            elif token.kind == "name" and len(token.text) > 2:
                yield Unread(start=token.start, end=token.end, text=draft.text[token.start : token.end][:1000], why="name that no action owns")


def _leaves(tokens: Iterable[Token]) -> Iterable[Token]:
    for token in tokens:
        if token.kind == "group":
            yield from _leaves(token.inner)
        else:
            yield token


class _Reader:
    """Reads sentence by sentence; the draft grows."""

    def __init__(self, draft: _Draft, text: str) -> None:
        self.draft = draft
        self.text = text
        self._data = False
        self._solution_made = False
        self._group_words: set[str] = set()

    def sentence(self, sentence: Sentence) -> None:
        """Read one sentence."""
        tokens = sentence.tokens
        parts, _ = clauses(tokens)
        if self._data and tokens and (not parts or self._is_spectrum(tokens)):
            self.draft.own(tokens[0].start, tokens[-1].end)
            return
        self._data = False
        if tokens:
            start, end = tokens[0].start, tokens[-1].end
            watched = _MONITOR.search(self.text, start, end)
            early = watched is not None and parts and watched.start() < self._found(parts[0])[0]
            if watched is not None and early:
                self._emit("Monitor", watched.span())
            reference = self._reference(start, end)
            if reference:
                self._refer(reference, tokens, parts)
            else:
                for number, clause in enumerate(parts):
                    self._clause(clause, number == 0)
            if watched is not None and not early and not (self.draft.actions and self.draft.actions[-1].verb == "Monitor"):
                self._emit("Monitor", watched.span())
        if sentence.data is not None:
            self.draft.own(*sentence.data)
            self._data = True
            if self._completes(sentence.data):
                return
            if not self.draft.actions or self.draft.actions[-1].verb != "Analyze":
                if self.draft.actions:
                    self._emit("Analyze", sentence.data, stated=True)

    def _completes(self, span: tuple[int, int]) -> bool:
        """Return whether data belong to the last actions: the boiling range of a distillation, or the yield."""
        words = self.text[slice(*span)].lstrip(" ,;:(").lower()
        values = figures(self.text[span[0] : span[1]])
        last = self.draft.actions
        if words.startswith(("yield", "overall crude yield")) and last and last[-1].verb == "Yield" and last[-1].gives:
            share = next((item for item in values if item.kind == "percent"), None)
            if share is not None:
                first, *rest = last[-1].gives
                amount = ", ".join(filter(None, (first.amount, _written(share, 1))))
                last[-1] = last[-1].model_copy(update={"gives": (first.model_copy(update={"amount": amount}), *rest)})
            return True
        if words.startswith(("b.p", "bp", "boiling", "b. p")):
            place = next((k for k in range(len(last) - 1, max(-1, len(last) - 4), -1) if last[k].verb == "Distill"), None)
            if place is not None:
                ranges = [_mercury(item) for item in values if item.kind in ("temperature", "pressure") or item.text.endswith("mm")]
                known = {key: value for key, value in _held_at(ranges).items() if key != "then"}
                last[place] = last[place].model_copy(update=known)
                return True
        return False

    def _is_spectrum(self, tokens: Sequence[Token]) -> bool:
        """Return whether a sentence goes on with peaks: "3.99 (s, 3H)"."""
        head = self.text[tokens[0].start : tokens[0].start + 60]
        return bool(re.match(r"[-+]?\d+(?:\.\d+)?(?:-\d+(?:\.\d+)?)? ?\(", head))

    def _reference(self, start: int, end: int) -> re.Match[str] | None:
        match = _REFERS.search(self.text, start, end)
        if match is None:
            return None
        depth = 0
        for char in self.text[start : match.start()]:
            depth += (char in "([") - (char in ")]")
        if depth > 0 or not _MADE.search(self.text, start, end):
            return None
        return match

    def _refer(self, match: re.Match[str], tokens: Sequence[Token], parts: Sequence[Clause]) -> None:
        label = _REFERRED.search(self.text, match.start(), min(tokens[-1].end, match.end() + 60))
        name = self.draft.text[slice(*label.span())] if label else self.draft.text[slice(*match.span())]
        phrases = PhraseReader(tokens, True).read()
        yields = [clause for clause in parts if clause.head.word.verb == "Yield"]
        first_yield = self._found(yields[0])[0] if yields and not yields[0].head.passive else len(self.text)
        sources = [phrase for phrase in phrases if phrase.prep in ("from", "with", "using", "substituting", "of", "and") and phrase.start < first_yield]
        for place, token in enumerate(tokens):
            if token.low in ("substituting", "employing", "replacing"):
                sources = [phrase for phrase in PhraseReader(tokens[place + 1 :]).read() if phrase.prep == "" and phrase.substances][:1]
        used = [item for phrase in sources for item in phrase.substances if item.start < first_yield and not (match.start() <= item.start < match.end())]
        used += [item for phrase in phrases for item in phrase.substances if item.is_measured and item not in used and item.start < first_yield]
        if used and not any(clause.head.word.verb in ("Add", "Dissolve", "MakeSolution") for clause in parts):
            used = [item for k, item in enumerate(used) if all(item.start != other.start for other in used[:k])]
            self._emit("Add", (used[0].start, used[-1].end), [self._portion(item) for item in used])
        for number, clause in enumerate(parts):
            if clause.head.word.verb != "Yield":
                self._clause(clause, number == 0)
        self._emit("Refers", match.span(), note=name[:400])
        self.draft.own(*match.span())
        if label:
            self.draft.own(*label.span())
        for number, clause in enumerate(parts):
            if clause.head.word.verb == "Yield":
                self._clause(clause, number == 0)
        if not yields:
            named = _label(tokens) if tokens[0].low in ("the", "this") else None
            product = [item for item in phrases[0].substances if phrases[0].prep == "" and item not in used]
            if named is not None or (product and any(token.low in ("prepared", "obtained", "synthesized", "synthesised", "made") for token in tokens)):
                start, end = named or (product[0].start, product[0].end)
                result = Portion(name=self.draft.text[start:end][:200], span=(start, end))
                self.draft.own(start, end)
                self._emit("Yield", (start, end), gives=(result,))

    # -- one operation ------------------------------------------------------------------------------------------

    def _clause(self, clause: Clause, first: bool) -> None:
        head = clause.head
        before = PhraseReader(clause.before, head.word.verb == "Yield" and head.passive).read()
        after = PhraseReader(clause.after, head.word.verb == "Yield").read()
        if first and not self.draft.actions and self._speaks_of_batch(before) and not _substances(before):
            self.draft.started_with_batch = True
        if head.marker not in ("after",):
            self._waited(before, clause)
        self._group_words = {token.low for token in clause.group if token.low in MANNERS}
        _HANDLERS.get(head.word.frame, _Reader._held)(self, clause, before, after)
        self._group_words = set()

    def _speaks_of_batch(self, phrases: Sequence[Phrase]) -> bool:
        return any(phrase.nouns for phrase in phrases)

    def _waited(self, before: list[Phrase], clause: Clause) -> None:
        """Emit the period that a clause begins with: "After 30 min, water was added"."""
        for phrase in before:
            times = [item for item in phrase.conditions if item.kind == "time"]
            later = any(word in ("later", "after") for other in before for word in other.words)
            if times and (phrase.prep == "after" or (phrase.prep == "" and later)):
                verb: Verb = "Stir" if "stirring" in phrase.words else "Wait"
                near = [other for other in before if other is phrase or (other.prep in ("at", "under") and other.conditions)]
                spent = [item for other in near for item in other.conditions]
                if clause.head.word.frame == "hold" and not clause.before[-1:] and clause.head.low.endswith("ing"):
                    continue
                self._emit(verb, (phrase.start, phrase.end), conditions=spent)
                for other in near:
                    other.conditions = []

    def _conditions(self, *groups: Sequence[Phrase]) -> list[Figure]:
        return [item for phrases in groups for phrase in phrases if phrase.prep in _CIRCUMSTANCE for item in phrase.conditions]

    def _span(self, clause: Clause) -> tuple[int, int]:
        tokens = [token for token in (*clause.before, *clause.after) if token.kind != "mark"]
        start = self._verb_start(clause)
        end = max([token.end for token in clause.after if token.kind != "mark"], default=start[1])
        return (start[0] if not tokens else start[0], max(end, start[1]))

    def _verb_start(self, clause: Clause) -> tuple[int, int]:
        return self._place[clause.head.place] if hasattr(self, "_place") else self._found(clause)

    def _found(self, clause: Clause) -> tuple[int, int]:
        """Return the span of an operation word, which lies between its two regions."""
        low = clause.head.low
        start = clause.before[-1].end if clause.before else None
        if start is None and clause.after:
            at = self.text.lower().rfind(low.split()[0], 0, clause.after[0].start)
        else:
            at = self.text.lower().find(low.split()[0], start or 0)
        at = max(at, 0)
        return at, at + len(low.split()[0])

    def _charge(self, phrases: Sequence[Phrase], span_end: int, always: bool = False) -> None:
        """Emit what the flask holds before an operation: a solution, or substances."""
        loose: list[Substance] = []
        solvents: list[Substance] = []
        for phrase in phrases:
            for item in [item for item in phrase.substances if self._is_intermediate(item, phrase)]:
                phrase.substances.remove(item)
                self._emit("Yield", (item.start, item.end), gives=(self._portion(item),))
            if phrase.prep not in ("", "to", "of", "in", "into", "with"):
                continue
            if not phrase.substances:
                continue
            if phrase.is_prepared or (phrase.solution is not None and any(item.is_measured for item in phrase.substances)):
                self._make(phrase)
            elif any(item.solvent for item in phrase.substances) and (always or any(item.is_measured for item in phrase.substances)):
                self._make(phrase)
            elif always or any(item.is_measured for item in phrase.substances):
                (solvents if phrase.prep == "in" else loose).extend(phrase.substances)
        if loose and solvents:
            items = [*loose, *solvents]
            self._emit("MakeSolution", (items[0].start, items[-1].end), [self._portion(item) for item in items])
        elif loose or solvents:
            items = loose or solvents
            self._emit("Add", (items[0].start, items[-1].end), [self._portion(item) for item in items])

    def _is_intermediate(self, item: Substance, phrase: Phrase) -> bool:
        """Return whether a name is that of the batch with its mass: "The residue (21.3 g) was distilled"."""
        name = self.text[item.start : item.end].lower()
        return item.weak and name in _INTERMEDIATES and phrase.prep == "" and bool(self.draft.actions) and item.is_measured

    def _make(self, phrase: Phrase) -> None:
        items = phrase.substances
        self._own_loose(phrase)
        self._emit("MakeSolution", (phrase.start, phrase.end), [self._portion(item) for item in items], ratios=phrase.ratios)

    def _own_loose(self, phrase: Phrase) -> None:
        for item in phrase.ratios:
            self.draft.own(item.start, item.end)

    def _portions(self, phrases: Iterable[Phrase]) -> list[Portion]:
        return [self._portion(item, phrase) for phrase in phrases for item in phrase.substances]

    def _portion(self, item: Substance, phrase: Phrase | None = None) -> Portion:
        self.draft.own(item.start, item.end)
        repeats = phrase.repeats if phrase is not None else 1
        return Portion(name=self.draft.text[item.start : item.end][:200], amount=self._amount(item, repeats), span=(item.start, item.end))

    def _amount(self, item: Substance, repeats: int = 1) -> str:
        parts: list[str] = []
        strengths: list[str] = []
        for value in item.amounts:
            self.draft.own(value.start, value.end)
            written = _written(value, repeats)
            if value.kind in ("molarity", "percent"):
                strengths.append(written)
            elif written and written not in parts:
                parts.append(written)
        words = list(dict.fromkeys(item.words))
        if strengths or len(words) > 1:
            words = [word for word in words if word != "aqueous"]
        stock = strengths + [word for word in words if word in _STOCK_WORDS]
        rest = [word for word in words if word not in _STOCK_WORDS]
        for strength in stock:
            if parts and " of " not in parts[0]:
                parts[0] = f"{parts[0]} of {strength}"
            else:
                parts.append(strength if not strength[0].isdigit() else f"of {strength}")
        return ", ".join([*parts, *rest])[:200]

    def _emit(
        self,
        verb: Verb,
        span: tuple[int, int],
        takes: Sequence[Portion] = (),
        conditions: Sequence[Figure] = (),
        phrases: Sequence[Phrase] = (),
        ratios: Sequence[Figure] = (),
        stated: bool = True,
        **fields: Any,
    ) -> None:
        words = {word for phrase in phrases for word in phrase.words} | self._group_words
        self._group_words = set()
        for phrase in phrases:
            for item in phrase.vessels:
                self.draft.own(item.start, item.end)
        for item in (*conditions, *ratios):
            self.draft.own(item.start, item.end)
        values: dict[str, Any] = {"verb": verb, "takes": tuple(takes)[:30], **_held_at(conditions), **fields}
        manner = next((MANNERS[word] for word in words if MANNERS.get(word)), None)
        if "portions" in words and manner is None:
            manner = "portionwise"
        if manner:
            values.setdefault("manner", manner)
        gas = next((word for word in words if word in GASES.values()), None)
        gas = gas or next((GASES[word] for word in words if word in GASES), None)
        if gas:
            values.setdefault("atmosphere", gas)
        if words & {"vacuo", "vacuum"} or {"reduced", "pressure"} <= words:
            values.setdefault("atmosphere", "vacuum")
        counted = [phrase for phrase in phrases if phrase.repeated is not None]
        if counted and "repeats" not in fields:
            values["repeats"] = max(1, counted[0].repeats)
        for phrase in counted:
            assert phrase.repeated is not None
            self.draft.own(phrase.repeated.start, phrase.repeated.end)
        if ratios:
            stated_ratio = ", ".join(self.draft.text[item.start : item.end] for item in ratios)
            values["note"] = "; ".join(filter(None, (values.get("note", ""), stated_ratio)))[:400]
        part = next((noun for phrase in phrases for noun in (*phrase.words, *phrase.nouns) if noun in _WATERY), None)
        if part and "part" not in values and verb in ("Wash", "Extract", "DrySolution", "Concentrate", "Filter", "AdjustPH", "Dissolve"):
            values["part"] = part
        if not stated:
            values["assumed"] = (*values.get("assumed", ()), "verb")
        start, end = span
        values["span"] = (start, max(end, start + 1))
        self.draft.actions.append(Action(**values))
        for portion in takes:
            self.draft.roles.setdefault(portion.name, _role(verb, portion, self.draft.actions))
        self._solution_made = verb in ("MakeSolution", "Dissolve")

    # -- frames -------------------------------------------------------------------------------------------------

    def _added(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        head = clause.head
        subject = [phrase for phrase in before if phrase.prep == "" and (phrase.substances or phrase.solution is not None)]
        theme = subject
        object_ = [phrase for phrase in after if phrase.prep in ("", "of") and phrase.substances]
        inverted = not subject or not head.passive
        if inverted and object_:
            theme = [*object_]
        targets = [phrase for phrase in (*before, *after) if phrase.prep in ("to", "into", "onto", "in", "on") and phrase not in theme]
        targets = [phrase for phrase in targets if phrase.substances]
        extra = [phrase for phrase in after if phrase.prep in ("with", "containing", "and", "using", "by") and phrase.substances and head.low != "adding"]
        spare = [phrase for phrase in before if phrase.prep in ("with", "of") and phrase.substances]
        if head.low in ("combined", "mixed", "combine", "mix", "combining") and not theme and not extra:
            return
        if inverted and subject and object_ and not head.passive and head.marker != "followed":
            targets = [*subject, *targets]
        if not theme and not head.passive and subject:
            theme = subject
        if head.low.startswith(("charg", "load", "flask")) and extra and not theme:
            theme, extra = extra, []
        solvent_like = head.low.startswith(("combin", "mix", "plac", "blend", "admix", "put", "introduc"))
        if solvent_like:
            medium = [phrase for phrase in targets if phrase.prep == "in"]
            targets = [phrase for phrase in targets if phrase not in medium]
            theme = [*theme, *medium]
        batch = {noun for phrase in before if phrase.prep == "" for noun in phrase.nouns}
        if not theme and not extra and head.passive and targets and batch & {"mixture", "solution", "reaction", "residue", "suspension", "slurry"}:
            self._emit("Pour", self._span(clause), self._portions(targets), self._conditions(before, after), [*before, *after])
            return
        for phrase in targets:
            self._charge([phrase], phrase.end, always=not self.draft.actions or any(item.is_measured for item in phrase.substances))
        circumstances = [phrase for phrase in (*before, *after) if phrase not in targets]
        self._theme([*theme, *extra], self._span(clause), circumstances)
        del spare

    def _theme(self, theme: Sequence[Phrase], span: tuple[int, int], circumstances: Sequence[Phrase], verb: Verb = "Add") -> None:
        conditions = self._conditions(circumstances)
        takes: list[Portion] = []
        made = ""
        for phrase in theme:
            if phrase.is_prepared:
                self._make(phrase)
                first = phrase.substances[0]
                made = phrase.solution.low if phrase.solution is not None else self.draft.text[first.start : first.end]
            else:
                takes += self._portions([phrase])
        dangling = not theme and (self._solution_made or any("solution" in phrase.nouns for phrase in circumstances if phrase.prep == ""))
        if made or dangling:
            noun = next((noun for phrase in circumstances for noun in phrase.nouns if noun in SOLUTIONS), "solution")
            self._emit(verb, span, takes, conditions, circumstances, part="solution", note=made or noun)
        elif takes or verb != "Add":
            ratios = [item for phrase in theme for item in phrase.ratios]
            stirred = any("stirring" in phrase.words for phrase in circumstances) and any(
                item.kind == "time" for item in conditions
            )
            if stirred and takes:
                self._emit(verb, span, takes, (), (), ratios)
                self._emit("Stir", span, (), conditions, circumstances)
            else:
                self._emit(verb, span, takes, conditions, circumstances, ratios)
        else:
            self._leave(circumstances)

    def _leave(self, phrases: Sequence[Phrase]) -> None:
        """Keep conditions of a word that is no action on the last action."""
        found = self._conditions(phrases)
        if found and self.draft.actions:
            last = self.draft.actions[-1]
            more = _held_at(found)
            first = Stretch(**{key: more[key] for key in ("temperature", "final_temperature", "duration") if key in more})
            for item in found:
                self.draft.own(item.start, item.end)
            self.draft.actions[-1] = last.model_copy(update={"then": (*last.then, first, *more.get("then", ()))[:20]})

    def _with(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        head = clause.head
        verb = head.word.verb
        if head.marker in ("", "after", "by", "to", "upon", "on") or head.passive:
            measured = [phrase for phrase in before if phrase.prep in ("", "to", "of", "in")]
            if not head.passive and head.marker in ("by", "after", "upon", "on", "to"):
                measured = []
            self._charge(measured, 0, always=verb == "Add" and not self.draft.actions)
        reagents = [phrase for phrase in after if phrase.prep in ("with", "by", "using", "of", "into", "to", "") and phrase.substances]
        if verb in ("Hydrogenate",):
            reagents = [phrase for phrase in after if phrase.substances]
        if verb == "Add" and not reagents:
            if head.low.startswith(("react", "condens")):
                self._emit("Wait", self._span(clause), (), self._conditions(before, after), [*before, *after])
            return
        if head.low.startswith(("react", "treat")):
            reagents = [phrase for phrase in after if phrase.prep in ("with", "in", "of", "using", "containing", "and", "") and phrase.substances]
        if verb == "Add":
            self._theme(reagents, self._span(clause), [*before, *after])
        elif verb in ("Wash", "Extract"):
            self._liquids(clause, before, after)
        elif verb == "AdjustPH":
            self._emit(verb, self._span(clause), self._portions(reagents), self._conditions(before, after), [*before, *after])
        else:
            self._theme(reagents, self._span(clause), [*before, *after], verb)

    def _liquids(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        """Emit washes and extractions: each liquid of a list is an action, a mixed liquid is one."""
        verb = clause.head.word.verb
        liquids = [phrase for phrase in after if phrase.prep in ("with", "using", "in", "into", "by", "of", "") and phrase.substances]
        rest = [phrase for phrase in (*before, *after) if phrase not in liquids]
        conditions = self._conditions(before, after)
        span = self._span(clause)
        counts = [phrase for phrase in (*before, *after) if phrase.repeated is not None]
        emitted = False
        for phrase in liquids:
            batches: list[list[Substance]] = []
            for item in phrase.substances:
                if batches and (item.paired or (phrase.solution is not None) or (item.solvent and not emitted) or verb == "Extract"):
                    batches[-1].append(item)
                else:
                    batches.append([item])
            for batch in batches:
                repeats = self._repeats(phrase, batch, counts, after)
                takes = [self._portion(item) for item in batch]
                own = [*rest, phrase] if not emitted else rest
                self._emit(
                    verb, span if not emitted else (batch[0].start, batch[-1].end), takes,
                    conditions if not emitted else (), own, phrase.ratios if not emitted else (), repeats=repeats,
                )  # fmt: skip
                emitted = True
        if not emitted:
            self._emit(verb, span, (), conditions, [*before, *after])

    def _repeats(self, phrase: Phrase, batch: Sequence[Substance], counts: Sequence[Phrase], after: Sequence[Phrase]) -> int:
        portions = max((value.portions for item in batch for value in item.amounts), default=1)
        if portions > 1:
            return portions
        if phrase.repeated is not None:
            self.draft.own(phrase.repeated.start, phrase.repeated.end)
            return max(1, phrase.repeats)
        place = after.index(phrase)
        if place and after[place - 1].repeated is not None and not after[place - 1].substances:
            repeated = after[place - 1].repeated
            assert repeated is not None
            self.draft.own(repeated.start, repeated.end)
            return max(1, after[place - 1].repeats)
        tail = [other for other in counts if after and other is after[-1]]
        return max(1, tail[0].repeats) if tail and not tail[0].substances else 1

    def _dissolved(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        verb = clause.head.word.verb
        if clause.head.low == "taken" and clause.head.last == clause.head.place:
            return self._collected(clause, before, after)
        solvents = [phrase for phrase in (*after, *before) if phrase.prep in ("in", "with", "into") and phrase.substances]
        solutes = [phrase for phrase in before if phrase.prep in ("", "of") and phrase.substances]
        solutes += [phrase for phrase in after if phrase.prep == "" and phrase.substances]
        takes = self._portions([*solutes, *solvents])
        ratios = [item for phrase in (*solutes, *solvents) for item in phrase.ratios]
        phrases = [*before, *after]
        self._emit(verb, self._span(clause), takes, self._conditions(phrases), phrases, ratios)
        return None

    def _poured(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        onto = [phrase for phrase in after if phrase.prep in ("onto", "into", "on", "to", "in", "over", "upon") and phrase.substances]
        theme = [phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)]
        self._charge(theme, 0)
        phrases = [*before, *after]
        self._emit("Pour", self._span(clause), self._portions(onto), self._conditions(phrases), phrases)

    def _held(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        head = clause.head
        verb = head.word.verb
        phrases = [*before, *after]
        if head.low in ("stirring", "heating", "cooling") and head.passive is False and head.marker == "" and not self._conditions(phrases) and not clause.after:
            return
        medium = [phrase for phrase in after if phrase.prep in ("with", "in") and any(item.is_measured for item in phrase.substances)]
        subject = [phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)]
        if medium and subject and head.passive and all(phrase.solution is None for phrase in (*medium, *subject)):
            items = [item for phrase in (*subject, *medium) for item in phrase.substances]
            for phrase in medium:
                phrase.substances = []
            self._emit("MakeSolution", (items[0].start, items[-1].end), [self._portion(item) for item in items])
        elif head.marker not in ("by", "after", "upon", "on", "to", "while") or head.passive:
            self._charge([phrase for phrase in before if phrase.prep in ("", "of", "to", "in", "into")], 0)
        words = {word for phrase in after for word in (*phrase.words, *phrase.nouns)}
        reflux = "reflux" in words or any(token.low in ("reflux", "refluxing") for token in clause.after[:5])
        conditions = self._conditions(phrases)
        fields: dict[str, Any] = {}
        temperatures = [item for item in conditions if item.kind == "temperature"]
        if verb in ("Heat", "Wait", "SetTemperature") and reflux and (not temperatures or verb == "Wait"):
            verb = "Reflux"
        elif verb == "Wait" and any(token.low in ("stirring", "agitation", "shaking") for token in clause.after[:6]):
            verb = "Stir"
        elif verb == "Wait" and head.low in ("allowed", "left", "let", "allow") and temperatures and any(
            token.low in ("reach", "attain", "come", "return", "equilibrate", "adapt") for token in clause.after[:4]
        ):
            verb = "SetTemperature"
        if verb == "SetTemperature":
            if any(item.kind == "ph" for item in conditions):
                if self.draft.actions and self.draft.actions[-1].verb == "Add" and head.marker == "to":
                    merged = {**_held_at(conditions), "verb": "AdjustPH"}
                    merged.pop("then", None)
                    for item in conditions:
                        self.draft.own(item.start, item.end)
                    self.draft.actions[-1] = self.draft.actions[-1].model_copy(update=merged)
                    return
                verb = "AdjustPH"
            elif not temperatures:
                if reflux:
                    verb = "Reflux"
                else:
                    return
            elif head.low in ("raised", "rises", "raise", "rose", "raises") and False:
                verb = "Heat"
        if verb == "Stir" and any(token.low in ("hydrogen", "h2") for token in clause.after):
            names = [token for token in clause.after if token.low in ("hydrogen", "h2")]
            gas = Portion(name=self.draft.text[names[0].start : names[0].end], span=(names[0].start, names[0].end))
            self.draft.own(*gas.span)
            self._emit("Hydrogenate", self._span(clause), [gas], conditions, phrases)
            return
        if verb == "Purge":
            gases = [GASES[token.low] for token in clause.after if token.low in GASES]
            names = [token for token in clause.after if token.low in GASES]
            for token in names:
                self.draft.own(token.start, token.end)
            fields["atmosphere"] = gases[0] if gases else "vacuum" if head.low.startswith("evac") else None
        if verb == "Wait" and head.low in ("left", "leave", "leaving", "let", "held", "hold", "kept", "keep", "maintained", "allowed", "continued") and not conditions and head.low in ("left", "let", "leave", "leaving", "continued"):
            return
        takes: list[Portion] = []
        added = [phrase for phrase in after if phrase.prep in ("with", "in") and phrase.substances and any(item.is_measured for item in phrase.substances)]
        if added and verb in ("Stir", "Heat", "Wait", "Reflux", "Irradiate", "Cool"):
            for phrase in added:
                if phrase.is_prepared:
                    self._make(phrase)
                else:
                    takes += self._portions([phrase])
            if takes:
                self._emit("Add", (takes[0].span or (0, 1))[:1] + (takes[-1].span or (0, 1))[1:], takes)
        until = any(token.low in _UNTIL for token in clause.after)
        if until:
            for token in clause.after:
                self.draft.own(token.start, token.end)
        self._emit(verb, self._span(clause), (), conditions, phrases, **fields)

    def _nothing(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        """Emit an operation that takes no substance: evaporation, distillation, separation, purification, transfer."""
        head, verb = clause.head, clause.head.word.verb
        phrases = [*before, *after]
        nouns = {noun for phrase in phrases for noun in (*phrase.nouns, *phrase.words)}
        subject = {token.low for token in clause.before} | ({token.low for token in clause.after[:6]} if not head.passive else set())
        if verb == "PhaseSeparation":
            return self._collected(clause, before, after)
        if head.low.startswith(("remov", "elimin", "freed")):
            if head.marker in ("to",) and not head.passive and not self._is_first(clause):
                self._own_names(phrases)
                return None
            solvent = subject & _SOLVENTS or any(phrase.substances for phrase in phrases)
            if subject & _NOT_SOLVENT:
                if head.method and verb == "Filter":
                    return self._filtered(clause, before, after)
                if subject & {"bath"}:
                    return None
                solvent = set()
            if not solvent and not head.method and "freed" not in head.low:
                return None
        if verb == "Chromatograph":
            return self._chromatographed(clause, before, after)
        if verb == "Purify":
            if _COLUMN.search(" ".join(token.low for token in (*clause.group, *clause.after))) or any("gel" in phrase.words for phrase in after):
                return self._chromatographed(clause, before, after)
            if "recrystallization" in nouns:
                verb = "Recrystallize"
        takes: list[Portion] = []
        if head.low.startswith("azeotrop") or (verb == "Concentrate" and any(phrase.prep == "with" and phrase.substances for phrase in after)):
            takes = self._portions([phrase for phrase in after if phrase.prep in ("with", "from") and phrase.substances])
        if head.passive or head.marker in ("", "by"):
            self._charge([phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances) and not head.low.startswith("remov")], 0)
        self._own_names(phrases)
        if verb == "Wait":
            return None
        self.draft.last_solid = False
        self._emit(verb, self._span(clause), takes, self._conditions(phrases), phrases)
        return None

    def _is_first(self, clause: Clause) -> bool:
        return not clause.before and clause.head.place == 0

    def _own_names(self, phrases: Iterable[Phrase]) -> None:
        """Own names that an operation is done to, not what it takes: the solvent that is removed."""
        for phrase in phrases:
            for item in phrase.substances:
                if not item.is_measured:
                    self.draft.own(item.start, item.end)

    def _collected(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        """Emit what separates: layers, one layer, or a solid."""
        phrases = [*before, *after]
        near = {token.low for token in (clause.before if clause.head.passive or clause.before else clause.after[:6])}
        if not clause.head.passive and not near & (_LAYERS | SOLID):
            near |= {token.low for token in clause.after[:6]}
        span = self._span(clause)
        conditions = self._conditions(phrases)
        self._own_names(phrases)
        if clause.head.method in ("filtration",):
            return self._filtered(clause, before, after)
        one = next((part for part in ("organic", "aqueous") if part in near), None)
        if "water" in near and near & _LAYERS:
            one = one or "aqueous"
        if near & {"layers", "phases"} or (near & _LAYERS and one is None) or {"organic", "aqueous"} <= near:
            self._emit("PhaseSeparation", span, (), conditions, phrases, part=None)
        elif near & {"layer", "phase", "extract", "extracts", "organics"}:
            self._emit("CollectLayer", span, (), conditions, phrases, keep=one)
        elif near & SOLID or "crystal" in near or clause.head.low in ("separated", "separating"):
            return self._filtered(clause, before, after)
        return None

    def _dried(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        phrases = [*before, *after]
        agents = [phrase for phrase in after if phrase.prep in ("over", "with", "on", "by", "using", "") and phrase.substances]
        words = {token.low for token in clause.after} | {token.low for token in clause.before}
        conditions = self._conditions(phrases)
        heated = any(item.kind in ("temperature", "pressure") for item in conditions)
        airy = bool(words & {"vacuum", "vacuo", "air", "oven", "desiccator", "pressure"})
        solid = self.draft.last_solid or bool({token.low for token in clause.before} & (SOLID | {"residue", "foam", "powder"}))
        if airy and not agents and {token.low for token in clause.before} & {"filtrate", "filtrates", "solution", "eluate"}:
            self._emit("Concentrate", self._span(clause), (), conditions, phrases)
        elif agents and not (solid and airy):
            self._emit("DrySolution", self._span(clause), self._portions(agents), conditions, phrases)
            self.draft.last_solid = False
        elif airy or heated or solid:
            self._own_names(phrases)
            self._emit("DrySolid", self._span(clause), (), conditions, phrases, **({"atmosphere": "air"} if "air" in words else {}))
        else:
            self._emit("DrySolution", self._span(clause), (), conditions, phrases)

    def _filtered(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        phrases = [*before, *after]
        subject = {token.low for token in clause.before} | {token.low for token in clause.after[:5]}
        last = self.draft.actions[-1].verb if self.draft.actions else ""
        if clause.head.low.startswith("collect") and subject & (_LAYERS | {"fractions", "filtrates", "filtrate", "fraction", "extracts"}) and not clause.head.method:
            if subject & _LAYERS:
                return self._collected(clause, before, after)
            return None
        aids = [phrase for phrase in after if phrase.prep in ("over", "through", "on", "via", "with") and phrase.substances]
        assumed: tuple[str, ...] = ()
        if subject & (SOLID | {"crystals"}) and not subject & {"catalyst", "insolubles", "undissolved"}:
            keep = "precipitate"
        elif subject & {"catalyst", "insolubles", "agent", "desiccant"} or last == "DrySolution" or aids or "undissolved" in subject:
            keep, assumed = "filtrate", ("keep",)
        elif clause.head.low.startswith(("collect", "isolat")):
            keep = "precipitate"
        else:
            keep, assumed = "precipitate", ("keep",)
        self._own_names([phrase for phrase in phrases if phrase not in aids])
        self.draft.last_solid = keep == "precipitate"
        self._emit("Filter", self._span(clause), self._portions(aids), self._conditions(phrases), phrases, keep=keep, assumed=assumed)
        return None

    def _over(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        verb = clause.head.word.verb
        if verb == "DrySolution":
            self._dried(clause, before, after)
        elif verb == "Filter":
            self._filtered(clause, before, after)
        else:
            self._chromatographed(clause, before, after)

    def _chromatographed(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        phrases = [*before, *after]
        self._charge([phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)], 0)
        used = [phrase for phrase in phrases if phrase.substances and (phrase.prep != "" or phrase in after or not clause.head.passive)]
        ratios = [item for phrase in phrases for item in phrase.ratios]
        for phrase in used:
            for item in phrase.substances:
                ratios += [value for value in item.amounts if value.kind == "percent"]
                item.amounts = [value for value in item.amounts if value.kind != "percent"]
        takes = self._portions(used)
        loose = [item for phrase in phrases for item in phrase.loose]
        for item in loose:
            self.draft.own(item.start, item.end)
        last = self.draft.actions[-1] if self.draft.actions else None
        if last is not None and last.verb == "Chromatograph" and clause.head.low.startswith(("elut",)):
            more = tuple(portion for portion in takes if portion.name not in {old.name for old in last.takes})
            self.draft.actions[-1] = last.model_copy(update={"takes": (*last.takes, *more)[:30]})
            return
        self._emit("Chromatograph", self._span(clause), takes, self._conditions(phrases), phrases, ratios)

    def _from(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        phrases = [*before, *after]
        verb = clause.head.word.verb
        into = [phrase for phrase in after if phrase.prep in ("into", "onto") and phrase.substances]
        if clause.head.low.startswith("precipitat") and into:
            return self._poured(clause, before, after)
        used = [phrase for phrase in after if phrase.prep in ("from", "in", "with", "using", "of", "by") and phrase.substances]
        used = used or [phrase for phrase in before if phrase.prep in ("in", "from") and phrase.substances]
        if clause.head.low.startswith("precipitat") and not used and not clause.head.passive and not clause.head.word.noun:
            return None
        if not used and clause.head.low in ("crystallized", "crystallised", "crystallize") and not clause.head.passive and clause.head.marker != "to" and clause.head.marker != "by":
            used = []
        self.draft.last_solid = True
        ratios = [item for phrase in used for item in phrase.ratios]
        self._emit(verb, self._span(clause), self._portions(used), self._conditions(phrases), phrases, ratios)
        return None

    def _partitioned(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        used = [phrase for phrase in after if phrase.prep in ("between", "with", "in", "") and phrase.substances]
        phrases = [*before, *after]
        self._emit("Partition", self._span(clause), self._portions(used), self._conditions(phrases), phrases)

    def _gave(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        """Emit a result: the name or label of the product, with its mass, moles and yield."""
        head = clause.head
        source = before if head.passive else after
        tokens = clause.before if head.passive else clause.after
        others = PhraseReader(clause.after, True).read() if head.passive else []
        if not head.passive and before and not any(token.low in ("to", "which") for token in clause.before):
            charged = [phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)]
            del charged
        phrases = [*source, *others]
        found = [item for phrase in source if phrase.prep in ("", "of", "as", "for") for item in phrase.substances]
        if head.low.startswith(("isolat", "recover", "separat")) and not found:
            return
        label = _label(tokens)
        direct = [item for phrase in source if phrase.prep in ("", "of") for item in phrase.substances]
        main = [item for item in direct if any(value.kind in ("mass", "substance") for value in item.amounts)]
        main = main or direct[:1] or found[:1]
        if label is not None and (not main or label[1] <= main[0].start or (label[0] <= main[0].start < label[1]) or label[0] <= main[0].end <= label[1]):
            extra = [value for item in main for value in item.amounts]
            known_name = bool(main) and not main[0].weak and main[0].start >= label[1] and main[0].is_measured
            if not known_name:
                main = [Substance(label[0], label[1], extra)]
        loose = [value for phrase in phrases for value in phrase.loose if value.kind in ("mass", "substance", "percent", "volume", "parts")]
        later = [value for item in found for value in item.amounts if item not in main]
        later += [value for phrase in others for item in phrase.substances for value in item.amounts]
        for phrase in phrases:
            for item in phrase.substances:
                self.draft.own(item.start, item.end)
        if not main and not loose:
            return
        if not main:
            first = loose[0]
            main = [Substance(first.start, first.end)]
        known = {value.start for item in main for value in item.amounts}
        main[0].amounts += [value for value in (*loose, *later) if value.start not in known and value.kind in ("mass", "substance", "percent", "volume", "parts")]
        gives = tuple(self._portion(item) for item in main)[:10]
        for value in self._conditions(phrases):
            self.draft.own(value.start, value.end)
        for phrase in phrases:
            self._own_loose(phrase)
        first_portion = gives[0]
        if not head.passive:
            self._charge([phrase for phrase in before if phrase.prep == "" and phrase.is_prepared], 0)
        if first_portion.name:
            self.draft.product, self.draft.result = first_portion.name, first_portion.amount
        start = min(self._span(clause)[0], main[0].start)
        self._emit("Yield", (start, max(self._span(clause)[1], main[-1].end)), (), (), (), gives=gives)

    def _between(self, clause: Clause, before: list[Phrase], after: list[Phrase]) -> None:
        self._partitioned(clause, before, after)


def _label(tokens: Sequence[Token]) -> tuple[int, int] | None:
    """Return the span of a product's label: "title compound", "product"."""
    for place, token in enumerate(tokens[:10]):
        if token.low in ("as", "with", "which", "in"):
            return None
        if token.low in ("product", "compound", "products", "material", "oil", "solid", "crystals", "powder", "foam", "residue"):
            first = place
            while first and tokens[first - 1].low in ("title", "desired", "titled", "above", "expected", "target"):
                first -= 1
            return tokens[first].start, token.end
        if token.kind == "name":
            return None
    return None


def _substances(phrases: Iterable[Phrase]) -> list[Substance]:
    return [item for phrase in phrases for item in phrase.substances]


def _held_at(conditions: Sequence[Figure]) -> dict[str, Any]:
    """Return the periods, the pressure and the pH that conditions in order make."""
    periods: list[dict[str, float]] = []
    values: dict[str, Any] = {}
    for item in conditions:
        if item.kind == "ph":
            values.setdefault("ph", min(16.0, item.value))
        elif item.kind == "pressure":
            values.setdefault("pressure", min(1000.0, item.value))
        else:
            key = "temperature" if item.kind == "temperature" else "duration"
            value = max(-273.15, min(3000.0, item.value)) if key == "temperature" else min(100_000.0, item.value)
            if not periods or key in periods[-1]:
                periods.append({})
            periods[-1][key] = value
    if periods:
        values.update(periods[0])
        values["then"] = tuple(Stretch(**period) for period in periods[1:])[:20]
    return values


def _mercury(item: Figure) -> Figure:
    """Return a length of mercury as the pressure that it means: "0.2 mm"."""
    if item.kind != "other":
        return item
    return replace(item, kind="pressure", value=round(item.value * 0.00133322, 9))


def _written(value: Figure, repeats: int) -> str:
    """Return an amount in base units as amounts are written: "3 x 30 mL"."""
    if value.kind == "substance":
        if value.value < 0.1:
            return f"{_figure(value.value * 1000.0)} mmol"
        return f"{_figure(value.value)} mol"
    units = {"mass": "g", "volume": "mL", "equivalents": "equiv", "molarity": "M", "percent": "%", "parts": "parts"}
    text = f"{_figure(value.value)} {units[value.kind]}"
    portions = value.portions if value.portions > 1 else repeats if value.kind in ("mass", "volume") else 1
    return f"{portions} x {text}" if portions > 1 else text


def _figure(value: float) -> str:
    return number(value, 6)


def _role(verb: Verb, portion: Portion, actions: Sequence[Action]) -> Role:
    worked_up = any(action.verb in ("Quench", "Extract", "Wash", "Filter", "Concentrate", "Pour", "AdjustPH", "Partition") for action in actions)
    if worked_up:
        return "workup"
    if verb in ("Wash", "Extract", "DrySolution", "Chromatograph", "Recrystallize", "Triturate"):
        return "workup"
    if "mL" in portion.amount and not re.search(r"\d (?:g|mol|mmol|equiv)\b", portion.amount) and " of " not in portion.amount:
        return "solvent"
    return "reactant"


_HANDLERS: dict[str, Callable[[_Reader, Clause, list[Phrase], list[Phrase]], None]] = {
    "theme": _Reader._added,
    "with": _Reader._with,
    "in": _Reader._dissolved,
    "onto": _Reader._poured,
    "from": _Reader._from,
    "hold": _Reader._held,
    "over": _Reader._over,
    "between": _Reader._between,
    "result": _Reader._gave,
    "none": _Reader._nothing,
}
