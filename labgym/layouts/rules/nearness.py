"""Near and ventilated: what a protocol requires close together or in a hood, and places with many trips."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from labgym.geometry import pairwise_distance
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import chemicals, kinds
from labgym.layouts.rules.rule import Instance, Term
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.navigation import goal_pose
from labgym.protocols import Protocol
from labgym.protocols.capability import is_ventilated
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
        gaps = [_between_poses(arrangement, *pair) for pair in pairs] if places else _gaps(arrangement, pairs)
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


def _gaps(arrangement: Arrangement, pairs: Sequence[tuple[int, int]]) -> list[float]:
    firsts, seconds = (list(dict.fromkeys(pair[end] for pair in pairs)) for end in (0, 1))
    gaps = pairwise_distance(arrangement.take(firsts), arrangement.take(seconds)).tolist()
    return [gaps[firsts.index(first)][seconds.index(second)] for first, second in pairs]


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
    looks_at=chemicals,
)


def ventilation_instances(arrangement: Arrangement, protocol: Protocol) -> list[Instance]:
    """Return one instance for each `ventilate` constraint of a protocol.

    The satisfaction is the share of the vessels of the steps that stand in a ventilated place: of the instruments that
    the protocol puts at the location and that a step with the reagent uses there. It is 0 if the location is not
    placed. A vessel outside is a hard violation (OSHA 1910.1450, appendix A; TRGS 526, 4.3.2: work
    with dangerous vapors is done in the hood).
    """
    whereabouts = Whereabouts(arrangement, protocol)
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    instances = []
    for constraint in protocol.chemical_constraints:
        if constraint.kind != "ventilate":
            continue
        reagent, location = constraint.subject, constraint.object
        place = whereabouts.place(location)
        vessels = [
            name
            for name in dict.fromkeys(
                name
                for step in protocol.steps
                if step.location == location and reagent in step.uses
                for name in step.uses
            )
            if homes.get(name) == location and whereabouts.of_name(name)
        ]
        outside = [name for name in vessels if not _inside(whereabouts, name)]
        ids: tuple[str, ...] = () if place is None else (arrangement.placements[place].id,)
        share = 0.0 if place is None else 1.0 - len(outside) / len(vessels) if vessels else 1.0
        ids += tuple(arrangement.placements[whereabouts.of_name(name)[0]].id for name in outside)
        note = f"{reagent} needs ventilation: {', '.join(outside)} outside of {location}" if outside else ""
        instances.append(Instance("ventilation", ids, None, 0.0, share, bool(outside), note))
    return instances


def _inside(whereabouts: Whereabouts, name: str) -> bool:
    """Whether some placement of an asset stands in a ventilated place."""
    assets = whereabouts.arrangement.assets
    carriers = (whereabouts.carriers(row) for row in whereabouts.of_name(name))
    return any(any(is_ventilated(assets[carrier]) for carrier in own) for own in carriers)


def _inside_hood(instance: Instance) -> tuple[float, str, str]:
    place, vessels = instance.ids[:1], instance.ids[1:]
    return 1.0, instance.note, f"place {', '.join(vessels)} in {place[0]}" if vessels else "place it"


VENTILATED = Term(
    name="ventilation",
    metric="ventilate",
    requires="Toxic and volatile reagents are handled in vessels that stand in a working hood",
    source="OSHA 29 CFR 1910.1450, appendix A; TRGS 526, 4.3.2",
    instances=lambda site: () if site.protocol is None else ventilation_instances(site.arrangement, site.protocol),
    remedy=_inside_hood,
    void="unusable",
    looks_at=kinds,
)
