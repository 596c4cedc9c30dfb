"""Chooses a wall for each unit of a brief before the floor plan is solved, which makes solving fast."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Brief, Unit, Wall
from labgym.layouts.floor import Room
from labgym.layouts.placement import Placement
from labgym.layouts.rules.zones import door_span

RANK = 0.8
"""Cost of each step down the list of preferred walls; the other costs, and noise of up to 1, are set against it."""
CROWDED = 3.0
"""Cost of a full wall; it grows with the square of the share that is used."""
HOSTILE = 0.7
"""Cost of sharing a wall with a unit that must stay at a distance."""
OVERFLOW = 100.0
"""Cost of a wall that is too short: more than all other costs together."""
SIDE_GAP = 0.02
"""Gap between neighbors, meters, as in the floor plan."""
CORNERS = {"back": 0.0, "front": 1.7, "left": 1.9, "right": 1.9}
"""Length lost to the rows on neighboring walls, meters: 0.85 m of side row twice at the front; at a side wall 0.85 m
of hood row and 1.05 m of front row with its clearance. The back row has its corners to itself."""
ROW = 0.75
"""Depth of a row of furniture, meters; a fixed object nearer to the wall takes its length."""
SHORTEST = 0.1
"""Least length of wall assumed, meters, so that the used share stays finite."""


def choose_walls(brief: Brief, room: Room, generator: np.random.Generator) -> Brief:
    """Return the brief with one wall for each wall unit.

    Greedy, longest unit first: preferred walls cost little, crowded walls and walls with a unit that must stay away
    cost much, and noise makes seeds differ.
    """
    free = {wall: _free_length(brief, room, wall) for wall in ("front", "back", "left", "right")}
    used = dict.fromkeys(free, 0.0)
    away = _away(brief)
    chosen: dict[str, Wall] = {}
    units = [unit for unit in brief.units if unit.stance == "wall" and unit.id not in brief.fixed]
    for unit in sorted(units, key=lambda unit: (len(unit.walls) > 1, -unit.width, unit.id)):
        noise = generator.uniform(0.0, 1.0, len(unit.walls))
        costs = []
        for rank, wall in enumerate(unit.walls):
            share = (used[wall] + unit.width) / max(free[wall], SHORTEST)
            hostile = sum(chosen.get(other) == wall for other in away.get(unit.id, ()))
            overflow = OVERFLOW if share > 1.0 else 0.0
            costs.append(RANK * rank + CROWDED * share**2 + HOSTILE * hostile + overflow + noise[rank])
        wall = unit.walls[int(np.argmin(costs))]
        chosen[unit.id] = wall
        used[wall] += unit.width + SIDE_GAP
    return replace(brief, units=tuple(_settled(unit, chosen) for unit in brief.units))


def _settled(unit: Unit, chosen: dict[str, Wall]) -> Unit:
    return replace(unit, walls=(chosen[unit.id],)) if unit.id in chosen else unit


def _away(brief: Brief) -> dict[str, set[str]]:
    away: dict[str, set[str]] = {}
    for rule in brief.separations:
        away.setdefault(rule.first, set()).add(rule.second)
        away.setdefault(rule.second, set()).add(rule.first)
    return away


def _free_length(brief: Brief, room: Room, wall: str) -> float:
    """Length of wall that units can use: without corners, door swings and fixed objects, meters."""
    length = room.width if wall in ("front", "back") else room.depth
    fixed = sum(_along(brief.fixed[unit.id], unit, room, wall) for unit in brief.units if unit.id in brief.fixed)
    return length - CORNERS[wall] - fixed - sum(door_span(door) for door in room.doors if door.wall == wall)


def _along(placement: Placement, unit: Unit, room: Room, wall: str) -> float:
    """Length of a wall that a fixed object takes, meters; 0 if it leaves enough depth for a unit behind it."""
    x, y, _ = placement.position
    x0, y0, x1, y1 = OrientedBox(x, y, unit.width, unit.depth, placement.yaw).bounds()
    gap = {"front": y0, "back": room.depth - y1, "left": x0, "right": room.width - x1}[wall]
    if gap > ROW:
        return 0.0
    return (x1 - x0 if wall in ("front", "back") else y1 - y0) + SIDE_GAP
