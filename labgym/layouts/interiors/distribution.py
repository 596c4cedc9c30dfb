"""Which piece of furniture stands in which space of a floor: by the use of the space, and by the wall it has left."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from labgym.layouts.brief import Unit
from labgym.layouts.ground import Ground
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.supply import lacking

CORNER = 0.9
"""Length that a row on the next wall takes at one end of a segment, meters."""
RANK, CROWDED = 1.5, 4.0
"""Cost of each step down the list of uses, and of a space whose walls are full; noise of up to 1 comes on top."""
REMOTE = 12.0
"""Cost of a space other than that of the units that must be near."""
DRY = 5.0
"""Cost of a space without a service that a piece needs and another space may have."""
UNWASHED = 50.0
"""Cost of a space for hazardous work in which no shower may stand."""
OVERFLOW = 100.0
"""Cost of a space without enough wall: more than all other costs together."""


def distribute(
    units: Sequence[Unit],
    grounds: Sequence[Ground],
    habits: Habits,
    generator: np.random.Generator,
    neighborhoods: Sequence[frozenset[str]] = (),
) -> dict[str, list[Unit]]:
    """Return the units of each space, by its id.

    Greedy, hoods first, then what must be near others, then what stands with the first hood, then the longest unit.
    Corridors stay clear.

    Args:
        neighborhoods: sets of units that must be near each other, by id.
    """
    usable = [ground for ground in grounds if ground.use != "corridor" and ground.segments] or list(grounds)
    shares: dict[str, list[Unit]] = {ground.space: [] for ground in grounds}
    lengths = {ground.space: wall_length(ground) for ground in usable}
    used = dict.fromkeys(lengths, 0.0)
    first_hood: Ground | None = None
    spaces: dict[frozenset[str], Ground] = {}
    near = {unit: group for group in neighborhoods for unit in group}
    for unit in sorted(units, key=lambda unit: _order(unit, habits, near)):
        longest = {g.space: max((s.length for s in g.segments), default=0.0) for g in usable}
        uses = habits.uses_of(unit.asset.role)
        noise = generator.uniform(0.0, 1.0, len(usable))
        costs = []
        for index, ground in enumerate(usable):
            share = (used[ground.space] + unit.width) / max(lengths[ground.space], 0.1)
            rank = uses.index(ground.use) if ground.use in uses else len(uses) + (ground.use != "laboratory")
            lacks, required = lacking(unit, ground)
            overflow = OVERFLOW if share > 1.0 or longest[ground.space] < unit.width or required else 0.0
            group = spaces.get(near[unit.id]) if unit.id in near else None
            remote = REMOTE if group is not None and group is not ground else 0.0
            dry = "water" in ground.supplies.required and not ground.supplies.of_kind("water")
            overflow += UNWASHED if dry and "work" in unit.hazards else 0.0
            costs.append(RANK * rank + CROWDED * share**2 + DRY * lacks + overflow + remote + noise[index])
        chosen = usable[int(np.argmin(costs))]
        if unit.asset.role in habits.together and first_hood is not None and not lacking(unit, first_hood)[1]:
            chosen = first_hood
        if unit.asset.fume_hood and first_hood is None:
            first_hood = chosen
        if unit.id in near:
            spaces.setdefault(near[unit.id], chosen)
        shares[chosen.space].append(unit)
        used[chosen.space] += unit.width
    return shares


def wall_length(ground: Ground) -> float:
    """Return the length of wall that furniture can use, meters; corners are counted once."""
    return sum(max(sum(b - a for a, b in segment.free(2.0)) - CORNER, 0.0) for segment in ground.segments)


def _order(unit: Unit, habits: Habits, near: Container[str]) -> tuple[bool, bool, bool, float, str]:
    together = unit.asset.role not in habits.together
    return not unit.asset.fume_hood, unit.id not in near, together, -unit.width, unit.id
