"""Bench devices that heat or cool: hotplates, mantles, baths, burners, ovens, the rotary evaporator."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import feet, knob, panel_screen
from labgym.assets.shapes.joints import door, hidden, moving
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    block,
    column,
    cylinder,
    ellipsoid,
    revolved,
    rod,
    rounded,
    side_profile,
    span,
    tube,
    turned,
)
from labgym.assets.shapes.registry import choice, extents, flag, shape
from labgym.assets.shapes.vessels import bulb, hollow


@shape("hotplate")
def hotplate(asset: Asset) -> Iterator[Part]:
    """A magnetic stirrer with a plate behind a sloping control panel; `heating` gives it two knobs and a display."""
    width, depth, height, hw, hd = extents(asset)
    heated = flag(asset, "heating")
    low = height * 0.36
    outline = [(-hd, 0.006), (hd, 0.006), (hd, low), (hd * 0.42, height * 0.80), (-hd, height * 0.80)]
    yield side_profile("plastic_light", outline, span(hw))
    yield from feet(hw * 0.8, hd * 0.85, 0.006)
    plate = width * 0.94
    middle = -hd + plate / 2.0 + 0.004
    yield column("porcelain" if heated else "stainless", plate, 0.0, middle, (height * 0.84, height))
    yield column("plastic_dark", plate * 0.9, 0.0, middle, (height * 0.78, height * 0.86))
    slope = math.atan2(height * 0.80 - low, hd * 0.58)
    facing = turned((1.0, 0.0, 0.0), -slope)
    at_y, at_z = hd * 0.72, low + (hd - hd * 0.72) / (hd * 0.58) * (height * 0.80 - low)
    for x in (-hw * 0.58, hw * 0.58) if heated else (hw * 0.5,):
        yield cylinder("plastic_dark", width * 0.20, 0.016, (x, at_y, at_z + 0.004), facing)
        yield cylinder(
            "safety_red" if heated and x < 0 else "abs_blue", width * 0.13, 0.018, (x, at_y, at_z + 0.004), facing
        )
    yield Part("box", (width * 0.26, depth * 0.10, 0.004), (0.0, at_y, at_z), facing, "screen_green")


@shape("mantle")
def heating_mantle(asset: Asset) -> Iterator[Part]:
    """A heating mantle: a round housing with a woven nest, and a knob in front."""
    width, depth, height, *_ = extents(asset)
    radius = width / 2.0
    body = radius * 0.90
    housing = [(radius, 0.0), (radius, 0.012), (body, 0.022), (body, height * 0.8), (body * 0.95, height)]
    nest = [(r * 0.62, height - (1.0 - z) * 0.62 * height) for r, z in bulb(1.0, 1.0, 0.0, math.pi / 2.0, 6)]
    rim = (nest[-1][0] * radius, height)
    yield revolved("powder_white", [(0.0, 0.0), *housing, rim, *[(r * radius, z) for r, z in reversed(nest[:-1])]])
    yield hollow("foam", [(r * radius, z) for r, z in nest], 0.004)
    front = depth / 2.0 - 0.006
    yield block("plastic_dark", span(body * 0.36), (body * 0.8, front), (height * 0.2, height * 0.66))
    yield from knob("safety_red", height * 0.26, 0.0, front, depth / 2.0, height * 0.43)


CONTENTS = {
    "oil": ("oil", "borosilicate"),
    "water": ("clear_liquid", "stainless"),
    "sand": ("sand", "stainless"),
    "ice": ("ice", "plastic_grey"),
}
"""Material of a bath's content, and of the round vessel that holds it."""


