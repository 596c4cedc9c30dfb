"""Agreement: how well read procedures agree with the action lists that people wrote.

Tuples are aligned in order. Strict: operation, substance and all amounts agree. Relaxed: operation and substance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from labgym.protocols.reading.actions import ActionList
from labgym.protocols.reading.figures import figures, plain
from labgym.protocols.reading.gold import GoldText, Tuple, Value, tuples

SAME = 2e-3
"""Largest relative difference of two values that count as equal."""
GRADE_B = 0.9
"""Least strict F1 of a text of grade B."""
_SOLUTIONS = frozenset(["solution", "suspension", "mixture", "slurry", "dispersion"])
_UNITS = {
    "mass": "g", "volume": "mL", "substance": "mol", "equivalents": "eq", "molarity": "M", "percent": "%",
    "parts": "parts",
}  # fmt: skip


Agreed = tuple[int, int]
"""How many there are, and how many of them agree."""
_KEEPING = ("Filter", "CollectLayer")


@dataclass
class ReadingScore:
    """Counts over texts; the figures are micro-averages.

    Attributes:
        gold, read: number of tuples.
        strict, relaxed: aligned tuples.
        invented: read tuples whose substance no gold tuple of the text names.
        lost: quantities of the gold that are neither in a read tuple nor unread.
        unread: spans that no action owns.
        pairs, ordered: pairs of tuples in both, and those in the same sequence.
        kept: filtrations and layers in both whose kept part the gold names, and those that are read with that part.
        worked: other tuples in both whose part the gold names, and those that are read with that part.
        repeats: tuples in both that one of them repeats, and those that both repeat as often.
        grades: texts by grade: A all tuples and conditions, B nearly all and nothing invented, C the rest.
    """

    texts: int = 0
    gold: int = 0
    read: int = 0
    strict: int = 0
    relaxed: int = 0
    gold_actions: int = 0
    read_actions: int = 0
    actions: int = 0
    gold_conditions: int = 0
    read_conditions: int = 0
    conditions: int = 0
    pairs: int = 0
    ordered: int = 0
    invented: int = 0
    lost: int = 0
    quantities: int = 0
    unread: int = 0
    kept: Agreed = (0, 0)
    worked: Agreed = (0, 0)
    repeats: Agreed = (0, 0)
    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    grades: Counter[str] = field(default_factory=Counter)
    differences: list[str] = field(default_factory=list)

    @property
    def order(self) -> float:
        """Kendall's tau of the tuples in both."""
        return 2.0 * self.ordered / self.pairs - 1.0 if self.pairs else 1.0

    def lines(self) -> list[str]:
        """Return the figures as lines of text."""
        same = sum(count for (gold, read), count in self.outcomes.items() if gold == read)
        refers = sum(count for (gold, _), count in self.outcomes.items() if gold == "refers")
        return [
            f"texts {self.texts}; tuples {self.gold} gold, {self.read} read",
            f"strict tuple F1 {f1(self.strict, self.gold, self.read):.3f} "
            f"(precision {_share(self.strict, self.read):.3f}, recall {_share(self.strict, self.gold):.3f})",
            f"relaxed tuple F1 {f1(self.relaxed, self.gold, self.read):.3f}",
            f"operations F1 {f1(self.actions, self.gold_actions, self.read_actions):.3f}",
            f"conditions F1 {f1(self.conditions, self.gold_conditions, self.read_conditions):.3f}",
            f"order (Kendall) {self.order:.3f}",
            f"invented tuples {self.invented}; quantities lost in silence {self.lost} of {self.quantities}; "
            f"unread spans {self.unread}",
            f"part kept {self.kept[1]} of {self.kept[0]}; part worked on {self.worked[1]} of {self.worked[0]}; "
            f"repeats {self.repeats[1]} of {self.repeats[0]}",
            f"outcome equal {same} of {self.texts}; refers found {self.outcomes['refers', 'refers']} of {refers}",
            f"grades A {self.grades['A']}, B {self.grades['B']}, C {self.grades['C']}",
        ]


def f1(hits: int, first: int, second: int) -> float:
    """Return the harmonic mean of precision and recall."""
    return 2.0 * hits / (first + second) if first + second else 1.0


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 1.0


