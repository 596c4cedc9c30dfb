"""Parts of the building and wall-mounted objects: doors, windows, boards, clocks, hooks; the robot's stand-in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import frame, lines
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    block,
    column,
    cylinder,
    plate,
    rod,
    rounded,
    span,
    sphere,
    turned,
)
from labgym.assets.shapes.registry import count, extents, flag, shape


@shape("door")
def door(asset: Asset) -> Iterator[Part]:
    """A door with a glass panel, a kick plate and a lever."""
    _, _, height, hw, hd = extents(asset)
    jamb, leaf = 0.06, (-hd, hd - 0.02)
    for x in ((-hw, -hw + jamb), (hw - jamb, hw)):
        yield block("door_frame", x, span(hd), (0.0, height))
    yield block("door_frame", span(hw - jamb), span(hd), (height - jamb, height))
    yield block("door_leaf", span(hw - jamb), leaf, (0.005, height - jamb))
    yield block(
        "window_glass", (hw * 0.15, hw * 0.60), (leaf[1] - 0.001, leaf[1] + 0.002), (height * 0.45, height * 0.85)
    )
    yield block("stainless", span(hw * 0.8), (leaf[1], leaf[1] + 0.002), (0.02, 0.22))
    yield rod("stainless", 0.016, (-hw * 0.75, hd - 0.009, height * 0.49), (-hw * 0.52, hd - 0.009, height * 0.49))


@shape("window")
def window(asset: Asset) -> Iterator[Part]:
    """A two-casement window with daylight behind the panes, and a sill."""
    _, _, height, hw, hd = extents(asset)
    rail = 0.05
    y = (-hd, hd - 0.04)
    for x in ((-hw, -hw + rail), (-rail / 2.0, rail / 2.0), (hw - rail, hw)):
        yield block("plastic_white", x, y, (0.03, height))
    for z in ((0.03, 0.03 + rail), (height - rail, height)):
        for x in ((-hw + rail, -rail / 2.0), (rail / 2.0, hw - rail)):
            yield block("plastic_white", x, y, z)
    for x in ((-hw + rail, -rail / 2.0), (rail / 2.0, hw - rail)):
        yield block("daylight", x, (-hd, -hd + 0.01), (0.03 + rail, height - rail))
    yield block("plastic_light", span(hw), span(hd), (0.0, 0.03))


@shape("whiteboard")
def whiteboard(asset: Asset) -> Iterator[Part]:
    """A whiteboard with writing and a pen tray, or with `cork` a notice board with papers."""
    width, _, height, hw, hd = extents(asset)
    rail = 0.018
    cork = flag(asset, "cork")
    face = hd - (0.006 if cork else 0.012)
    yield block("cork" if cork else "paper", span(hw - rail), (-hd, face), (rail, height - rail))
    yield from frame(
        "oak" if cork else "aluminium", span(hw), (-hd, hd - (0.0 if cork else 0.008)), (0.0, height), rail
    )
    if cork:
        papers = (
            (-0.62, 0.62, "paper"),
            (-0.12, 0.68, "safety_yellow"),
            (0.40, 0.60, "paper"),
            (-0.40, 0.24, "silicone_blue"),
            (0.20, 0.26, "paper"),
            (0.70, 0.30, "safety_yellow"),
        )
        for share, up, color in papers:
            across, high = share * hw, up * height
            yield block(color, span(0.065, across), (face, face + 0.001), span(0.09, high))
            yield from lines(0.10, 0.11, 5, across, face + 0.001, high - 0.01)
            yield cylinder("abs_red", 0.012, 0.004, (across, face + 0.003, high + 0.078), ALONG_Y)
        return
    yield block("aluminium", span(hw * 0.4), (face, hd), (rail, rail + 0.012))
    for k, color in enumerate(("abs_blue", "abs_red", "print_black")):
        yield cylinder(color, 0.010, 0.10, (-0.15 + 0.14 * k, hd - 0.006, rail + 0.017), ALONG_X)
    yield from lines(width * 0.36, height * 0.30, 6, hw * 0.45, face, height * 0.66)
    center, ring = (-hw * 0.45, height * 0.55), 0.11
    for k in range(6):
        a, b = k * math.pi / 3.0, (k + 1) * math.pi / 3.0
        start = (center[0] + ring * math.sin(a), center[1] + ring * math.cos(a))
        end = (center[0] + ring * math.sin(b), center[1] + ring * math.cos(b))
        middle = ((start[0] + end[0]) / 2.0, face + 0.0005, (start[1] + end[1]) / 2.0)
        tilt = math.atan2(end[1] - start[1], end[0] - start[0])
        yield plate("abs_blue", (ring, 0.001, 0.008), middle, turned((0.0, 1.0, 0.0), -tilt))


@shape("clock")
def clock(asset: Asset) -> Iterator[Part]:
    """A round wall clock at ten past ten."""
    width, depth, height, *_ = extents(asset)
    hd, z = depth / 2.0, height / 2.0
    yield cylinder("plastic_black", min(width, height), depth - 0.006, (0.0, -0.003, z), ALONG_Y)
    yield cylinder("paper", min(width, height) * 0.90, depth - 0.004, (0.0, -0.002, z), ALONG_Y)
    face = hd - 0.003
    radius = min(width, height) * 0.40
    for k in range(12):
        angle = k * math.pi / 6.0
        at = (radius * math.sin(angle), face, z + radius * math.cos(angle))
        yield plate("print_black", (0.006, 0.002, 0.020), at, turned((0.0, 1.0, 0.0), angle))
    # Seen from the front, +x is to the left, so the hands' angles run the other way.
    for angle, length, thick in ((math.radians(55.0), 0.55, 0.010), (math.radians(-60.0), 0.85, 0.007)):
        at = (0.5 * length * radius * math.sin(angle), hd - 0.001, z + 0.5 * length * radius * math.cos(angle))
        yield plate("print_black", (thick, 0.002, length * radius), at, turned((0.0, 1.0, 0.0), angle))


@shape("coat_hooks")
def coat_hooks(asset: Asset) -> Iterator[Part]:
    """A board of coat hooks."""
    width, _, height, hw, hd = extents(asset)
    yield block("oak", span(hw), (-hd, -hd + 0.018), (0.02, height))
    hooks = count(asset, "hooks", 6)
    for k in range(hooks):
        x = -hw + (k + 0.5) * width / hooks
        yield rod("chrome", 0.012, (x, -hd + 0.015, height * 0.55), (x, hd - 0.006, height * 0.45))
        yield sphere("chrome", 0.018, (x, hd - 0.009, height * 0.52))
        yield rod("chrome", 0.010, (x, -hd + 0.015, height * 0.4), (x, -hd + 0.05, 0.002))


@shape("robot")
def robot(asset: Asset) -> Iterator[Part]:
    """A mobile manipulator at rest: a round base, a column, a folded arm."""
    width, depth, height, *_ = extents(asset)
    radius = min(width, depth) / 2.0
    yield rounded("plastic_dark", span(width / 2.0), span(depth / 2.0), (0.03, 0.10), radius * 0.7)
    yield rounded("plastic_white", span(width * 0.48), span(depth * 0.48), (0.10, 0.34), radius * 0.7)
    yield column("screen_dark", 0.10, 0.0, depth * 0.30, (0.34, 0.40))
    for side in (-1.0, 1.0):
        yield cylinder("rubber", 0.15, 0.04, (side * radius * 0.75, 0.0, 0.075), ALONG_X)
    yield rounded("plastic_white", span(0.09), (-0.15, 0.03), (0.34, height * 0.80), 0.04)
    joints = [(0.0, 0.06, height * 0.72), (0.13, 0.20, height * 0.60), (0.0, 0.24, height * 0.44)]
    for start, end in pairwise(joints):
        yield rod("plastic_light", 0.07, start, end)
    for at in joints:
        yield sphere("abs_blue", 0.085, at)
    yield block("plastic_dark", span(0.04), (0.21, 0.27), (height * 0.36, height * 0.42))
    yield block("plastic_dark", span(0.02), (-0.09, -0.05), (height * 0.80, height * 0.92))
    yield rounded("plastic_white", span(0.11), (-0.11, -0.01), (height * 0.90, height), 0.03)
    yield block("screen_dark", span(0.09), (-0.012, -0.006), (height * 0.925, height * 0.975))


@shape("glass_screen")
def glass_screen(asset: Asset) -> Iterator[Part]:
    """A sheet of glass that stands on the floor; `frame` gives it a metal frame."""
    _, _, height, hw, hd = extents(asset)
    rail = 0.04 if flag(asset, "frame") else 0.0
    if rail:
        yield from frame("stainless", span(hw), span(hd), (0.0, height), rail)
    yield block("window_glass", span(hw - rail), span(hd), (rail, height - rail))
