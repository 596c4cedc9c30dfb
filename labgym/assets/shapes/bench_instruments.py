"""Bench instruments with an individual form: balances, microscope, mixers, stirrer, screens."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import curve_screen, feet, knob, panel_screen
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    block,
    column,
    cylinder,
    plate,
    revolved,
    rod,
    rounded,
    side_profile,
    span,
    turned,
)
from labgym.assets.shapes.registry import extents, flag, shape


@shape("balance")
def balance(asset: Asset) -> Iterator[Part]:
    """A balance with a pan and a sloping display; `shield` puts the pan in a glass draft shield."""
    width, _, height, hw, hd = extents(asset)
    shield = flag(asset, "shield")
    deck = height * 0.24 if shield else height * 0.74
    step = hd * 0.30
    yield side_profile(
        "plastic_white", [(-hd, 0.008), (hd, 0.008), (hd, deck * 0.45), (step, deck), (-hd, deck)], span(hw)
    )
    yield from feet(hw * 0.8, hd * 0.85, 0.008)
    facing = turned((1.0, 0.0, 0.0), -math.atan2(deck * 0.55, hd - step))
    middle = (hd + step) / 2.0
    yield plate("screen_dark", (width * 0.62, (hd - step) * 0.62, 0.004), (0.0, middle, deck * 0.725 + 0.001), facing)
    yield plate(
        "display_lcd", (width * 0.5, (hd - step) * 0.36, 0.004), (0.0, middle - 0.006, deck * 0.725 + 0.005), facing
    )
    center = (step - hd) / 2.0
    yield column("stainless", 0.03, 0.0, center, (deck, deck + 0.012))
    if not shield:
        pan = min(width * 0.86, (hd + step) * 0.9)
        yield block("stainless", span(pan / 2.0), span(pan / 2.0, center), (height - 0.010, height))
        yield block("plastic_dark", span(pan * 0.2), span(pan * 0.2, center), (deck, height - 0.008))
        return
    yield column("stainless", 0.09, 0.0, center, (deck + 0.010, deck + 0.016))
    x, y0, y1, top = hw - 0.006, -hd + 0.006, step - 0.004, height - 0.012
    for side in (-1.0, 1.0):
        yield block("sash_glass", (side * x, side * (x - 0.004)), (y0, y1), (deck, top))
        for y in (y0, y1):
            yield column("plastic_dark", 0.010, side * (x - 0.002), y, (deck, height))
    yield block("sash_glass", span(x), (y1 - 0.004, y1), (deck, top))
    yield block("plastic_white", span(x - 0.001), (y0 - 0.004, y0 + 0.03), (deck, height - 0.002))
    yield block("plastic_dark", span(x - 0.002), (y0, y1), (top, height - 0.004))


@shape("microscope")
def microscope(asset: Asset) -> Iterator[Part]:
    """A light microscope: foot with lamp, stage, objectives, inclined eyepieces."""
    _, _, height, hw, hd = extents(asset)
    yield rounded("plastic_white", span(hw * 0.8), span(hd), (0.0, height * 0.10), 0.04)
    yield column("lamp", 0.05, 0.0, hd * 0.25, (height * 0.10, height * 0.13))
    yield rounded("plastic_white", span(hw * 0.32), (-hd, -hd * 0.45), (height * 0.10, height * 0.80), 0.02)
    yield block("plastic_black", span(hw * 0.72), (-hd * 0.4, hd * 0.75), (height * 0.36, height * 0.39))
    yield rounded("plastic_white", span(hw * 0.36), (-hd, hd * 0.45), (height * 0.72, height * 0.84), 0.02)
    for dx in (-0.022, 0.022):
        yield column("chrome", 0.018, dx, hd * 0.25, (height * 0.48, height * 0.64))
    yield column("plastic_dark", 0.07, 0.0, hd * 0.25, (height * 0.63, height * 0.72))
    for dx in (-0.03, 0.03):
        yield rod("plastic_black", 0.030, (dx, hd * 0.15, height * 0.80), (dx, hd * 0.72, height - 0.007))
    for side in (-1.0, 1.0):
        yield cylinder("plastic_black", 0.05, hw * 0.66, (side * hw * 0.67, -hd * 0.5, height * 0.24), ALONG_X)


@shape("mixer")
def mixer(asset: Asset) -> Iterator[Part]:
    """A vortex mixer, or with `platform` an orbital shaker with a rubber-topped tray."""
    width, _, height, hw, hd = extents(asset)
    if flag(asset, "platform"):
        top = height * 0.66
        yield rounded("plastic_white", span(hw), (-hd, hd - 0.010), (0.010, top), 0.02)
        yield from feet(hw * 0.85, hd * 0.85, 0.010)
        yield from panel_screen("screen_green", (-hw * 0.35, hw * 0.1), hd - 0.010, (height * 0.22, height * 0.48))
        yield from knob("plastic_dark", height * 0.28, hw * 0.55, hd - 0.010, hd, height * 0.35)
        yield column("stainless", 0.05, 0.0, -0.01, (top, height * 0.82))
        yield block("aluminium", span(hw * 0.95), (-hd * 0.97, hd * 0.90), (height * 0.80, height * 0.88))
        yield block("rubber", span(hw * 0.90), (-hd * 0.92, hd * 0.85), (height * 0.88, height))
        return
    yield side_profile(
        "plastic_grey",
        [
            (-hd, 0.008),
            (hd, 0.008),
            (hd, height * 0.35),
            (hd * 0.4, height * 0.68),
            (-hd * 0.7, height * 0.68),
            (-hd, height * 0.5),
        ],
        span(hw),
    )
    yield from feet(hw * 0.75, hd * 0.8, 0.008)
    yield revolved(
        "rubber",
        [
            (width * 0.20, height * 0.66),
            (width * 0.28, height * 0.94),
            (width * 0.28, height),
            (width * 0.12, height * 0.95),
        ],
        (0.0, -hd * 0.15, 0.0),
    )
    yield cylinder("abs_blue", 0.035, 0.012, (0.0, hd * 0.76, height * 0.48), turned((1.0, 0.0, 0.0), -0.75))


@shape("overhead_stirrer")
def overhead_stirrer(asset: Asset) -> Iterator[Part]:
    """An overhead stirrer motor with display and knob, and its chuck and shaft below."""
    width, depth, height, hw, hd = extents(asset)
    low = height * 0.40
    yield rounded("plastic_light", span(hw), (-hd * 0.45, hd - 0.012), (low, height), 0.02)
    yield from panel_screen("screen_green", span(hw * 0.6), hd - 0.012, (height * 0.74, height * 0.90))
    yield from knob("plastic_dark", width * 0.4, 0.0, hd - 0.012, hd, height * 0.56)
    yield cylinder("stainless", 0.014, depth * 0.3, (0.0, -hd + depth * 0.15, height * 0.7), ALONG_Y)
    yield column("chrome", 0.030, 0.0, hd * 0.25, (low - 0.03, low + 0.005))
    yield column("stainless", 0.008, 0.0, hd * 0.25, (0.012, low))
    yield block("stainless", span(hw * 0.75), span(0.002, hd * 0.25), (0.0, 0.022))


@shape("monitor")
def monitor(asset: Asset) -> Iterator[Part]:
    """A flat screen on a stand, showing a chromatogram."""
    _, _, height, hw, hd = extents(asset)
    low, face = height * 0.24, hd * 0.25
    yield rounded("plastic_dark", span(hw * 0.42), span(hd), (0.0, 0.012), 0.03)
    yield block("plastic_dark", span(0.035), (-hd * 0.4, -hd * 0.2), (0.012, height * 0.6))
    yield block("plastic_black", span(hw), (-hd * 0.2, face), (low, height))
    yield from curve_screen(span(hw - 0.012), face, (low + 0.016, height - 0.012))


@shape("laptop")
def laptop(asset: Asset) -> Iterator[Part]:
    """An open laptop, its screen leaning back."""
    width, _, height, hw, hd = extents(asset)
    yield rounded("aluminium", span(hw), (-hd * 0.88, hd), (0.0, 0.016), 0.01)
    yield block("plastic_black", span(hw * 0.88), (-hd * 0.55, hd * 0.15), (0.016, 0.0175))
    yield block("plastic_grey", span(hw * 0.22), (hd * 0.32, hd * 0.82), (0.016, 0.0168))
    lean, thick = 0.14, 0.008
    tall = (height - 0.014) / math.cos(lean) - thick * math.tan(lean)
    facing = turned((1.0, 0.0, 0.0), lean)
    middle_y = -hd * 0.88 + 0.010 - tall / 2.0 * math.sin(lean) + 0.012
    middle = (0.0, max(middle_y, -hd + tall / 2.0 * math.sin(lean) + thick * 0.55), 0.012 + tall / 2.0 * math.cos(lean))
    yield plate("aluminium", (width * 0.995, thick, tall), middle, facing)
    front = (middle[0], middle[1] + thick * 0.5, middle[2])
    yield plate("screen_dark", (width * 0.94, 0.002, tall * 0.90), front, facing)
    yield plate(
        "screen",
        (width * 0.90, 0.003, tall * 0.55),
        (front[0], front[1] - tall * 0.12 * math.sin(lean), front[2] + tall * 0.12),
        facing,
    )