def score(pairs: Iterable[tuple[GoldText, ActionList]]) -> ReadingScore:
    """Return the agreement of read procedures with their gold."""
    total = ReadingScore()
    for gold, actions in pairs:
        _count(total, gold, actions)
    return total


def _count(total: ReadingScore, gold: GoldText, actions: ActionList) -> None:
    ours, theirs = tuples(actions), gold.tuples
    strict = _aligned(theirs, ours, _agree)
    relaxed = _aligned(theirs, ours, _same)
    total.texts += 1
    total.gold += len(theirs)
    total.read += len(ours)
    total.strict += len(strict)
    total.relaxed += len(relaxed)
    first, second = _operations(theirs), _operations(ours)
    total.gold_actions += len(first)
    total.read_actions += len(second)
    total.actions += len(_aligned(first, second, lambda a, b: a == b))
    wanted, stated = _conditions(theirs), _conditions(ours)
    pooled = _matched(wanted, stated)
    total.gold_conditions += len(wanted)
    total.read_conditions += len(stated)
    total.conditions += pooled
    kept = {j for _, j in relaxed}
    invented = [
        item
        for j, item in enumerate(ours)
        if j not in kept and item.substance and not any(_names(other, item) for other in theirs)
    ]
    total.invented += len(invented)
    quantities = [value for item in theirs for value in item.amounts if value[0] != "word"]
    reported = [value for item in ours for value in item.amounts]
    reported += [value for span in actions.unread for value in _reported(span.text)]
    lost = len(quantities) - _matched(quantities, reported)
    total.quantities += len(quantities)
    total.lost += lost
    total.unread += len(actions.unread)
    _count_order(total, theirs, ours)
    _count_parts(total, gold.id, [(theirs[i], ours[j]) for i, j in relaxed])
    total.outcomes[gold.outcome, actions.outcome] += 1
    perfect = len(strict) == len(theirs) == len(ours) and pooled == len(wanted) == len(stated)
    near = f1(len(strict), len(theirs), len(ours)) >= GRADE_B and not invented and not lost
    total.grades["A" if perfect else "B" if near else "C"] += 1
    total.differences += _differences(gold, actions, ours, strict)


def _reported(text: str) -> Iterator[Value]:
    for figure in figures(plain(text)):
        if figure.kind in _UNITS:
            yield _UNITS[figure.kind], figure.value


def _count_order(total: ReadingScore, theirs: Sequence[Tuple], ours: Sequence[Tuple]) -> None:
    free = list(range(len(ours)))
    sequence = []
    for item in theirs:
        match = next((j for j in free if _agree(item, ours[j])), None)
        if match is not None:
            free.remove(match)
            sequence.append(match)
    pairs = [(a, b) for k, a in enumerate(sequence) for b in sequence[k + 1 :]]
    total.pairs += len(pairs)
    total.ordered += sum(a < b for a, b in pairs)


def _count_parts(total: ReadingScore, name: str, both: Sequence[tuple[Tuple, Tuple]]) -> None:
    """Count kept parts, parts that are worked on, and repeats of tuples that both have; note kept parts that differ."""
    keeping = [(a.phase, b.phase) for a, b in both if a.op in _KEEPING and a.phase is not None]
    working = [(a.phase, b.phase) for a, b in both if a.op not in _KEEPING and a.phase is not None]
    repeated = [(a.repeat, b.repeat) for a, b in both if (a.repeat, b.repeat) != (1, 1)]
    total.kept = _added(total.kept, keeping)
    total.worked = _added(total.worked, working)
    total.repeats = _added(total.repeats, repeated)
    for a, b in both:
        if a.op in _KEEPING and a.phase not in (None, b.phase):
            total.differences.append(f"{name} keeps {a.order:2d} {a.op} {a.phase}, read {b.phase}")
        if a.repeat != b.repeat:
            total.differences.append(f"{name} repeats {a.order:2d} {a.op} {a.repeat}, read {b.repeat}")


def _added(agreed: Agreed, more: Sequence[tuple[object, object]]) -> Agreed:
    return agreed[0] + len(more), agreed[1] + sum(a == b for a, b in more)


