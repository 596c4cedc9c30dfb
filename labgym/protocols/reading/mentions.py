"""Mentions: the phrases of a clause with the substances that they name, and the draft in which they grow."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import BATCH, GASES, QUALITIES, SOLUTIONS, VESSELS, is_stop
from labgym.protocols.reading.tokens import Token

STRENGTHS = frozenset(("molarity", "percent"))
"""Kinds of figures that say how concentrated a solution is."""
MEASURES = frozenset(("mass", "volume", "substance", "equivalents", "parts"))
"""Kinds of figures that say how much of a substance there is."""
CONDITIONS = frozenset(("temperature", "time", "pressure", "ph"))
"""Kinds of figures that say how a mixture is held."""
_TIMES = frozenset(("at", "over", "for", "during", "after", "under", "within", "before", "while"))
"""Prepositions of circumstance."""
_CLASSES = frozenset((
    "acetate", "acid", "anhydride", "bromide", "chloride", "ester", "ether", "fluoride", "hydrate", "hydride",
    "hydrochloride", "hydroxide", "iodide", "ketone", "oxide", "reagent", "sulfate", "sulphate",
))  # fmt: skip
"""Names that end a name."""
_GASES = frozenset(GASES.values())
_MOTIONS = frozenset(("stirring", "agitation", "shaking", "cooling"))
_ORIGINS = frozenset(("prepared", "obtained", "from", "described", "produced", "of"))
"""Words that say where a substance came from."""
_THUS = frozenset(("so", "thus"))
_PLACES = frozenset(("example", "step", "preparation", "intermediate", "above"))
"""Words for the place of a text where a substance was made."""


@dataclass
class SubstanceMention:
    """A name in a phrase, with its amounts.

    Attributes:
        start, end: the span of the name.
        amounts: figures, in order.
        words: amounts in words ("saturated", "excess").
        weak: whether only its place says that it is a substance.
        solvent: whether it is what the others of its phrase are dissolved in.
        paired: whether it is mixed with the name before it, as in "EtOAc/hexane".
        repeated: how often it is used, if that is said of it alone: "brine (2 x)".
    """

    start: int
    end: int
    amounts: list[QuantitySpan] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    weak: bool = False
    solvent: bool = False
    paired: bool = False
    repeated: QuantitySpan | None = None

    @property
    def is_stock(self) -> bool:
        """Whether it is a solution of a stated concentration."""
        return any(figure.kind in STRENGTHS for figure in self.amounts) or "saturated" in self.words

    @property
    def is_measured(self) -> bool:
        """Whether it has a mass, a volume, moles or equivalents."""
        return any(figure.kind in MEASURES for figure in self.amounts)


@dataclass
class TextPhrase:
    """A part of a clause.

    Attributes:
        prep: the preposition that begins it, or "".
        solution: the noun ("solution", "suspension") whose contents the substances are, or None.
        nouns: words for the batch or its parts, in lower case.
        conditions: temperatures, times, pressures and pH, in order.
        loose: amounts that no name stands with.
    """

    prep: str
    start: int
    end: int
    substances: list[SubstanceMention] = field(default_factory=list)
    solution: Token | None = None
    nouns: list[str] = field(default_factory=list)
    conditions: list[QuantitySpan] = field(default_factory=list)
    ratios: list[QuantitySpan] = field(default_factory=list)
    loose: list[QuantitySpan] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    repeats: int = 1
    repeated: QuantitySpan | None = None
    remarks: list[tuple[int, int]] = field(default_factory=list)
    vessels: list[QuantitySpan] = field(default_factory=list)
    is_stock: bool = False

    @property
    def is_measured(self) -> bool:
        """Whether one of its substances has an amount."""
        return any(item.is_measured for item in self.substances)

    def mixed_with(self, last: SubstanceMention) -> list[SubstanceMention]:
        """Return the names of a mixture such as "EtOAc/hexane", in order, by its last one."""
        end = next(k for k, item in enumerate(self.substances) if item is last)
        first = next((k for k in range(end, 0, -1) if not self.substances[k].paired), 0)
        return self.substances[first : end + 1]

    @property
    def is_prepared(self) -> bool:
        """Whether it is a solution that is made here, not a stock solution."""
        solutes = [item for item in self.substances if not item.solvent]
        solvents = [item for item in self.substances if item.solvent]
        if self.solution is None:
            measured = solutes and all(item.is_measured and not item.is_stock for item in solutes)
            return bool(measured and solvents and all(item.is_measured for item in solvents))
        if not self.substances or self.is_stock:
            return False
        if solvents and len(solutes) == 1:
            return True
        if any(item.is_stock for item in solutes) and not any(
            figure.kind in ("mass", "substance") for item in solutes for figure in item.amounts if len(solutes) == 1
        ):
            return len(solutes) > 1 and bool(solvents) and any(item.is_measured for item in solvents)
        return bool(solvents) or len(solutes) > 1


class PhraseDraft:
    """The phrases of a sequence of tokens as far as they are read.

    Attributes:
        is_result: whether the tokens name a product.
        pending: amounts that wait for the name after them.
        quality: amounts in words that wait for the name after them.
        solution_amounts: amounts of the solution whose contents follow.
        separated: whether the next name is another substance.
        adjacent: whether the next name continues the last one.
        in_solvent: whether the next name dissolves the others.
        paired: whether the next name is mixed with the last one.
        instead: whether the next name takes the place of the last one.
        closed: whether the last name has its amounts in brackets.
        skip: index of the last token to pass over.
        ahead: how often what the next phrase names is used: "twice with water".
        each: the amount of each name of the phrase: "25 mL each of water and brine".
        adjective: a solvent as an adjective, which follows its noun.
    """

    def __init__(self, tokens: Sequence[Token], is_result: bool) -> None:
        self.tokens = tokens
        self.is_result = is_result
        self.phrases: list[TextPhrase] = []
        self.pending: list[QuantitySpan] = []
        self.quality: list[str] = []
        self.solution_amounts: list[QuantitySpan] = []
        self.last: SubstanceMention | None = None
        self.adjective: SubstanceMention | None = None
        self.separated, self.adjacent = True, False
        self.in_solvent = self.paired = self.instead = self.closed = False
        self.skip = -1
        self.ahead: QuantitySpan | None = None
        self.each: QuantitySpan | None = None

    @property
    def phrase(self) -> TextPhrase:
        """The phrase that is being read."""
        return self.phrases[-1]

    def open(self, prep: str, start: int, keep: bool = False) -> None:
        """Begin a phrase.

        Args:
            prep: the preposition that begins it.
            start: its first character.
            keep: whether amounts and qualities that wait for a name go on to wait for it.
        """
        waiting = (self.pending, self.quality) if keep else ([], [])
        if keep:
            self.pending, self.quality = [], []
        if self.phrases:
            self.close()
        self.pending, self.quality = waiting
        self.phrases.append(TextPhrase(prep, start, start))
        if self.ahead is not None:
            self.phrase.repeats, self.phrase.repeated = int(self.ahead.value), self.ahead
            self.ahead = None
        self.separate()
        self.in_solvent, self.last = False, None

    def close(self) -> None:
        """Give amounts that wait to the substances of the phrase."""
        phrase = self.phrase
        if self.solution_amounts and phrase.substances:
            self._share_solution_amounts()
        each = [self.each] if self.each is not None else []
        for item in phrase.substances:
            item.amounts += each if not (item.is_measured or item.solvent) else []
        if phrase.substances:
            self.pending = [figure for figure in self.pending if figure is not self.each]
        self.each = None
        phrase.loose += self.pending + self.solution_amounts
        self.pending, self.solution_amounts, self.quality = [], [], []
        _settle(phrase)

    def _share_solution_amounts(self) -> None:
        """Give the concentration of a solution to its solute, and its volume to the solvent or the only solute."""
        solutes = [item for item in self.phrase.substances if not item.solvent] or self.phrase.substances
        solvents = [item for item in self.phrase.substances if item.solvent]
        stock = any(figure.kind in STRENGTHS for figure in self.solution_amounts)
        for figure in self.solution_amounts:
            stronger = figure.kind in STRENGTHS or stock or not solvents
            (solutes[0] if stronger else solvents[0]).amounts.append(figure)
        self.solution_amounts = []

    def separate(self) -> None:
        """Let the next name be another substance."""
        self.separated, self.adjacent = True, False

    def after(self, place: int) -> str:
        """Return the token after a place in lower case, or ""."""
        return self.tokens[place + 1].low if place + 1 < len(self.tokens) else ""

    def is_ended(self) -> bool:
        """Return whether a phrase of circumstance is complete, so that a noun begins a new one."""
        phrase = self.phrase
        stirred = phrase.prep in ("with", "while") and not _MOTIONS.isdisjoint(phrase.words)
        stirred = stirred or (phrase.prep == "under" and not _GASES.isdisjoint(phrase.words))
        ended = stirred or (bool(phrase.conditions) and phrase.prep in _TIMES)
        return ended and not phrase.substances and phrase.solution is None

    def name(self, place: int, token: Token, weak: bool) -> None:
        """Read a name: it continues the last one, takes its place, or is another substance."""
        if self.is_ended():
            self.open("", token.start)
        if self.in_solvent and self.separated and self._is_reagent(place):
            if self.phrase.solution is None and self.phrase.prep in ("with", "to", "by"):
                self.open(self.phrase.prep, token.start, keep=True)
            self.in_solvent = False
        last = self.last
        if self.instead and last is not None:
            self.instead = False
            last.start, last.end, last.weak = token.start, token.end, weak
        elif last is not None and self.adjacent and not self.separated and not self.pending and not self.closed:
            last.end = token.end
            last.weak = last.weak and weak
        elif last is not None and self._joins_ester(place, token):
            last.end = token.end
        else:
            last = SubstanceMention(
                self._begin(place), token.end, self.pending, self.quality, weak, self.in_solvent, self.paired
            )
            self.pending, self.quality = [], []
            self.phrase.substances.append(last)
            self.last = last
            if self.adjective is not None:
                self.phrase.substances.append(self.adjective)
                self.adjective = None
        self.separated, self.adjacent, self.paired, self.closed = False, True, False, False

    def _begin(self, place: int) -> int:
        """Return where a name begins: at an unknown word before a class, "alloxan hydrate"."""
        token, before = self.tokens[place], self.tokens[place - 1] if place else None
        unknown = before is not None and before.kind == "word" and len(before.text) > 4 and not is_stop(before.low)
        known = before is None or before.low in BATCH | QUALITIES | SOLUTIONS | VESSELS
        free = before is not None and before.end + 1 == token.start and token.low in _CLASSES
        return before.start if before is not None and unknown and free and not known else token.start

    def _is_reagent(self, place: int) -> bool:
        """Return whether a name behind a solvent is no solvent: it has a mass, an amount of substance or a strength.

        A solvent is measured by its volume: "A (2 g) in water (10 mL) and hydrogen peroxide (30%, 12 mL)".
        """
        measured = bool(self.phrase.substances) and self.phrase.substances[-1].solvent
        measured = measured and self.phrase.substances[-1].is_measured
        ahead = self.tokens[place + 1 : place + 5]
        group = next((token for token in ahead if token.kind != "name"), None)
        kinds = {figure.kind for figure in self.pending}
        kinds |= {item.figure.kind for item in group.inner if item.figure is not None} if group is not None else set()
        return measured and bool(kinds & {"mass", "substance", "equivalents", "molarity", "percent"})

    def _joins_ester(self, at: int, token: Token) -> bool:
        """Return whether a name goes on after a comma: "pentanoic acid, benzyl ester"."""
        assert self.last is not None
        comma = at > 0 and self.tokens[at - 1].text == ","
        salt = token.low in ("oxime", "hydrochloride", "dihydrochloride", "hydrobromide")
        tail = salt or self.after(at) in ("ester", "amide")
        before = all(figure.start < self.last.start for figure in self.last.amounts)
        return comma and before and tail and not self.pending

    def is_separate(self, place: int) -> bool:
        """Return whether a name is one word without an amount, not the end of a longer one."""
        return not self.pending and (place == 0 or self.tokens[place - 1].kind != "name")

    def is_label(self, place: int) -> bool:
        """Return whether a word that names no substance stands for one: an amount stands with it."""
        if self.refers_back(place):
            return True
        if any(figure.kind in MEASURES for figure in self.pending):
            return True
        if (
            self.is_result
            and not self.phrase.substances
            and self.phrase.prep in ("", "of")
            and self.tokens[place].low in BATCH
        ):
            return True
        ahead = self.tokens[place + 1 : place + 3]
        inner = ahead[0].inner if len(ahead) == 2 else ()
        coded = len(inner) == 1 and inner[0].figure is None
        following = ahead[-1] if coded else ahead[0] if ahead else None
        return (
            following is not None
            and _holds(following, ("mass", "volume", "substance", "equivalents"))
            and (self.last is None or self.separated or not self.last.amounts)
        )

    def refers_back(self, place: int) -> bool:
        """Return whether an amount follows the words about where a substance came from: "X from Step 8 (2 g)"."""
        ahead = self.tokens[place + 1 : place + 11]
        if not ahead or ahead[0].low not in _ORIGINS | _THUS:
            return False
        for k, token in enumerate(ahead):
            if token.kind == "group":
                if not any(item.figure is not None for item in token.inner):
                    continue
                if not _holds(token, ("mass", "volume", "substance")):
                    return False
                self.skip = place + k
                return any(item.low in _PLACES | _THUS for item in ahead[:k])
            ends = k > 1 and token.low in (",", "was", "were")
            if ends or token.kind in ("name", "figure") or token.low in SOLUTIONS:
                return False
        return False


def _holds(token: Token, kinds: Sequence[str]) -> bool:
    """Return whether a token is a bracket with a figure of one of some kinds."""
    return any(item.figure is not None and item.figure.kind in kinds for item in token.inner)


def _divide(phrase: TextPhrase) -> None:
    """Divide the volume of a mixture by its ratio: "a 2:1 mixture of ether and hexane (30 mL)"."""
    items = phrase.mixed_with(phrase.substances[-1]) if phrase.substances else []
    if len(items) < 2 and phrase.solution is not None:
        items = phrase.substances
    measured = [figure for item in items for figure in item.amounts]
    ratio = next((figure for figure in phrase.ratios if figure.kind == "ratio"), None)
    shares = [float(number) for number in re.findall(r"[\d.]+", ratio.text)] if ratio is not None else []
    whole = sum(shares)
    if len(shares) == len(items) > 1 and [figure.kind for figure in measured] == ["volume"] and whole:
        total = measured[0]
        phrase.ratios.append(total)
        for item, share in zip(items, shares, strict=True):
            item.amounts = [replace(total, value=total.value * share / whole)]


def _settle(phrase: TextPhrase) -> None:
    """Move amounts that stand with the solvent of a solution to the solute that they measure."""
    _divide(phrase)
    solutes = [item for item in phrase.substances if not item.solvent]
    solvents = [item for item in phrase.substances if item.solvent]
    if len(solutes) != 1 or not solvents:
        return
    solute, solvent = solutes[0], solvents[-1]
    if phrase.solution is not None and not solute.is_measured:
        if any(figure.kind in STRENGTHS for figure in solvent.amounts):
            solute.amounts += solvent.amounts
            solvent.amounts = []
    if not solute.is_stock:
        return
    kinds = {figure.kind for figure in solute.amounts}
    if "volume" in kinds:
        _move(solvent, solute, ("substance", "equivalents"))
        kinds = {figure.kind for figure in solute.amounts}
    if (phrase.solution is not None or "molarity" in kinds) and not kinds & {"mass", "substance", "volume"}:
        _move(solvent, solute, ("volume",))


def _move(source: SubstanceMention, target: SubstanceMention, kinds: Sequence[str]) -> None:
    moved = [figure for figure in source.amounts if figure.kind in kinds]
    source.amounts = [figure for figure in source.amounts if figure not in moved]
    target.amounts += moved
