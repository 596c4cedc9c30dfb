"""Spreads the required furniture over the spaces of a floor, and furnishes each space with its share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Demands, Separation
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.distances import dry_separations, nearness_of, neighborhoods
from labgym.layouts.interiors.distribution import distribute
from labgym.layouts.interiors.filling import Names
from labgym.layouts.interiors.furnisher import FurnishedSpace, Share, furnish
from labgym.layouts.interiors.interior import Interior, fixed_pieces
from labgym.layouts.interiors.needs import Needs
from labgym.layouts.interiors.safeguards import with_safeguards
from labgym.layouts.interiors.standing import Distances
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
    boxes = {unit.id: _to_floor(ground, foot) for ground in grounds for unit, foot in standing[ground.space]}
    rooms: dict[str, Interior] = {}
    total = FurnishedSpace(None)
    for ground in sorted(grounds, key=lambda ground: -len(shares[ground.space])):
        here = {unit.id for unit in shares[ground.space]}
        separations = *least, *needs.wished
        apart, further = (_remote(ground, here, rules, boxes) for rules in (least, separations))
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
        boxes |= {unit_id: _to_floor(ground, foot) for unit_id, foot in outcome.room.feet.items()}
    return {ground.space: rooms[ground.space] for ground in grounds}, total


def _remote(
    ground: Ground, here: set[str], separations: Sequence[Separation], boxes: Mapping[str, OrientedBox]
) -> dict[str, Distances]:
    """Return the boxes of other spaces from which units of a space keep a distance, in the frame of its ground."""
    apart: dict[str, list[tuple[OrientedBox, float]]] = {}
    for rule in separations:
        for unit, other in ((rule.first, rule.second), (rule.second, rule.first)):
            if unit in here and other in boxes:
                apart.setdefault(unit, []).append((ground.to_ground(boxes[other]), rule.distance))
    return dict(apart)


def _hood_walls(ground: Ground, style: Style) -> frozenset[str]:
    walls = {wall for space, wall in style.hood_walls if space == ground.space}
    return frozenset(segment.id for segment in ground.segments if walls.intersection(segment.walls))


def _to_floor(ground: Ground, foot: OrientedBox) -> OrientedBox:
    x, y, yaw = ground.to_floor((foot.x, foot.y, foot.yaw))
    return OrientedBox(x, y, foot.width, foot.depth, yaw)
