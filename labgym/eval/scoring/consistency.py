"""A rule-based proxy for semantic plausibility, for where no vision-language model looks at pictures.

It is no substitute for one and is reported under its own name. Each dimension is ten times the mean of its rules.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from labgym.eval.scoring.layout_report import ConsistencyProxy, RuleScore
from labgym.layouts.model import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility import SHOWER_WALK, blocked_front, box_of, hoods, shower_walks
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.zones import door_area, standing_in
from labgym.protocols import Protocol

BACK_GAP = 0.15
"""A back this near to a wall stands against it, metres: room for pipes."""

TALL = 1.5
"""Furniture of this height belongs against a wall, metres: it blocks the view."""

FREE_STANDING = frozenset({"shower", "ventilation"})
"""Subtypes that the rule for tall furniture leaves out: a shower stands clear, hoods have a rule of their own."""

RIGHT_ANGLE = math.radians(2.0)
"""Furniture turned less than this from the walls counts as parallel to them."""

ROBOT_FRONT = 0.90
"""Free depth that lets the robot stand in front of a location: stand-off plus planning radius, metres."""

BARE_WALL = 0.2
"""Share of the walls' length that furniture should line (LabBuilder's completeness rule: not over 80% empty)."""

ESSENTIALS: dict[str, frozenset[str]] = {
    "bench": frozenset({"workbench"}),
    "hood": frozenset({"ventilation"}),
    "sink": frozenset({"sink"}),
    "eyewash or shower": frozenset({"eyewash", "shower"}),
    "fire extinguisher": frozenset({"fire"}),
    "waste": frozenset({"container", "station"}),
}
"""What every synthesis laboratory has, by subtype; a reagent cabinet comes on top."""


def consistency_proxy(assessment: Assessment, protocol: Protocol | None) -> ConsistencyProxy:
    """Score realism, layout and completeness by rules, each of 10."""
    arrangement = assessment.arrangement
    rules = [
        rule
        for rule in (
            *_realism(arrangement),
            *_layout(arrangement, protocol),
            *_completeness(assessment, protocol),
        )
        if rule is not None
    ]
    return ConsistencyProxy(
        realism=_points(rules, "realism"),
        layout=_points(rules, "layout"),
        completeness=_points(rules, "completeness"),
        rules=tuple(rules),
    )


def _points(rules: Iterable[RuleScore], dimension: str) -> float:
    scores = [rule.score for rule in rules if rule.dimension == dimension]
    return 10.0 * sum(scores) / len(scores) if scores else 0.0


def _realism(arrangement: Arrangement) -> list[RuleScore | None]:
    assets = arrangement.assets
    floor = [row for row, placement in enumerate(arrangement.placements) if placement.support == FLOOR]
    furniture = [row for row in floor if assets[row].kind == "facility" and assets[row].surfaces]
    tall = [row for row in floor if assets[row].size.height >= TALL and assets[row].subtype not in FREE_STANDING]
    yaws = arrangement.boxes.yaw
    parallel = [abs(math.remainder(float(yaws[row]), math.pi / 2.0)) <= RIGHT_ANGLE for row in furniture]
    backed = [_backed(arrangement, row) for row in hoods(arrangement)]
    stray = [
        arrangement.placements[row].support not in (FLOOR, WALL)
        for row, asset in enumerate(assets)
        if asset.placing == "desktop"
    ]
    return [
        _share("realism", "hoods stand with their back to a wall", backed),
        _share("realism", "tall furniture stands against a wall", [_against_wall(arrangement, row) for row in tall]),
        _share("realism", "furniture is parallel to the walls", parallel),
        _share("realism", "desktop items stand on furniture, not on the floor", stray),
    ]


def _layout(arrangement: Arrangement, protocol: Protocol | None) -> list[RuleScore | None]:
    room = arrangement.layout.room
    doors = [not standing_in(arrangement, door_area(room, door)) for door in room.doors]
    walks = [walk <= SHOWER_WALK for walk in shower_walks(arrangement).values()]
    located = [arrangement.layout.find(name) for name in (protocol.locations if protocol is not None else ())]
    rows = [arrangement.index[placement.id] for placement in located if placement is not None]
    fronts = [blocked_front(arrangement, row, ROBOT_FRONT) is None for row in rows]
    clear = [
        blocked_front(arrangement, row, arrangement.assets[row].clearance) is None
        for row in hoods(arrangement)
        if arrangement.assets[row].clearance > 0.0
    ]
    return [
        _share("layout", "the area inside each door is clear", doors),
        _share("layout", "a safety shower is within 16.8 m of each hood", walks),
        _share("layout", "the fronts of the protocol's locations are free", fronts),
        _share("layout", "each hood has its clearance in front", clear),
    ]


def _completeness(assessment: Assessment, protocol: Protocol | None) -> list[RuleScore | None]:
    arrangement = assessment.arrangement
    subtypes = {asset.subtype for asset in arrangement.assets if asset.kind == "facility"}
    have = [not subtypes.isdisjoint(wanted) for wanted in ESSENTIALS.values()]
    have.append(any(asset.storage_class is not None for asset in arrangement.assets))
    used = {placement.support for placement in arrangement.placements}
    tops = [
        placement.id in used
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if asset.kind == "facility" and (asset.subtype in ("workbench", "desk") or asset.fume_hood)
    ]
    rules = [
        _share("completeness", "a laboratory's essentials are there", have),
        _share("completeness", "benches, desks and hoods carry something", tops),
        _walls(arrangement),
    ]
    if protocol is not None and assessment.missing is not None:
        total = len(protocol.required_assets())
        there = total - len(assessment.missing)
        rules.append(_rule("completeness", "the protocol's assets are there", there / total, f"{there} of {total}"))
    return rules


def _walls(arrangement: Arrangement) -> RuleScore:
    """Share of the walls' length that floor furniture lines, full marks from a fifth."""
    room = arrangement.layout.room
    rows = [
        row
        for row, placement in enumerate(arrangement.placements)
        if placement.support == FLOOR and arrangement.assets[row].kind == "facility"
    ]
    corners = arrangement.corners[rows]
    lined = 0.0
    for along, across, length, far in ((0, 1, room.width, room.depth), (1, 0, room.depth, room.width)):
        for near_wall in (corners[..., across], far - corners[..., across]):
            close = near_wall.min(axis=1) <= BACK_GAP if len(rows) else np.zeros(0, dtype=bool)
            spans = [(float(c[:, along].min()), float(c[:, along].max())) for c in corners[close]]
            lined += _covered(spans, length)
    share = lined / (2.0 * (room.width + room.depth))
    detail = f"{share:.0%} of their length"
    return _rule("completeness", "walls are lined with furniture", min(1.0, share / BARE_WALL), detail)


