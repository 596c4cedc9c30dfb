"""Furnishes one space: what is required along the walls by the solver, then further pieces and benches in the open."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Nearness, Separation, Unit
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.program import plan_walls
from labgym.layouts.interiors.siting import all_places, choose_segments, every_segment, stand_oblique
from labgym.layouts.interiors.standing import Distances

ATTEMPTS = 6
"""Number of choices of walls that are tried before the solver chooses them."""
FREE_ATTEMPTS = 2
"""Number of them, the last ones, in which furniture may stand beyond the reach of services that are not required."""
QUICK, THOROUGH = 0.05, 1.0
"""Deterministic search time with walls chosen beforehand, and with walls left to the solver."""


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
    apart: Mapping[str, Distances],
    separations: Sequence[Separation],
    nearness: Sequence[Nearness],
    hood_walls: Collection[str],
    seed: int,
    generator: np.random.Generator,
    attempts: int = ATTEMPTS,
    thorough: bool = True,
) -> Outcome:
    """Place the required units of a space.

    Args:
        ground: the space.
        units: what has to be placed.
        standing: units that stand there already, with their footprints in the ground's frame.
        apart: boxes of other spaces and the distance to keep from each, by unit id.
        separations, nearness: between units of the space.
        hood_walls: ids of the segments that may carry hoods, empty for any.
        seed: random seed of the solver.
        attempts: number of choices of walls tried.
        thorough: whether the solver chooses the walls in the end.
    """
    outcome = Outcome(None)
    for attempt in range(attempts + thorough):
        last = attempt == attempts
        room = Interior(ground)
        for unit, foot in standing:
            room.add_anyway(unit, foot)
        near = attempt < attempts - FREE_ATTEMPTS
        places = all_places(room.standing, units, apart, hood_walls, near)
        feet = {} if last else stand_oblique(room.standing, units, places, generator)
        upright = [unit for unit in units if unit.id not in feet]
        if feet:
            places = all_places(room.standing, upright, apart, hood_walls, near)
        if last:
            stands = every_segment(upright, places, ground.supplies, generator)
        else:
            stands = choose_segments(upright, places, separations, nearness, generator)
        effort = THOROUGH if last else QUICK
        plan = plan_walls(stands, separations, nearness, seed + attempt, effort * max(1.0, len(units) / 15.0))
        if plan.status != "solved":
            outcome.attempts[plan.status] += 1
            outcome.proven = (
                last and plan.status == "infeasible" and not any(not segment.straight for segment in ground.segments)
            )
            continue
        room = Interior(ground)
        for unit, foot in standing:
            room.add_anyway(unit, foot)
        by_id = {unit.id: unit for unit in units}
        if room.add([(by_id[unit_id], foot) for unit_id, foot in {**feet, **plan.feet}.items()]):
            outcome.room = room
            return outcome
        outcome.attempts["closed"] += 1
    return outcome
