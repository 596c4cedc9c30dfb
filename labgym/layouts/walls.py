"""Chooses a wall for each unit of a brief before the floor plan is solved, so that the solving is quick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labgym.layouts.brief import Brief, Unit, Wall
from labgym.layouts.model import Room

CROWDED = 3.0
"""Cost of filling a wall wholly, in ranks of liking."""
HOSTILE = 0.7
"""Cost of sharing a wall with a unit to be kept away from, in ranks of liking."""


def choose_walls(brief: Brief, room: Room, generator: np.random.Generator) -> Brief:
    """Return the brief with one wall for each wall unit.

    Greedy, longest unit first: the liked walls are cheap, crowded walls and walls with a unit that must stay away
    are dear, and a little noise makes seeds differ.
    """
    free = {wall: _free_length(room, wall) for wall in ("front", "back", "left", "right")}
    used = dict.fromkeys(free, 0.0)
    away = _away(brief)
    chosen: dict[str, Wall] = {}
    units = [unit for unit in brief.units if unit.stance == "wall"]
    for unit in sorted(units, key=lambda unit: (len(unit.walls) > 1, -unit.width, unit.id)):
        noise = generator.uniform(0.0, 1.0, len(unit.walls))
        costs = []
        for rank, wall in enumerate(unit.walls):
            filled = (used[wall] + unit.width) / max(free[wall], 0.1)
            hostile = sum(chosen.get(other) == wall for other in away.get(unit.id, ()))
            overflow = 100.0 if filled > 1.0 else 0.0
            costs.append(0.8 * rank + CROWDED * filled**2 + HOSTILE * hostile + overflow + noise[rank])
        wall = unit.walls[int(np.argmin(costs))]
        chosen[unit.id] = wall
        used[wall] += unit.width + 0.02
    return replace(brief, units=tuple(_settled(unit, chosen) for unit in brief.units))


def _settled(unit: Unit, chosen: dict[str, Wall]) -> Unit:
    return replace(unit, walls=(chosen[unit.id],)) if unit.id in chosen else unit


def _away(brief: Brief) -> dict[str, set[str]]:
    away: dict[str, set[str]] = {}
    for rule in brief.separations:
        away.setdefault(rule.first, set()).add(rule.second)
        away.setdefault(rule.second, set()).add(rule.first)
    return away


def _free_length(room: Room, wall: str) -> float:
    """Length of wall that units can use: corners are shared, doors keep their swing."""
    length = room.width if wall in ("front", "back") else room.depth
    corners = 0.0 if wall == "back" else 1.7 if wall == "front" else 1.9
    return length - corners - sum(max(door.width, 1.2) for door in room.doors if door.wall == wall)
