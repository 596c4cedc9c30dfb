"""A clause of a regulation, what is measured for it, and the ruling on a layout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from labgym.documents import Record
from labgym.layouts.rules.regulations.premises import Premises

Sense = Literal["at least", "at most"]
Basis = Literal["read", "recalled"]
"""`read`: the figure was seen in a public page that cites the clause. `recalled`: it is known from the published
standard, whose clause was not read again; check it before relying on it."""
Outcome = Literal["pass", "fail", "does not apply"]

TOLERANCE = 1e-3
"""A value may miss its limit by this much: rounding of positions, meters."""


@dataclass(frozen=True)
class Measured:
    """A value of one object, door or room: its name and the value, in meters or as a count."""

    name: str
    value: float


@dataclass(frozen=True)
class LegalClause:
    """A requirement on a value that a layout's geometry decides.

    Attributes:
        source: standard and clause.
        requires: the requirement, in a few words.
        sense: whether the limit is the least or the greatest permitted value.
        limit: meters, or a count.
        measure: returns the values to compare; none if the clause does not apply to the layout.
        basis: how the limit is known.
    """

    source: str
    requires: str
    sense: Sense
    limit: float
    measure: Callable[[Premises], list[Measured]]
    basis: Basis

    def rule(self, premises: Premises) -> Ruling:
        """Return the ruling on a layout; the value is the worst one."""
        values = self.measure(premises)
        worst: Measured | None = None
        if values:
            pick = min if self.sense == "at least" else max
            worst = pick(values, key=lambda measured: measured.value)
        outcome: Outcome = "does not apply"
        if worst is not None:
            short = self.limit - worst.value if self.sense == "at least" else worst.value - self.limit
            outcome = "fail" if short > TOLERANCE else "pass"
        finite = worst is not None and abs(worst.value) != float("inf")
        return Ruling(
            source=self.source,
            requires=self.requires,
            sense=self.sense,
            limit=self.limit,
            value=worst.value if worst is not None and finite else None,
            where=worst.name if worst is not None else "",
            outcome=outcome,
            basis=self.basis,
        )


class Ruling(Record):
    """The ruling of one clause on a layout.

    Attributes:
        source, requires, sense, limit, basis: as of the clause.
        value: the worst measured value; None if the clause does not apply or there is nothing to measure, such as a
            walk to a shower that does not exist.
        where: the object, door or room with the worst value.
    """

    source: str
    requires: str
    sense: Sense
    limit: float
    value: float | None
    where: str
    outcome: Outcome
    basis: Basis
