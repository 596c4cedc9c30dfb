"""Cup sinks with taps on islands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from labgym.assets.shapes.parts import Part, block, column, rod
from labgym.geometry import OrientedBox
from labgym.scenes.fittings.hosts import Host
from labgym.scenes.fittings.installation import moved
from labgym.scenes.fittings.sweep import hose

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
