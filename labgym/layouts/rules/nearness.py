"""Near: what a protocol requires close together, the pieces of one apparatus and places with many trips."""

from __future__ import annotations

import math
from collections.abc import Mapping

from labgym.geometry import pairwise_distance
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import Term
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.navigation import goal_pose
from labgym.protocols import Protocol
from labgym.protocols.model import SpatialConstraint

APPARATUS_DISTANCE_M = 0.85
"""Greatest distance between the pieces of one apparatus, meters: the reach of a Franka-class arm (0.855 m)."""

PLACES_DISTANCE_M = 2.74
"""Greatest distance between the goal poses of two places with several trips between them, meters: 9 ft, the longest leg
of a work triangle (NKBA Kitchen Planning Guidelines, guideline 3; laboratories have no such standard)."""


def near_instances(arrangement: Arrangement, protocol: Protocol) -> tuple[Instance, ...]:
    """Return one instance for each `near` constraint of a protocol; the nearest pair of placements counts.

    The satisfaction is 1 up to the limit and limit / distance beyond. Pieces of an apparatus are measured from surface
    to surface; farther apart than the limit and on different furniture, they are a hard violation. Two places are
    measured between the poses from which they are used. A constraint on something that is not placed scores 0. Pieces
    that the same protocol puts at two locations (constraint `on`) are left out: one is carried to the other when used.
    """
    whereabouts = Whereabouts(arrangement, protocol)
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    instances = []
    for constraint in protocol.spatial_constraints:
        if constraint.kind != "near" or _homes_differ(homes, constraint):
            continue
        firsts, seconds = whereabouts.of_name(constraint.subject), whereabouts.of_name(constraint.object)
        places = constraint.subject in protocol.locations and constraint.object in protocol.locations
        limit = PLACES_DISTANCE_M if places else APPARATUS_DISTANCE_M
        pairs = [(first, second) for first in firsts for second in seconds if first != second]
        note = f"{constraint.subject} near {constraint.object}: {constraint.reason}"
        if not pairs:
            instances.append(Instance("near", (), None, limit, 0.0, False, note))
            continue
        gaps = [_between_poses(arrangement, *pair) if places else _gap(arrangement, *pair) for pair in pairs]
        gap = min(gaps)
        first, second = pairs[gaps.index(gap)]
        ids = arrangement.placements[first].id, arrangement.placements[second].id
        apart = not places and whereabouts.root(first) != whereabouts.root(second)
        satisfaction = 1.0 if gap <= limit else limit / gap
        instances.append(Instance("near", ids, gap, limit, satisfaction, apart and gap > limit, note))
    return tuple(instances)


def _homes_differ(homes: Mapping[str, str], constraint: SpatialConstraint) -> bool:
    subject, other = homes.get(constraint.subject), homes.get(constraint.object)
    return subject is not None and other is not None and subject != other


def _gap(arrangement: Arrangement, first: int, second: int) -> float:
    return float(pairwise_distance(arrangement.take([first]), arrangement.take([second]))[0, 0])


def _between_poses(arrangement: Arrangement, first: int, second: int) -> float:
    boxes = (arrangement.box(row) for row in (first, second))
    (ax, ay, _), (bx, by, _) = (goal_pose(box) for box in boxes)
    return math.hypot(ax - bx, ay - by)


def _together(instance: Instance) -> tuple[float, str, str]:
    gap = instance.distance or 0.0
    message = f"{instance.ids[0]} is {gap:.2f} m from {instance.ids[1]}: {instance.note}"
    return gap - instance.limit, message, f"place them on one surface, at most {instance.limit:g} m apart"


NEAR = Term(
    name="near",
    metric="near",
    requires="What a protocol requires close together is close together",
    source="the protocol's constraints; NKBA guideline 3 for places of work",
    instances=lambda site: () if site.protocol is None else near_instances(site.arrangement, site.protocol),
    remedy=_together,
    chemical=False,
)
