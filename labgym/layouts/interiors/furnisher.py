"""Furnishes one space: what is required along the walls by the solver, then further pieces and benches in the open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Nearness, Proximity, Separation, Unit
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.program import plan_walls
from labgym.layouts.interiors.siting import (
    Aloof,
    all_places,
    choose_segments,
    distances_from,
    every_segment,
    options_on,
    stand_oblique,
)
from labgym.layouts.interiors.standing import Distances
from labgym.layouts.interiors.supply import supplied

ATTEMPTS = 10
"""Number of choices of walls that are tried before the solver chooses them."""
FREE_ATTEMPTS = 2
"""Number of them, the last ones, in which furniture may stand beyond the reach of services that are not required, and
in which only the least demands hold."""
QUICK, THOROUGH = 0.05, 1.0
"""Deterministic search time with walls chosen beforehand, and with walls left to the solver."""


@dataclass(frozen=True)
class Demands:
    """Conditions between units.

    Attributes:
        separations, nearness, proximities: between units of the space.
        apart: boxes of other spaces and the distance to keep from each, by unit id.
    """

    separations: tuple[Separation, ...] = ()
    nearness: tuple[Nearness, ...] = ()
    proximities: tuple[Proximity, ...] = ()
    apart: Mapping[str, Distances] = field(default_factory=dict)


class _Attempt(NamedTuple):
    """An attempt: the demands that it meets, and how it chooses walls.

    Attributes:
        near_supplies: whether furniture stands within reach of all services that it needs if it can.
        all_walls: whether the solver chooses the walls.
        aloof: which units stand farther from doors than they must.
    """

    demands: Demands
    near_supplies: bool
    all_walls: bool
    aloof: Aloof


@dataclass
class Outcome:
    """Result of placing the required furniture of a space.

    Attributes:
        room: the space with its required furniture, None if no plan was found.
        attempts: number of attempts by result: infeasible, stopped (at the effort limit), closed (a way was cut off).
        proven: whether it is proved that the furniture does not fit.
        space: id of the space without a plan.
    """

    room: Interior | None
    attempts: Counter[str] = field(default_factory=Counter)
    proven: bool = False
    space: str = ""


def furnish(
    ground: Ground,
    units: Sequence[Unit],
    standing: Sequence[tuple[Unit, OrientedBox]],
    wished: Demands,
    least: Demands,
    hood_walls: Collection[str],
    seed: int,
    generator: np.random.Generator,
    further: Sequence[Unit] = (),
    attempts: int = ATTEMPTS,
    thorough: bool = True,
) -> Outcome:
    """Place the required units of a space.

    Args:
        ground: the space.
        units: what has to be placed.
        standing: units that stand there already, with their footprints in the ground's frame.
        wished: demands that the first attempts meet. least: demands that every attempt meets.
        hood_walls: ids of the segments that may carry hoods, empty for any.
        seed: random seed of the solver.
        further: units, of which the first attempts leave those other than hoods a place within reach of the services
            that they need.
        attempts: number of choices of walls tried.
        thorough: whether the solver chooses the walls in the end.
    """
    outcome = Outcome(None)
    for number, attempt in enumerate(_attempts(wished, least, attempts, thorough)):
        demands = attempt.demands
        room = Interior(ground)
        for unit, foot in standing:
            room.add_anyway(unit, foot)
        places = all_places(room.standing, units, demands.apart, hood_walls, attempt.near_supplies, attempt.aloof)
        bound = {unit for rule in demands.proximities for unit in (rule.first, rule.second)}
        able = [] if attempt.all_walls else [unit for unit in units if unit.id not in bound]
        feet = stand_oblique(room.standing, able, places, demands.separations, generator)
        upright = [unit for unit in units if unit.id not in feet]
        if feet:
            from_feet = distances_from(feet, [unit.id for unit in upright], demands.separations)
            apart = {unit.id: [*demands.apart.get(unit.id, ()), *from_feet.get(unit.id, ())] for unit in upright}
            places = all_places(room.standing, upright, apart, hood_walls, attempt.near_supplies, attempt.aloof)
        if attempt.all_walls:
            stands = every_segment(upright, places, ground.supplies, generator)
        else:
            stands = choose_segments(
                upright, places, demands.separations, demands.nearness, demands.proximities, generator
            )
        effort = THOROUGH if attempt.all_walls else QUICK
        effort *= max(1.0, len(units) / 15.0)
        plan = plan_walls(stands, demands.separations, demands.nearness, seed + number, effort, demands.proximities)
        if plan.status != "solved":
            outcome.attempts[plan.status] += 1
            straight = all(segment.straight for segment in ground.segments)
            lifted = demands is least and attempt.aloof == "none"
            outcome.proven = attempt.all_walls and lifted and plan.status == "infeasible" and straight
            continue
        room = Interior(ground)
        for unit, foot in standing:
            room.add_anyway(unit, foot)
        by_id = {unit.id: unit for unit in units}
        added = room.add([(by_id[unit_id], foot) for unit_id, foot in {**feet, **plan.feet}.items()])
        if added and (
            not attempt.near_supplies
            or all(_has_supplied_place(room, unit) for unit in further if not unit.asset.fume_hood)
        ):
            outcome.room = room
            return outcome
        outcome.attempts["closed"] += 1
    return outcome


def _has_supplied_place(room: Interior, unit: Unit) -> bool:
    """Whether a unit has a place from which it reaches what it needs, as far as the space has it."""
    supplies = room.ground.supplies
    if not any(supplies.of_kind(kind) for kind in unit.supplies):
        return True
    return bool(supplied(options_on(room.standing, unit, ()), unit, supplies))


def _attempts(wished: Demands, least: Demands, count: int, thorough: bool) -> Iterator[_Attempt]:
    """Yield the attempts in order: `count` with walls chosen beforehand, those with the least demands last.

    Before the wishes are given up, the solver looks for walls that meet them, and in the end, if the search is
    thorough, for walls that meet the least demands. Hoods give their distance from doors up last.
    """
    for _ in range(count - FREE_ATTEMPTS):
        yield _Attempt(wished, True, False, "all")
    if wished.proximities or wished.separations != least.separations:
        yield _Attempt(wished, True, True, "hoods")
    for _ in range(min(count, FREE_ATTEMPTS)):
        yield _Attempt(least, False, False, "hoods")
    if thorough:
        yield _Attempt(least, False, True, "hoods")
        yield _Attempt(least, False, True, "none")
