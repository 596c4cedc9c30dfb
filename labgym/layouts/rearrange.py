"""Rearranges the furniture of a layout with the constraint solver, for when single moves do not help."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from labgym.layouts.interiors.rearranging import rearranged
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED
from labgym.layouts.tidying import tidied
from labgym.protocols import Protocol

EFFORTS = (0.1, 0.1, 0.2, 0.6)
"""Deterministic search time with only the wall furniture in question free, with islands in question too, with all wall
furniture, and with all furniture."""


def rearrangements(layout: Layout, protocol: Protocol | None, involved: Collection[str]) -> Iterator[Layout]:
    """Yield layouts with one-sided furniture at walls and islands free, close to where they are.

    First only the involved furniture moves, wall furniture before islands, then all furniture that stands against
    walls, then all; each space in its frame (`rearranged`). Stools, bins and boards make way.
    """
    furniture = [
        placement.id
        for placement in layout.placements
        if placement.support == FLOOR
        and layout.asset(placement.id).subtype not in MOVABLE
        and may_move(layout, placement.id)
    ]
    at_walls = [item for item in furniture if layout.asset(item).size.depth < ONE_SIDED or item in involved]
    in_question = [item for item in furniture if item in involved]
    if not in_question:
        return
    walled = [item for item in in_question if layout.asset(item).size.depth < ONE_SIDED]
    last: set[str] = set()
    for movers, effort in zip((walled, in_question, at_walls, furniture), EFFORTS, strict=True):
        if set(movers) != last:
            last = set(movers)
            candidate = rearranged(layout, movers, effort)
            if candidate is not None:
                yield tidied(candidate, protocol)
