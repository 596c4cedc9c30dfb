"""Phrases: the parts of a clause that a preposition begins, with their substances, amounts and conditions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import (
    BATCH,
    DETERMINERS,
    GASES,
    MANNERS,
    PREPOSITIONS,
    QUALITIES,
    SOLUTIONS,
    SOLVENT_ADJECTIVES,
    VESSELS,
    WORDS_OF_AMOUNT,
    is_code,
    is_stop,
)
from labgym.protocols.reading.tokens import Token

_TIMES = frozenset(("at", "over", "for", "during", "after", "under", "within", "before", "while"))
"""Prepositions of circumstance."""
_ORIGINS = frozenset(("example", "step", "formula", "preparation", "structure", "intermediate"))
_CIRCUMSTANCES = frozenset(("vacuo", "vacuum", "reflux", "reduced", "high", "pressure"))
_NAME_TAILS = frozenset(("gel", "earth", "ester", "salt", "dust", "reagent", "sieves"))
_TAILS = _NAME_TAILS | frozenset(
    ("example", "step", "formula", "free", "base", "charcoal", "catalyst", "oil", "powder", "solid")
)
"""Words behind a name: those that are a part of it, and others."""


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
    """

    start: int
    end: int
    amounts: list[QuantitySpan] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    weak: bool = False
    solvent: bool = False
    paired: bool = False

    @property
    def is_stock(self) -> bool:
        """Whether it is a solution of a stated concentration."""
        kinds = {figure.kind for figure in self.amounts}
        return bool(kinds & {"molarity", "percent"}) or "saturated" in self.words

    @property
    def is_measured(self) -> bool:
        """Whether it has a mass, a volume, moles or equivalents."""
        return any(figure.kind in ("mass", "volume", "substance", "equivalents", "parts") for figure in self.amounts)


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

    @property
    def is_prepared(self) -> bool:
        """Whether it is a solution that is made here, not a stock solution."""
        solutes = [item for item in self.substances if not item.solvent]
        solvents = [item for item in self.substances if item.solvent]
        if self.solution is None:
            measured = solutes and all(item.is_measured and not item.is_stock for item in solutes)
            return bool(measured and solvents and all(item.is_measured for item in solvents))
        if not self.substances:
            return False
        if self.is_stock:
            return False
        if solvents and len(solutes) == 1:
            return True
        if any(item.is_stock for item in solutes) and not any(
            figure.kind in ("mass", "substance") for item in solutes for figure in item.amounts if len(solutes) == 1
        ):
            return len(solutes) > 1 and bool(solvents) and any(item.is_measured for item in solvents)
        return bool(solvents) or len(solutes) > 1


