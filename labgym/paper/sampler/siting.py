"""Places furniture as the sampler does: one piece after the other, by habit and relation, with its errors.

Without errors a piece stands at the free place along a wall that suits it best: its habitual wall, near the pieces it
belongs to, next to the previous place of the workflow, with its front free and its distance from hazards. Nothing is
planned ahead, and nothing moves afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.brief import Nearness, Separation, Unit
from labgym.layouts.ground import Ground, Segment
from labgym.layouts.ground import grounds as grounds_of
from labgym.layouts.interiors.distances import nearness_of
from labgym.layouts.interiors.distribution import distribute
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.zones import INTRUSION
from labgym.paper.sampler.beliefs import Attention, Belief, Foot, Roles, wall_gap
from labgym.paper.sampler.rates import Slips

RANK, NEAR, WORKFLOW = 2.0, 0.5, 0.25
"""Cost of each step down the list of preferred walls, of a meter from each piece that belongs near, and of a meter from
the previous place of the workflow; a meter from the habitual place along a wall costs 1."""
STORAGE = 4
"""Weight of the nearness of cabinets: together they are the zone for storage."""
ROUND = 0.25
"""Multiple to which positions are rounded, meters."""
MISJUDGED = (0.15, 0.45)
"""Least and greatest share by which the size of furniture is underestimated."""
OPPOSITE = (0.15, 0.5)
"""Least and greatest width between a piece and the one that it faces, meters: less than the robot needs."""
ABOUT_FACE = 0.7
"""Share of turned pieces that face their wall; the others face along it."""

Pose = tuple[float, float, float]


@dataclass
class Sites:
    """Where the furniture of a proposal stands.

    Attributes:
        beliefs: what is believed to stand in each space, by its id.
        poses: where pieces really stand, (x, y, yaw) in the floor's frame, by id.
        spaces: the space in which each piece stands.
    """

    beliefs: dict[str, Belief]
    roles: dict[str, Roles]
    poses: dict[str, Pose] = field(default_factory=dict)
    spaces: dict[str, str] = field(default_factory=dict)

    def believed(self, piece: str) -> OrientedBox:
        """Return where a piece is believed to stand, in the floor's frame."""
        belief = self.beliefs[self.spaces[piece]]
        box = belief.feet[piece].box
        x, y, yaw = belief.ground.to_floor((box.x, box.y, box.yaw))
        return replace(box, x=x, y=y, yaw=yaw)


@dataclass(frozen=True)
class Relations:
    """Pieces that belong together: those that stand near each other, and those that keep a distance.

    Attributes:
        near: ids and weights by id.
        before: the previous place of the workflow by id.
        apart: ids and distances in meters by id.
    """

    near: Mapping[str, Sequence[tuple[str, float]]]
    before: Mapping[str, str]
    apart: Mapping[str, Sequence[tuple[str, float]]]

    @classmethod
    def of(cls, request: Request, units: Sequence[Unit], separations: Sequence[Separation]) -> Relations:
        """Collect the relations between units: habits, cabinets as one zone, and the workflow."""
        near: dict[str, list[tuple[str, float]]] = {}
        cabinets = [unit.id for unit in units if unit.asset.storage_class is not None]
        pairs = [*nearness_of(units, request.habits), *(Nearness(*each, STORAGE) for each in pairwise(cabinets))]
        for pair in pairs:
            near.setdefault(pair.first, []).append((pair.second, float(pair.weight)))
            near.setdefault(pair.second, []).append((pair.first, float(pair.weight)))
        apart: dict[str, list[tuple[str, float]]] = {}
        for rule in separations:
            apart.setdefault(rule.first, []).append((rule.second, rule.distance))
            apart.setdefault(rule.second, []).append((rule.first, rule.distance))
        first: dict[str, str] = {}
        for unit in units:
            first.setdefault(unit.asset.role, unit.id)
        stops = [first[name] for name in request.protocol.locations if name in first]
        return cls(near, {later: earlier for earlier, later in pairwise(stops)}, apart)


