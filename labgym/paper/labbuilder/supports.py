"""Supports of the objects of a LabBuilder scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.geometry import rotate
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.paper.labbuilder.scene import key


@dataclass(frozen=True)
class SupportBody:
    """A placement without its support, its asset at the placement's size, and the object's name in the file."""

    placement: Placement
    asset: Asset
    name: str


@dataclass(frozen=True)
class Support:
    """Support of an object: `floor`, `wall` or an id with the index of its surface; a note on what was assumed."""

    id: str
    slot: int | None = None
    note: str = ""


class Bodies:
    """The objects of a scene, by id and by what a location may call them."""

    def __init__(self, bodies: Sequence[SupportBody]) -> None:
        self._by_id = {body.placement.id: body for body in bodies}
        self._by_key: dict[str, list[SupportBody]] = {}
        self._by_name: dict[str, list[SupportBody]] = {}
        for body in bodies:
            self._by_key.setdefault(key(body.placement.id), []).append(body)
            self._by_name.setdefault(key(body.name), []).append(body)

    def named(self, location: str) -> Sequence[SupportBody]:
        """Return the objects that a location names: by id, else by their names without case and underscores."""
        if location in self._by_id:
            return [self._by_id[location]]
        return self._by_key.get(key(location)) or self._by_name.get(key(location), [])


def support_of(item: SupportBody, location: str, bodies: Bodies) -> Support:
    """Return what carries an object: of the objects that the location names the nearest, its surface nearest in height.

    An object whose location names nothing that can carry it is taken as on the floor, at its height.
    """
    if key(location) == FLOOR:
        return Support(FLOOR, note=_hovering(item))
    if key(location) == WALL:
        return Support(WALL)
    carriers = bodies.named(location)
    able = [body for body in carriers if body.asset.surfaces and body is not item]
    if not able:
        problem = f"{carriers[0].asset.name} has no surface" if carriers else "no object has that name"
        return Support(FLOOR, note=f"initial_location {location!r}: {problem}; taken as on the floor")
    carrier = min(able, key=lambda body: _distance(item, body))
    heights = [carrier.placement.position[2] + surface.z for surface in carrier.asset.surfaces]
    bottom = item.placement.position[2]
    slot = min(range(len(heights)), key=lambda index: (abs(heights[index] - bottom), index))
    return Support(carrier.placement.id, slot)


def _distance(item: SupportBody, carrier: SupportBody) -> tuple[float, float]:
    """Return the distance from an object's center to a footprint, 0 within, and to its center; meters."""
    (x, y, _), (cx, cy, _) = item.placement.position, carrier.placement.position
    dx, dy = rotate(x - cx, y - cy, -carrier.placement.yaw)
    size = carrier.asset.size
    beyond = max(abs(dx) - size.width / 2.0, 0.0), max(abs(dy) - size.depth / 2.0, 0.0)
    return math.hypot(*beyond), math.hypot(dx, dy)


def _hovering(item: SupportBody) -> str:
    z = item.placement.position[2]
    return f"stands on the floor, its bottom at {z:g} m" if abs(z) > 1e-9 else ""
