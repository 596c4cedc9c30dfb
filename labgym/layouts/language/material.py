"""Facts for a language model as plain JSON data: requests, layouts and their violations. Meters and degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.adjust import Level
from labgym.layouts.floor import Floor
from labgym.layouts.language.commands import surface_pose
from labgym.layouts.language.offer import Offer
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.rules.thresholds import ONE_SIDED, Profile
from labgym.protocols import Protocol

MAX_CONSTRAINTS = 200
"""Greatest number of constraints of a protocol in a prompt."""


def floor_facts(floor: Floor) -> dict[str, Any]:
    """Return spaces with their corners, doorways, columns, services and keep-outs, in the floor's frame."""
    return {
        "spaces": [
            {
                "id": space.id,
                "use": space.use,
                "rectangles": [_corners(box) for box in space.boxes],
                "ceiling": _m(space.ceiling),
            }
            for space in floor.spaces
        ],
        "doorways": [
            {
                "kind": "exit" if way.exit else way.opening.kind,
                "x": _m(way.x),
                "y": _m(way.y),
                "width": _m(way.width),
                "joins": list(way.spaces),
            }
            for way in floor.doorways
        ],
        "columns": [_corners(OrientedBox(c.x, c.y, c.width, c.depth, c.yaw)) for c in floor.columns],
        "services": [{"kind": s.kind, "x": _m(s.x), "y": _m(s.y)} for s in floor.services],
        "keep_outs": [_corners(area.box) for area in floor.keep_outs],
    }


def furniture_facts(offer: Offer) -> dict[str, str]:
    """Return the properties of each kind of furniture that decide where it can stand, by name."""
    return {name: "; ".join(_furniture(asset)) for name, asset in offer.furniture.items()}


def needs_facts(offer: Offer) -> dict[str, dict[str, Any]]:
    """Return how many pieces of each kind of furniture are required, and why."""
    return {need.asset.name: {"count": need.count, "reason": need.reason} for need in offer.needs}


def item_facts(items: Mapping[str, Asset], profile: Profile) -> dict[str, str]:
    """Return the properties of each item that decide where it can stand, by id."""
    return {item: "; ".join(_item(asset, profile)) for item, asset in items.items()}


def piece_facts(name: str, asset: Asset) -> dict[str, Any]:
    """Return the surfaces of a piece of furniture, by number."""
    surfaces = [
        {
            "surface": slot,
            "width": _m(surface.width),
            "depth": _m(surface.depth),
            "height": _m(surface.z),
            "free height": None if surface.headroom is None else _m(surface.headroom),
        }
        for slot, surface in enumerate(asset.surfaces)
    ]
    return {"id": name, "asset": asset.name, "surfaces": surfaces}


def fixed_facts(request: Request) -> list[dict[str, Any]]:
    """Return the pieces that stand where they are, with their poses and sizes."""
    facts = []
    for placement in request.fixed:
        size, (x, y, z) = request.fixed_asset(placement).size, placement.position
        pose = {"x": _m(x), "y": _m(y), "z": _m(z), "yaw": _degrees(placement.yaw)}
        facts.append({"id": placement.id, "asset": placement.asset, **pose, "size": _size(size.width, size.depth)})
    return facts


def protocol_facts(protocol: Protocol) -> dict[str, Any]:
    """Return the steps and constraints of a protocol; steps are numbered from 1."""
    constraints = [f"{rule.kind}: {rule.subject}, {rule.object}" for rule in protocol.spatial_constraints]
    constraints += [f"{rule.kind}: {rule.subject}, {rule.object}" for rule in protocol.chemical_constraints]
    return {
        "name": protocol.name,
        "description": protocol.description,
        "steps": [
            {"step": number, "location": step.location, "action": step.action, "uses": list(step.uses)}
            for number, step in enumerate(protocol.steps, 1)
        ],
        "constraints": list(dict.fromkeys(constraints))[:MAX_CONSTRAINTS],
    }


def distance_facts(profile: Profile) -> dict[str, str]:
    """Return the distances that hazards keep, measured from surface to surface."""
    return {
        "incompatible reagents": f"{profile.incompatible.d_min:g} m",
        "glass to the edge of its surface": f"{profile.glass:g} m",
    }


def _furniture(asset: Asset) -> Iterator[str]:
    size = asset.size
    yield f"{asset.subtype}, {_size(size.width, size.depth)} m, {size.height:g} m high"
    if asset.clearance > 0.0:
        yield f"{asset.clearance:g} m free in front"
        yield "back to a wall" if size.depth < ONE_SIDED else "in the open, used from both long sides"
    if asset.storage_class is not None:
        yield f"stores {asset.storage_class}"
    for slot, surface in enumerate(asset.surfaces):
        yield f"surface {slot}: {_size(surface.width, surface.depth)} m at {surface.z:g} m"


def _item(asset: Asset, profile: Profile) -> Iterator[str]:
    size = asset.size
    yield f"{asset.kind}, {asset.subtype}, {_size(size.width, size.depth)} m, {size.height:g} m high"
    if asset.chemistry is not None:
        yield f"belongs on a shelf of a {asset.chemistry.storage_class} cabinet"
    if asset.hazards.glass_container:
        yield "glass"
    if asset.hazards.flammable:
        yield "flammable"
    band = heat_band(asset, profile)
    if band is not None:
        yield f"heat source: flammable reagents keep {band.d_min:g} m"


def _size(width: float, depth: float) -> str:
    return f"{width:g} x {depth:g}"


def _corners(box: OrientedBox) -> list[list[float]]:
    return [[_m(float(x)), _m(float(y))] for x, y in box.corners()]


def _m(value: float) -> float:
    return round(value, 3)


def _degrees(yaw: float) -> float:
    return round(math.degrees(yaw), 1)


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