def _covered(spans: list[tuple[float, float]], length: float) -> float:
    """Length of [0, length] that a union of intervals covers."""
    covered, reached = 0.0, 0.0
    for start, end in sorted(spans):
        start, end = max(start, reached), min(end, length)
        if end > start:
            covered += end - start
            reached = end
    return covered


def _backed(arrangement: Arrangement, row: int) -> bool:
    """Whether an object's back lies along a wall and its front looks into the room."""
    room, corners = arrangement.layout.room, box_of(arrangement, row).corners()[:2]
    gaps = (corners[:, 0], corners[:, 1], room.width - corners[:, 0], room.depth - corners[:, 1])
    return bool(min(float(gap.max()) for gap in gaps) <= BACK_GAP)


def _against_wall(arrangement: Arrangement, row: int) -> bool:
    room, corners = arrangement.layout.room, arrangement.corners[row]
    gaps = (corners[:, 0], corners[:, 1], room.width - corners[:, 0], room.depth - corners[:, 1])
    return bool(min(float(gap.min()) for gap in gaps) <= BACK_GAP)


def _share(dimension: str, rule: str, kept: list[bool]) -> RuleScore | None:
    """Score a rule by the share that keeps it; None where it applies to nothing."""
    return _rule(dimension, rule, sum(kept) / len(kept), f"{sum(kept)} of {len(kept)}") if kept else None


def _rule(dimension: str, rule: str, score: float, detail: str) -> RuleScore:
    return RuleScore(dimension=dimension, rule=rule, score=score, detail=detail)