@shape("bath")
def bath(asset: Asset) -> Iterator[Part]:
    """A bath of oil, water, sand or ice; `controller` gives it a housing with a display, `dewar` a vacuum wall."""
    width, _, height, hw, hd = extents(asset)
    filling, vessel = CONTENTS[choice(asset, "content", "water", CONTENTS, "bath content")]
    if not flag(asset, "controller"):
        yield from _round_bath(width / 2.0, height, filling, "cabinet_blue" if flag(asset, "dewar") else vessel)
        return
    lid = flag(asset, "lid")
    rim = height * (0.80 if lid else 0.92)
    yield rounded("stainless" if lid else "powder_grey", span(hw), (-hd, hd - 0.012), (0.012, rim), 0.02)
    yield from feet(hw * 0.82, hd * 0.8, 0.012)
    yield block("plastic_dark", span(hw * 0.9), (hd - 0.014, hd - 0.006), (height * 0.12, height * 0.42))
    yield from panel_screen("screen_green", (-hw * 0.7, -hw * 0.05), hd - 0.006, (height * 0.18, height * 0.36))
    yield from knob("plastic_light", min(0.035, height * 0.2), hw * 0.5, hd - 0.006, hd, height * 0.27)
    inner_x, inner_y = hw - 0.025, hd - 0.035
    if lid:
        yield rounded("stainless", span(inner_x), span(inner_y), (rim, height - 0.025), 0.03)
        yield block("plastic_black", span(0.05), span(0.01), (height - 0.026, height))
        return
    for x0, x1, y0, y1 in (
        (-hw, -inner_x, -hd, hd - 0.012),
        (inner_x, hw, -hd, hd - 0.012),
        (-inner_x, inner_x, -hd, -inner_y),
        (-inner_x, inner_x, inner_y, hd - 0.012),
    ):
        yield block("stainless", (x0, x1), (y0, y1), (rim, height))
    yield block(filling, span(inner_x), span(inner_y), (rim - 0.02, height - 0.008))


def _round_bath(radius: float, height: float, filling: str, shell: str) -> Iterator[Part]:
    wall = 0.010 if shell == "cabinet_blue" else 0.003
    outline = [
        (0.0, 0.0),
        (radius * 0.9, 0.0),
        (radius * 0.97, height * 0.06),
        (radius * 0.97, height - 0.008),
        (radius, height),
    ]
    yield hollow(shell, outline, wall)
    level = height * (0.78 if filling == "ice" else 0.6)
    yield column(filling, 1.94 * radius - 2.2 * wall, 0.0, 0.0, (wall + 0.001, level))
    if filling == "ice":
        for k in range(7):
            angle, reach = 2.4 * k, radius * (0.2 + 0.09 * k)
            tilt = turned((math.cos(angle), math.sin(angle), 0.0), 0.6)
            yield Part(
                "box", (0.03, 0.026, 0.022), (reach * math.cos(angle), reach * math.sin(angle), level), tilt, "ice"
            )


@shape("gun")
def heat_gun(asset: Asset) -> Iterator[Part]:
    """A heat gun on its foot: barrel along x, nozzle to +x, handle below."""
    width, depth, height, *_ = extents(asset)
    hw, r = width / 2.0, depth / 2.0
    axis = height - r
    yield cylinder("abs_blue", depth, width * 0.5, (-hw + width * 0.25, 0.0, axis), ALONG_X)
    yield revolved(
        "stainless",
        [(r * 0.8, width * 0.5), (r * 0.55, width * 0.7), (r * 0.55, width)],
        (-hw, 0.0, axis),
        turned((0.0, 1.0, 0.0), math.pi / 2.0),
    )
    yield rounded("plastic_dark", (-hw * 0.75, -hw * 0.28), span(r * 0.55), (0.0, axis), 0.02)
    yield block("safety_red", (-hw * 0.28, -hw * 0.20), span(r * 0.3), (height * 0.42, height * 0.55))


@shape("burner")
def burner(asset: Asset) -> Iterator[Part]:
    """A Bunsen burner with a small blue flame, or without `gas` an alcohol lamp."""
    width, depth, height, *_ = extents(asset)
    radius = width / 2.0
    flame = [(height * 0.02, height * 0.80), (height * 0.05, height * 0.86), (0.0, height)]
    if flag(asset, "gas"):
        yield revolved("cast_iron", [(radius, 0.0), (radius, height * 0.06), (radius * 0.35, height * 0.14)])
        yield column("brass", 0.014, 0.0, 0.0, (height * 0.1, height * 0.80))
        yield column("chrome", 0.022, 0.0, 0.0, (height * 0.22, height * 0.32))
        yield cylinder("brass", 0.009, depth / 2.0, (0.0, -depth / 4.0, height * 0.18), ALONG_Y)
    else:
        yield revolved(
            "thick_glass",
            [(radius * 0.8, 0.0), (radius, height * 0.12), (radius, height * 0.4), (radius * 0.3, height * 0.62)],
        )
        yield column("blue_liquid", radius * 1.5, 0.0, 0.0, (0.003, height * 0.3))
        yield column("brass", radius * 0.6, 0.0, 0.0, (height * 0.58, height * 0.70))
        yield column("foam", 0.006, 0.0, 0.0, (height * 0.7, height * 0.82))
    yield revolved("flame_blue", flame)


