"""A rule-based proxy for semantic plausibility.

It does not replace a vision-language model and is reported under its own name. Each dimension is ten times the mean of
its rules. Version 1 has rules of general planning, and passes layouts that one fault makes useless. Version 2 adds
rules in which every fault counts, and conditions under which a dimension is 0, as in the paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from labgym.eval.scoring.layout_report import ConsistencyProxy, RuleScore
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.fronts import blocked_front
from labgym.layouts.rules.facility.showers import SHOWER_WALK, shower_walks
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.zones import standing_in
from labgym.protocols import Protocol

BACK_GAP = 0.15
"""Largest gap between the back of furniture and its wall, meters; it leaves room for pipes."""

TALL = 1.5
"""Furniture of at least this height belongs against a wall, because it blocks the view, meters."""

FREE_STANDING = frozenset({"shower", "ventilation"})
"""Subtypes exempt from the rule on tall furniture: showers need clear space, hoods have their own rule."""

RIGHT_ANGLE = math.radians(2.0)
"""Largest angle between furniture and walls that counts as parallel, radians."""

ROBOT_FRONT = 0.90
"""Free depth that the robot needs in front of a location: stand-off plus planning radius, meters."""

BARE_WALL = 0.2
"""Share of the walls' length that furniture should line (LabBuilder's completeness rule: at most 80% empty)."""

MOSTLY = 0.5
"""Share of desktop items on the floor, and of reagents outside of cabinets of their class, above which realism and
layout are 0 in version 2."""

BARE_TOPS = 0.2
"""Share of work surfaces in use under which completeness is 0 in version 2 (LabBuilder: over 80% empty)."""

ESSENTIALS: dict[str, frozenset[str]] = {
    "bench": frozenset({"workbench"}),
    "hood": frozenset({"ventilation"}),
    "sink": frozenset({"sink"}),
    "eyewash or shower": frozenset({"eyewash", "shower"}),
    "fire extinguisher": frozenset({"fire"}),
    "waste": frozenset({"container", "station"}),
}
"""Subtypes of the essentials of a synthesis laboratory, in addition to a reagent cabinet."""


SAFETY: dict[str, frozenset[str]] = {
    "emergency shower": frozenset({"shower"}),
    "eyewash": frozenset({"eyewash"}),
    "fire extinguisher": frozenset({"fire"}),
    "waste": frozenset({"container", "station"}),
}
"""Subtypes of safety equipment; version 2 counts what is missing."""


def consistency_proxy(assessment: Assessment) -> ConsistencyProxy:
    """Return scores for realism, layout and completeness by rules, at most 10 each.

    The rule set chooses the version of the rules.

    Args:
        assessment: with navigation; without it, version 2 judges neither ways out nor transitions.
    """
    arrangement, protocol, version = assessment.arrangement, assessment.protocol, assessment.rules.proxy
    listed = [*_realism(arrangement), *_layout(arrangement, protocol), *_completeness(assessment, protocol)]
    if version == 2:
        listed += _faults(assessment)
    rules = [rule for rule in listed if rule is not None]
    zeros = _hard_zeros(assessment, rules) if version == 2 else []
    return ConsistencyProxy(
        realism=_points(rules, zeros, "realism"),
        layout=_points(rules, zeros, "layout"),
        completeness=_points(rules, zeros, "completeness"),
        rules=(*rules, *zeros),
        version=version,
    )


def _points(rules: Iterable[RuleScore], zeros: Iterable[RuleScore], dimension: str) -> float:
    if any(zero.dimension == dimension for zero in zeros):
        return 0.0
    scores = [rule.score for rule in rules if rule.dimension == dimension]
    return 10.0 * sum(scores) / len(scores) if scores else 0.0


def _faults(assessment: Assessment) -> list[RuleScore | None]:
    """Return the rules of version 2: each is 1 without a fault, a half with one, a third with two."""
    arrangement = assessment.arrangement
    own = _in_own_class(arrangement)
    subtypes = {asset.subtype for asset in arrangement.assets}
    lacking = sum(subtypes.isdisjoint(kinds) for kinds in SAFETY.values())
    return [
        _count("realism", "objects stand wholly on their support and in nothing else", len(assessment.faulty)),
        _count("layout", "no facility rule is broken", len(assessment.errors)),
        _count("layout", "the robot gets from step to step", len(assessment.unreached))
        if assessment.transitions
        else None,
        _count("layout", "reagents stand in a cabinet of their class", own.count(False)) if own else None,
        _count("completeness", "safety equipment is present", lacking),
        None
        if assessment.missing is None
        else _count("completeness", "nothing that the protocol requires is missing", len(assessment.missing)),
    ]


def _hard_zeros(assessment: Assessment, rules: Iterable[RuleScore]) -> list[RuleScore]:
    """Return a rule with score 0 for each condition under which its dimension is 0."""
    by_name = {rule.rule: rule for rule in rules}
    on_furniture = by_name.get("desktop items stand on furniture, not on the floor")
    in_use, lined = by_name.get("benches, desks and hoods carry something"), by_name["walls are lined with furniture"]
    shut = [issue for issue in assessment.errors if issue.rule in ("door_area", "egress")]
    own = _in_own_class(assessment.arrangement)
    conditions = [
        ("realism", "most desktop items stand on the floor", on_furniture is not None and on_furniture.score < MOSTLY),
        ("layout", "a door or the way to it is blocked", bool(shut)),
        ("layout", "a step cannot be reached", bool(assessment.unreached)),
        ("layout", "most reagents are not in a cabinet of their class", own.count(False) > MOSTLY * len(own)),
        ("completeness", "benches are nearly empty", in_use is not None and in_use.score < BARE_TOPS),
        ("completeness", "walls are nearly empty", lined.score < 1.0),
    ]
    return [_rule(dimension, f"hard zero: {name}", 0.0, "") for dimension, name, holds in conditions if holds]


def _in_own_class(arrangement: Arrangement) -> list[bool]:
    """Return for each reagent that has a storage class whether it stands in furniture of that class."""
    classed = [row for row in arrangement.reagents if _own_class(arrangement, row) is not None]
    return [_cabinet_class(arrangement, row) == _own_class(arrangement, row) for row in classed]


def _own_class(arrangement: Arrangement, row: int) -> str | None:
    chemistry = arrangement.assets[row].chemistry
    return None if chemistry is None else chemistry.storage_class


def _cabinet_class(arrangement: Arrangement, row: int) -> str | None:
    """Return the storage class of what an object stands in, None on the floor, on a wall or on other furniture."""
    support = arrangement.placements[row].support
    return None if support in (FLOOR, WALL) else arrangement.layout.asset(support).storage_class


def _realism(arrangement: Arrangement) -> list[RuleScore | None]:
    assets = arrangement.assets
    floor = [row for row, placement in enumerate(arrangement.placements) if placement.support == FLOOR]
    furniture = [row for row in floor if assets[row].kind == "facility" and assets[row].surfaces]
    tall = [row for row in floor if assets[row].size.height >= TALL and assets[row].subtype not in FREE_STANDING]
    parallel = [bool(skew <= RIGHT_ANGLE) for skew in arrangement.building.skew(arrangement.take(furniture))]
    backed = [_backed(arrangement, row) for row in arrangement.hoods]
    on_furniture = [
        arrangement.placements[row].support not in (FLOOR, WALL)
        for row, asset in enumerate(assets)
        if asset.placing == "desktop"
    ]
    return [
        _share("realism", "hoods stand with their back to a wall", backed),
        _share("realism", "tall furniture stands against a wall", [_against_wall(arrangement, row) for row in tall]),
        _share("realism", "furniture is parallel to the walls", parallel),
        _share("realism", "desktop items stand on furniture, not on the floor", on_furniture),
    ]


def _layout(arrangement: Arrangement, protocol: Protocol | None) -> list[RuleScore | None]:
    doors = [
        not standing_in(arrangement, entrance.area, space=entrance.space) for entrance in arrangement.building.entrances
    ]
    walks = [walk <= SHOWER_WALK for walk in shower_walks(arrangement).values()]
    located = [arrangement.layout.find(name) for name in (protocol.locations if protocol is not None else ())]
    rows = [arrangement.index[placement.id] for placement in located if placement is not None]
    fronts = [blocked_front(arrangement, row, ROBOT_FRONT) is None for row in rows]
    clear = [
        blocked_front(arrangement, row, arrangement.assets[row].clearance) is None
        for row in arrangement.hoods
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
    essentials = [not subtypes.isdisjoint(kinds) for kinds in ESSENTIALS.values()]
    essentials.append(any(asset.storage_class is not None for asset in arrangement.assets))
    supports = {placement.support for placement in arrangement.placements}
    tops = [
        placement.id in supports
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if asset.kind == "facility" and (asset.subtype in ("workbench", "desk") or asset.fume_hood)
    ]
    rules = [
        _share("completeness", "a laboratory's essentials are present", essentials),
        _share("completeness", "benches, desks and hoods carry something", tops),
        _walls(arrangement),
    ]
    if protocol is not None and assessment.missing is not None:
        total = len(protocol.required_assets())
        present = total - len(assessment.missing)
        rules.append(
            _rule("completeness", "the protocol's assets are present", present / total, f"{present} of {total}")
        )
    return rules


def _walls(arrangement: Arrangement) -> RuleScore:
    """Return the score for the share of the walls' length lined by floor furniture; 1 from `BARE_WALL`."""
    rows = [
        row
        for row, placement in enumerate(arrangement.placements)
        if placement.support == FLOOR and arrangement.assets[row].kind == "facility"
    ]
    share = arrangement.building.lined(arrangement.take(rows), BACK_GAP)
    detail = f"{share:.0%} of their length"
    return _rule("completeness", "walls are lined with furniture", min(1.0, share / BARE_WALL), detail)


def _backed(arrangement: Arrangement, row: int) -> bool:
    """Return whether an object's back is along a wall."""
    gaps = arrangement.building.gaps(arrangement.box(row).corners()[:2])
    return bool(gaps.max(axis=1).min() <= BACK_GAP)


def _against_wall(arrangement: Arrangement, row: int) -> bool:
    return bool(arrangement.building.gaps(arrangement.corners[row]).min() <= BACK_GAP)


def _share(dimension: str, rule: str, passed: list[bool]) -> RuleScore | None:
    """Return the share of objects that pass a rule as its score; None if it applies to no object."""
    return _rule(dimension, rule, sum(passed) / len(passed), f"{sum(passed)} of {len(passed)}") if passed else None


def _count(dimension: str, rule: str, faults: int) -> RuleScore:
    """Return the score of a rule in which every fault counts."""
    return _rule(dimension, rule, 1.0 / (1.0 + faults), f"{faults} faults" if faults else "")


def _rule(dimension: str, rule: str, score: float, detail: str) -> RuleScore:
    return RuleScore(dimension=dimension, rule=rule, score=score, detail=detail)
