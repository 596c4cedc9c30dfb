"""Spreads the required furniture over the spaces of a floor, and furnishes each space with its share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labgym.layouts.brief import Demands
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.distances import dry_separations, nearness_of, neighborhoods
from labgym.layouts.interiors.distribution import distribute
from labgym.layouts.interiors.filling import Names
from labgym.layouts.interiors.furnisher import FurnishedSpace, Share, furnish
from labgym.layouts.interiors.interior import Interior, fixed_pieces
from labgym.layouts.interiors.needs import Needs
from labgym.layouts.interiors.safeguards import with_safeguards
from labgym.layouts.interiors.siting import distances_from
from labgym.layouts.request import Request
from labgym.layouts.style import Style


def furnish_spaces(
    request: Request, needs: Needs, grounds: Sequence[Ground], last: bool, generator: np.random.Generator
) -> tuple[dict[str, Interior] | None, FurnishedSpace]:
    """Return the spaces with the required furniture; None and the outcome of the first that cannot hold its share."""
    fixed = {placement.id: placement for placement in request.fixed}
    free = [unit for unit in needs.required if unit.id not in fixed]
    shares = distribute(free, grounds, request.habits, generator, neighborhoods(needs.proximities))
    nearness = tuple(nearness_of(needs.required, request.habits))
    standing = fixed_pieces(request, needs.required, grounds)
    names = Names({unit.id for unit in (*needs.required, *needs.further)})
    shares = with_safeguards(request, grounds, shares, standing, names)
    units = [unit for share in shares.values() for unit in share]
    dry = [rule for rule in dry_separations(units) if rule not in needs.separations] if needs.separations else []
    least = (*needs.separations, *dry)
    boxes = {unit.id: ground.box_on_floor(foot) for ground in grounds for unit, foot in standing[ground.space]}
    rooms: dict[str, Interior] = {}
    total = FurnishedSpace(None)
    for ground in sorted(grounds, key=lambda ground: -len(shares[ground.space])):
        here = {unit.id for unit in shares[ground.space]}
        separations = *least, *needs.wished
        elsewhere = {name: ground.to_ground(box) for name, box in boxes.items()}
        apart, further = (distances_from(elsewhere, here, rules) for rules in (least, separations))
        share = Share(
            ground,
            units=shares[ground.space],
            standing=standing[ground.space],
            wished=Demands(separations, nearness, needs.proximities, further),
            least=Demands(least, nearness, (), apart),
            hood_walls=_hood_walls(ground, request.style),
            further=needs.further,
        )
        outcome = furnish(share, request.seed, generator, thorough=last or len(grounds) == 1)
        total.attempts += outcome.attempts
        if outcome.room is None:
            total.proven = outcome.proven and len(grounds) == 1
            total.space = ground.space
            return None, total
        rooms[ground.space] = outcome.room
        boxes |= {unit_id: ground.box_on_floor(foot) for unit_id, foot in outcome.room.feet.items()}
    return {ground.space: rooms[ground.space] for ground in grounds}, total


def _hood_walls(ground: Ground, style: Style) -> frozenset[str]:
    walls = {wall for space, wall in style.hood_walls if space == ground.space}
    return frozenset(segment.id for segment in ground.segments if walls.intersection(segment.walls))
