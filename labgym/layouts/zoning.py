"""Proposes functional zones for a layout, and the zone in which the steps of each location are carried out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise

from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR
from labgym.layouts.records import Role, Zone, ZoneAssignment
from labgym.navigation.goals import goal_pose
from labgym.protocols import Protocol

ROUNDS = 8
"""Most rounds in which the assignment of one location after the other is improved."""


def zoned(layout: Layout, protocol: Protocol) -> Layout:
    """Return the layout with functional zones, and an assignment of the protocol's steps to them.

    Each piece of furniture at which a location of the protocol can be is a zone; the others form a zone for each role.
    A location with several candidates is assigned to the one that carries most of the protocol's instruments, of equal
    ones to that with the shortest straight way along the steps. Zones that the layout already has are replaced.
    """
    candidates = {location: _places(layout, location) for location in protocol.locations}
    stations = dict.fromkeys(root for places in candidates.values() for root in places)
    zones, counts = [], Counter[Role]()
    groups: dict[Role, list[str]] = {}
    for placement in layout.placements:
        if placement.support != FLOOR:
            continue
        role = role_of(layout, placement.id)
        if placement.id in stations:
            counts[role] += 1
            zones.append(Zone(name=f"{role}_{counts[role]}", role=role, furniture=(placement.id,)))
        else:
            groups.setdefault(role, []).append(placement.id)
    for role, members in groups.items():
        zones.append(Zone(name=f"other_{role}", role=role, furniture=tuple(members)))
    names = {item: zone.name for zone in zones for item in zone.furniture}
    chosen = _assigned(layout, protocol, candidates)
    assignment = (ZoneAssignment(location=name, zone=names[root]) for name, root in chosen.items() if root in names)
    return layout.replace(zones=tuple(zones), assignment=tuple(assignment))


def role_of(layout: Layout, placement_id: str) -> Role:
    """Return the role of a piece of furniture, by what it is and what stands on it."""
    asset = layout.asset(placement_id)
    if asset.category == "waste":
        return "waste"
    if asset.storage_class is not None or asset.category in ("storage", "cold_storage"):
        return "storage"
    if asset.fume_hood or asset.category == "containment":
        return "reaction"
    if asset.category == "safety_equipment":
        return "safety"
    if asset.subtype == "sink" or "sink" in asset.name.lower():
        return "cleaning"
    words = f"{asset.name} {asset.variant_of or ''}".lower()
    if "preparation" in words:
        return "preparation"
    if "validation" in words or "analy" in words:
        return "analysis"
    return "work"


def _places(layout: Layout, location: str) -> tuple[str, ...]:
    """Return the floor objects that are a location or carry one."""
    return tuple(dict.fromkeys(layout.root(item.id).id for item in layout.all_of(location)))


def _assigned(layout: Layout, protocol: Protocol, candidates: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return the floor object for each location that is placed."""
    needed = set(protocol.instruments)
    carried = Counter(layout.root(item.id).id for item in layout.placements if item.asset in needed)
    best: dict[str, list[str]] = {}
    for location, places in candidates.items():
        most = max((carried[place] for place in places), default=0)
        if places:
            best[location] = [place for place in places if carried[place] == most]
    chosen = {location: places[0] for location, places in best.items()}
    for _ in range(ROUNDS):
        before = dict(chosen)
        for location, places in best.items():
            chosen[location] = min(places, key=lambda place: _length(layout, protocol, {**chosen, location: place}))
        if chosen == before:
            break
    return chosen


def _length(layout: Layout, protocol: Protocol, chosen: Mapping[str, str]) -> float:
    """Return the straight way along the steps, meters."""
    poses = [goal_pose(layout.box(chosen[location])) for location in protocol.route if location in chosen]
    return sum(math.dist(start[:2], goal[:2]) for start, goal in pairwise(poses))
