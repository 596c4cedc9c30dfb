"""Holodeck and Holodeck+ as proposers.

Holodeck (Yang and others, CVPR 2024, arXiv 2312.09067; code: allenai/Holodeck) asks a language model for objects and
constraints, places large objects by depth-first search, hangs wall objects, and spawns small objects on receptacles at
random. LabBuilder compares with it as "Holodeck" (a description as input) and "Holodeck+" (the structured protocol).
Floor plan, doors and windows are the request's; the language model is a seeded table.

From the public repository come, in `object_selector.py`, the selection from the listed objects: capacities, the round
over the kinds of object, and the second request if less than `ENOUGH` of the floor's capacity is used; and in
`wall_objects.py` wall objects on grid points along the walls: the first branch of its depth-first search, which takes
the spot nearest to the target, or a random one; heights come from the plan and stay 0.20 m below the ceiling.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.model import Layout
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.paper.rivals.chamber import SLACK, Chamber, chambers
from labgym.paper.rivals.holodeck.search import SearchLimits, grid_step, search, yaw_of
from labgym.paper.rivals.piece import RivalPiece, generator_of, layout_of, named, numbers_in_use
from labgym.paper.rivals.plan import Designer, DesignPlan, Hung, Large, household_plan
from labgym.paper.rivals.protocol_plan import protocol_plan
from labgym.paper.rivals.spawning import spawn

STREAM = 0x401
"""Sub-stream of the seed."""


@dataclass(frozen=True)
class HolodeckProposer:
    """Holodeck with a description of the experiment; deterministic.

    Attributes:
        designer: lists objects and constraints. source: who the designer is, for the layout's provenance.
        limits: size of the search.
    """

    designer: Designer = household_plan
    limits: SearchLimits = field(default_factory=SearchLimits)
    name: str = "holodeck"
    source: str = "table"

    def propose(self, request: Request) -> Layout:
        """Return Holodeck's scene: the largest laboratory space first, what has no place there in the next ones."""
        generator = generator_of(request, STREAM)
        plan = self.designer(request, generator)
        counts = numbers_in_use(request)
        rooms: list[tuple[Chamber, list[RivalPiece]]] = []
        expansions, spaces = 0, chambers(request)
        for chamber in spaces:
            pieces, plan, nodes = self._furnish(chamber, plan, generator, counts)
            rooms.append((chamber, pieces))
            expansions += nodes
            if not plan.large:
                break
        options = {
            "designer": self.source,
            "expansions": expansions,
            "left_out": [one.name for one in plan.large if one.wish < 2],
        }
        return layout_of(request, rooms, self.name, options)

    def _furnish(
        self, chamber: Chamber, plan: DesignPlan, generator: np.random.Generator, counts: Counter[str]
    ) -> tuple[list[RivalPiece], DesignPlan, int]:
        """Furnish a space. Return its pieces, the plan that remains, and the number of expanded nodes."""
        selection = select(plan, chamber)
        solution = search(selection.large, chamber, generator, self.limits)
        placed = [one for one in selection.large if one.name in solution.spots]
        homes: dict[str, RivalPiece] = {}
        for one in placed:
            spot = solution.spots[one.name]
            x, y = spot.center[0].tolist()
            homes[one.name] = RivalPiece(named(counts, one.asset), one.asset, x, y, yaw_of(spot))
        small = [piece for one in placed for piece in spawn(homes[one.name], one.tops, generator, counts)]
        standing = [*homes.values(), *small]
        mounted = mount(
            chamber, selection.hung, standing, homes, grid_step(chamber, self.limits.density), generator, counts
        )
        return [*standing, *mounted], _remaining(plan, homes, selection.hung), solution.expansions


@dataclass(frozen=True)
class HolodeckPlusProposer(HolodeckProposer):
    """Holodeck with the structured protocol: required assets and chemical constraints."""

    designer: Designer = protocol_plan
    name: str = "holodeck+"


def _remaining(plan: DesignPlan, homes: dict[str, RivalPiece], hung: Sequence[Hung]) -> DesignPlan:
    """The objects of the first request that have no place yet."""
    large: tuple[Large, ...] = tuple(one for one in plan.large if one.name not in homes and one.wish < 2)
    return DesignPlan(large, tuple(one for one in plan.hung if one not in hung))


BELOW_CEILING = 0.20
"""Least distance of a wall object's top from the ceiling, meters."""
OFF_WALL = 0.01
"""Gap to the wall, meters."""


def mount(
    chamber: Chamber,
    hung: Sequence[Hung],
    standing: Sequence[RivalPiece],
    homes: dict[str, RivalPiece],
    step: float,
    generator: np.random.Generator,
    counts: Counter[str],
) -> list[RivalPiece]:
    """Return the wall objects that find a place.

    Args:
        hung: objects to hang. standing: pieces that they must not overlap. homes: large pieces by name in the plan.
        step: spacing of the points along the walls, meters.
        counts: numbers of ids that are in use, by asset; updated.
    """
    mounted: list[RivalPiece] = []
    for one in hung:
        spots = _spots(chamber, one, step)
        if not spots:
            continue
        blocked = [piece.box for piece in (*standing, *mounted)]
        blocked += [replace(box, z0=0.0, z1=chamber.ground.ceiling) for box in chamber.ground.solid]
        free = np.ones(len(spots), dtype=np.bool_)
        if blocked:
            free = np.all(pairwise_penetration(BoxArray.of(spots), BoxArray.of(blocked)) <= SLACK, axis=1)
        rows = np.flatnonzero(free)
        if not len(rows):
            continue
        row = int(generator.choice(rows))
        if one.above in homes:
            x, y = homes[one.above].x, homes[one.above].y
            row = int(min(rows, key=lambda k: ((spots[k].x - x) ** 2 + (spots[k].y - y) ** 2, k)))
        box = spots[row]
        mounted.append(RivalPiece(named(counts, one.asset), one.asset, box.x, box.y, box.yaw, box.z0, WALL))
    return mounted


def _spots(chamber: Chamber, one: Hung, step: float) -> list[OrientedBox]:
    """Boxes with their back at a wall, one grid step apart, clear of doors, windows and the wall's ends."""
    size = one.asset.size
    height = max(min(one.height, chamber.ground.ceiling - BELOW_CEILING - size.height), 0.0)
    spots = []
    for segment in chamber.ground.segments:
        for low, high in segment.free(height + size.height):
            for along in np.arange(low, high - size.width + 1e-9, step).tolist():
                x, y = segment.point(along + size.width / 2.0, OFF_WALL + size.depth / 2.0)
                spots.append(OrientedBox(x, y, size.width, size.depth, segment.yaw, height, height + size.height))
    return spots


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
