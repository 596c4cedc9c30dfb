"""Stools, trolleys, cartons, drums, a pallet truck and a floor sign: objects that a push moves."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_X,
    Part,
    block,
    column,
    cylinder,
    revolved,
    rod,
    rounded,
    side_profile,
    span,
)
from labgym.assets.shapes.registry import choice, count, extents, flag, shape, text

TROLLEY_CASTOR_M = 0.12
"""Height of a trolley's castors, meters."""
RAIL_M = 0.06
"""Height of the rail around a tray, meters."""
TUBE_M = 0.022
"""Diameter of a trolley's tubes, meters."""


@shape("trolley")
def trolley(asset: Asset) -> Iterator[Part]:
    """A service trolley: trays with rails between four tubes, on castors."""
    _, _, height, hw, hd = extents(asset)
    half = TUBE_M / 2.0
    yield from castors(hw - 0.05, hd - 0.05, TROLLEY_CASTOR_M)
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield column("chrome", TUBE_M, sx * (hw - half), sy * (hd - half), (TROLLEY_CASTOR_M, height))
    trays = count(asset, "trays", 2)
    for k in range(trays):
        low = TROLLEY_CASTOR_M + k * (height - RAIL_M - 0.02 - TROLLEY_CASTOR_M) / max(trays - 1, 1)
        yield block("stainless", span(hw - half), span(hd - half), (low, low + 0.02))
        rail = low + RAIL_M
        for sign in (-1.0, 1.0):
            x, y = sign * (hw - half), sign * (hd - half)
            yield block("chrome", span(hw), span(half, y), (rail, rail + 0.02))
            yield block("chrome", span(half, x), span(hd), (rail, rail + 0.02))


@shape("cylinder_trolley")
def cylinder_trolley(asset: Asset) -> Iterator[Part]:
    """A gas cylinder strapped to a two-wheeled trolley."""
    _, _, height, hw, hd = extents(asset)
    wheel, radius = 0.25, 0.115
    y, back = hd - radius - 0.01, hd - 2.0 * radius - 0.03
    for sign in (-1.0, 1.0):
        yield cylinder("rubber", wheel, 0.05, (sign * (hw - 0.025), -hd + wheel / 2.0, wheel / 2.0), ALONG_X)
        yield rod("safety_yellow", 0.03, (sign * 0.14, back, 0.05), (sign * 0.14, back, height * 0.72))
        yield rod("safety_yellow", 0.03, (sign * 0.14, back, height * 0.72), (sign * 0.14, -hd + 0.016, height * 0.82))
    yield cylinder("galvanised", 0.03, 2.0 * hw - 0.1, (0.0, -hd + wheel / 2.0, wheel / 2.0), ALONG_X)
    yield rod("rubber", 0.032, (-0.14, -hd + 0.016, height * 0.82), (0.14, -hd + 0.016, height * 0.82))
    yield block("safety_yellow", span(0.16), (back, hd), (0.0, 0.04))
    shoulder, neck = height * 0.80, height * 0.90
    body = [(radius * 0.9, 0.04), (radius, 0.06), (radius, shoulder)]
    yield revolved(text(asset, "body", "gas_grey"), body, (0.0, y, 0.0))
    yield revolved(
        text(asset, "shoulder", "gas_black"),
        [(radius, shoulder), (radius * 0.6, height * 0.87), (0.03, neck)],
        (0.0, y, 0.0),
    )
    yield column("brass", 0.034, 0.0, y, (neck, height - 0.02))
    yield column("cast_iron", 0.065, 0.0, y, (height - 0.022, height))
    for z in (height * 0.3, height * 0.6):
        yield block("plastic_black", span(radius + 0.01), (back, y), (z, z + 0.04))


@shape("carton")
def carton(asset: Asset) -> Iterator[Part]:
    """A closed cardboard box with tape along its flaps and a label."""
    width, _, height, hw, hd = extents(asset)
    tape = 0.001
    yield block("cardboard", span(hw), (-hd, hd - tape), (0.0, height - tape))
    yield block("oil", span(hw), span(0.025), (height - tape, height))
    yield block("paper", (-0.3 * width, 0.0), (hd - tape, hd), (0.55 * height, 0.8 * height))


@shape("steel_drum")
def steel_drum(asset: Asset) -> Iterator[Part]:
    """A steel drum with rims, two rolling hoops and bungs."""
    width, _, height, *_ = extents(asset)
    rim, radius = width / 2.0, width / 2.0 - 0.008
    color = coating(text(asset, "colour", "blue"))
    profile = [(rim, 0.0), (rim, 0.015), (radius, 0.02)]
    for z in (height / 3.0, 2.0 * height / 3.0):
        profile += [(radius, z - 0.02), (rim, z - 0.005), (rim, z + 0.005), (radius, z + 0.02)]
    profile += [
        (radius, height - 0.025),
        (rim, height - 0.02),
        (rim, height),
        (radius, height),
        (radius, height - 0.015),
    ]
    yield revolved(color, profile)
    yield column("galvanised", 0.07, 0.65 * radius, 0.0, (height - 0.016, height - 0.004))
    yield column("galvanised", 0.04, -0.65 * radius, 0.0, (height - 0.016, height - 0.004))