class PhraseReader:
    """Reads the phrases of a sequence of tokens; each token is looked at once."""

    def __init__(self, tokens: Sequence[Token], is_result: bool = False) -> None:
        self.tokens = tokens
        self.is_result = is_result
        self.phrases: list[TextPhrase] = []
        self._pending: list[QuantitySpan] = []
        self._quality: list[str] = []
        self._solution_amounts: list[QuantitySpan] = []
        self._separated = True
        self._in_solvent = False
        self._last: SubstanceMention | None = None
        self._adjacent = False
        self._paired = False
        self._instead = False
        self._skip = -1
        self._closed = False
        self._adjective: SubstanceMention | None = None

    def read(self) -> list[TextPhrase]:
        """Return the phrases in order."""
        if self.tokens:
            self._open("", self.tokens[0].start)
        for place, token in enumerate(self.tokens):
            getattr(self, f"_{token.kind}")(place, token)
            self.phrases[-1].end = token.end
        if self.phrases:
            self._close()
        return self.phrases

    @property
    def _phrase(self) -> TextPhrase:
        return self.phrases[-1]

    def _open(self, prep: str, start: int) -> None:
        if self.phrases:
            self._close()
        self.phrases.append(TextPhrase(prep, start, start))
        self._separated, self._in_solvent, self._last, self._adjacent = True, False, None, False

    def _close(self) -> None:
        phrase = self._phrase
        if self._solution_amounts and phrase.substances:
            self._share_solution_amounts(phrase)
        phrase.loose += self._pending + self._solution_amounts
        self._pending, self._solution_amounts, self._quality = [], [], []
        solutes = [item for item in phrase.substances if not item.solvent]
        solvents = [item for item in phrase.substances if item.solvent]
        if (
            phrase.solution is not None
            and len(solutes) == 1
            and solvents
            and not solutes[0].is_measured
            and any(figure.kind in ("molarity", "percent") for figure in solvents[-1].amounts)
        ):
            solutes[0].amounts += solvents[-1].amounts
            solvents[-1].amounts = []
        if (
            len(solutes) == 1
            and solutes[0].is_stock
            and solvents
            and any(f.kind == "volume" for f in solutes[0].amounts)
        ):
            moles = [figure for figure in solvents[-1].amounts if figure.kind in ("substance", "equivalents")]
            solvents[-1].amounts = [figure for figure in solvents[-1].amounts if figure not in moles]
            solutes[0].amounts += moles
        if phrase.solution is not None and len(solutes) == 1 and solutes[0].is_stock and solvents:
            volumes = [figure for figure in solvents[-1].amounts if figure.kind == "volume"]
            if volumes and not any(figure.kind in ("mass", "substance") for figure in solutes[0].amounts):
                solvents[-1].amounts = [figure for figure in solvents[-1].amounts if figure not in volumes]
                solutes[0].amounts += volumes

    def _share_solution_amounts(self, phrase: TextPhrase) -> None:
        """Give the concentration of a solution to its solute, and its volume to the solvent or the only solute."""
        solutes = [item for item in phrase.substances if not item.solvent] or phrase.substances
        solvents = [item for item in phrase.substances if item.solvent]
        stock = any(figure.kind in ("molarity", "percent") for figure in self._solution_amounts)
        for figure in self._solution_amounts:
            stronger = figure.kind in ("molarity", "percent") or stock or not solvents
            (solutes[0] if stronger else solvents[0]).amounts.append(figure)
        self._solution_amounts = []

    def _figure(self, place: int, token: Token) -> None:
        figure = token.figure
        assert figure is not None
        if figure.kind == "repeats":
            self._phrase.repeats, self._phrase.repeated = int(figure.value), figure
        elif figure.kind in ("temperature", "time", "pressure", "ph"):
            self._phrase.conditions.append(figure)
        elif figure.kind in ("ratio", "other", "length") or (
            figure.kind == "percent"
            and any(t.low in ("pure", "purity", "ee", "conversion") for t in self.tokens[place + 1 : place + 4])
        ):
            self._phrase.ratios.append(figure)
        elif figure.kind == "volume" and self._is_vessel(place):
            self._phrase.vessels.append(figure)
        elif self._is_ended():
            self._open("", token.start)
            self._pending.append(figure)
        elif self._attaches_back(place):
            assert self._last is not None
            self._last.amounts.append(figure)
        else:
            self._pending.append(figure)
        self._adjacent = False

    def _is_vessel(self, place: int) -> bool:
        """Return whether an amount is the size of a vessel: "a 250 mL round-bottomed flask"."""
        for token in self.tokens[place + 1 : place + 7]:
            if token.low.rstrip(".") in VESSELS:
                return True
            if token.kind not in ("word", "verb") and token.low != ".":
                return False
            if token.low == "of" and token is not self.tokens[place + 1]:
                return False
        return False

    def _is_ended(self) -> bool:
        """Return whether a phrase of circumstance is complete, so that a noun begins a new one."""
        phrase = self._phrase
        return bool(phrase.conditions) and not phrase.substances and phrase.solution is None and phrase.prep in _TIMES

    def _attaches_back(self, place: int) -> bool:
        """Return whether an amount belongs to the name before it: "n-BuLi 2.5 M in hexane"."""
        if self._last is None or self._separated or not self._adjacent:
            return False
        following = next((token for token in self.tokens[place + 1 : place + 3] if token.low != "."), None)
        if following is None:
            return True
        return not (following.kind == "name" or following.low in ("of", "aqueous") or following.low in SOLUTIONS)

    def _name(self, place: int, token: Token) -> None:
        if place <= self._skip:
            return
        if (
            token.low in GASES
            and self._phrase.prep in ("under", "with", "by", "in", "of")
            and not self._pending
            and self._is_gas(place)
        ):
            self._phrase.words.append(GASES[token.low])
            self._phrase.remarks.append((token.start, token.end))
            self._adjacent = False
            return
        if (
            token.low in GASES
            and place + 1 < len(self.tokens)
            and self.tokens[place + 1].low in ("inlet", "line", "bubbler", "balloon")
        ):
            self._phrase.remarks.append((token.start, token.end))
            return
        if token.low == "ice" and place + 1 < len(self.tokens) and self.tokens[place + 1].low in ("bath", "cooling"):
            return
        if token.low in SOLVENT_ADJECTIVES or token.low in QUALITIES:
            self._word(place, token)
            return
        self._named(place, token, weak=False)
        self._refers_back(place)

    def _is_gas(self, place: int) -> bool:
        rest = [token.low for token in self.tokens[place + 1 : place + 2]]
        return (
            self._phrase.prep == "under"
            or "atmosphere" in self._phrase.words
            or rest[:1] in (["atmosphere"], ["gas"], ["inlet"])
        )

    def _named(self, place: int, token: Token, weak: bool) -> None:
        if self._is_ended():
            self._open("", token.start)
        last = self._last
        if self._instead and last is not None:
            self._instead = False
            last.start, last.end, last.weak = token.start, token.end, weak
        elif last is not None and self._adjacent and not self._separated and not self._pending and not self._closed:
            last.end = token.end
            last.weak = last.weak and weak
        elif last is not None and self._joins_ester(place, token):
            last.end = token.end
        else:
            last = SubstanceMention(
                token.start, token.end, self._pending, self._quality, weak, self._in_solvent, self._paired
            )
            self._pending, self._quality = [], []
            self._phrase.substances.append(last)
            self._last = last
            if self._adjective is not None:
                self._phrase.substances.append(self._adjective)
                self._adjective = None
        self._separated, self._adjacent, self._paired, self._closed = False, True, False, False

    def _joins_ester(self, at: int, token: Token) -> bool:
        """Return whether a name goes on after a comma: "pentanoic acid, benzyl ester"."""
        assert self._last is not None
        after = self.tokens[at + 1].low if at + 1 < len(self.tokens) else ""
        comma = at > 0 and self.tokens[at - 1].text == ","
        tail = token.low in ("oxime", "hydrochloride", "dihydrochloride", "hydrobromide") or after in ("ester", "amide")
        before = all(figure.start < self._last.start for figure in self._last.amounts)
        return comma and before and tail and not self._pending

    def _word(self, place: int, token: Token) -> None:
        """Read a word that is no name: the first rule that knows it decides."""
        if place <= self._skip:
            return
        low = token.low.rstrip(".") if token.low not in WORDS_OF_AMOUNT else token.low
        if any(rule(self, place, token, low) for rule in _WORD_RULES):
            return
        self._phrase.words.append(low)
        self._adjacent = self._adjacent and token.text[:1].isupper()

    def _after(self, place: int) -> str:
        return self.tokens[place + 1].low if place + 1 < len(self.tokens) else ""

    def _acid(self, place: int, token: Token, low: str) -> bool:
        known = low.endswith("ic") and self._after(place) in ("acid", "anhydride")
        if known:
            self._named(place, token, weak=False)
        return known

    def _of(self, place: int, token: Token, low: str) -> bool:
        del token
        if low != "of":
            return False
        last = self._last
        following = self.tokens[place + 1 : place + 3]
        if (
            last is not None
            and last.weak
            and not self._separated
            and len(following) == 2
            and following[0].low in _ORIGINS
        ):
            last.end = following[1].end
            self._skip = place + 2
        elif (
            last is not None
            and self._adjacent
            and self._phrase.solution is None
            and not self._separated
            and not self._pending
        ):
            self._phrase.words.append("of")
        else:
            self._adjacent = False
        return True

    def _in(self, place: int, token: Token, low: str) -> bool:
        """Read "in": what follows dissolves what the phrase has, unless it is a vessel or a bath."""
        del token
        phrase = self._phrase
        if low != "in":
            return False
        after = self._after(place)
        if phrase.solution is not None and phrase.substances:
            self._in_solvent, self._separated, self._adjacent = True, True, False
            return True
        if after in ("portions", "solution", "suspension"):
            if after == "portions":
                phrase.words.append("portionwise")
            self._adjacent = False
            return True
        if phrase.substances and phrase.prep in ("", "to", "with", "of"):
            ahead = self.tokens[place + 1 : place + 7]
            following = [item for item in ahead if item.low not in QUALITIES and item.low not in DETERMINERS]
            solvent = any(item.kind == "name" or item.low in SOLUTIONS for item in following[:5])
            if solvent and not any(item.low in VESSELS for item in following[:4]):
                self._in_solvent, self._separated, self._adjacent = True, True, False
                return True
        return False

    def _equipment(self, place: int, token: Token, low: str) -> bool:
        if low not in ("equipped", "fitted"):
            return False
        breaks = (k for k in range(place, len(self.tokens)) if self.tokens[k].text in (",", ";"))
        end = next(breaks, len(self.tokens))
        self._skip = end - 1
        self._phrase.remarks.append((token.start, self.tokens[end - 1].end))
        return True

    def _such_as(self, place: int, token: Token, low: str) -> bool:
        """Read "such as": the example takes the place of the class before it."""
        del token
        previous = self.tokens[place - 1].low if place else ""
        if low == "such" and self._after(place) == "as":
            self._instead = self._last is not None and (previous == "," or not self._separated)
            return True
        return low == "as" and previous == "such"

    def _conjunction(self, place: int, token: Token, low: str) -> bool:
        del place
        if low in DETERMINERS and self._is_ended():
            self._open("", token.start)
        if low not in ("and", "or", "plus"):
            return False
        self._separated, self._adjacent = True, False
        if low == "or":
            self._phrase.words.append("or")
        return True

    def _preposition(self, place: int, token: Token, low: str) -> bool:
        del place
        if low not in PREPOSITIONS:
            return False
        if low == "containing" and (self._phrase.solution is not None or self._phrase.substances):
            self._separated, self._adjacent = True, False
        else:
            self._open(low, token.start)
        return True

    def _solution_word(self, place: int, token: Token, low: str) -> bool:
        if low in SOLUTIONS:
            self._solution_noun(place, token)
        return low in SOLUTIONS

    def _solvent_adjective(self, place: int, token: Token, low: str) -> bool:
        if low not in SOLVENT_ADJECTIVES:
            return False
        following = self.tokens[place + 1 : place + 2]
        if following and (following[0].low in SOLUTIONS or following[0].kind == "name"):
            adjective = SubstanceMention(token.start, token.end, [], [], False, True)
            if following[0].kind == "name":
                self._adjective = adjective
            else:
                self._phrase.substances.append(adjective)
        return True

    def _strength(self, place: int, token: Token, low: str) -> bool:
        del token
        if low not in WORDS_OF_AMOUNT:
            return False
        trailing = self._last is not None and not self._separated and self._after(place) in SOLUTIONS
        if not (low in ("aqueous", "aq", "aq.") and trailing):
            self._quality.append(WORDS_OF_AMOUNT[low])
            self._adjacent = False
        return True

    def _batch(self, place: int, token: Token, low: str) -> bool:
        if low not in BATCH and low not in VESSELS:
            return False
        if self._is_label(place):
            self._named(place, token, weak=True)
        else:
            self._phrase.nouns.append(low)
            self._adjacent = False
        return True

    def _quality_word(self, place: int, token: Token, low: str) -> bool:
        del place, token
        known = low in MANNERS or low in _CIRCUMSTANCES or low in DETERMINERS or low in QUALITIES
        if known:
            self._phrase.words.append(low)
            self._adjacent = False
        return known

    def _name_tail(self, place: int, token: Token, low: str) -> bool:
        """Read a word or number behind a name: a part of it ("silica gel") or its number ("amine 12b")."""
        del place
        if self._last is None or not self._adjacent:
            return False
        if not (is_code(token.text) or low in _TAILS or token.text[:1].isdigit()):
            return False
        if low in _NAME_TAILS:
            self._last.end = token.end
        return True

    def _stop(self, place: int, token: Token, low: str) -> bool:
        if not is_stop(low):
            return False
        self._phrase.words.append(low)
        self._adjacent = False
        if low in ("title", "desired", "titled") and self._after(place) in BATCH and self.is_result:
            self._named(place, token, weak=True)
            self._separated = False
        return True

    def _unknown(self, place: int, token: Token, low: str) -> bool:
        del low
        if self._is_label(place):
            self._named(place, token, weak=True)
            return True
        if self._last is not None and self._adjacent and not self._separated and self._ends_name(place):
            self._last.end = token.end
            return True
        return False

    def _ends_name(self, place: int) -> bool:
        """Return whether an unknown word after a name is its last one: "glycerol formal (5 g)"."""
        word = self.tokens[place].text
        after = self.tokens[place + 1] if place + 1 < len(self.tokens) else None
        if self.tokens[place - 1].kind != "name":
            return False
        closed = (
            after is None or after.kind in ("group", "mark") or after.low in ("and", "or") or after.low in PREPOSITIONS
        )
        return closed and len(word) > 3 and word.isalpha() and word.islower()

    def _solution_noun(self, place: int, token: Token) -> None:
        phrase = self._phrase
        after = self.tokens[place + 1].low if place + 1 < len(self.tokens) else ""
        if after in ("of", "containing", "obtained", "from") and (
            phrase.solution is None or self._in_solvent or not phrase.substances
        ):
            if self._last is not None and phrase.solution is None and not self._separated:
                self._last.solvent = True
            if not self._in_solvent:
                phrase.solution = token
                phrase.is_stock = (
                    any(figure.kind in ("molarity", "percent") for figure in self._pending)
                    or "saturated" in self._quality
                )
                self._solution_amounts += self._pending
                self._pending = []
            self._separated, self._adjacent = True, False
            return
        if (after == "()" and phrase.solution is None and not phrase.substances) or self._last is None:
            phrase.nouns.append(token.low)
        self._adjacent = False

    def _is_label(self, place: int) -> bool:
        """Return whether a word that names no substance stands for one: an amount stands with it."""
        if self._refers_back(place):
            return True
        if self._pending and any(
            figure.kind in ("mass", "volume", "substance", "equivalents", "parts") for figure in self._pending
        ):
            return True
        if (
            self.is_result
            and not self._phrase.substances
            and self._phrase.prep in ("", "of")
            and self.tokens[place].low in BATCH
        ):
            return True
        following = self.tokens[place + 1] if place + 1 < len(self.tokens) else None
        return (
            following is not None
            and following.kind == "group"
            and any(
                token.figure is not None and token.figure.kind in ("mass", "volume", "substance", "equivalents")
                for token in following.inner
            )
            and (self._last is None or self._separated or not self._last.amounts)
        )

    def _refers_back(self, place: int) -> bool:
        """Return whether an amount follows the words about where a substance came from: "X from Step 8 (2 g)"."""
        ahead = self.tokens[place + 1 : place + 11]
        if not ahead or ahead[0].low not in ("prepared", "obtained", "from", "described", "produced", "of"):
            return False
        for k, token in enumerate(ahead):
            if (
                token.kind in ("name", "figure")
                or token.low in SOLUTIONS
                or (token.low in (",", "was", "were", "in") and k > 1 and token.low != "in")
            ):
                return False
            if token.kind == "group":
                if any(
                    item.figure is not None and item.figure.kind in ("mass", "volume", "substance")
                    for item in token.inner
                ):
                    self._skip = place + k
                    return any(
                        item.low in ("example", "step", "preparation", "intermediate", "above") for item in ahead[:k]
                    )
                return False
        return False

    def _verb(self, place: int, token: Token) -> None:
        """Pass a word for an operation that is used as an adjective or a noun."""
        if place <= self._skip:
            return
        if token.low in ("equipped", "fitted") or token.low in BATCH:
            self._word(place, token)
            return
        if token.low in WORDS_OF_AMOUNT:
            self._quality.append(WORDS_OF_AMOUNT[token.low])
            self._adjacent = False
            return
        if self._is_label(place) and token.low in BATCH:
            self._named(place, token, weak=True)
            return
        self._phrase.words.append(token.low)
        self._adjacent = False

    def _mark(self, place: int, token: Token) -> None:
        if token.text in ",":
            if (
                (
                    self._phrase.prep
                    not in (
                        "",
                        "to",
                        "with",
                        "of",
                        "in",
                        "from",
                        "between",
                        "into",
                        "over",
                        "by",
                        "using",
                        "onto",
                        "through",
                    )
                    and not self._phrase.substances
                )
                or (
                    self._phrase.prep
                    and not self._phrase.substances
                    and (self._phrase.conditions or self._phrase.nouns)
                    and not self._pending
                )
                or (
                    self._phrase.prep == "to"
                    and self._phrase.solution is not None
                    and not self._in_solvent
                    and any(item.solvent for item in self._phrase.substances)
                )
            ):
                self._open("", token.start)
            subject = self._phrase.prep == "" and self._phrase.solution is not None
            if self._in_solvent and self._phrase.prep in ("", "to", "with") and not subject and self._goes_on(place):
                self._open("", token.start)
            self._separated, self._adjacent = True, False
        elif token.text in "/:-":
            self._separated, self._adjacent, self._paired = True, False, True

    def _goes_on(self, place: int) -> bool:
        """Return whether new substances follow the comma after a solvent, not more of its phrase."""
        following = self.tokens[place + 1 : place + 5]
        return any(token.kind in ("name", "figure") for token in following)

    def _group(self, place: int, token: Token) -> None:
        """Read a bracket: amounts of the name before it, conditions, a remark, or substances."""
        del place
        inner, phrase = token.inner, self._phrase
        values = [item.figure for item in inner if item.figure is not None]
        amounts = [figure for figure in values if figure.is_amount]
        names = any(item.kind == "name" for item in inner)
        if self._is_remark(inner, bool(amounts)):
            phrase.remarks.append((token.start, token.end))
            if not amounts:
                return
        phrase.conditions += [figure for figure in values if figure.kind in ("temperature", "time", "pressure", "ph")]
        phrase.ratios += [figure for figure in values if figure.kind in ("ratio", "other", "length")]
        for figure in values:
            if figure.kind == "repeats":
                phrase.repeats, phrase.repeated = int(figure.value), figure
        last = self._last
        if self._pending and amounts and not names:
            self._pending += amounts
        elif names and self._paired:
            for part in PhraseReader(inner).read():
                phrase.substances += part.substances
            self._paired, self._last = False, None
        elif last is None or self._stands_alone(last, inner, names, bool(amounts)):
            self._free_group(inner, names, amounts)
        else:
            self._measure(last, inner, names, amounts)

    def _is_remark(self, inner: Sequence[Token], has_amounts: bool) -> bool:
        verbs = any(item.kind == "verb" for item in inner)
        words = ("mw", "mw=", "prepared", "example", "from", "see")
        return (verbs and not has_amounts) or any(item.low in words or item.low.startswith("mw=") for item in inner[:3])

    def _stands_alone(self, last: SubstanceMention, inner: Sequence[Token], names: bool, has_amounts: bool) -> bool:
        """Return whether a bracket names further substances: eluents after silica gel, a drying agent."""
        if names and self._is_eluent(inner):
            return True
        return names and not has_amounts and not last.is_measured and last.weak

    def _free_group(self, inner: Sequence[Token], names: bool, amounts: list[QuantitySpan]) -> None:
        phrase = self._phrase
        if names:
            for part in PhraseReader(inner).read():
                phrase.substances += part.substances
                phrase.ratios += part.ratios
                phrase.loose += part.loose
        elif phrase.substances:
            phrase.substances[-1].amounts += amounts
        else:
            phrase.loose += amounts

    def _measure(
        self, last: SubstanceMention, inner: Sequence[Token], names: bool, amounts: list[QuantitySpan]
    ) -> None:
        """Give the amounts of a bracket to the name before it: "HCl (2 M in ether, 5 mL)"."""
        phrase = self._phrase
        measured = [figure for figure in amounts if not (figure.kind == "percent" and _is_purity(inner, figure))]
        strong = any(figure.kind in ("molarity", "percent") for figure in measured)
        words = [item.low for item in inner]
        if names and strong and "in" in words:
            solvent = next((part for part in PhraseReader(inner).read() if part.prep == "in" and part.substances), None)
            if solvent is not None and not {"dispersion", "suspension"} & set(words):
                dissolving = solvent.substances[0]
                dissolving.amounts, dissolving.solvent = [], True
                phrase.substances.append(dissolving)
        while last.paired and last is not phrase.substances[0]:
            last = phrase.substances[phrase.substances.index(last) - 1]
        last.amounts += measured
        self._closed = bool(measured)
        last.words += [WORDS_OF_AMOUNT[word] for word in words if word in ("excess", "catalytic", "saturated")]
        self._adjacent = True

    def _is_eluent(self, inner: Sequence[Token]) -> bool:
        """Return whether a bracket after a stationary phase names eluents."""
        named = self.text_of_last()
        return named in ("silica", "silica gel", "sio2", "alumina", "al2o3", "celite") and any(
            token.kind == "name" for token in inner
        )

    def text_of_last(self) -> str:
        """Return the last name in lower case."""
        assert self._last is not None
        return " ".join(
            token.low for token in self.tokens if self._last.start <= token.start and token.end <= self._last.end
        )


_WORD_RULES = (
    PhraseReader._acid,
    PhraseReader._of,
    PhraseReader._in,
    PhraseReader._equipment,
    PhraseReader._such_as,
    PhraseReader._conjunction,
    PhraseReader._preposition,
    PhraseReader._solution_word,
    PhraseReader._solvent_adjective,
    PhraseReader._strength,
    PhraseReader._batch,
    PhraseReader._quality_word,
    PhraseReader._name_tail,
    PhraseReader._stop,
    PhraseReader._unknown,
)
"""Rules for a word that is no name, in order."""


def _is_purity(inner: Iterable[Token], figure: QuantitySpan) -> bool:
    words = [token.low for token in inner]
    place = next((k for k, token in enumerate(inner) if token.figure is figure), 0)
    return "purity" in words[max(0, place - 2) : place] or any(
        word in ("ee", "pure", "purity") for word in words[place + 1 : place + 2]
    )
