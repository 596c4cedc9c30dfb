"""Facts about a request for a language model: plain JSON data with lengths in meters and angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor
from labgym.layouts.language.offer import Offer
from labgym.layouts.request import Request
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