def site_furniture(
    request: Request, units: Sequence[Unit], separations: Sequence[Separation], slips: Slips
) -> dict[str, Pose]:
    """Return the pose (x, y, yaw) of each unit that is not fixed, in the floor's frame, by id."""
    grounds = grounds_of(request.floor)
    generator = slips.generator("habits", "furniture")
    storage_left = bool(generator.random() < 0.5)
    sites = Sites(
        {ground.space: Belief(ground) for ground in grounds},
        {ground.space: Roles.of(ground, storage_left) for ground in grounds},
    )
    free = _add_fixed(request, units, sites)
    shares = distribute(free, grounds, request.habits, generator)
    spaces = {unit.id: space for space, share in shares.items() for unit in share}
    relations = Relations.of(request, units, separations)
    for unit in sorted(free, key=lambda unit: _order(request, unit)):
        space = spaces[unit.id]
        use = sites.beliefs[space].ground.use
        able = [ground.space for ground in grounds if ground.use not in ("corridor", use)]
        if able and slips.happens("space_confused", unit.id):
            space = able[slips.choice("space_confused", unit.id, len(able))]
        sites.spaces[unit.id] = space
        _place(request, unit, sites, relations, slips)
    return {unit.id: sites.poses[unit.id] for unit in free}


def _order(request: Request, unit: Unit) -> tuple[bool, int, str]:
    """Hoods first, then the places of work in the order in which they are visited, then the rest."""
    locations = request.protocol.locations
    place = locations.index(unit.asset.role) if unit.asset.role in locations else len(locations)
    return not unit.asset.fume_hood, place, unit.id


def _add_fixed(request: Request, units: Sequence[Unit], sites: Sites) -> list[Unit]:
    """Note the fixed objects; return the units that remain to be placed."""
    by_id = {unit.id: unit for unit in units}
    fixed = {placement.id: placement for placement in request.fixed}
    for placement in request.fixed:
        asset = request.fixed_asset(placement)
        x, y, _ = placement.position
        space = request.floor.space_at(x, y)
        if space is None or (placement.support == WALL and asset.size.depth <= INTRUSION):
            continue
        belief = sites.beliefs[space.id]
        box = belief.ground.to_ground(OrientedBox(x, y, asset.size.width, asset.size.depth, placement.yaw))
        belief.fixed[placement.id] = box
        if placement.id in by_id:
            unit = by_id[placement.id]
            belief.feet[unit.id] = Foot(box, unit.front, unit.clear)
            sites.spaces[unit.id] = space.id
            sites.poses[unit.id] = (x, y, placement.yaw)
    return [unit for unit in units if unit.id not in fixed]


def _place(request: Request, unit: Unit, sites: Sites, relations: Relations, slips: Slips) -> None:
    """Choose where a piece stands, and note where it is believed to stand and where it does."""
    belief = sites.beliefs[sites.spaces[unit.id]]
    target = _facing(unit, belief, relations, slips)
    if target is not None:
        gap = slips.between("opposite", unit.id, OPPOSITE)
        box, front = _opposite(target, unit, gap), 0.0
    else:
        imagined = _imagined(unit, slips)
        attention = Attention(
            neighbors=not slips.happens("neighbors_overlooked", unit.id),
            fixed=not slips.happens("fixed_overlooked", unit.id),
            doors=not slips.happens("door_overlooked", unit.id),
            fronts=not slips.happens("clearance_forgotten", unit.id),
        )
        careless = slips.happens("distance_forgotten", unit.id)
        apart = () if careless else _apart(unit, sites, belief.ground, relations)
        segment, along = _chosen(request, imagined, sites, relations, attention, apart, slips)
        if slips.happens("position_rounded", unit.id):
            middle = round((along + imagined.width / 2.0) / ROUND) * ROUND
            along = middle - imagined.width / 2.0
        box = segment.box(along, wall_gap(segment), imagined.width, imagined.depth)
        front = unit.front if attention.fronts else 0.0
    belief.feet[unit.id] = Foot(box, front, unit.clear)
    yaw = wrap_angle(box.yaw + _turn(unit, slips))
    sites.poses[unit.id] = belief.ground.to_floor((box.x, box.y, yaw))


def _imagined(unit: Unit, slips: Slips) -> Unit:
    """The unit with the size that it is believed to have."""
    width, depth = unit.width, unit.depth
    if slips.happens("width_misjudged", unit.id):
        width *= 1.0 - slips.between("width_misjudged", unit.id, MISJUDGED)
    if slips.happens("depth_misjudged", unit.id):
        depth *= 1.0 - slips.between("depth_misjudged", unit.id, MISJUDGED)
    return replace(unit, width=width, depth=depth)


def _facing(unit: Unit, belief: Belief, relations: Relations, slips: Slips) -> OrientedBox | None:
    """The piece opposite which a unit stands in the open: one to which it is related, or any."""
    if not belief.feet or not slips.happens("opposite", unit.id):
        return None
    related = [other for other, _ in relations.near.get(unit.id, ()) if other in belief.feet]
    able = related or list(belief.feet)
    return belief.feet[able[slips.choice("opposite", unit.id, len(able))]].box


