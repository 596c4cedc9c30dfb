"""Power cables from devices to the nearest socket of their furniture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from labgym.assets.shapes.parts import Vector
from labgym.geometry import OrientedBox
from labgym.scenes.fittings.hosts import Host, Installation, Item, overlap
from labgym.scenes.fittings.outlets import PLUG, Outlet, plug
from labgym.scenes.fittings.sweep import hose, rounded_path

CORE = 0.007
"""Diameter of a cable, meters."""
STEP_OUT = 0.015
"""Distance of a cable from its device, meters."""
LANE = 0.005
"""Clearance between a cable and objects next to it, meters."""
BEND = 0.03
"""Radius of a cable's bends, meters."""
CORDLESS = frozenset({"Keyboard"})
"""Electrical assets without a cable to a socket."""

Point = tuple[float, float]


def cables(host: Host, outlets: Sequence[Outlet], built_in: Sequence[OrientedBox] = ()) -> Iterator[Installation]:
    """Yield the cable of each electrical device that stands on a piece of furniture.

    A cable lies on the worktop, along the furniture's axes, past everything that stands there. A device whose cable
    would cross other objects on every way has none, and neither has one without a free socket.

    Args:
        outlets: sockets of the furniture, each for one plug.
        built_in: what else cables pass around, such as sinks.
    """
    free = list(outlets)
    surface = host.asset.surfaces[0].z if host.asset.surfaces else 0.0
    for item in host.items:
        if "electrical" not in item.asset.specs.features or item.asset.name in CORDLESS:
            continue
        if not free or (item.stand or item.box).z0 > surface + 0.05:
            continue
        route = _shortest(host, item, free, built_in)
        if route is not None:
            outlet, corners = route
            free.remove(outlet)
            yield host.installation("cable", [hose("cable_black", CORE, corners), *plug(outlet)], owner=item.id)


def _shortest(
    host: Host, item: Item, outlets: Sequence[Outlet], built_in: Sequence[OrientedBox]
) -> tuple[Outlet, list[Vector]] | None:
    """Return the socket that a cable reaches on the shortest free way, and the cable's path."""
    ways: list[tuple[float, int, Outlet, list[Point]]] = []
    for number, outlet in enumerate(outlets):
        for start, inside in _exits(item):
            corners = [(start[0], outlet.foot[1]), (outlet.foot[0], start[1])]
            for corner in reversed(corners) if outlet.riser else corners:
                way = [inside, start, corner, outlet.foot]
                length = sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in pairwise(way))
                ways.append((round(length, 4), number, outlet, way))
    ways.sort(key=lambda way: way[:2])
    for _, _, outlet, way in ways:
        if all(_clear(host, built_in, a, b) for a, b in pairwise(way[1:])):
            return outlet, _path(item, outlet, way)
    return None


def _exits(item: Item) -> Iterator[tuple[Point, Point]]:
    """Yield where a cable may touch the worktop next to a device, and where it leaves the device; the back first.

    From a device in an apparatus it leads over the edge of the stand's base.
    """
    device, base = item.box, item.stand or item.box
    width, depth = device.width / 2.0, device.depth / 2.0
    shift_x, shift_y = base.to_local(device.x, device.y)
    edge_x, edge_y = base.width / 2.0 + STEP_OUT, base.depth / 2.0 + STEP_OUT
    for share in (0.6, -0.6, 0.0):
        inside = device.to_world(share * width, -depth + 0.004)
        yield base.to_world(shift_x + share * width, -edge_y), inside
    for side in (-1.0, 1.0):
        for share in (-0.7, 0.0):
            inside = device.to_world(side * (width - 0.004), share * depth)
            yield base.to_world(side * edge_x, shift_y + share * depth), inside


def _clear(host: Host, built_in: Sequence[OrientedBox], start: Point, end: Point) -> bool:
    """Whether a straight piece of cable touches no other object and stays on the worktop."""
    surface = host.asset.surfaces[0]
    reach_x, reach_y = surface.width / 2.0 + 0.001, surface.depth / 2.0 + 0.001
    if any(abs(x - surface.x) > reach_x or abs(y - surface.y) > reach_y for x, y in (start, end)):
        return False
    x0, x1 = sorted((start[0], end[0]))
    y0, y1 = sorted((start[1], end[1]))
    margin = 2.0 * (CORE / 2.0 + LANE)
    box = OrientedBox(
        (x0 + x1) / 2.0, (y0 + y1) / 2.0, x1 - x0 + margin, y1 - y0 + margin, 0.0, surface.z, surface.z + CORE
    )
    return host.free(box) and not any(overlap(box, other) for other in built_in)


def _path(item: Item, outlet: Outlet, way: Sequence[Point]) -> list[Vector]:
    """Return a cable's path: out of the device, down to the worktop, along it, and up into the plug."""
    low = (item.stand or item.box).z0 + CORE / 2.0
    leaving = item.box.z0 + min(0.03, 0.4 * (item.box.z1 - item.box.z0))
    (x, y, z), (dx, dy) = outlet.point, outlet.facing
    ends = (x + dx * PLUG * 0.9, y + dy * PLUG * 0.9, z)
    level = [(px, py, low) for px, py in way[1:]]
    hanging = [(x + dx * (PLUG + 0.02), y + dy * (PLUG + 0.02), z - 0.02)] if not outlet.riser else []
    corners = [(*way[0], leaving), *level, *outlet.riser, *hanging, ends]
    return rounded_path(_distinct(corners), BEND)


def _distinct(points: Sequence[Vector]) -> list[Vector]:
    """Return the points without those that repeat the one before."""
    kept = [points[0]]
    for point in points[1:]:
        if max(abs(a - b) for a, b in zip(point, kept[-1], strict=True)) > 1e-4:
            kept.append(point)
    return kept
