"""Temperature and duration of the reaction: from the text, from a precedent in the library, or usual for its kind."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.assets import Catalog
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Action, experiments
from labgym.protocols.library import protocols
from labgym.protocols.model import Step
from labgym.protocols.retrieval import SearchResults, search
from labgym.protocols.rules.conditions import STEAM_BATH
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.roles import Participant
from labgym.protocols.synthesis.transformations import Transformation
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE

HOLDING_VERBS = ("Stir", "Heat", "Reflux")
PRECEDENT_REAGENTS = 2
"""Number of reagents besides solvents, among them the substrate, that a precedent shares with the reaction."""
COLD, WARM = ROOM_RANGE
MILD_REFLUX_C = 120.0
"""Highest boiling point of a solvent in which a usual reflux is still a reflux, degrees Celsius."""
BATH_EXCESS_K = 60.0
"""A stated temperature up to this much above the boiling point is that of the bath, degrees Celsius."""
_GRADUAL = re.compile(r"\bover\b|\bduring\b|\bwithin\b|drop-?wise|portion|slowly|滴加|分批|缓慢|内加", re.IGNORECASE)
"""A duration with these words is that of the addition."""
_CLOSED = re.compile(
    r"\b(?:sealed|pressure (?:tube|vessel)|autoclave|closed vessel|microwave vial)\b|密闭|封管|高压釜", re.IGNORECASE
)
BOILING_TOLERANCE_K = 4.0
"""Margin around a boiling point within which a temperature counts as reflux, degrees Celsius."""
STEAM_BATH_C = 95.0
"""Temperature of a flask on a steam bath."""
HOLDING = ("Stir", "Heat", "Reflux", "Distill", None)
ADDING = ("Add", "Cool", "Dissolve")


@dataclass(frozen=True)
class Precedent:
    """The conditions under which a published protocol or experiment lets the same reagents react.

    Attributes:
        source: id of the protocol or experiment.
        temperature: degrees Celsius.
        duration: minutes.
    """

    source: str
    temperature: float
    duration: float


def context_of(text: str, keyword_only: bool, catalog: Catalog) -> SearchResults:
    """Return the fragments nearest to a text, best first: the nearest of all kinds, and the nearest protocols."""
    nearest = search(text, keyword_only=keyword_only, catalog=catalog)
    sources = {hit.fragment.source for hit in nearest.hits}
    nearest_protocols = search(text, keyword_only=keyword_only, origin="protocol", catalog=catalog).hits
    additional = (hit for hit in nearest_protocols if hit.fragment.source not in sources)
    return replace(nearest, hits=tuple(sorted((*nearest.hits, *additional), key=lambda hit: -hit.score)))


def precedent(context: SearchResults, parts: Sequence[Participant]) -> Precedent | None:
    """Return the best precedent with the same substrate and reagents, or None."""
    substrates = {part.asset.name for part in parts if "substrate" in part.role}
    reagents = {part.asset.name for part in parts if "solvent" not in part.role}
    for hit in context.hits:
        names, steps = _library_entry(hit.fragment.source)
        shared = reagents & names
        if shared & substrates and len(shared) >= PRECEDENT_REAGENTS:
            longest = _longest_hold(hit.fragment.source, steps)
            if longest is not None:
                return longest
    return None


def _library_entry(source: str) -> tuple[set[str], Sequence[Step | Action]]:
    """Return the reagents and the steps of a protocol or an experiment; nothing for a rule."""
    protocol, experiment = protocols().get(source), experiments().get(source)
    if protocol is not None:
        return {use.name for use in protocol.reagents}, protocol.steps
    if experiment is not None:
        return {material.name for material in experiment.materials}, experiment.actions
    return set(), ()


def _longest_hold(source: str, steps: Sequence[Step | Action]) -> Precedent | None:
    holds = [
        Precedent(source, step.temperature, step.duration)
        for step in steps
        if (step.verb if isinstance(step, Action) else step.action) in HOLDING_VERBS
        and step.temperature is not None
        and step.duration is not None
    ]
    return max(holds, key=lambda item: item.duration, default=None)


@dataclass(frozen=True)
class Hold:
    """A period of the reaction at one temperature.

    Attributes:
        action: name of the action.
        temperature: degrees Celsius.
        duration: minutes.
        bath: temperature of the bath if the mixture boils below it, degrees Celsius.
    """

    action: str
    temperature: float
    duration: float
    bath: float | None = None


def boiling_point(parts: Sequence[Participant]) -> tuple[float, str] | None:
    """Return the lowest boiling point of the solvents and that solvent's name, or None without solvents."""
    points = [
        (point, part.asset.name)
        for part in parts
        if "solvent" in part.role and (point := part.asset.boiling_point) is not None
    ]
    return min(points, default=None)


def _boils(parts: Sequence[Participant]) -> float | None:
    """Return the lowest temperature at which a liquid of the reaction boils under a condenser, or None."""
    points = [part.asset.boiling_point for part in parts if part.asset.phase == "liquid"]
    return min((point for point in points if point is not None and point > WARM), default=None)


