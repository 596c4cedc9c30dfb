"""Supplies of furniture: sockets in trunking, in turrets and on posts of hoods, and cup sinks on islands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from labgym.assets.shapes.parts import ALONG_X, ALONG_Y, Part, Vector, block, column, cylinder, rod, turned
from labgym.geometry import OrientedBox
from labgym.layouts.ground import without
from labgym.scenes.fittings.hosts import Host, Interval, Kind, moved, overlap
from labgym.scenes.fittings.sweep import hose

RISE, TALL = 0.14, 0.10
"""Height of trunking above a worktop and its own height, meters."""
DEEP = 0.018
"""Depth by which trunking reaches over a worktop: objects keep 20 mm from its edge, meters."""
SHORTEST = 0.25
"""Length of the shortest piece of trunking, meters."""
PITCH = 0.45
"""Least distance between double sockets, meters."""
PLATE = (0.146, 0.086)
"""Width and height of a double socket, meters."""
PLUG = 0.04
"""Length of a plug, meters."""
TURRET = (0.10, 0.12, 0.26)
"""Width along an island, depth and height of a turret, meters."""
CLEAR = 0.012
"""Gap between a turret and objects on the island, meters."""
BENCHES = ("workbench", "desk")
"""Subtypes of furniture that has trunking along the wall behind it."""
LENGTH, WIDTH, RIM = 0.30, 0.18, 0.014
"""Outer length and width of a sink, and width of its rim, meters."""
TAP, REACH = 0.31, 0.16
"""Height of a tap and reach of its spout, meters."""
TAP_GAP = 0.04
"""Distance of a tap from its sink, meters."""
FROM_END = 0.30
"""Distance of the middle of a sink from the end of its island, meters."""
LEAST_ISLAND = 2.0
"""Length of the shortest island with a sink, meters."""


@dataclass(frozen=True)
class Outlet:
    """A socket, in the frame of its furniture.

    Attributes:
        point: middle of its face. facing: unit vector out of the face, in the plane.
        foot: where a cable to it leaves the worktop, (x, y).
        riser: corners of the cable's way from the foot to the plug.
    """

    point: Vector
    facing: tuple[float, float]
    foot: tuple[float, float]
    riser: tuple[Vector, ...] = ()


@dataclass(frozen=True)
class Supply:
    """Parts with sockets, in the frame of their furniture; `wall` as in `Installation`."""

    kind: Kind
    parts: tuple[Part, ...]
    outlets: tuple[Outlet, ...]
    wall: str = ""


def supplies(host: Host, built_in: Sequence[OrientedBox] = ()) -> Iterator[Supply]:
    """Yield what supplies power at a piece of furniture; `built_in` are the boxes of its sinks."""
    if host.asset.fume_hood:
        yield _posts(host)
    elif host.asset.shape.name == "island":
        yield from _turrets(host, built_in)
    elif host.asset.subtype in BENCHES and host.backing is not None and "casters" not in host.asset.specs.features:
        yield from _trunking(host)


def _posts(host: Host) -> Supply:
    """The sockets that a hood's shape has on its posts."""
    cavity = host.asset.cavity
    assert cavity is not None
    half, depth = host.half
    inner = cavity.x + cavity.width / 2.0
    outlets = []
    for side in (-1.0, 1.0):
        x, face, z = side * (inner + half) / 2.0, depth - 0.022, cavity.z0 + 0.10
        sill = (side * (inner - 0.03), depth - 0.09)
        riser = ((side * (inner - 0.02), depth + 0.02, cavity.z0 + 0.02), (x, depth + 0.035, z - 0.03))
        outlets.append(Outlet((x, face, z), (0.0, 1.0), sill, riser))
    return Supply("cable", (), tuple(outlets))


