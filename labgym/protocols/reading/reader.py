"""Reading: a procedure becomes a list of actions, sentence by sentence, operation by operation."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from labgym.errors import OptionError
from labgym.protocols.amounts import figure as number
from labgym.protocols.experiments.model import Action, Period, Portion, Role, Verb
from labgym.protocols.reading.actions import MAX_TEXT, ActionList, Outcome, Unread
from labgym.protocols.reading.clauses import VerbClause, clauses
from labgym.protocols.reading.figures import QuantitySpan, figures, plain
from labgym.protocols.reading.lexicon import GASES, MANNERS, QUALITIES, SOLID, SOLUTIONS
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.phrases import read_phrases
from labgym.protocols.reading.tokens import Sentence, Token, sentences

_REFERS = re.compile(
    r"\b(?:(?:as|that|those|conditions|procedures?|methods?|manner|way|process|"
    r"steps?) (?:described|set forth|set out|given|outlined|indicated|used|reported|in)"
    r"(?: (?:above|earlier|previously|for|in|by|under|the|preparation|synthesis|of|"
    r"general))* ?(?:Example|Ex\.|EXAMPLE|example|Step|step|Preparation|Procedure|procedure|"
    r"Method|method|Scheme|Intermediate|Reference|reference)"
    r"|according to (?:the )?(?:\w+ )?(?:general )?(?:procedures?|methods?|process|Example|"
    r"EXAMPLE|example|protocols?|Scheme|manner)"
    r"|(?:analogous|similar|identical)(?:ly)? (?:procedure |manner |fashion |way )?(?:to|as)\b"
    r"|in an? (?:analogous|similar|identical) (?:manner|fashion|way)|in the same (?:manner|way|"
    r"fashion) (?:as|of)|in a manner (?:analogous|similar|identical)"
    r"|(?:[Ff]ollowing|[Bb]y|[Uu]sing|[Uu]nder|from) (?:the |"
    r"a )?(?:\w+ )?(?:general )?(?:procedures?|methods?|conditions|process) (?:of|in|described|"
    r"as|from|outlined|above|given|similar|analogous|for|that)"
    r"|(?:general|standard) (?:procedure|method)s? [A-Z\d]\b|"
    r"by (?:the )?(?:general )?(?:procedure|method|Procedure|Method) [A-Z\d]|"
    r"Prepared by Procedure"
    r"|in (?:the )?(?:procedure|process|method) of (?:Example|example)|"
    r"in accordance with (?:the )?(?:process|procedure|method|general))"
)
_REFERRED = re.compile(
    r"(?:Example|EXAMPLE|Ex\.|example|Step|Preparation|Procedure|Method|Scheme|"
    r"Intermediate)s? [A-Z\d][\w.-]*|general procedure(?: [A-Z\d]\w*)?"
)
_MADE = re.compile(
    r"\b(?:prepared?|Following|added|obtained|synthesi[sz]ed|made|produced|converted|carried out|"
    r"reacted|performed|gave|yielded|treated|isolated|substituting|repeated|purified|working up|"
    r"worked up|conducted|given|afforded|get|substituted|Reaction)\b",
    re.IGNORECASE,
)
_REACHING = frozenset(("reach", "attain", "come", "return", "equilibrate", "adapt"))
_UNTIL = frozenset(("until", "till"))
_CIRCUMSTANCE = frozenset((
    "at", "under", "in", "for", "over", "during", "within", "after", "while", "with", "to", "below", "between",
    "until", "into", "on", "by", "from", "before", "", "through", "without", "using", "since", "when", "once",
    "of", "than", "against", "as",
))  # fmt: skip
_SOLVENTS = frozenset((
    "solvent", "solvents", "volatiles", "solution", "liquor", "components", "excess", "thf", "ether", "ethanol",
    "methanol", "toluene", "dmf", "water", "acetone", "dichloromethane", "pyridine", "benzene", "chloroform",
    "dioxane", "acetonitrile", "reagent", "tfa", "chloride",
))  # fmt: skip
_NOT_SOLVENT = frozenset((
    "bath", "catalyst", "insolubles", "solid", "solids", "precipitate", "material", "salts", "salt", "crystals",
    "agent", "desiccant", "sulfate", "celite", "impurities", "carbon",
))  # fmt: skip
_UNFINISHED = frozenset(
    ["precipitate", "residue", "suspension", "slurry", "solution", "mixture", "phase", "layer", "layers"]
)
"""What an operation leaves that is no product by itself."""
_INTERMEDIATES = frozenset(
    ["residue", "oil", "solid", "product", "crystals", "precipitate", "material", "foam", "liquid", "powder"]
)
_MONITOR = re.compile(
    r"\b(?:LC-?/?MS|TLC|HPLC|GC|t\.l\.c\.)(?: analysis| control| monitoring)? (?:showed|shows|"
    r"indicated|indicates|revealed|confirmed)"
    r"|\bno starting material remain|\b(?:as )?(?:monitored|followed|judged|determined|indicated|"
    r"shown) by (?:TLC|HPLC|LC-?/?MS|GC|tlc)"
)
_NUMBERED = frozenset((
    "example", "examples", "step", "steps", "scheme", "preparation", "compound", "formula", "intermediate",
    "reference", "section", "table", "method", "part", "procedure", "figure", "no.", "no", "vol.", "page",
    "claim", "structure", "number", "product", "ref", "entry",
))  # fmt: skip
_NUMBER = re.compile(r"^\d{1,6}(?:[.,]\d{1,6})?$")
_RESULTS = frozenset(("mass", "substance", "percent", "volume", "parts"))
_LAYERS = frozenset(["layer", "layers", "phase", "phases"])
_STOCK_WORDS = frozenset(("saturated", "concentrated", "dilute", "aqueous", "half-saturated", "glacial"))
_WATERY = frozenset(("organic", "aqueous"))
_COLUMN = re.compile(
    r"\b(?:column|silica|chromatograph\w*|hplc|biotage|flash|tlc|spe|combiflash|isco|alumina|sio2)\b", re.IGNORECASE
)


@dataclass
class _Draft:
    """State of the reading: what has been read so far.

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
        OptionError: the text is longer than `MAX_TEXT` characters.
    """
    if len(text) > MAX_TEXT:
        limit = f"at most {MAX_TEXT} are read: give one procedure at a time"
        raise OptionError(f"the text has {len(text)} characters, {limit}")
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
        before = {token.start: sentence.tokens[k - 1] for k, token in enumerate(sentence.tokens) if k}
        for token in _leaves(sentence.tokens):
            if any(draft.owned[token.start : token.end]):
                continue
            kind = token.figure.kind if token.figure is not None else None
            if kind is not None and kind not in ("other", "length", "ratio", "repeats"):
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


def _is_numbering(before: Token | None) -> bool:
    """Return whether a number behind a token counts something or numbers it: "Example 3", "compound 12"."""
    return before is None or before.kind in ("name", "mark", "group") or before.low in _NUMBERED


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
        self._lower = text.lower()
        self._data = False
        self._solution_made = False
        self._group_words: set[str] = set()
        self._early: list[TextPhrase] = []

    def sentence(self, sentence: Sentence) -> None:
        """Read one sentence."""
        tokens = sentence.tokens
        parts = clauses(tokens)
        amounts = any(token.figure is not None and token.figure.kind in ("mass", "volume") for token in _leaves(tokens))
        if self._data and tokens and (self._is_spectrum(tokens) or (not parts and not amounts)):
            self.draft.own(tokens[0].start, tokens[-1].end)
            return
        self._data = False
        if tokens:
            start, end = tokens[0].start, tokens[-1].end
            if not parts:
                self._isolated(tokens)
            watched = _MONITOR.search(self.text, start, end)
            early = watched is not None and parts and watched.start() < self._found(parts[0])[0]
            if watched is not None and early:
                self._emit("Monitor", watched.span())
            reference = self._reference(start, end)
            if reference:
                self._refer(reference, tokens, parts)
            else:
                for place, clause in enumerate(parts):
                    self._clause(clause, place == 0)
            if (
                watched is not None
                and not early
                and not (self.draft.actions and self.draft.actions[-1].verb == "Monitor")
            ):
                self._emit("Monitor", watched.span())
        if sentence.data is not None:
            self.draft.own(*sentence.data)
            self._data = True
            if self._completes(sentence.data):
                return
            if not self.draft.actions or self.draft.actions[-1].verb != "Analyze":
                if self.draft.actions:
                    self._emit("Analyze", sentence.data)

    def _isolated(self, tokens: Sequence[Token]) -> None:
        """Emit the result that a sentence without an operation names: "The oily product (78.4 g) was pure"."""
        phrases = read_phrases(tokens, True)
        subject = [item for phrase in phrases[:1] if phrase.prep == "" for item in phrase.substances]
        masses = [item for item in subject if any(value.kind in ("mass", "percent") for value in item.amounts)]
        if (
            masses
            and self.draft.actions
            and (
                masses[0].weak
                or "product" in phrases[0].nouns
                or {"mass", "percent"} <= {v.kind for v in masses[0].amounts}
            )
        ):
            self._emit("Yield", (masses[0].start, masses[0].end), gives=(self._product(masses[0]),))

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
            place = next(
                (k for k in range(len(last) - 1, max(-1, len(last) - 4), -1) if last[k].verb == "Distill"), None
            )
            if place is not None:
                ranges = [
                    _mercury(item)
                    for item in values
                    if item.kind in ("temperature", "pressure") or item.text.endswith("mm")
                ]
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

    def _refer(self, match: re.Match[str], tokens: Sequence[Token], parts: Sequence[VerbClause]) -> None:
        label = _REFERRED.search(self.text, match.start(), min(tokens[-1].end, match.end() + 60))
        name = self.draft.text[slice(*label.span())] if label else self.draft.text[slice(*match.span())]
        phrases = read_phrases(tokens, True)
        yields = [clause for clause in parts if clause.head.word.verb == "Yield"]
        first_yield = self._found(yields[0])[0] if yields and not yields[0].head.passive else len(self.text)
        sources = [
            phrase
            for phrase in phrases
            if phrase.prep in ("from", "with", "using", "substituting", "of", "and") and phrase.start < first_yield
        ]
        for place, token in enumerate(tokens):
            if token.low in ("substituting", "employing", "replacing"):
                sources = [
                    phrase for phrase in read_phrases(tokens[place + 1 :]) if phrase.prep == "" and phrase.substances
                ][:1]
        used = [
            item
            for phrase in sources
            for item in phrase.substances
            if item.start < first_yield and not (match.start() <= item.start < match.end())
        ]
        used += [
            item
            for phrase in phrases
            for item in phrase.substances
            if item.is_measured and item not in used and item.start < first_yield
        ]
        if used and not any(clause.head.word.verb in ("Add", "Dissolve", "MakeSolution") for clause in parts):
            used = [item for k, item in enumerate(used) if all(item.start != other.start for other in used[:k])]
            self._emit("Add", (used[0].start, used[-1].end), [self._portion(item) for item in used])
        for place, clause in enumerate(parts):
            if clause.head.word.verb != "Yield":
                self._clause(clause, place == 0)
        self._emit("Refers", match.span(), note=name[:400])
        self.draft.own(*match.span())
        if label:
            self.draft.own(*label.span())
        for place, clause in enumerate(parts):
            if clause.head.word.verb == "Yield":
                self._clause(clause, place == 0)
        if not yields:
            named = _label(tokens) if tokens[0].low in ("the", "this") else None
            product = [item for item in phrases[0].substances if phrases[0].prep == "" and item not in used]
            if named is not None or (
                product
                and any(token.low in ("prepared", "obtained", "synthesized", "synthesised", "made") for token in tokens)
            ):
                start, end = named or (product[0].start, product[0].end)
                result = Portion(name=self.draft.text[start:end][:200], span=(start, end))
                self.draft.own(start, end)
                self._emit("Yield", (start, end), gives=(result,))

    # -- one operation ------------------------------------------------------------------------------------------

    def _clause(self, clause: VerbClause, first: bool) -> None:
        head = clause.head
        before = read_phrases(clause.before, head.word.verb == "Yield" and head.passive)
        after = read_phrases(clause.after, head.word.verb == "Yield")
        for phrase in (*before, *after):
            for remark in phrase.remarks:
                self.draft.own(*remark)
        if first and not self.draft.actions and self._speaks_of_batch(before) and not _substances(before):
            self.draft.started_with_batch = True
        if head.marker not in ("after",):
            self._waited(before, clause)
        for phrase in before:
            if set(phrase.nouns) & (_LAYERS | {"extract", "extracts"}) or any(
                word in SOLUTIONS for word in phrase.nouns
            ):
                self._own_names([phrase])
        self._group_words = {token.low for token in clause.group if token.low in MANNERS}
        _HANDLERS.get(head.word.frame, _Reader._held)(self, clause, before, after)
        self._group_words = set()

    def _speaks_of_batch(self, phrases: Sequence[TextPhrase]) -> bool:
        return any(phrase.nouns for phrase in phrases)

    def _waited(self, before: list[TextPhrase], clause: VerbClause) -> None:
        """Emit the period that a clause begins with: "After 30 min, water was added"."""
        for phrase in before:
            times = [item for item in phrase.conditions if item.kind == "time"]
            later = any(word in ("later", "after") for other in before for word in other.words)
            if times and (phrase.prep == "after" or (phrase.prep == "" and later)):
                verb: Verb = "Stir" if "stirring" in phrase.words else "Wait"
                near = [
                    other for other in before if other is phrase or (other.prep in ("at", "under") and other.conditions)
                ]
                spent = [item for other in near for item in other.conditions]
                if clause.head.word.frame == "hold" and clause.head.low.endswith("ing"):
                    continue
                self._emit(verb, (phrase.start, phrase.end), conditions=spent)
                for other in near:
                    other.conditions = []

    def _conditions(self, *groups: Sequence[TextPhrase]) -> list[QuantitySpan]:
        return [
            item
            for phrases in groups
            for phrase in phrases
            if phrase.prep in _CIRCUMSTANCE
            for item in phrase.conditions
        ]

    def _span(self, clause: VerbClause) -> tuple[int, int]:
        """Return the span of an operation word and of what follows it."""
        start, stop = self._found(clause)
        return start, max([token.end for token in clause.after if token.kind != "mark"] + [stop])

    def _found(self, clause: VerbClause) -> tuple[int, int]:
        """Return the span of an operation word, which lies between its two regions."""
        low = clause.head.low
        start = clause.before[-1].end if clause.before else None
        if start is None and clause.after:
            at = self._lower.rfind(low.split()[0], 0, clause.after[0].start)
        else:
            at = self._lower.find(low.split()[0], start or 0)
        at = max(at, 0)
        return at, at + len(low.split()[0])

    def _charge(self, phrases: Sequence[TextPhrase], always: bool = False) -> None:
        """Emit what the flask holds before an operation: a solution, or substances."""
        loose: list[SubstanceMention] = []
        solvents: list[SubstanceMention] = []
        for phrase in phrases:
            for item in [item for item in phrase.substances if self._is_intermediate(item, phrase)]:
                phrase.substances.remove(item)
                self._emit("Yield", (item.start, item.end), gives=(self._product(item),))
            if phrase.prep not in ("", "to", "of", "in", "into", "with"):
                continue
            if not phrase.substances:
                continue
            if (
                phrase.is_prepared
                or (phrase.solution is not None and any(item.is_measured for item in phrase.substances))
                or (
                    any(item.solvent for item in phrase.substances)
                    and (always or any(item.is_measured for item in phrase.substances))
                )
            ):
                self._make(phrase)
            elif always or any(item.is_measured for item in phrase.substances):
                (solvents if phrase.prep == "in" else loose).extend(phrase.substances)
        if loose and solvents:
            items = [*loose, *solvents]
            self._emit("MakeSolution", (items[0].start, items[-1].end), [self._portion(item) for item in items])
        elif loose or solvents:
            items = loose or solvents
            self._emit("Add", (items[0].start, items[-1].end), [self._portion(item) for item in items])

    def _is_intermediate(self, item: SubstanceMention, phrase: TextPhrase) -> bool:
        """Return whether a name is that of the batch with its mass: "The residue (21.3 g) was distilled"."""
        name = self.text[item.start : item.end].lower()
        kinds = {value.kind for value in item.amounts}
        if (
            phrase.prep == ""
            and self.draft.actions
            and {"mass", "percent"} <= kinds
            and phrase.solution is None
            and ("product" in phrase.nouns or "compound" in phrase.nouns)
        ):
            return True
        return (
            item.weak and name in _INTERMEDIATES and phrase.prep == "" and bool(self.draft.actions) and item.is_measured
        )

    def _make(self, phrase: TextPhrase) -> None:
        items = phrase.substances
        self._own_loose(phrase)
        self._emit(
            "MakeSolution", (phrase.start, phrase.end), [self._portion(item) for item in items], ratios=phrase.ratios
        )

    def _own_loose(self, phrase: TextPhrase) -> None:
        for item in phrase.ratios:
            self.draft.own(item.start, item.end)

    def _portions(self, phrases: Iterable[TextPhrase]) -> list[Portion]:
        return [self._portion(item, phrase) for phrase in phrases for item in phrase.substances]

    def _portion(self, item: SubstanceMention, phrase: TextPhrase | None = None) -> Portion:
        self.draft.own(item.start, item.end)
        repeats = phrase.repeats if phrase is not None else 1
        return Portion(
            name=self.draft.text[item.start : item.end][:200],
            amount=self._amount(item, repeats),
            span=(item.start, item.end),
        )

    def _product(self, item: SubstanceMention) -> Portion:
        """Return a product; its percentage is the yield."""
        portion = self._portion(replace(item, amounts=[value for value in item.amounts if value.kind != "percent"]))
        shares = [value for value in item.amounts if value.kind == "percent"]
        for value in shares:
            self.draft.own(value.start, value.end)
        amount = ", ".join(filter(None, (portion.amount, *(_written(value, 1) for value in shares))))
        return portion.model_copy(update={"amount": amount[:200]})

    def _amount(self, item: SubstanceMention, repeats: int = 1) -> str:
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
        conditions: Sequence[QuantitySpan] = (),
        phrases: Sequence[TextPhrase] = (),
        ratios: Sequence[QuantitySpan] = (),
        **fields: Any,
    ) -> None:
        words = {word for phrase in phrases for word in phrase.words} | (self._group_words if phrases else set())
        if phrases:
            self._group_words = set()
        for phrase in phrases:
            for item in phrase.vessels:
                self.draft.own(item.start, item.end)
        for item in (*conditions, *ratios):
            self.draft.own(item.start, item.end)
        values: dict[str, Any] = {"verb": verb, "takes": tuple(takes)[:30], **_held_at(conditions), **fields}
        values = {**_stated_by(words), **values}
        counted = [phrase for phrase in phrases if phrase.repeated is not None]
        if counted and "repeats" not in fields:
            values["repeats"] = max(1, counted[0].repeats)
        for phrase in counted:
            assert phrase.repeated is not None
            self.draft.own(phrase.repeated.start, phrase.repeated.end)
        shares = {item.start: item for item in ratios if item.kind in ("ratio", "percent", "molarity")}
        if shares:
            stated_ratio = ", ".join(self.draft.text[item.start : item.end] for item in shares.values())
            values["note"] = "; ".join(filter(None, (values.get("note", ""), stated_ratio)))[:400]
        part = next((noun for phrase in phrases for noun in (*phrase.words, *phrase.nouns) if noun in _WATERY), None)
        if (
            part
            and "part" not in values
            and verb in ("Wash", "Extract", "DrySolution", "Concentrate", "Filter", "AdjustPH", "Dissolve")
        ):
            values["part"] = part
        start, end = span
        values["span"] = (start, max(end, start + 1))
        self.draft.actions.append(Action(**values))
        for portion in takes:
            self.draft.roles.setdefault(portion.name, _role(verb, portion, self.draft.actions))
        self._solution_made = verb in ("MakeSolution", "Dissolve")

    # -- frames -------------------------------------------------------------------------------------------------

    def _added(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        head = clause.head
        subject = [
            phrase for phrase in before if phrase.prep == "" and (phrase.substances or phrase.solution is not None)
        ]
        layered = [
            phrase
            for phrase in (*before, *after)
            if set(phrase.nouns) & (_LAYERS | {"extract", "extracts", "filtrates"})
            and not any(item.is_measured for item in phrase.substances)
        ]
        self._own_names(layered)
        subject = [phrase for phrase in subject if phrase not in layered]
        after = [phrase for phrase in after if phrase not in layered or phrase.prep]
        theme = subject
        object_ = [phrase for phrase in after if phrase.prep in ("", "of") and phrase.substances]
        inverted = not subject or not head.passive
        if inverted and object_:
            theme = [*object_]
        targets = [
            phrase
            for phrase in (*before, *after)
            if phrase.prep in ("to", "into", "onto", "in", "on") and phrase not in theme
        ]
        targets = [phrase for phrase in targets if phrase.substances]
        extra = [
            phrase
            for phrase in after
            if phrase.prep in ("with", "containing", "and", "using", "by")
            and phrase.substances
            and head.low != "adding"
        ]
        spare = [phrase for phrase in before if phrase.prep in ("with", "of") and phrase.substances]
        if head.low in ("combined", "mixed", "combine", "mix", "combining") and not theme and not extra:
            return
        if inverted and subject and object_ and not head.passive and head.marker != "followed":
            targets = [*subject, *targets]
        if not theme and not head.passive and subject:
            theme = subject
        if head.low.startswith(("charg", "load", "flask")) and extra and not theme:
            theme, extra = extra, []
        if head.low.startswith("plac") and any(token.low in ("oven", "desiccator") for token in clause.after):
            self._emit("DrySolid", self._span(clause), (), self._conditions(before, after), [*before, *after])
            return
        solvent_like = head.low.startswith(("combin", "mix", "plac", "blend", "admix", "put", "introduc"))
        if solvent_like:
            medium = [phrase for phrase in targets if phrase.prep == "in"]
            targets = [phrase for phrase in targets if phrase not in medium]
            theme = [*theme, *medium]
        elided = (
            not theme
            and not extra
            and targets
            and head.low == "added"
            and not head.passive
            and not before
            and self.draft.actions
        )
        batch = {noun for phrase in before if phrase.prep == "" for noun in phrase.nouns}
        if elided or (
            not theme
            and not extra
            and head.passive
            and targets
            and batch & {"mixture", "solution", "reaction", "residue", "suspension", "slurry"}
        ):
            self._emit(
                "Pour", self._span(clause), self._portions(targets), self._conditions(before, after), [*before, *after]
            )
            return
        early = [
            phrase
            for phrase in theme
            if phrase.is_prepared and targets and phrase.start < targets[0].start and targets[0].is_prepared
        ]
        for phrase in early:
            self._make(phrase)
        for phrase in targets:
            self._charge(
                [phrase],
                always=not self.draft.actions or any(item.is_measured for item in phrase.substances),
            )
        self._early = early
        circumstances = [phrase for phrase in (*before, *after) if phrase not in targets]
        self._theme([*theme, *extra], self._span(clause), circumstances)
        del spare

    def _theme(
        self,
        theme: Sequence[TextPhrase],
        span: tuple[int, int],
        circumstances: Sequence[TextPhrase],
        verb: Verb = "Add",
    ) -> None:
        conditions = self._conditions(circumstances)
        takes: list[Portion] = []
        made = ""
        for phrase in theme:
            if phrase.is_prepared:
                if phrase not in self._early:
                    self._make(phrase)
                first = phrase.substances[0]
                made = phrase.solution.low if phrase.solution is not None else self.draft.text[first.start : first.end]
            else:
                takes += self._portions([phrase])
        self._early = []
        dangling = (
            verb == "Add"
            and not theme
            and (
                self._solution_made or any("solution" in phrase.nouns for phrase in circumstances if phrase.prep == "")
            )
        )
        if made or dangling:
            noun = next((noun for phrase in circumstances for noun in phrase.nouns if noun in SOLUTIONS), "solution")
            self._emit(verb, span, takes, conditions, circumstances, part="solution", note=made or noun)
        elif takes or verb != "Add":
            ratios = [item for phrase in theme for item in phrase.ratios]
            if verb == "Add" and any(item.kind == "ph" for item in conditions):
                verb = "AdjustPH"
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

    def _leave(self, phrases: Sequence[TextPhrase]) -> None:
        """Keep conditions of a word that is no action on the last action."""
        found = self._conditions(phrases)
        if found and self.draft.actions:
            last = self.draft.actions[-1]
            more = _held_at(found)
            first = Period(
                **{key: more[key] for key in ("temperature", "final_temperature", "duration") if key in more}
            )
            for item in found:
                self.draft.own(item.start, item.end)
            self.draft.actions[-1] = last.model_copy(update={"then": (*last.then, first, *more.get("then", ()))[:20]})

    def _with(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        head = clause.head
        verb = head.word.verb
        if head.marker in ("", "after", "by", "to", "upon", "on") or head.passive:
            measured = [phrase for phrase in before if phrase.prep in ("", "to", "of", "in")]
            if not head.passive and head.marker in ("by", "after", "upon", "on", "to"):
                measured = []
            self._charge(measured, always=verb == "Add" and not self.draft.actions)
        reagents = [
            phrase
            for phrase in after
            if phrase.prep in ("with", "by", "using", "of", "into", "to", "") and phrase.substances
        ]
        if verb in ("Hydrogenate",):
            reagents = [phrase for phrase in after if phrase.substances]
        if verb == "Add" and not reagents:
            if head.low.startswith(("react", "condens")):
                self._emit("Wait", self._span(clause), (), self._conditions(before, after), [*before, *after])
            return
        if head.low.startswith("convert"):
            reagents = [phrase for phrase in after if phrase.prep in ("with", "using", "by") and phrase.substances]
        elif head.low.startswith(("react", "treat")):
            reagents = [
                phrase
                for phrase in after
                if phrase.prep in ("with", "in", "of", "using", "containing", "and", "") and phrase.substances
            ]
        if verb == "Add":
            self._theme(reagents, self._span(clause), [*before, *after])
        elif verb in ("Wash", "Extract"):
            self._liquids(clause, before, after)
        elif verb == "AdjustPH":
            self._emit(
                verb, self._span(clause), self._portions(reagents), self._conditions(before, after), [*before, *after]
            )
        else:
            self._theme(reagents, self._span(clause), [*before, *after], verb)

    def _liquids(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        """Emit washes and extractions: each liquid of a list is an action, a mixed liquid is one."""
        verb = clause.head.word.verb
        liquids = [
            phrase
            for phrase in after
            if phrase.prep in ("with", "using", "in", "into", "by", "of", "") and phrase.substances
        ]
        rest = [phrase for phrase in (*before, *after) if phrase not in liquids]
        conditions = self._conditions(before, after)
        span = self._span(clause)
        counts = [phrase for phrase in (*before, *after) if phrase.repeated is not None]
        emitted = False
        for phrase in liquids:
            batches: list[list[SubstanceMention]] = []
            for item in phrase.substances:
                if batches and (
                    item.paired or (phrase.solution is not None) or (item.solvent and not emitted) or verb == "Extract"
                ):
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

    def _repeats(
        self,
        phrase: TextPhrase,
        batch: Sequence[SubstanceMention],
        counts: Sequence[TextPhrase],
        after: Sequence[TextPhrase],
    ) -> int:
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

    def _dissolved(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        verb = clause.head.word.verb
        if clause.head.low == "taken" and clause.head.last == clause.head.place:
            return self._collected(clause, before, after)
        solvents = [
            phrase for phrase in (*after, *before) if phrase.prep in ("in", "with", "into") and phrase.substances
        ]
        solutes = [phrase for phrase in before if phrase.prep in ("", "of") and phrase.substances]
        solutes += [phrase for phrase in after if phrase.prep == "" and phrase.substances]
        takes = self._portions([*solutes, *solvents])
        ratios = [item for phrase in (*solutes, *solvents) for item in phrase.ratios]
        phrases = [*before, *after]
        self._emit(verb, self._span(clause), takes, self._conditions(phrases), phrases, ratios)
        return None

    def _poured(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        onto = [
            phrase
            for phrase in after
            if phrase.prep in ("onto", "into", "on", "to", "in", "over", "upon") and phrase.substances
        ]
        theme = [
            phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)
        ]
        self._charge(theme)
        phrases = [*before, *after]
        self._emit("Pour", self._span(clause), self._portions(onto), self._conditions(phrases), phrases)

    def _held(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        """Emit an operation that holds the mixture at conditions, after what goes into it."""
        head, phrases = clause.head, [*before, *after]
        conditions = self._conditions(phrases)
        bare = head.low in ("stirring", "heating", "cooling") and not head.passive and head.marker == ""
        if bare and not conditions and not clause.after:
            return
        self._fill(clause, before, after)
        if clause.before and clause.before[0].low in ("while", "whilst") and not conditions:
            return
        verb = self._holding_verb(clause, after, conditions)
        if verb is None or self._is_adjusted(clause, verb, conditions):
            return
        if verb == "Stir" and any(token.low in ("hydrogen", "h2") for token in clause.after):
            named = next(token for token in clause.after if token.low in ("hydrogen", "h2"))
            gas = Portion(name=self.draft.text[named.start : named.end], span=(named.start, named.end))
            self.draft.own(named.start, named.end)
            self._emit("Hydrogenate", self._span(clause), [gas], conditions, phrases)
            return
        fields: dict[str, Any] = {"atmosphere": self._purging(clause)} if verb == "Purge" else {}
        if verb == "Wait" and not conditions and head.low in ("left", "let", "leave", "leaving", "continued"):
            return
        self._add_to(clause, verb, after)
        if any(token.low in _UNTIL for token in clause.after):
            for token in clause.after:
                self.draft.own(token.start, token.end)
        self._emit(verb, self._span(clause), (), conditions, phrases, **fields)

    def _fill(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        """Emit what the mixture is made of, if the text names it with the operation."""
        head = clause.head
        medium = [phrase for phrase in after if phrase.prep in ("with", "in") and phrase.is_measured]
        subject = [phrase for phrase in before if phrase.prep == "" and phrase.is_measured]
        if medium and subject and head.passive and all(phrase.solution is None for phrase in (*medium, *subject)):
            items = [item for phrase in (*subject, *medium) for item in phrase.substances]
            for phrase in medium:
                phrase.substances = []
            self._emit("MakeSolution", (items[0].start, items[-1].end), [self._portion(item) for item in items])
        elif head.marker not in ("by", "after", "upon", "on", "to", "while") or head.passive:
            self._charge([phrase for phrase in before if phrase.prep in ("", "of", "to", "in", "into")])

    def _holding_verb(
        self, clause: VerbClause, after: list[TextPhrase], conditions: Sequence[QuantitySpan]
    ) -> Verb | None:
        """Return the verb that a holding word means with its conditions, or None if it is no operation."""
        verb, low = clause.head.word.verb, clause.head.low
        words = {word for phrase in after for word in (*phrase.words, *phrase.nouns)}
        ahead = {token.low for token in clause.after[:6]}
        reflux = "reflux" in words or any(token.low in ("reflux", "refluxing") for token in clause.after[:5])
        warm = any(item.kind == "temperature" for item in conditions)
        if verb in ("Heat", "Wait", "SetTemperature", "Stir") and reflux:
            return "Reflux"
        if verb == "Wait" and ahead & {"stirring", "agitation", "shaking"}:
            return "Stir"
        if verb == "Wait" and low in ("allowed", "left", "let", "allow") and warm and ahead & _REACHING:
            return "SetTemperature"
        if verb == "SetTemperature" and any(item.kind == "ph" for item in conditions):
            return "AdjustPH"
        return None if verb == "SetTemperature" and not warm else verb

    def _is_adjusted(self, clause: VerbClause, verb: Verb, conditions: Sequence[QuantitySpan]) -> bool:
        """Merge a pH with the addition before it: "NaOH was added to bring the pH to 6"."""
        last = self.draft.actions[-1] if self.draft.actions else None
        if verb != "AdjustPH" or clause.head.marker != "to" or last is None or last.verb != "Add":
            return False
        merged = {key: value for key, value in _held_at(conditions).items() if key != "then"}
        for item in conditions:
            self.draft.own(item.start, item.end)
        self.draft.actions[-1] = last.model_copy(update={**merged, "verb": "AdjustPH"})
        return True

    def _purging(self, clause: VerbClause) -> str | None:
        names = [token for token in clause.after if token.low in GASES]
        for token in names:
            self.draft.own(token.start, token.end)
        return GASES[names[0].low] if names else "vacuum" if clause.head.low.startswith("evac") else None

    def _add_to(self, clause: VerbClause, verb: Verb, after: list[TextPhrase]) -> None:
        """Emit what is added with a holding word: "shaken with water"."""
        if verb not in ("Stir", "Heat", "Wait", "Reflux", "Irradiate", "Cool"):
            return
        shaken = clause.head.low.startswith(("shak", "stir", "agitat", "heat", "reflux", "boil"))
        takes: list[Portion] = []
        for phrase in after:
            named = bool(phrase.substances) and shaken and phrase.prep == "with" and not phrase.substances[0].weak
            if phrase.prep not in ("with", "in") or not (phrase.is_measured or named):
                continue
            if phrase.is_prepared:
                self._make(phrase)
            else:
                takes += self._portions([phrase])
        if takes and takes[0].span is not None and takes[-1].span is not None:
            self._emit("Add", (takes[0].span[0], takes[-1].span[1]), takes)

    def _nothing(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        """Emit an operation that takes no substance: evaporation, distillation, separation, purification, transfer."""
        head, verb = clause.head, clause.head.word.verb
        phrases = [*before, *after]
        nouns = {noun for phrase in phrases for noun in (*phrase.nouns, *phrase.words)}
        subject = {token.low for token in clause.before} | (
            {token.low for token in clause.after[:6]} if not head.passive else set()
        )
        if verb == "PhaseSeparation":
            return self._collected(clause, before, after)
        if head.low.startswith(("remov", "elimin", "freed")):
            if head.method and verb == "Filter" and subject & _NOT_SOLVENT:
                return self._filtered(clause, before, after)
            if not self._is_evaporated(clause, phrases, subject):
                return None
        if verb == "Chromatograph":
            return self._chromatographed(clause, before, after)
        if verb == "Purify":
            if _COLUMN.search(" ".join(token.low for token in (*clause.group, *clause.after))) or any(
                "gel" in phrase.words for phrase in after
            ):
                return self._chromatographed(clause, before, after)
            if "recrystallization" in nouns:
                verb = "Recrystallize"
        takes: list[Portion] = []
        if head.low.startswith("azeotrop") or (
            verb == "Concentrate" and any(phrase.prep == "with" and phrase.substances for phrase in after)
        ):
            takes = self._portions(
                [phrase for phrase in after if phrase.prep in ("with", "from") and phrase.substances]
            )
        if head.passive or head.marker in ("", "by"):
            self._charge(
                [
                    phrase
                    for phrase in before
                    if phrase.prep == ""
                    and any(item.is_measured for item in phrase.substances)
                    and not head.low.startswith("remov")
                ]
            )
        self._own_names(phrases)
        if verb == "Wait":
            return None
        self.draft.last_solid = False
        self._emit(verb, self._span(clause), takes, self._conditions(phrases), phrases)
        return None

    def _is_evaporated(self, clause: VerbClause, phrases: Sequence[TextPhrase], subject: set[str]) -> bool:
        """Return whether "removed" means that a solvent is evaporated, not that a bath or a solid is taken away."""
        head = clause.head
        if head.marker == "to" and not head.passive and not self._is_first(clause):
            self._own_names(phrases)
            return False
        if "bath" in subject:
            return False
        solvent = not subject & _NOT_SOLVENT and (subject & _SOLVENTS or any(phrase.substances for phrase in phrases))
        return bool(solvent) or bool(head.method) or head.low == "freed"

    def _is_first(self, clause: VerbClause) -> bool:
        return not clause.before and clause.head.place == 0

    def _own_names(self, phrases: Iterable[TextPhrase]) -> None:
        """Own names that an operation is done to, not what it takes: the solvent that is removed."""
        for phrase in phrases:
            for item in phrase.substances:
                if not item.is_measured:
                    self.draft.own(item.start, item.end)

    def _collected(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
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

    def _dried(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        phrases = [*before, *after]
        agents = [
            phrase for phrase in after if phrase.prep in ("over", "with", "on", "by", "using", "") and phrase.substances
        ]
        agents = [
            phrase
            for phrase in agents
            if phrase.prep or not (set(phrase.nouns) & (_LAYERS | {"extract", "extracts", "solution"}))
        ]
        words = {token.low for token in clause.after} | {token.low for token in clause.before}
        conditions = self._conditions(phrases)
        heated = any(item.kind in ("temperature", "pressure") for item in conditions)
        airy = bool(words & {"vacuum", "vacuo", "air", "oven", "desiccator", "pressure"})
        solid = self.draft.last_solid or bool(
            {token.low for token in clause.before} & (SOLID | {"residue", "foam", "powder"})
        )
        if (
            airy
            and not agents
            and {token.low for token in clause.before} & {"filtrate", "filtrates", "solution", "eluate"}
        ):
            self._emit("Concentrate", self._span(clause), (), conditions, phrases)
        elif agents and not (solid and airy):
            self._emit("DrySolution", self._span(clause), self._portions(agents), conditions, phrases)
            self.draft.last_solid = False
        elif airy or heated or solid:
            self._own_names(phrases)
            gas: dict[str, Any] = {"atmosphere": "air"} if "air" in words else {}
            self._emit("DrySolid", self._span(clause), (), conditions, phrases, **gas)
        else:
            self._emit("DrySolution", self._span(clause), (), conditions, phrases)

    def _filtered(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        phrases = [*before, *after]
        subject = {token.low for token in clause.before} | {token.low for token in clause.after[:5]}
        last = self.draft.actions[-1].verb if self.draft.actions else ""
        if (
            clause.head.low.startswith("collect")
            and subject & (_LAYERS | {"fractions", "filtrates", "filtrate", "fraction", "extracts"})
            and not clause.head.method
        ):
            if subject & _LAYERS:
                return self._collected(clause, before, after)
            return None
        aids = [
            phrase for phrase in after if phrase.prep in ("over", "through", "on", "via", "with") and phrase.substances
        ]
        assumed: tuple[str, ...] = ()
        if subject & (SOLID | {"crystals"}) and not subject & {"catalyst", "insolubles", "undissolved"}:
            keep = "precipitate"
        elif (
            subject & {"catalyst", "insolubles", "agent", "desiccant"}
            or last == "DrySolution"
            or aids
            or "undissolved" in subject
        ):
            keep, assumed = "filtrate", ("keep",)
        elif clause.head.low.startswith(("collect", "isolat")):
            keep = "precipitate"
        else:
            keep, assumed = "precipitate", ("keep",)
        self._own_names([phrase for phrase in phrases if phrase not in aids])
        self.draft.last_solid = keep == "precipitate"
        self._emit(
            "Filter",
            self._span(clause),
            self._portions(aids),
            self._conditions(phrases),
            phrases,
            keep=keep,
            assumed=assumed,
        )
        return None

    def _over(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        verb = clause.head.word.verb
        if verb == "DrySolution":
            self._dried(clause, before, after)
        elif verb == "Filter":
            self._filtered(clause, before, after)
        else:
            self._chromatographed(clause, before, after)

    def _chromatographed(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        phrases = [*before, *after]
        self._charge(
            [phrase for phrase in before if phrase.prep == "" and any(item.is_measured for item in phrase.substances)]
        )
        inner = read_phrases(clause.group) if len(clause.group) > 1 else []
        phrases = [*before, *inner, *after]
        used = [
            phrase
            for phrase in phrases
            if phrase.substances
            and (phrase.prep != "" or phrase in inner or phrase in after or not clause.head.passive)
        ]
        ratios = [item for phrase in phrases for item in phrase.ratios]
        for phrase in used:
            for item in phrase.substances:
                ratios += [value for value in item.amounts if value.kind == "percent"]
                item.amounts = [value for value in item.amounts if value.kind != "percent"]
        takes = self._portions(used)
        loose = [item for phrase in phrases for item in phrase.loose]
        for figure in loose:
            self.draft.own(figure.start, figure.end)
        last = self.draft.actions[-1] if self.draft.actions else None
        if last is not None and last.verb == "Chromatograph" and clause.head.low.startswith(("elut",)):
            more = tuple(portion for portion in takes if portion.name not in {old.name for old in last.takes})
            self.draft.actions[-1] = last.model_copy(update={"takes": (*last.takes, *more)[:30]})
            return
        self._emit("Chromatograph", self._span(clause), takes, self._conditions(phrases), phrases, ratios)

    def _from(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        phrases = [*before, *after]
        verb = clause.head.word.verb
        into = [phrase for phrase in after if phrase.prep in ("into", "onto") and phrase.substances]
        if clause.head.low.startswith("precipitat") and into:
            return self._poured(clause, before, after)
        used = [
            phrase
            for phrase in after
            if phrase.prep in ("from", "in", "with", "using", "of", "by", "") and phrase.substances
        ]
        used = used or [phrase for phrase in before if phrase.prep in ("in", "from") and phrase.substances]
        if (
            clause.head.low.startswith("precipitat")
            and not used
            and not clause.head.passive
            and not clause.head.word.noun
        ):
            return None
        if (
            not used
            and clause.head.low in ("crystallized", "crystallised", "crystallize")
            and not clause.head.passive
            and clause.head.marker != "to"
            and clause.head.marker != "by"
        ):
            used = []
        self.draft.last_solid = True
        ratios = [item for phrase in used for item in phrase.ratios]
        self._emit(verb, self._span(clause), self._portions(used), self._conditions(phrases), phrases, ratios)
        return None

    def _partitioned(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        used = [phrase for phrase in after if phrase.prep in ("between", "with", "in", "") and phrase.substances]
        phrases = [*before, *after]
        self._emit("Partition", self._span(clause), self._portions(used), self._conditions(phrases), phrases)

    def _gave(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        """Emit a result: the name or label of the product, with its mass, moles and yield."""
        head = clause.head
        source, tokens = (before, clause.before) if head.passive else (after, clause.after)
        others = read_phrases(clause.after, True) if head.passive else []
        phrases = [*source, *others]
        substances = [item for phrase in source if phrase.prep in ("", "of", "as", "for") for item in phrase.substances]
        if head.low.startswith(("isolat", "recover", "separat")) and not substances:
            return
        main = _named_result(source, tokens) or substances[:1]
        loose = [value for phrase in phrases for value in phrase.loose if value.kind in _RESULTS]
        extra = [value for item in substances if item not in main for value in item.amounts]
        extra += [value for phrase in others for item in phrase.substances for value in item.amounts]
        for item in _substances(phrases):
            self.draft.own(item.start, item.end)
        if not main:
            if not loose:
                return
            main = [SubstanceMention(loose[0].start, loose[0].end)]
        name = self.text[main[0].start : main[0].end].lower()
        if not main[0].amounts and not loose and name in _UNFINISHED:
            return
        known = {value.start for item in main for value in item.amounts}
        more = [value for value in (*loose, *extra) if value.start not in known and value.kind in _RESULTS]
        main[0].amounts += [value for k, value in enumerate(more) if all(value != other for other in more[:k])]
        for value in self._conditions(phrases):
            self.draft.own(value.start, value.end)
        for phrase in phrases:
            self._own_loose(phrase)
        if not head.passive:
            self._charge([phrase for phrase in before if phrase.prep == "" and phrase.is_prepared])
        gives = tuple(self._product(item) for item in main)[:10]
        self.draft.product, self.draft.result = gives[0].name, gives[0].amount
        start, end = self._span(clause)
        self._emit("Yield", (min(start, main[0].start), max(end, main[-1].end)), gives=gives)

    def _between(self, clause: VerbClause, before: list[TextPhrase], after: list[TextPhrase]) -> None:
        self._partitioned(clause, before, after)


def _named_result(source: Sequence[TextPhrase], tokens: Sequence[Token]) -> list[SubstanceMention]:
    """Return the products that a result names: with a mass, else the first name, else its label."""
    direct = [item for phrase in source if phrase.prep in ("", "of") for item in phrase.substances]
    main = [item for item in direct if any(value.kind in ("mass", "substance") for value in item.amounts)]
    main = main or direct[:1]
    label = _label(tokens)
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


def _label(tokens: Sequence[Token]) -> tuple[int, int] | None:
    """Return the span of a product's label: "title compound", "product"."""
    for place, token in enumerate(tokens[:10]):
        if token.low in ("as", "with", "which", "in") or token.low in SOLUTIONS:
            return None
        if token.low in (
            "product",
            "compound",
            "products",
            "material",
            "oil",
            "solid",
            "crystals",
            "powder",
            "foam",
            "residue",
        ):
            first, last = place, place
            if (
                tokens[place + 1 : place + 2]
                and tokens[place + 1].low == "of"
                and tokens[place + 2 : place + 3]
                and tokens[place + 2].low in ("formula", "structure", "example")
            ):
                last = min(place + 3, len(tokens) - 1)
            while first and tokens[first - 1].low in ("title", "desired", "titled", "above", "expected", "target"):
                first -= 1
            return tokens[first].start, tokens[last].end
        if token.kind == "name":
            return None
    return None


