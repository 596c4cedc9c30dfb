"""Furnishes one space: what is required along the walls by the solver, then further pieces and benches in the open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Demands, Unit
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.program import plan_walls
from labgym.layouts.interiors.siting import (
    Aloof,
    Places,
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
class Share:
    """The furniture of a space.

    Attributes:
        units: what has to be placed.
        standing: units that stand there already, with their footprints in the ground's frame.
        wished: demands that the first attempts meet. least: demands that every attempt meets.
        hood_walls: ids of the segments that may carry hoods, empty for any.
        further: units, of which the first attempts leave those other than hoods a place within reach of the services
            that they need.
    """

    ground: Ground
    units: Sequence[Unit]
    standing: Sequence[tuple[Unit, OrientedBox]]
    wished: Demands
    least: Demands
    hood_walls: Collection[str]
    further: Sequence[Unit] = ()

    def occupied(self) -> Interior:
        """Return the space with what stands there already."""
        room = Interior(self.ground)
        for unit, foot in self.standing:
            room.add_anyway(unit, foot)
        return room


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
class FurnishedSpace:
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


def furnish(share: Share, seed: int, generator: np.random.Generator, thorough: bool = True) -> FurnishedSpace:
    """Place the required units of a space.

    Args:
        share: the space and its furniture.
        seed: random seed of the solver.
        thorough: whether the solver chooses the walls in the end.
    """
    result, ground, units = FurnishedSpace(None), share.ground, share.units
    occupied = share.occupied().standing
    known: dict[tuple[bool, bool, Aloof], Places] = {}
    for number, attempt in enumerate(_attempts(share.wished, share.least, thorough)):
        demands = attempt.demands
        standing = occupied.copy()

        def places_of(able: Sequence[Unit], apart: Mapping[str, Distances]) -> Places:
            return all_places(standing, able, apart, share.hood_walls, attempt.near_supplies, attempt.aloof)  # noqa: B023

        kind = demands is share.least, attempt.near_supplies, attempt.aloof
        if kind not in known:
            known[kind] = places_of(units, demands.apart)
        places = known[kind]
        bound = {unit for rule in demands.proximities for unit in (rule.first, rule.second)}
        able = [] if attempt.all_walls else [unit for unit in units if unit.id not in bound]
        feet = stand_oblique(standing, able, places, demands.separations, generator)
        upright = [unit for unit in units if unit.id not in feet]
        if feet:
            from_feet = distances_from(feet, [unit.id for unit in upright], demands.separations)
            apart = {unit.id: [*demands.apart.get(unit.id, ()), *from_feet.get(unit.id, ())] for unit in upright}
            places = places_of(upright, apart)
        if attempt.all_walls:
            stands = every_segment(upright, places, ground.supplies, generator)
        else:
            stands = choose_segments(upright, places, demands, generator)
        effort = (THOROUGH if attempt.all_walls else QUICK) * max(1.0, len(units) / 15.0)
        plan = plan_walls(stands, demands, seed + number, effort)
        if plan.status != "solved":
            result.attempts[plan.status] += 1
            straight = all(segment.straight for segment in ground.segments)
            lifted = demands is share.least and attempt.aloof == "none"
            result.proven = attempt.all_walls and lifted and plan.status == "infeasible" and straight
            continue
        room = share.occupied()
        by_id = {unit.id: unit for unit in units}
        added = room.add([(by_id[unit_id], foot) for unit_id, foot in {**feet, **plan.feet}.items()])
        served = (_has_supplied_place(room, unit) for unit in share.further if not unit.asset.fume_hood)
        if added and (not attempt.near_supplies or all(served)):
            result.room = room
            return result
        result.attempts["closed"] += 1
    return result


def _has_supplied_place(room: Interior, unit: Unit) -> bool:
    """Whether a unit has a place from which it reaches what it needs, as far as the space has it."""
    supplies = room.ground.supplies
    if not any(supplies.of_kind(kind) for kind in unit.supplies):
        return True
    return bool(supplied(options_on(room.standing, unit, ()), unit, supplies))


def _attempts(wished: Demands, least: Demands, thorough: bool) -> Iterator[_Attempt]:
    """Yield the attempts in order: `ATTEMPTS` with walls chosen beforehand, those with the least demands last.

    Before the wishes are given up, the solver looks for walls that meet them, and in the end, if the search is
    thorough, for walls that meet the least demands. Hoods give their distance from doors up last.
    """
    for _ in range(ATTEMPTS - FREE_ATTEMPTS):
        yield _Attempt(wished, True, False, "all")
    if wished.proximities or wished.separations != least.separations:
        yield _Attempt(wished, True, True, "hoods")
    for _ in range(FREE_ATTEMPTS):
        yield _Attempt(least, False, False, "hoods")
    if thorough:
        yield _Attempt(least, False, True, "hoods")
        yield _Attempt(least, False, True, "none")
