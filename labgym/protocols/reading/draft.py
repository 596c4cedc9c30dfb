"""Draft: the action list as it grows, and the operation that is read into it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from labgym.protocols.experiments.model import Action, Portion, Role, Verb
from labgym.protocols.reading.actions import Unread
from labgym.protocols.reading.clauses import VerbClause
from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.heads import Head
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.stated import amount, held_at, stated_by, written
from labgym.protocols.reading.tokens import Token

ASIDE = 2
"""Mark of characters that no action has to state: sizes of vessels, data."""
LAYERS = frozenset(("layer", "layers", "phase", "phases"))
EXTRACTS = frozenset(("extract", "extracts"))
_CIRCUMSTANCE = frozenset((
    "at", "under", "in", "for", "over", "during", "within", "after", "while", "with", "to", "below", "between",
    "until", "into", "on", "by", "from", "before", "", "through", "without", "using", "since", "when", "once",
    "of", "than", "against", "as",
))  # fmt: skip
"""Prepositions whose conditions are those of the operation."""
_INTERMEDIATES = frozenset((
    "residue", "oil", "solid", "product", "crystals", "precipitate", "material", "foam", "liquid", "powder",
))  # fmt: skip
_WATERY = frozenset(("organic", "aqueous"))
_OF_A_PART = frozenset(("Wash", "Extract", "DrySolution", "Concentrate", "Filter", "AdjustPH", "Dissolve"))
_WORKUP = frozenset(("Quench", "Extract", "Wash", "Filter", "Concentrate", "Pour", "AdjustPH", "Partition"))
_NOTED = frozenset(("ratio", "percent", "molarity", "volume", "mass"))
"""Kinds of figures of a mixture or a column that are kept in the note."""
_PORTIONS = re.compile(r"(\d{1,2}) x ")
_REPEATED = frozenset(("Concentrate", "Triturate"))
"""Operations that are done once with each portion of what they take, besides those that say so themselves."""
_UNREPEATED = frozenset(("Stir", "Heat", "Reflux", "Wait", "Cool", "Yield", "Analyze"))
"""Operations that are not counted; a number of times next to them is of something else."""
_PURIFYING = frozenset(("Wash", "Extract", "DrySolution", "Chromatograph", "Recrystallize", "Triturate"))


@dataclass(frozen=True)
class PhrasedOperation:
    """An operation word with its phrases.

    Attributes:
        before, after: phrases before and after the word.
        span: characters of the word and of what follows it.
    """

    clause: VerbClause
    before: list[TextPhrase]
    after: list[TextPhrase]
    span: tuple[int, int]

    @property
    def head(self) -> Head:
        """The operation word."""
        return self.clause.head

    @property
    def verb(self) -> Verb:
        """The verb that the operation word means."""
        return self.clause.head.word.verb

    @property
    def phrases(self) -> list[TextPhrase]:
        """All phrases, in order."""
        return [*self.before, *self.after]

    @property
    def conditions(self) -> list[QuantitySpan]:
        """Conditions of all phrases, in order."""
        return conditions(self.phrases)


def lows(tokens: Iterable[Token]) -> set[str]:
    """Return tokens in lower case."""
    return {token.low for token in tokens}


def conditions(phrases: Iterable[TextPhrase]) -> list[QuantitySpan]:
    """Return the conditions of phrases, in order."""
    return [item for phrase in phrases if phrase.prep in _CIRCUMSTANCE for item in phrase.conditions]


def substances(phrases: Iterable[TextPhrase]) -> list[SubstanceMention]:
    """Return the substances of phrases, in order."""
    return [item for phrase in phrases for item in phrase.substances]


def ratios(phrases: Iterable[TextPhrase]) -> list[QuantitySpan]:
    """Return the ratios of phrases, in order."""
    return [item for phrase in phrases for item in phrase.ratios]


def with_substances(phrases: Iterable[TextPhrase], *prepositions: str) -> list[TextPhrase]:
    """Return the phrases that begin with one of some prepositions and name a substance."""
    return [phrase for phrase in phrases if phrase.prep in prepositions and phrase.substances]


@dataclass
class ActionDraft:
    """Actions and state of a procedure while it is read.

    Attributes:
        text: the procedure.
        plain: the procedure with simple characters, of the same length.
        owned: 1 for each character that an action owns, `ASIDE` for the size of a vessel and data, else 0.
        last_solid: whether the batch is a solid.
        solution_made: whether the last action makes a solution.
        manners: words for the manner of the operation that no action has yet.
        doubts: spans of which the text does not tell what they mean for the actions.
    """

    text: str
    plain: str
    actions: list[Action] = field(default_factory=list)
    owned: bytearray = field(init=False)
    roles: dict[str, Role] = field(default_factory=dict)
    last_solid: bool = False
    solution_made: bool = False
    started_with_batch: bool = False
    manners: set[str] = field(default_factory=set)
    product: str = ""
    result: str = ""
    doubts: list[Unread] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.owned = bytearray(len(self.text))
        self._lower = self.plain.lower()

    @property
    def last_verb(self) -> str:
        """The verb of the last action, or ""."""
        return self.actions[-1].verb if self.actions else ""

    def found(self, clause: VerbClause) -> tuple[int, int]:
        """Return the span of an operation word, which lies between its two regions."""
        low = clause.head.low.split()[0]
        word = next((token for token in clause.group if token.low == low), None)
        if word is not None:
            return word.start, word.end
        if not clause.before and clause.after:
            at = self._lower.rfind(low, 0, clause.after[0].start)
        else:
            at = self._lower.find(low, clause.before[-1].end if clause.before else 0)
        at = max(at, 0)
        return at, at + len(low)

    def own(self, start: int, end: int, by: int = 1) -> None:
        """Note that an action owns characters, or that they are set aside: `by` is `ASIDE`."""
        self.owned[start:end] = bytes([by]) * (end - start)

    def doubt(self, span: tuple[int, int], why: str) -> None:
        """Report a span whose meaning for the actions is not clear; the actions are then partial."""
        start, end = span
        self.doubts.append(Unread(start=start, end=end, text=self.text[start:end][:1000], why=why))

    def own_all(self, items: Iterable[Token | QuantitySpan | SubstanceMention]) -> None:
        """Note that an action owns tokens, figures or names."""
        for item in items:
            self.own(item.start, item.end)

    def own_names(self, phrases: Iterable[TextPhrase]) -> None:
        """Own the names of an operation that takes nothing of them, such as a solvent that is removed."""
        self.own_all(item for item in substances(phrases) if not item.is_measured)

    def portion(self, item: SubstanceMention, repeats: int = 1) -> Portion:
        """Return a substance with its amount, and own both."""
        self.own_all((item, *item.amounts))
        return Portion(
            name=self.text[item.start : item.end][:200],
            amount=amount(item.amounts, item.words, repeats),
            span=(item.start, item.end),
        )

    def portions(self, phrases: Iterable[TextPhrase]) -> list[Portion]:
        """Return the substances of phrases."""
        return [self.portion(item, phrase.repeats) for phrase in phrases for item in phrase.substances]

    def yielded(self, item: SubstanceMention) -> Portion:
        """Return a product; its percentage is the yield."""
        shares = [value for value in item.amounts if value.kind == "percent"]
        self.own_all(shares)
        portion = self.portion(replace(item, amounts=[value for value in item.amounts if value.kind != "percent"]))
        stated = ", ".join(filter(None, (portion.amount, *map(written, shares))))
        return portion.model_copy(update={"amount": stated[:200]})

    def emit(
        self,
        verb: Verb,
        span: tuple[int, int],
        takes: Sequence[Portion] = (),
        held: Sequence[QuantitySpan] = (),
        phrases: Sequence[TextPhrase] = (),
        ratios: Sequence[QuantitySpan] = (),
        **fields: Any,
    ) -> None:
        """Append an action.

        Args:
            verb: what is done.
            span: the characters that say so.
            takes: what it takes.
            held: its conditions, in order.
            phrases: whose words say the manner, the gas, the part and the repeats.
            ratios: of mixed solvents.
            fields: further fields of the action.
        """
        words = {word for phrase in phrases for word in phrase.words}
        if phrases:
            words |= self.manners
            self.manners = set()
        for vessel in (item for phrase in phrases for item in phrase.vessels):
            self.own(vessel.start, vessel.end, ASIDE)
        self.own_all((*held, *ratios))
        values = {**stated_by(words), "verb": verb, "takes": tuple(takes)[:30], **held_at(held), **fields}
        if verb not in _UNREPEATED:
            told = [phrase.repeated for phrase in phrases] + [item.repeated for item in substances(phrases)]
            counts = [count for count in told if count is not None]
            portions = _PORTIONS.match(takes[0].amount) if takes and verb in _REPEATED else None
            if counts:
                values.setdefault("repeats", max(1, int(counts[0].value)))
            elif portions is not None:
                values.setdefault("repeats", max(1, int(portions[1])))
            self.own_all(counts)
        shares = {item.start: item for item in ratios if item.kind in _NOTED}
        if shares:
            ratio = ", ".join(
                f"{self.text[item.start : item.end]}{' in all' if item.kind == 'volume' else ''}"
                for item in shares.values()
            )
            values["note"] = "; ".join(filter(None, (values.get("note", ""), ratio)))[:400]
        part = next((noun for phrase in phrases for noun in (*phrase.words, *phrase.nouns) if noun in _WATERY), None)
        if part and verb in _OF_A_PART:
            values.setdefault("part", part)
        start, end = span
        values["span"] = (start, max(end, start + 1))
        self.insert(len(self.actions), Action(**values))
        self.solution_made = verb in ("MakeSolution", "Dissolve")

    def insert(self, place: int, action: Action) -> None:
        """Insert an action, and note the roles of what it takes."""
        self.actions.insert(place, action)
        for portion in action.takes:
            self.roles.setdefault(portion.name, _role(action.verb, portion, self.actions[: place + 1]))

    def act(
        self,
        verb: Verb,
        operation: PhrasedOperation,
        takes: Sequence[Portion] = (),
        ratios: Sequence[QuantitySpan] = (),
        **fields: Any,
    ) -> None:
        """Append the action of an operation with all its conditions."""
        counts = [item.figure for item in operation.clause.group if item.figure is not None]
        if counts and counts[0].kind == "repeats" and verb not in _UNREPEATED:
            fields.setdefault("repeats", max(1, int(counts[0].value)))
            self.own_all(counts[:1])
        self.emit(verb, operation.span, takes, operation.conditions, operation.phrases, ratios, **fields)

    def make(self, phrase: TextPhrase) -> None:
        """Append the making of a solution."""
        self.own_all(phrase.ratios)
        takes = [self.portion(item) for item in phrase.substances]
        self.emit("MakeSolution", (phrase.start, phrase.end), takes, ratios=phrase.ratios)

    def put(self, verb: Verb, items: Sequence[SubstanceMention]) -> None:
        """Append an action that takes substances which lie together in the text."""
        self.emit(verb, (items[0].start, items[-1].end), [self.portion(item) for item in items])

    def charge(self, phrases: Iterable[TextPhrase], always: bool = False) -> None:
        """Append what the flask holds before an operation: a solution, or substances."""
        loose: list[SubstanceMention] = []
        solvents: list[SubstanceMention] = []
        for phrase in phrases:
            for item in [item for item in phrase.substances if self._is_intermediate(item, phrase)]:
                phrase.substances.remove(item)
                self.emit("Yield", (item.start, item.end), gives=(self.yielded(item),))
            if not phrase.substances or phrase.prep not in ("", "to", "of", "in", "into", "with"):
                continue
            measured = phrase.is_measured
            dissolved = any(item.solvent for item in phrase.substances)
            if phrase.is_prepared or (phrase.solution is not None and measured) or (dissolved and (always or measured)):
                self.make(phrase)
            elif always or measured:
                (solvents if phrase.prep == "in" else loose).extend(phrase.substances)
        if loose or solvents:
            self.put("MakeSolution" if loose and solvents else "Add", [*loose, *solvents])

    def _is_intermediate(self, item: SubstanceMention, phrase: TextPhrase) -> bool:
        """Return whether a name is that of the batch with its mass: "The residue (21.3 g) was distilled"."""
        if phrase.prep not in ("", "of") or not self.actions:
            return False
        kinds = {value.kind for value in item.amounts}
        if {"mass", "percent"} <= kinds and phrase.solution is None and {"product", "compound"} & set(phrase.nouns):
            return True
        return item.weak and item.is_measured and self.plain[item.start : item.end].lower() in _INTERMEDIATES


def _role(verb: Verb, portion: Portion, actions: Sequence[Action]) -> Role:
    if verb in _PURIFYING or any(action.verb in _WORKUP for action in actions):
        return "workup"
    bare = " of " not in portion.amount and not re.search(r"\d (?:g|mol|mmol|equiv)\b", portion.amount)
    return "solvent" if bare and "mL" in portion.amount else "reactant"