def _substances(phrases: Iterable[TextPhrase]) -> list[SubstanceMention]:
    return [item for phrase in phrases for item in phrase.substances]


def _stated_by(words: set[str]) -> dict[str, Any]:
    """Return how something is added, and the gas above it, as words say."""
    values: dict[str, Any] = {}
    manner = next((MANNERS[word] for word in sorted(words) if MANNERS.get(word)), None)
    if manner:
        values["manner"] = manner
    gas = next((word for word in sorted(words) if word in GASES.values()), None)
    gas = gas or next((GASES[word] for word in sorted(words) if word in GASES), None)
    if words & {"vacuo", "vacuum"} or {"reduced", "pressure"} <= words:
        gas = gas or "vacuum"
    if gas:
        values["atmosphere"] = gas
    return values


def _held_at(conditions: Sequence[QuantitySpan]) -> dict[str, Any]:
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
        values["then"] = tuple(Period(**period) for period in periods[1:])[:20]
    return values


def _mercury(item: QuantitySpan) -> QuantitySpan:
    """Return a length of mercury as the pressure that it means: "0.2 mm"."""
    if item.kind != "other":
        return item
    return replace(item, kind="pressure", value=round(item.value * 0.00133322, 9))


def _written(value: QuantitySpan, repeats: int) -> str:
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
    worked_up = any(
        action.verb in ("Quench", "Extract", "Wash", "Filter", "Concentrate", "Pour", "AdjustPH", "Partition")
        for action in actions
    )
    if worked_up:
        return "workup"
    if verb in ("Wash", "Extract", "DrySolution", "Chromatograph", "Recrystallize", "Triturate"):
        return "workup"
    if (
        "mL" in portion.amount
        and not re.search(r"\d (?:g|mol|mmol|equiv)\b", portion.amount)
        and " of " not in portion.amount
    ):
        return "solvent"
    return "reactant"


_HANDLERS: dict[str, Callable[[_Reader, VerbClause, list[TextPhrase], list[TextPhrase]], None]] = {
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