@shape("pallet_truck")
def pallet_truck(asset: Asset) -> Iterator[Part]:
    """A hand pallet truck: two forks, a pump on steered wheels, an upright handle; the forks point along +y."""
    _, _, height, hw, hd = extents(asset)
    fork = 0.16
    heel = -hd + 0.36
    for sign in (-1.0, 1.0):
        x = sign * hw, sign * (hw - fork)
        yield block("safety_orange", x, (heel, hd), (0.035, 0.085))
        middle = sign * (hw - fork / 2.0)
        yield cylinder("rubber", 0.08, 0.07, (middle, hd - 0.15, 0.04), ALONG_X)
        yield cylinder("rubber", 0.18, 0.05, (sign * 0.06, -hd + 0.14, 0.09), ALONG_X)
    yield block("safety_orange", span(hw), (heel - 0.08, heel), (0.035, 0.42))
    yield column("cast_iron", 0.11, 0.0, -hd + 0.14, (0.18, 0.46))
    top = height - 0.02
    yield rod("safety_orange", 0.04, (0.0, -hd + 0.14, 0.44), (0.0, -hd + 0.02, top - 0.16))
    for sign in (-1.0, 1.0):
        yield rod("safety_orange", 0.03, (0.0, -hd + 0.02, top - 0.16), (sign * 0.15, -hd + 0.02, top - 0.04))
    yield rod("rubber", 0.04, (-0.15, -hd + 0.02, top), (0.15, -hd + 0.02, top))


@shape("floor_sign")
def floor_sign(asset: Asset) -> Iterator[Part]:
    """A folding sign that warns of a wet floor: two plates that lean against each other."""
    _, _, height, hw, hd = extents(asset)
    thick = 0.012
    for sign in (-1.0, 1.0):
        outline = [(sign * (hd - thick), 0.0), (sign * hd, 0.0), (sign * thick, height), (0.0, height)]
        yield side_profile("safety_yellow", outline if sign > 0 else outline[::-1], span(hw))
    slope = (hd - thick) / height
    for low, high in ((0.62, 0.86), (0.50, 0.57)):  # an exclamation mark on the front
        y0, y1 = hd - slope * low * height, hd - slope * high * height
        mark = [(y0 - 0.002, low * height), (y0 + 0.001, low * height)]
        mark += [(y1 + 0.001, high * height), (y1 - 0.002, high * height)]
        yield side_profile("print_black", mark, span(0.12 * hw))


@shape("stool")
def stool(asset: Asset) -> Iterator[Part]:
    """A round stool on a five-star base with a foot ring."""
    width, _, height, *_ = extents(asset)
    r = width / 2.0
    yield revolved(
        "seat", [(r * 0.74, height - 0.05), (r * 0.80, height - 0.03), (r * 0.78, height - 0.006), (r * 0.6, height)]
    )
    yield column("plastic_dark", r * 1.2, 0.0, 0.0, (height - 0.07, height - 0.05))
    yield column("chrome", 0.05, 0.0, 0.0, (0.07, height - 0.07))
    for k in range(5):
        angle = math.pi / 2.0 + k * 2.0 * math.pi / 5.0
        tip = (r - 0.024) * math.cos(angle), (r - 0.024) * math.sin(angle)
        yield rod("plastic_dark", 0.034, (0.0, 0.0, 0.075), (tip[0], tip[1], 0.050))
        yield column("rubber", 0.046, tip[0], tip[1], (0.0, 0.05))
    ring, z = r - 0.001, height * 0.38
    yield hollow_ring(ring, 0.020, z)
    for k in range(4):
        angle = math.pi / 4.0 + k * math.pi / 2.0
        yield rod(
            "chrome",
            0.014,
            (0.0, 0.0, z - 0.04),
            ((ring - 0.01) * math.cos(angle), (ring - 0.01) * math.sin(angle), z + 0.008),
        )


def hollow_ring(radius: float, thickness: float, z: float) -> Part:
    """A chrome ring of that outer radius round the z axis, its underside at z."""
    corners = [
        (radius - thickness, z),
        (radius - thickness * 0.3, z),
        (radius, z + thickness * 0.5),
        (radius - thickness * 0.3, z + thickness),
    ]
    return revolved("chrome", [*corners, (radius - thickness, z + thickness), corners[0]])


STOOL_BASES = ("star", "legs", "sled")
MODULAR_CASTOR_M = 0.11
"""Height of the castors of a trolley, meters."""
TRAYS = {"steel": "stainless", "wood": "oak"}
"""Materials of trays that are no color."""


