"""Holodeck's selection from the listed objects: as many as the capacity of the floor and the walls allows.

Public repository allenai/Holodeck, `object_selector.py`: capacities, the round over the kinds of object, and the second
request if less than `ENOUGH` of the floor's capacity is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.paper.rivals.chamber import Chamber
from labgym.paper.rivals.plan import DesignPlan, Hung, Large

FLOOR_SHARE = 0.4
"""Share of the floor that furniture may cover (`floor_capacity_ratio`)."""
WALL_SHARE = 0.5
"""Share of the perimeter that wall objects may take (`wall_capacity_ratio`)."""
DOOR_SHARE = 0.6
"""Share of each door area that counts as used."""
ENOUGH = 0.8
"""Used share of the capacity below which the designer is asked for more."""
LARGEST = 0.8
"""Greatest width of an object relative to the longer side of the room (`object_size_tolerance`)."""


@dataclass(frozen=True)
class Selection:
    """Objects that are to be placed, in the order of the plan."""

    large: tuple[Large, ...]
    hung: tuple[Hung, ...]


def select(plan: DesignPlan, chamber: Chamber) -> Selection:
    """Return the objects of a plan that the space has the capacity for.

    One object of each kind is taken in turn, then the next one of each, until nothing more fits. What the second
    request lists counts only if the first one uses less than `ENOUGH` of the capacity.
    """
    ground = chamber.ground
    fitting = [one for one in plan.large if _fits(one, chamber)]
    used = DOOR_SHARE * sum(door.width * door.depth for door in chamber.doors)
    used += sum(box.width * box.depth for box in chamber.fixed)
    capacity = FLOOR_SHARE * ground.area
    first = [one for one in fitting if one.wish < 2]
    taken, area = _rounds(first, used, capacity)
    if area < ENOUGH * capacity:
        taken, _ = _rounds(fitting, used, capacity)
    names = {one.name for one in taken}
    large = tuple(
        replace(one, constraints=tuple(c for c in one.constraints if not c.target or c.target in names))
        for one in plan.large
        if one.name in names
    )
    return Selection(large, _hung(plan.hung, WALL_SHARE * float(_perimeter(chamber))))


def _rounds(objects: Sequence[Large], used: float, capacity: float) -> tuple[list[Large], float]:
    """Take one object of each kind in turn; what must be there comes first. Return the objects and the area used."""
    waiting, taken = sorted(objects, key=lambda one: one.wish > 0), list[Large]()
    while True:
        kinds: set[str] = set()
        for one in list(waiting):
            area = one.asset.size.width * one.asset.size.depth
            if one.asset.name in kinds or (taken and used + area > capacity):
                continue
            kinds.add(one.asset.name)
            waiting.remove(one)
            taken.append(one)
            used += area
        if not kinds:
            return taken, used


def _fits(one: Large, chamber: Chamber) -> bool:
    size, ground = one.asset.size, chamber.ground
    return size.height <= ground.ceiling and max(size.width, size.depth) <= LARGEST * max(ground.width, ground.depth)


def _hung(hung: Sequence[Hung], capacity: float) -> tuple[Hung, ...]:
    taken: list[Hung] = []
    for one in hung:
        if not taken or sum(other.asset.size.width for other in (*taken, one)) <= capacity:
            taken.append(one)
    return tuple(taken)


def _perimeter(chamber: Chamber) -> float:
    return sum(segment.length for segment in chamber.ground.segments)