@shape("oven")
def oven(asset: Asset) -> Iterator[Part]:
    """A drying oven: a door with a window and a bar handle under a control strip; `round_window` is a vacuum oven."""
    _, _, height, hw, hd = extents(asset)
    face = hd - 0.028
    yield rounded("powder_white", span(hw), (-hd, face - 0.02), (0.025, height), 0.012)
    yield from feet(hw * 0.85, hd * 0.8, 0.025)
    strip = height * 0.80
    yield block("plastic_dark", span(hw), (face - 0.02, face), (strip + 0.01, height - 0.004))
    yield from panel_screen("screen_green", span(0.09), face, (strip + 0.035, height - 0.03))
    for x in (-hw * 0.7, hw * 0.7):
        yield from knob("plastic_light", 0.035, x, face, face + 0.018, (strip + height) / 2.0 + 0.003)
    leaf = (-hw + 0.006, hw - 0.006), (face - 0.02, face), (0.04, strip)
    joint = door("door", "appliance door", leaf, "low")
    yield from moving(joint, [rounded("powder_white", *leaf, 0.008)])
    yield from moving(joint, _oven_window(asset, face))
    yield from moving(joint, _oven_handle(hw * 0.84, face, hd, height))
    chamber = (-hw + 0.05, hw - 0.05), (face - 0.02, face - 0.019), (0.08, strip - 0.04)
    yield from hidden([block("powder_dark", *chamber)])


def _oven_window(asset: Asset, face: float) -> Iterator[Part]:
    width, _, height, *_ = extents(asset)
    hw = width / 2.0
    if flag(asset, "round_window"):
        size = min(width, height) * 0.42
        yield cylinder("powder_dark", size, 0.006, (0.0, face + 0.003, height * 0.42), ALONG_Y)
        yield cylinder("window_glass", size * 0.85, 0.004, (0.0, face + 0.008, height * 0.42), ALONG_Y)
        yield cylinder("screen_dark", size * 0.84, 0.004, (0.0, face + 0.005, height * 0.42), ALONG_Y)
    elif flag(asset, "window"):
        yield block("powder_dark", span(hw * 0.62), (face, face + 0.004), (height * 0.22, height * 0.66))
        yield block("screen_dark", span(hw * 0.54), (face + 0.004, face + 0.006), (height * 0.26, height * 0.62))


def _oven_handle(x: float, face: float, front: float, height: float) -> Iterator[Part]:
    yield rod("stainless", 0.014, (x, front - 0.007, height * 0.22), (x, front - 0.007, height * 0.66))
    for z in (height * 0.26, height * 0.62):
        yield cylinder("stainless", 0.010, front - 0.007 - face, (x, (front - 0.007 + face) / 2.0, z), ALONG_Y)


@shape("furnace")
def muffle_furnace(asset: Asset) -> Iterator[Part]:
    """A muffle furnace: an insulated box with a lift door over a control base, and a flue."""
    width, _, height, hw, hd = extents(asset)
    base, top = height * 0.26, height - 0.04
    yield rounded("powder_grey", span(hw), (-hd, hd - 0.05), (0.0, base), 0.012)
    yield rounded("powder_white", span(hw), (-hd, hd - 0.06), (base + 0.006, top), 0.02)
    yield block("plastic_dark", span(hw * 0.9), (hd - 0.05, hd - 0.046), (base * 0.2, base * 0.85))
    yield from panel_screen("screen_green", (0.0, hw * 0.7), hd - 0.046, (base * 0.4, base * 0.75))
    yield from knob("safety_red", 0.04, -hw * 0.6, hd - 0.046, hd - 0.025, base * 0.55)
    yield rounded("stainless", span(hw * 0.78), (hd - 0.06, hd - 0.022), (base + 0.06, top - 0.05), 0.006)
    yield cylinder("powder_dark", 0.05, 0.004, (0.0, hd - 0.020, (base + top) / 2.0), ALONG_Y)
    for x in (-hw * 0.5, hw * 0.5):
        yield block("stainless", span(0.008, x), (hd - 0.024, hd - 0.010), (base + 0.09, base + 0.11))
    yield cylinder("plastic_black", 0.020, width * 0.6, (0.0, hd - 0.010, base + 0.10), ALONG_X)
    yield column("galvanised", 0.07, 0.0, -hd * 0.5, (top, height))