def _trunking(host: Host) -> Iterator[Supply]:
    backing, top = host.backing, host.asset.size.height
    assert backing is not None
    half, depth = host.half
    low, high = top + RISE, top + RISE + TALL
    wall, face = -depth - backing.gap, -depth + DEEP
    tall = [item.box.bounds() for item in host.items if item.box.z1 > low and item.box.z0 < high]
    tall += [box.bounds() for box in host.mounted if box.z1 > low and box.z0 < high]
    behind = [(x0 - CLEAR, x1 + CLEAR) for x0, y0, x1, y1 in tall if y0 < face + 0.002 and y1 > wall - 0.02]
    parts: list[Part] = []
    outlets: list[Outlet] = []
    for span in backing.free((-half + 0.01, half - 0.01), low, high):
        for x0, x1 in without(span, behind):
            if x1 - x0 >= SHORTEST:
                parts.append(block("trunking", (x0, x1), (wall, face), (low, high)))
                parts.append(block("plastic_grey", (x0, x1), (face, face + 0.001), (high - 0.012, high - 0.009)))
                for x in _places((x0, x1)):
                    parts += moved(_socket(), x, face, (low + high) / 2.0)
                    point = (x - 0.035, face + 0.006, (low + high) / 2.0)
                    outlets.append(Outlet(point, (0.0, 1.0), (x - 0.035, -depth + 0.010)))
                if host.use == "laboratory" and host.asset.subtype == "workbench":
                    parts += moved(_valve("safety_yellow"), x1 - 0.06, face, (low + high) / 2.0)
    if parts:
        yield Supply("trunking", tuple(parts), tuple(outlets), backing.wall)


def _places(span: Interval) -> list[float]:
    """Middles of the double sockets in a piece of trunking; its right end is left to a gas valve."""
    length = span[1] - span[0] - 0.12
    count = max(1, int(length / PITCH))
    return [span[0] + (k + 0.5) * length / count for k in range(count)]


def _socket() -> Iterator[Part]:
    """A double socket on a face at y = 0 that looks along +y."""
    width, height = PLATE
    yield block("socket_plate", (-width / 2.0, width / 2.0), (0.0, 0.006), (-height / 2.0, height / 2.0))
    for x in (-0.035, 0.035):
        yield cylinder("plastic_grey", 0.042, 0.0016, (x, 0.0062, 0.0), ALONG_Y)
        for pin in (-0.0095, 0.0095):
            yield cylinder("print_black", 0.006, 0.002, (x + pin, 0.0065, 0.0), ALONG_Y)


def _valve(color: str) -> Iterator[Part]:
    """A gas valve on a face at y = 0: a hose barb towards +y and a colored handle."""
    yield cylinder("brass", 0.03, 0.008, (0.0, 0.004, 0.0), ALONG_Y)
    yield rod("brass", 0.014, (0.0, 0.0, 0.0), (0.0, 0.035, 0.0))
    yield rod("brass", 0.009, (0.0, 0.030, 0.0), (0.0, 0.055, -0.02))
    yield block(color, (-0.006, 0.006), (0.012, 0.030), (0.008, 0.030))


def _turrets(host: Host, built_in: Sequence[OrientedBox]) -> Iterator[Supply]:
    """One turret for every 1.2 m of an island, on its middle line, where nothing stands."""
    depth = TURRET[1]
    top, (half, _) = host.asset.size.height, host.half
    wanted = max(1, int(2.0 * half / 1.2))
    parts: list[Part] = []
    outlets: list[Outlet] = []
    for k in range(wanted):
        preferred = -half + (k + 0.5) * 2.0 * half / wanted
        x = _free_place(host, built_in, preferred, half, [outlet.point[0] for outlet in outlets])
        if x is None:
            continue
        parts += moved(_turret(), x, 0.0, top)
        for side in (-1.0, 1.0):
            point = (x, side * (depth / 2.0 + 0.006), top + 0.07)
            outlets.append(Outlet(point, (0.0, side), (x, side * (depth / 2.0 + PLUG))))
    if parts:
        yield Supply("turret", tuple(parts), tuple(outlets))


def _free_place(
    host: Host, built_in: Sequence[OrientedBox], preferred: float, half: float, taken: list[float]
) -> float | None:
    """The free place on the middle line that is nearest to a preferred one, or None."""
    width, depth, height = TURRET
    top, reach = host.asset.size.height, half - width / 2.0 - 0.03
    steps = int(2.0 * reach / 0.02)
    places = sorted((-reach + k * 0.02 for k in range(steps + 1)), key=lambda x: (abs(x - preferred), x))
    for x in places:
        box = OrientedBox(x, 0.0, width + 2.0 * CLEAR, depth + 2.0 * (CLEAR + PLUG), 0.0, top + 0.001, top + height)
        clear = host.free(box) and not any(overlap(box, other) for other in built_in)
        if clear and all(abs(x - other) > 3.0 * width for other in taken):
            return x
    return None