@shape("modular_stool")
def modular_stool(asset: Asset) -> Iterator[Part]:
    """A stool or a laboratory chair.

    Parameters: `colour` of the seat; `base`: star (on castors), legs or sled (two runners); `back`, with a backrest;
    `round`, a round seat in place of a square one. `seat`, the height of the seat as a share of the total height.
    """
    _, _, height, hw, hd = extents(asset)
    seat = coating(text(asset, "colour", "blue"))
    base = choice(asset, "base", "star", STOOL_BASES, "base of a stool")
    back = flag(asset, "back")
    level = 0.62 * height if back else height
    if flag(asset, "round"):
        yield column(seat, 1.7 * hw, 0.0, 0.0, (level - 0.06, level))
    else:
        yield rounded(seat, span(0.86 * hw), span(0.86 * hd), (level - 0.06, level), 0.06)
    if back:
        yield block("powder_dark", span(0.03), (-hd + 0.02, -hd + 0.05), (level - 0.05, 0.86 * height))
        yield rounded(seat, span(0.75 * hw), (-hd, -hd + 0.06), (0.74 * height, height), 0.03)
    yield from _star(min(hw, hd), level) if base == "star" else _legs(base, hw, hd, level)


def _star(radius: float, level: float) -> Iterator[Part]:
    yield column("chrome", 0.05, 0.0, 0.0, (0.06, level - 0.06))
    for k in range(4):
        angle = k * math.pi / 2.0
        x, y = (radius - 0.025) * math.cos(angle), (radius - 0.025) * math.sin(angle)
        yield rod("aluminium", 0.036, (0.0, 0.0, 0.08), (x, y, 0.06))
        yield column("rubber", 0.05, x, y, (0.0, 0.05))


def _legs(base: str, hw: float, hd: float, level: float) -> Iterator[Part]:
    """Four upright tubes with a foot rest, on the floor or on two runners."""
    thick = 0.026
    for sx in (-1.0, 1.0):
        x = sx * (hw - thick / 2.0)
        for sy in (-1.0, 1.0):
            yield column("chrome", thick, x, sy * (hd - thick / 2.0), (0.0, level - 0.05))
        if base == "sled":
            yield block("chrome", span(thick / 2.0, x), span(hd), (0.0, thick))
        yield block("chrome", span(thick / 2.0, x), span(hd), (level - 0.08, level - 0.06))
    for y in (-0.4 * hd, 0.4 * hd):
        yield block("chrome", span(hw - thick), span(0.01, y), (level - 0.08, level - 0.06))
    yield block("chrome", span(hw), (hd - thick, hd), (0.32 * level, 0.32 * level + 0.02))


@shape("modular_trolley")
def modular_trolley(asset: Asset) -> Iterator[Part]:
    """A trolley with trays between corner posts.

    Parameters: `trays`; `tray`: steel, wood or a color; `frame`, a color; `closed`, with panels on three sides;
    `handle`, a bar at one end.
    """
    _, _, height, hw, hd = extents(asset)
    word = text(asset, "tray", "steel")
    tray = TRAYS[word] if word in TRAYS else coating(word)
    frame, post = coating(text(asset, "frame", "grey")), 0.03
    reach = hw - (0.06 if flag(asset, "handle") else 0.0)
    middle = reach - hw
    yield from castors(reach - 0.06, hd - 0.06, MODULAR_CASTOR_M)
    for sx in (-hw, 2.0 * reach - hw - post):
        for sy in (-hd, hd - post):
            yield block(frame, (sx, sx + post), (sy, sy + post), (MODULAR_CASTOR_M, height))
    trays, x = count(asset, "trays", 2), (-hw + post / 2.0, 2.0 * reach - hw - post / 2.0)
    for k in range(trays):
        low = MODULAR_CASTOR_M + k * (height - 0.04 - MODULAR_CASTOR_M) / max(trays - 1, 1)
        yield block(tray, (x[0] + 0.003, x[1] - 0.003), (-hd + post / 2.0, hd - post / 2.0 - 0.002), (low, low + 0.03))
    if flag(asset, "closed"):
        yield block(frame, (x[0], x[0] + 0.01), span(hd - post), (MODULAR_CASTOR_M, height - 0.01))
        yield block(frame, (x[1] - 0.01, x[1]), span(hd - post), (MODULAR_CASTOR_M, height - 0.01))
        yield block(frame, x, (-hd + 0.005, -hd + 0.015), (MODULAR_CASTOR_M, height - 0.01))
    if flag(asset, "handle"):
        yield block("chrome", (hw - 0.024, hw), span(0.8 * hd), (height - 0.03, height - 0.006))
        for y in (-0.7 * hd, 0.7 * hd):
            yield block(
                "chrome", (hw + 2.0 * middle - 0.002, hw - 0.02), span(0.01, y), (height - 0.03, height - 0.006)
            )