def _differences(
    gold: GoldText, actions: ActionList, ours: Sequence[Tuple], strict: Sequence[tuple[int, int]]
) -> Iterator[str]:
    left, right = {i for i, _ in strict}, {j for _, j in strict}
    for i, item in enumerate(gold.tuples):
        if i not in left:
            yield f"{gold.id} - {item.order:2d} {item.op} {item.substance} {_shown(item.amounts)}"
    for j, item in enumerate(ours):
        if j not in right:
            yield f"{gold.id} + {item.order:2d} {item.op} {item.substance} {_shown(item.amounts)}"
    if gold.outcome != actions.outcome:
        yield f"{gold.id} outcome {gold.outcome}, read {actions.outcome}"
    stated = _conditions(ours)
    for entry in _conditions(gold.tuples):
        match = next((other for other in stated if _close(entry, other)), None)
        if match is None:
            yield f"{gold.id} - condition {' '.join(map(str, entry))}"
        else:
            stated.remove(match)
    for entry in stated:
        yield f"{gold.id} + condition {' '.join(map(str, entry))}"


def _shown(values: Sequence[Value]) -> str:
    return ", ".join(f"{value:g} {unit}" if isinstance(value, float | int) else str(value) for unit, value in values)


def _operations(items: Sequence[Tuple]) -> list[str]:
    return [item.op for k, item in enumerate(items) if not k or items[k - 1].order != item.order]


def _conditions(items: Sequence[Tuple]) -> list[tuple[str, str, float | str]]:
    return [(item.op, *value) for item in items for value in item.conditions]


def _same(gold: Tuple, read: Tuple) -> bool:
    return gold.op == read.op and _names(gold, read)


def _agree(gold: Tuple, read: Tuple) -> bool:
    return _same(gold, read) and _equal(gold.amounts, read.amounts)


def _names(gold: Tuple, read: Tuple) -> bool:
    """Return whether two tuples name one substance: by the same words, or by spans of which one holds the other."""
    if gold.substance is None or read.substance is None:
        return gold.substance is None and read.substance is None
    first, second = _folded(gold.substance), _folded(read.substance)
    if first == second or (first in _SOLUTIONS and second in _SOLUTIONS):
        return True
    if gold.op == "Refers":
        return first in second or second in first
    if gold.span is None or read.span is None:
        return False
    inside = (gold.span[0] <= read.span[0] and read.span[1] <= gold.span[1]) or (
        read.span[0] <= gold.span[0] and gold.span[1] <= read.span[1]
    )
    lengths = sorted((gold.span[1] - gold.span[0], read.span[1] - read.span[0]))
    return inside and 2 * lengths[0] >= lengths[1]


def _folded(name: str) -> str:
    return "".join(name.lower().split())


def _equal(first: Sequence[Value], second: Sequence[Value]) -> bool:
    return len(first) == len(second) and _matched(first, second) == len(first)


def _matched(first: Sequence[tuple[Any, ...]], second: Sequence[tuple[Any, ...]]) -> int:
    """Return how many entries of one list another has, each used once."""
    rest = list(second)
    count = 0
    for entry in first:
        match = next((k for k, other in enumerate(rest) if _close(entry, other)), None)
        if match is not None:
            del rest[match]
            count += 1
    return count


def _close(first: tuple[Any, ...], second: tuple[Any, ...]) -> bool:
    *names, a = first
    *others, b = second
    if names != others:
        return False
    if isinstance(a, float | int) and isinstance(b, float | int):
        return bool(abs(a - b) <= SAME * max(abs(a), abs(b)) + 1e-9)
    return bool(a == b)


def _aligned(first: Sequence[Any], second: Sequence[Any], same: Callable[[Any, Any], bool]) -> list[tuple[int, int]]:
    """Return the longest common subsequence of two lists as pairs of indices."""
    rows, columns = len(first), len(second)
    table = [[0] * (columns + 1) for _ in range(rows + 1)]
    for i in range(rows - 1, -1, -1):
        for j in range(columns - 1, -1, -1):
            joined = table[i + 1][j + 1] + 1 if same(first[i], second[j]) else 0
            table[i][j] = max(table[i + 1][j], table[i][j + 1], joined)
    pairs, i, j = [], 0, 0
    while i < rows and j < columns:
        if table[i][j] == table[i + 1][j + 1] + 1 and same(first[i], second[j]):
            pairs.append((i, j))
            i, j = i + 1, j + 1
        elif table[i + 1][j] >= table[i][j + 1]:
            i += 1
        else:
            j += 1
    return pairs