def _turret() -> Iterator[Part]:
    """A service turret on z = 0 with a socket and a gas valve to both sides."""
    width, depth, height = TURRET
    hw, hd = width / 2.0, depth / 2.0
    yield block("trunking", (-hw, hw), (-hd, hd), (0.0, height - 0.012))
    yield block("plastic_dark", (-hw - 0.003, hw + 0.003), (-hd - 0.003, hd + 0.003), (height - 0.012, height))
    yield block("plastic_grey", (-hw - 0.006, hw + 0.006), (-hd - 0.006, hd + 0.006), (0.0, 0.008))
    for side in (0.0, math.pi):
        faced = [
            block("socket_plate", (-0.043, 0.043), (0.0, 0.006), (-0.043, 0.043)),
            cylinder("plastic_grey", 0.042, 0.0016, (0.0, 0.0062, 0.0), ALONG_Y),
            *(cylinder("print_black", 0.006, 0.002, (pin, 0.0065, 0.0), ALONG_Y) for pin in (-0.0095, 0.0095)),
        ]
        x, y = (0.0, hd) if side == 0.0 else (0.0, -hd)
        yield from moved(faced, x, y, 0.07, side)
        yield from moved(_valve("safety_yellow"), x, y, 0.18, side)


def plug(outlet: Outlet) -> Iterator[Part]:
    """Yield a plug in a socket."""
    (x, y, z), (dx, dy) = outlet.point, outlet.facing
    middle = (x + dx * PLUG / 2.0, y + dy * PLUG / 2.0, z)
    quaternion = ALONG_Y if abs(dy) > 0.5 else ALONG_X
    if abs(dx) > 0.5 and abs(dy) > 0.5:
        quaternion = turned((0.0, 0.0, 1.0), math.atan2(dy, dx))
    yield cylinder("cable_black", 0.034, PLUG, middle, quaternion)


@dataclass(frozen=True)
class Sink:
    """Parts of a sink with its tap, in the frame of the island, and the box around them."""

    parts: tuple[Part, ...]
    box: OrientedBox


def sinks(host: Host) -> Iterator[Sink]:
    """Yield the sink of an island in a laboratory, near one of its ends, unless something stands in all places."""
    if host.asset.shape.name != "island" or host.use != "laboratory" or host.asset.size.width < LEAST_ISLAND:
        return
    top, (half, _) = host.asset.size.height, host.half
    for side in (1.0, -1.0):
        for y in (0.0, 0.3, -0.3):
            x = side * (half - FROM_END)
            box = OrientedBox(
                x - side * TAP_GAP, y, LENGTH + 3.0 * TAP_GAP, WIDTH + 0.04, 0.0, top + 0.001, top + TAP + 0.03
            )
            if host.free(box):
                yield Sink(moved(_cup(), x, y, top, 0.0 if side > 0.0 else math.pi), box)
                return


def _cup() -> Iterator[Part]:
    """A cup sink let into a worktop at z = 0, with a tap on its -x side."""
    half, side = LENGTH / 2.0, WIDTH / 2.0
    for x in (-half, half - RIM):
        yield block("sink_black", (x, x + RIM), (-side, side), (0.0, 0.010))
    for y in (-side, side - RIM):
        yield block("sink_black", (-half + RIM, half - RIM), (y, y + RIM), (0.0, 0.010))
    yield block("plastic_black", (-half + RIM, half - RIM), (-side + RIM, side - RIM), (0.0, 0.0015))
    yield column("stainless", 0.05, 0.05, 0.0, (0.0015, 0.003))
    start, radius = -half - TAP_GAP, REACH / 2.0
    yield column("chrome", 0.045, start, 0.0, (0.0, 0.018))
    angles = [math.pi * k / 8 for k in range(9)]
    arch = [(start + radius - radius * math.cos(a), 0.0, TAP - radius - 0.009 + radius * math.sin(a)) for a in angles]
    yield hose("chrome", 0.018, [(start, 0.0, 0.01), *arch, (start + REACH, 0.0, 0.16)])
    yield rod("chrome", 0.010, (start, 0.0, 0.06), (start, 0.055, 0.07))
    yield column("signal_blue", 0.02, start, 0.052, (0.06, 0.08))