def holds(
    kind: Transformation,
    clauses: Sequence[Clause],
    parts: Sequence[Participant],
    precedent: Precedent | None,
    notes: list[str],
) -> tuple[Hold, ...]:
    """Return the periods of the reaction in order, at least one; a temperature that is changed is noted.

    If the text gives neither temperature nor duration, those of a precedent apply.
    """
    boiling = boiling_point(parts)
    stated = [clause for clause in clauses if is_period(clause)]
    timed = [clause for clause in stated if clause.duration is not None or _is(clause, "Reflux") or clause.warmed]
    # A temperature without a time before a stretch with one is that of the addition: "at 0 C, then 2 h at 22 C".
    stated = timed or stated
    if not stated and precedent is not None and kind.action != "Distill":
        notes.append(f"temperature and duration of the reaction as in {precedent.source}")
        limit = boiling[0] if boiling is not None else precedent.temperature
        temperature = min(precedent.temperature, limit)
        return (Hold(_action(kind, None, temperature, boiling), temperature, precedent.duration),)
    if not stated:
        return (hold(kind, None, parts, _stated_addition(clauses)),)
    return periods(kind, stated, parts, _stated_addition(clauses))


def periods(
    kind: Transformation, clauses: Sequence[Clause], parts: Sequence[Participant], start: float | None
) -> tuple[Hold, ...]:
    """Return the periods of clauses in order; one without a temperature keeps that of the one before.

    Args:
        start: temperature before the first, degrees Celsius, if the text gives one.
    """
    at, stretches = start, []
    for position, clause in enumerate(clauses):
        following = clauses[position + 1] if position + 1 < len(clauses) else None
        passing = clause.warmed and clause.duration is None and following is not None and following.temperature is None
        if not passing:
            stretches.append(hold(kind, clause, parts, at))
        at = ROOM_TEMPERATURE if clause.warmed else clause.temperature if clause.temperature is not None else at
    return tuple(stretches)


def is_period(clause: Clause) -> bool:
    """Return whether a clause keeps the mixture at a temperature or for a time."""
    action = clause.operation.action if clause.operation else None
    timed = clause.temperature is not None or clause.duration is not None or clause.warmed
    treated = action == "Add" and clause.duration is not None and not _GRADUAL.search(clause.text)
    return treated or (action in HOLDING and (timed or _is(clause, "Reflux")))


def addition_temperature(kind: Transformation, clauses: Sequence[Clause]) -> float:
    """Return the temperature at which reagents are added."""
    stated = _stated_addition(clauses)
    cold = [c.temperature for c in clauses if c.temperature is not None and c.temperature < COLD]
    if stated is not None or cold:
        return stated if stated is not None else min(cold)
    return kind.add_temperature if kind.add_temperature is not None else ROOM_TEMPERATURE


def _stated_addition(clauses: Sequence[Clause]) -> float | None:
    stated = [
        c.temperature for c in clauses if c.operation and c.operation.action in ADDING and c.temperature is not None
    ]
    return min(stated, default=None)


def hold(kind: Transformation, clause: Clause | None, parts: Sequence[Participant], add: float | None) -> Hold:
    """Return the period that a clause describes, or that is usual for the kind of reaction.

    Args:
        add: temperature of the addition before it, degrees Celsius, if the text gives one; it is kept if the
            clause gives none.

    Raises:
        RefusalError: the mixture boils far below the temperature, and no vessel for pressure is provided for.
    """
    boiling = boiling_point(parts)
    temperature = clause.temperature if clause is not None else None
    if clause is not None and clause.warmed:
        temperature = ROOM_TEMPERATURE
    elif temperature is None and clause is not None and STEAM_BATH.search(clause.text):
        temperature = STEAM_BATH_C
    if temperature is None:
        if clause is not None and _is(clause, "Reflux") and boiling is not None:
            temperature = boiling[0]
        elif clause is not None and _is(clause, "Reflux") and kind.temperature <= WARM:
            temperature = _boils(parts) or kind.temperature
        elif clause is not None and _is(clause, "Heat") and kind.temperature <= WARM:
            temperature = 60.0 if boiling is None else min(60.0, boiling[0])
        elif add is not None and clause is not None and not _is(clause, "Heat"):
            temperature = add
        elif kind.action == "Reflux" and boiling is not None and boiling[0] <= MILD_REFLUX_C:
            temperature = boiling[0]
        else:
            temperature = kind.temperature
    duration = clause.duration if clause is not None and clause.duration else kind.duration
    bath = None
    if boiling is not None and temperature > boiling[0] and kind.action != "Distill":
        stated = clause is not None and clause.temperature is not None
        if clause is not None and stated:
            if temperature > boiling[0] + BATH_EXCESS_K or _CLOSED.search(clause.text):
                message = f"{temperature:g} C is above the boiling point of {boiling[1]} ({boiling[0]:g} C), and no"
                raise RefusalError("infeasible", f"{message} template works under pressure: take another solvent")
            bath = temperature
        temperature = boiling[0]
    return Hold(_action(kind, clause, temperature, boiling), round(temperature, 1), duration, bath)


def _action(kind: Transformation, clause: Clause | None, temperature: float, boiling: tuple[float, str] | None) -> str:
    if kind.action == "Distill":
        return "Distill"
    hot = temperature > WARM
    if hot and boiling is not None and temperature >= boiling[0] - BOILING_TOLERANCE_K:
        return "Reflux"
    if hot and (_is(clause, "Reflux") or (clause is None and kind.action == "Reflux" and boiling is None)):
        return "Reflux"
    return "Heat" if hot else "Stir"


def _is(clause: Clause | None, action: str) -> bool:
    return clause is not None and clause.operation is not None and clause.operation.action == action
