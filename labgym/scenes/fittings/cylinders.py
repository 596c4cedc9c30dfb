"""Gas cylinders along walls: bracket and chains, and the line from the regulator to the building's pipe."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.shapes.parts import ALONG_Y, Part, Vector, block, column, cylinder, rod
from labgym.geometry import OrientedBox
from labgym.scenes.fittings.hosts import Backing, Host, Installation, overlap
from labgym.scenes.fittings.sweep import curve, hose

CATEGORY = "gas_cylinder"
CHAINS = (0.30, 0.68)
"""Heights of the chains as shares of the cylinder's height (assumption: lower and upper third)."""
LINK, WIRE = 0.022, 0.006
"""Length of a chain's link and diameter of its wire, meters."""
PANEL = 1.75
"""Height of the outlet panel on the wall, meters."""
PIPE = 0.012
"""Diameter of the pipe on the wall, meters."""


def cylinders(host: Host) -> Iterator[Installation]:
    """Yield bracket, chains and line of a gas cylinder that stands at a wall."""
    backing = host.backing
    if host.asset.subtype != CATEGORY or backing is None:
        return
    half = host.asset.size.width / 2.0
    if len(backing.free((-half - 0.06, half + 0.06), 0.3, PANEL + 0.2)) == 1:
        yield host.installation("restraint", _restraint(host, backing), backing.wall)
        place = _free_place(host, backing)
        if place is not None and host.ceiling > PANEL + 0.3:
            yield host.installation("gas_line", _line(host, backing, place), backing.wall)


def _restraint(host: Host, backing: Backing) -> Iterator[Part]:
    radius, height = host.asset.size.width / 2.0, host.asset.size.height
    wall = -radius - backing.gap
    reach = radius + 0.045
    for share in CHAINS:
        z = share * height
        yield block("galvanised", (-reach, reach), (wall, wall + min(0.008, backing.gap)), (z - 0.025, z + 0.025))
        for side in (-1.0, 1.0):
            yield block(
                "galvanised", (side * (reach - 0.02), side * reach), (wall, wall + 0.03), (z - 0.012, z + 0.012)
            )
        yield from _chain(radius + WIRE, reach - 0.01, wall + 0.028, z)


def _chain(radius: float, reach: float, back: float, z: float) -> Iterator[Part]:
    """Links from (-reach, back) around the front of a cylinder to (reach, back)."""
    slope = math.atan2(back, reach)
    touch = math.acos(min(1.0, radius / math.hypot(reach, back)))
    first = slope + touch
    steps = 24
    around = [first + (math.pi - 2.0 * first) * k / steps for k in range(steps + 1)]
    path: list[Vector] = [(reach, back, z)]
    path += [(radius * math.cos(a), radius * math.sin(a), z) for a in around]
    path.append((-reach, back, z))
    for k, (start, end) in enumerate(_links(path)):
        lift = 0.004 if k % 2 else -0.004
        yield rod("galvanised", WIRE, (start[0], start[1], z + lift), (end[0], end[1], z - lift))


def _links(path: list[Vector]) -> Iterator[tuple[Vector, Vector]]:
    """Cut a path into pieces of the length of a link, which overlap by a wire's diameter."""
    lengths = [math.dist(a, b) for a, b in pairwise(path)]
    count = max(1, round(sum(lengths) / (LINK - WIRE)))
    ends = [_at(path, lengths, k / count * sum(lengths)) for k in range(count + 1)]
    for start, end in pairwise(ends):
        share = WIRE / 2.0 / max(math.dist(start, end), 1e-9)
        dx, dy = (end[0] - start[0]) * share, (end[1] - start[1]) * share
        yield (start[0] - dx, start[1] - dy, start[2]), (end[0] + dx, end[1] + dy, end[2])


def _at(path: list[Vector], lengths: list[float], distance: float) -> Vector:
    for start, end, length in zip(path, path[1:], lengths, strict=False):
        if distance <= length:
            share = distance / length if length > 0.0 else 0.0
            x, y, z = (a + (b - a) * share for a, b in zip(start, end, strict=True))
            return x, y, z
        distance -= length
    return path[-1]


def _free_place(host: Host, backing: Backing) -> float | None:
    """Return where along the wall a pipe covers nothing that hangs there, near the cylinder's middle, or None."""
    radius = host.asset.size.width / 2.0
    wall = -radius - backing.gap
    for share in (0.35, -0.35, 1.2, -1.2, 2.0, -2.0):
        x = share * radius
        pipe = OrientedBox(x, wall + 0.03, 0.12, 0.06, 0.0, PANEL - 0.08, host.ceiling)
        if backing.free((x - 0.06, x + 0.06), PANEL, host.ceiling) == [(x - 0.06, x + 0.06)]:
            if not any(overlap(pipe, box) for box in host.mounted):
                return x
    return None


def _line(host: Host, backing: Backing, x: float) -> Iterator[Part]:
    """A hose from the regulator to a valve on the wall, and a pipe from there to the ceiling."""
    radius, height = host.asset.size.width / 2.0, host.asset.size.height
    wall = -radius - backing.gap
    yield block("trunking", (x - 0.05, x + 0.05), (wall, wall + 0.012), (PANEL - 0.07, PANEL + 0.07))
    yield cylinder("brass", 0.03, 0.05, (x, wall + 0.035, PANEL), ALONG_Y)
    yield block("signal_blue", (x - 0.03, x + 0.03), (wall + 0.058, wall + 0.066), (PANEL - 0.006, PANEL + 0.006))
    yield column("copper", PIPE, x, wall + 0.02, (PANEL, host.ceiling))
    clips = int((host.ceiling - PANEL) / 0.4)
    for k in range(1, clips + 1):
        z = PANEL + k * (host.ceiling - PANEL) / (clips + 1)
        yield block("plastic_grey", (x - 0.012, x + 0.012), (wall, wall + 0.03), (z - 0.006, z + 0.006))
    outlet: Vector = (0.0, radius * 0.8, height * 0.945)
    valve: Vector = (x, wall + 0.05, PANEL)
    path = curve(outlet, (radius * 0.9, 0.06, 0.02), (-0.05, -0.02, 0.25), valve)
    yield hose("copper", 0.006, path)
