"""Holodeck and Holodeck+ as proposers.

Holodeck (Yang and others, CVPR 2024, arXiv 2312.09067; code: allenai/Holodeck) asks a language model for objects and
constraints, places large objects by depth-first search, hangs wall objects, and spawns small objects on receptacles at
random. LabBuilder compares with it as "Holodeck" (a description as input) and "Holodeck+" (the structured protocol).
Floor plan, doors and windows are the request's; the language model is a seeded table.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.paper.rivals.chamber import Chamber, chambers
from labgym.paper.rivals.holodeck.mounting import mount
from labgym.paper.rivals.holodeck.search import SearchLimits, grid_step, search, yaw_of
from labgym.paper.rivals.holodeck.selection import select
from labgym.paper.rivals.piece import RivalPiece, layout_of, named
from labgym.paper.rivals.plan import Designer, DesignPlan, Hung, Large, household_plan
from labgym.paper.rivals.protocol_plan import protocol_plan
from labgym.paper.rivals.randomness import generator_of, numbers_in_use
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
