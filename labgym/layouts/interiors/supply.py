"""Places from which furniture reaches the water, gas and exhaust that it needs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from labgym.layouts.brief import Unit
from labgym.layouts.floor import Service
from labgym.layouts.ground import Ground, Segment
from labgym.layouts.interiors.standing import OBLIQUE_GAP, WALL_GAP, Intervals
from labgym.layouts.rules.supplies import Supplies, reach_of

Options = list[tuple[Segment, Intervals]]


def supplied(options: Options, unit: Unit, supplies: Supplies) -> Options:
    """Return the places of a unit along segments from which it reaches what it needs and the floor has."""
    return _near(options, unit, supplies, supplies.described)


def required(options: Options, unit: Unit, supplies: Supplies) -> Options:
    """Return the places from which a unit reaches what the floor requires it to reach."""
    return _near(options, unit, supplies, supplies.required)


def preferred(options: Options, unit: Unit, supplies: Supplies) -> Options:
    """Return the places from which a unit reaches all that it needs, or else those from which it must."""
    return supplied(options, unit, supplies) or required(options, unit, supplies)


def _near(options: Options, unit: Unit, supplies: Supplies, kinds: frozenset[str]) -> Options:
    """The places from which a unit reaches a point of each kind that it needs; the same list if it needs none."""
    needs = [supplies.of_kind(kind) for kind in unit.supplies if kind in kinds]
    if not needs:
        return options
    near = []
    for segment, intervals in options:
        for points in needs:
            intervals = _shared(intervals, [_reach(segment, unit, point) for point in points])
        if intervals:
            near.append((segment, intervals))
    return near


def lacking(unit: Unit, ground: Ground) -> tuple[bool, bool]:
    """Return whether a space has no point of a kind that a unit needs, and whether the floor requires that kind."""
    kinds = [kind for kind in unit.supplies if kind in ground.supplies.described and not ground.supplies.of_kind(kind)]
    return bool(kinds), not ground.supplies.required.isdisjoint(kinds)


def _reach(segment: Segment, unit: Unit, point: Service) -> tuple[float, float]:
    """The places along a segment from which a unit reaches a point; an empty interval if it reaches it nowhere."""
    dx, dy = point.x - segment.x, point.y - segment.y
    cosine, sine = math.cos(segment.yaw), math.sin(segment.yaw)
    along, inward = dx * cosine + dy * sine, dy * cosine - dx * sine
    back = WALL_GAP if segment.straight else OBLIQUE_GAP
    across = max(back - inward, inward - back - unit.depth, 0.0)
    reach = reach_of(point)
    if across > reach:
        return math.inf, -math.inf
    slack = math.sqrt(reach**2 - across**2)
    margin = max(unit.width - unit.asset.size.width, 0.0) / 2.0
    return along - unit.width - slack + margin, along + slack - margin


def _shared(intervals: Sequence[tuple[float, float]], others: Iterable[tuple[float, float]]) -> Intervals:
    """The parts of intervals that lie in the union of others, in order."""
    parts = sorted(
        (max(low, start), min(high, end))
        for low, high in intervals
        for start, end in others
        if min(high, end) >= max(low, start)
    )
    union: Intervals = []
    for low, high in parts:
        if union and low <= union[-1][1]:
            union[-1] = (union[-1][0], max(high, union[-1][1]))
        else:
            union.append((low, high))
    return union