def _opposite(target: OrientedBox, unit: Unit, gap: float) -> OrientedBox:
    """A footprint that faces another one across a gap in meters."""
    reach = (target.depth + unit.depth) / 2.0 + gap
    fx, fy = target.front
    yaw = wrap_angle(target.yaw + math.pi)
    return OrientedBox(target.x + reach * fx, target.y + reach * fy, unit.width, unit.depth, yaw)


def _turn(unit: Unit, slips: Slips) -> float:
    """The angle by which a piece is turned from where it should face, radians."""
    if not slips.happens("turned", unit.id):
        return 0.0
    about = slips.between("turned", unit.id, (0.0, 1.0)) < ABOUT_FACE
    return math.pi if about else (math.pi / 2.0 if slips.choice("turned", unit.id, 2) else -math.pi / 2.0)


def _apart(unit: Unit, sites: Sites, ground: Ground, relations: Relations) -> tuple[tuple[OrientedBox, float], ...]:
    """Boxes from which a unit keeps a distance, in the frame of its ground, with the distances in meters."""
    return tuple(
        (ground.to_ground(sites.believed(other)), distance)
        for other, distance in relations.apart.get(unit.id, ())
        if other in sites.poses
    )


def _chosen(
    request: Request,
    unit: Unit,
    sites: Sites,
    relations: Relations,
    attention: Attention,
    apart: tuple[tuple[OrientedBox, float], ...],
    slips: Slips,
) -> tuple[Segment, float]:
    """The segment on which a unit stands, and the place of its left end along it, meters.

    If nothing is free, demands are dropped one after the other: distances, fronts, door areas, and at last the room
    that others take.
    """
    space = sites.spaces[unit.id]
    belief = sites.beliefs[space]
    tries = (
        (attention, apart),
        (attention, ()),
        (replace(attention, fronts=False), ()),
        (replace(attention, fronts=False, doors=False), ()),
        (Attention(neighbors=False, fixed=False, doors=False, fronts=False), ()),
    )
    place = float(slips.generator("habits", unit.id).random())
    for level, distances in tries:
        options = belief.places(unit, level, distances)
        if options:
            return min(
                (
                    (_cost(request, unit, segment, along, sites, relations, place), segment, along)
                    for segment, intervals in options
                    for along in _candidates(intervals, _anchor(request, unit, segment, sites, place))
                ),
                key=lambda option: (option[0], option[1].id, option[2]),
            )[1:]
    longest = max(belief.ground.segments, key=lambda segment: (segment.length, segment.id), default=None)
    if longest is None:
        longest = Segment("none", 0.0, 0.0, 0.0, belief.ground.width)
    return longest, max(0.0, (longest.length - unit.width) / 2.0)


def _anchor(request: Request, unit: Unit, segment: Segment, sites: Sites, place: float) -> float:
    """Where the habit of a unit puts its left end along a segment, meters."""
    roles = sites.roles[sites.spaces[unit.id]]
    return roles.anchor(segment, request.habits.of(unit.asset.role), place) - unit.width / 2.0


def _candidates(intervals: Sequence[tuple[float, float]], anchor: float) -> list[float]:
    """The places that are compared: the ends of the free intervals and the habitual place, or what is nearest to it."""
    places = [end for interval in intervals for end in interval]
    return [*places, *(min(max(anchor, low), high) for low, high in intervals)]


def _cost(
    request: Request, unit: Unit, segment: Segment, along: float, sites: Sites, relations: Relations, place: float
) -> float:
    """How little a place suits a unit, in meters."""
    space = sites.spaces[unit.id]
    habit = request.habits.of(unit.asset.role)
    side = sites.roles[space].side(segment)
    rank = habit.walls.index(side) if side in habit.walls else len(habit.walls) + 1
    cost = RANK * rank + abs(along - _anchor(request, unit, segment, sites, place))
    x, y = segment.point(along + unit.width / 2.0, unit.depth / 2.0)
    feet = sites.beliefs[space].feet
    partners = [(other, NEAR * weight) for other, weight in relations.near.get(unit.id, ())]
    partners += [(relations.before[unit.id], WORKFLOW)] if unit.id in relations.before else []
    return cost + sum(
        weight * math.hypot(feet[other].box.x - x, feet[other].box.y - y) for other, weight in partners if other in feet
    )
