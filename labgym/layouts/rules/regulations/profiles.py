"""The regulation profiles by name, and the rulings of one on a layout."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from labgym.errors import check_name
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations import china, europe, united_states
from labgym.layouts.rules.regulations.clause import LegalClause, Ruling
from labgym.layouts.rules.regulations.premises import Premises

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment

REGULATIONS: Mapping[str, tuple[LegalClause, ...]] = {
    "US": united_states.CLAUSES,
    "EN": europe.CLAUSES,
    "CN": china.CLAUSES,
}
"""Clauses by profile. They are information on a design, not a certificate: codes have exceptions, and occupancies,
amounts of chemicals, air flows and construction are not in a layout."""


def rulings(arrangement: Arrangement, name: str, premises: Premises | None = None) -> tuple[Ruling, ...]:
    """Return what each clause of a regulation profile says about a layout, in the order of the profile.

    Args:
        arrangement: the layout, unrolled.
        name: `US`, `EN` or `CN`.
        premises: the layout's walks, if they exist already.

    Raises:
        UnknownNameError: no profile has that name.
    """
    check_name("regulation profile", name, REGULATIONS)
    measured = Premises(arrangement) if premises is None else premises
    return tuple(clause.rule(measured) for clause in REGULATIONS[name])


def regulation_figures(assessment: Assessment) -> dict[str, dict[str, tuple[Ruling, ...]]]:
    """Return the rulings of each clause by regulation profile."""
    arrangement, premises = assessment.arrangement, assessment.premises
    return {"regulations": {name: rulings(arrangement, name, premises) for name in REGULATIONS}}