@shape("rotavap")
def rotary_evaporator(asset: Asset) -> Iterator[Part]:
    """A rotary evaporator: tower, tilted flask over a heated bath, upright condenser, receiving flask."""
    _, _, height, hw, hd = extents(asset)
    k = hw / 0.3  # scale of the glass and the bath: 1 for an evaporator of 0.6 m
    yield rounded("plastic_white", span(hw), span(hd), (0.0, 0.05), 0.03)
    yield block("plastic_dark", span(hw * 0.25), (hd - 0.012, hd - 0.004), (0.012, 0.045))
    yield block("screen", span(hw * 0.14), (hd - 0.005, hd - 0.001), (0.016, 0.042))
    bath_x, bath_r, rim = hw - 0.135 * k, 0.125 * k, 0.20 * k
    yield hollow("plastic_light", [(0.0, 0.05), (bath_r, 0.05), (bath_r, rim)], 0.010, (bath_x, 0.0, 0.0))
    yield column("clear_liquid", 2.0 * bath_r - 0.022, bath_x, 0.0, (0.062, 0.175 * k))
    yield column("stainless", 2.0 * bath_r - 0.018, bath_x, 0.0, (rim - 0.002, rim + 0.0005))
    tower = (-0.06 * k, -hd * 0.35)
    yield rounded("plastic_white", span(0.045 * k, tower[0]), (-hd, -hd + 0.12), (0.05, height * 0.78), 0.02)
    head_z = height * 0.60
    yield rounded("plastic_grey", (-0.15 * k, 0.03 * k), (-hd * 0.75, hd * 0.35), span(0.05, head_z), 0.03)
    yield from panel_screen("screen", (-0.125, -0.02), hd * 0.35, (head_z - 0.025, head_z + 0.03))
    lean = math.radians(122.0)
    reach = 0.205 * k
    flask = [(0.011 * k, 0.0), (0.011 * k, 0.12 * k)]
    flask += [
        (0.078 * k * math.sin(a), reach - 0.078 * k * math.cos(a))
        for a in [0.16 + (math.pi - 0.16) * step / 10 for step in range(11)]
    ]
    start = (0.01, 0.0, head_z - 0.005)
    yield revolved("borosilicate", flask, start, turned((0.0, 1.0, 0.0), lean))
    center = (start[0] + reach * math.sin(lean), 0.0, start[2] + reach * math.cos(lean))
    yield ellipsoid("yellow_liquid", (0.115 * k, 0.115 * k, 0.08 * k), (center[0], 0.0, center[2] - 0.032 * k))
    cx = -0.19 * k
    jacket = [
        (0.020 * k, 0.0),
        (0.045 * k, 0.035 * k),
        (0.045 * k, height - head_z - 0.06),
        (0.018 * k, height - head_z - 0.02),
        (0.018 * k, height - head_z),
    ]
    yield revolved("borosilicate", jacket, (cx, 0.0, head_z))
    for turn in range(5):
        coil = (head_z + 0.045 * k + 0.03 * k * turn, head_z + 0.060 * k + 0.03 * k * turn)
        yield column("clear_liquid", 0.060 * k, cx, 0.0, coil)
    yield rod("borosilicate", 0.030 * k, (cx, 0.0, head_z), (cx + 0.10 * k, 0.0, head_z), flat=True)
    receiver, hung = 0.062 * k, head_z - 0.06 * k
    yield column("borosilicate", 0.024 * k, cx, 0.0, (head_z - 0.07 * k, head_z + 0.02))
    yield revolved("borosilicate", bulb(receiver, hung - receiver, 0.0, math.pi - 0.2, 9), (cx, 0.0, 0.0))
    yield column("clear_liquid", receiver * 1.6, cx, 0.0, (hung - 1.7 * receiver, hung - 1.2 * receiver))
    yield from tube(
        "silicone_blue",
        0.012,
        [(cx, -0.04, height - 0.05), (cx - 0.06, -hd * 0.6, height * 0.6), (cx - 0.06, -hd * 0.8, 0.056)],
    )
