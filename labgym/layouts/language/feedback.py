"""Facts about a layout for a model that may adjust it: poses, violations and their causes."""

from __future__ import annotations

import math
from typing import Any

from labgym.layouts.adjust import Level
from labgym.layouts.language.commands import surface_pose
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.objective import Assessment

MAX_OBJECTS = 200
"""Greatest number of objects that are described; those that violate a rule come first."""
MAX_PROBLEMS = 60
"""Greatest number of violations that are described."""


def problem_facts(assessment: Assessment) -> list[dict[str, Any]]:
    """Return hard violations, broken facility rules, and rules that are met in part: with ids, amounts and remedies."""
    facts: list[dict[str, Any]] = [
        {"kind": each.kind, "ids": list(each.ids), "amount": round(each.amount, 3), "problem": each.message}
        for each in assessment.violations.items
    ]
    facts += [
        {"kind": issue.rule, "ids": list(issue.ids), "amount": issue.value, "problem": issue.message}
        for issue in assessment.errors
    ]
    facts += [
        {
            "kind": instance.rule,
            "ids": list(instance.ids),
            "amount": instance.distance,
            "problem": f"met to {instance.satisfaction:.0%} {instance.note}".strip(),
        }
        for instance in sorted(assessment.instances, key=lambda each: (each.satisfaction, each.rule, each.ids))
        if instance.satisfaction < 1.0 and not instance.hard
    ]
    return facts[:MAX_PROBLEMS]


def involved(layout: Layout, assessment: Assessment, level: Level) -> tuple[str, ...]:
    """Return the objects of a level that may move, those in a violation first, at most `MAX_OBJECTS`."""
    named = [item for fact in problem_facts(assessment) for item in fact["ids"] if item in layout.by_id]
    if level == "room":
        named = [layout.root(item).id for item in named]
    own = [each.id for each in layout.placements if (each.support in (FLOOR, WALL)) == (level == "room")]
    first = [item for item in dict.fromkeys(named) if item in set(own)]
    movable = [item for item in dict.fromkeys([*first, *own]) if may_move(layout, item)]
    return tuple(movable[:MAX_OBJECTS])


def carriers(layout: Layout) -> tuple[str, ...]:
    """Return the furniture that has surfaces."""
    standing = [
        each.id for each in layout.placements if each.support in (FLOOR, WALL) and layout.asset(each.id).surfaces
    ]
    return tuple(standing[:MAX_OBJECTS])


def object_facts(layout: Layout, names: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Return asset, size and pose of some objects, by id: in the floor's frame, items in that of their surface."""
    facts: dict[str, dict[str, Any]] = {}
    for name in names:
        placement, size = layout.placement(name), layout.asset(name).size
        fact: dict[str, Any] = {"asset": placement.asset, "size": f"{size.width:g} x {size.depth:g}"}
        fact |= {
            "x": round(placement.position[0], 3),
            "y": round(placement.position[1], 3),
            "yaw": round(math.degrees(placement.yaw), 1),
        }
        if placement.support not in (FLOOR, WALL):
            x, y, yaw = surface_pose(layout, name)
            fact |= {"support": placement.support, "surface": placement.slot or 0, "on surface": [x, y, yaw]}
        facts[name] = fact
    return facts


def carrier_facts(layout: Layout, names: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the surfaces of furniture, by id."""
    return {
        name: [
            f"{surface.width:g} x {surface.depth:g}"
            + ("" if surface.headroom is None else f", {surface.headroom:g} m free above")
            for surface in layout.asset(name).surfaces
        ]
        for name in names
    }
