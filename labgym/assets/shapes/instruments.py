"""Measuring instruments: boxes with individual fronts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import curve_screen, feet, gauge, keypad, louvres, panel_screen
from labgym.assets.shapes.parts import (
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
from labgym.assets.shapes.registry import Extents, extents, flag, shape

FACE_M = 0.012
"""Depth that an instrument's front leaves to its screens, keys and knobs, meters."""


@shape("instrument_box")
def instrument_box(asset: Asset) -> Iterator[Part]:
    """An instrument in a housing; each flag of the shape adds a characteristic feature."""
    size = extents(asset)
    for name, feature in FEATURES.items():
        if flag(asset, name):
            yield from feature(size)
            return
    yield from _housing(size)
    yield from _panel(size, flag(asset, "screen"), flag(asset, "keypad"))


def _housing(size: Extents, top: float | None = None, material: str = "plastic_white") -> Iterator[Part]:
    _, _, height, hw, hd = size
    high = height if top is None else top
    yield rounded(material, span(hw), (-hd, hd - FACE_M), (0.012, high), min(0.025, 0.2 * hw))
    yield block("plastic_dark", span(hw * 0.97), (-hd * 0.97, hd - FACE_M - 0.004), (0.006, 0.02))
    yield from feet(hw * 0.8, hd * 0.8, 0.012)


def _panel(size: Extents, screen: bool, keys: bool, top: float | None = None) -> Iterator[Part]:
    _, _, height, hw, hd = size
    face = hd - FACE_M
    high = height if top is None else top
    yield block("plastic_grey", span(hw * 0.92), (face - 0.002, face + 0.004), (high * 0.22, high * 0.92))
    front, low, up = face + 0.004, high * 0.34, high * 0.84
    right = -hw * 0.05 if keys else hw * 0.35
    if screen:
        yield from panel_screen("screen", (-hw * 0.8, right), front, (low, up))
    if keys:
        yield from keypad((hw * 0.15, hw * 0.8), front, (low, up))
    yield cylinder("lamp_green", 0.008, 0.004, (hw * 0.84, front + 0.002, high * 0.28), ALONG_Y)
    yield block("abs_blue", span(hw * 0.92), (face, face + FACE_M), (high * 0.14, high * 0.18))


def _with_lid(size: Extents) -> Iterator[Part]:
    """A sample compartment lid on a long optical bench, and a tilted screen next to it."""
    width, depth, height, hw, hd = size
    top = height * 0.78
    yield from _housing(size, top)
    yield rounded("plastic_dark", (-hw * 0.85, hw * 0.10), (-hd * 0.72, hd * 0.68), (top, height), 0.02)
    yield block("plastic_grey", (-hw * 0.55, -hw * 0.20), (hd * 0.66, hd * 0.72), (top + 0.004, height - 0.004))
    yield rounded("plastic_light", (hw * 0.25, hw * 0.92), (-hd * 0.5, hd * 0.62), (top, top + 0.012), 0.02)
    yield plate(
        "screen_dark", (width * 0.30, depth * 0.34, 0.004), (hw * 0.58, hd * 0.05, top + 0.014), (1.0, 0.0, 0.0, 0.0)
    )
    yield plate(
        "screen", (width * 0.27, depth * 0.30, 0.004), (hw * 0.58, hd * 0.05, top + 0.0155), (1.0, 0.0, 0.0, 0.0)
    )
    yield block("abs_blue", span(hw * 0.94), (hd - FACE_M, hd), (top * 0.3, top * 0.4))


def _oven_front(size: Extents, tower: bool = False) -> Iterator[Part]:
    """A gas chromatograph: an oven door with a latch, a control column with keypad and screen, injectors on top."""
    width, depth, height, hw, hd = size
    top = height * 0.86
    split = hw * (0.02 if tower else 0.32)
    face = hd - FACE_M
    wide = width - 0.004 * tower
    yield from _housing((wide, depth, height, wide / 2.0, hd), top, "plastic_light")
    oven = (-hw * 0.94, split)
    control = (split + 0.02, (hw * 0.48 if tower else hw * 0.94))
    yield rounded("plastic_grey", oven, (face - 0.01, face + 0.004), (top * 0.10, top * 0.94), 0.01)
    yield from louvres((oven[0] + 0.05, oven[1] - 0.05), face + 0.004, (top * 0.16, top * 0.36), 6)
    yield block("plastic_dark", (split - 0.035, split - 0.015), (face, hd), (top * 0.45, top * 0.70))
    yield block("plastic_dark", control, (face - 0.002, face + 0.004), (top * 0.10, top * 0.94))
    yield from panel_screen("screen", (control[0] + 0.02, control[1] - 0.02), face + 0.004, (top * 0.66, top * 0.88))
    yield from keypad((control[0] + 0.02, control[1] - 0.02), face + 0.004, (top * 0.18, top * 0.58), 3, 5)
    for x in (-hw * 0.70, -hw * 0.40):
        yield column("stainless", 0.05, x, 0.0, (top, top + 0.4 * (height - top)))
        yield rounded("plastic_white", span(0.045, x), (-0.08, 0.06), (top + 0.3 * (height - top), height), 0.012)
    if tower:
        yield rounded("plastic_white", (hw * 0.52, hw), (-hd, face + 0.002), (0.0, top * 1.05), 0.03)
        yield block("abs_blue", (hw * 0.56, hw * 0.96), (face - 0.002, hd), (top * 0.80, top * 0.86))
        yield from louvres((hw * 0.60, hw * 0.92), face + 0.002, (top * 0.20, top * 0.6), 8)


def _mass_spectrometer(size: Extents) -> Iterator[Part]:
    return _oven_front(size, tower=True)


def _attenuated_reflection(size: Extents) -> Iterator[Part]:
    """An infrared spectrometer with its press over a crystal."""
    _, _, height, hw, hd = size
    top = height * 0.52
    yield from _housing(size, top)
    yield rounded("plastic_dark", span(hw * 0.55), (-hd * 0.1, hd * 0.75), (top, top + 0.02), 0.02)
    yield column("chrome", 0.03, 0.0, hd * 0.32, (top + 0.02, top + 0.028))
    yield rounded("plastic_grey", span(0.03), (-hd * 0.15, -hd * 0.15 + 0.05), (top, height * 0.88), 0.012)
    yield block("plastic_grey", span(0.022), (-hd * 0.15, hd * 0.42), (height * 0.80, height * 0.88))
    yield column("stainless", 0.016, 0.0, hd * 0.32, (top + 0.05, height * 0.94))
    yield column("abs_blue", 0.05, 0.0, hd * 0.32, (height * 0.92, height))
    yield from curve_screen((-hw * 0.8, -hw * 0.1), hd - FACE_M, (top * 0.35, top * 0.85))
    yield block("abs_blue", (0.0, hw * 0.9), (hd - FACE_M, hd), (top * 0.5, top * 0.62))


def _eyepiece(size: Extents) -> Iterator[Part]:
    """A refractometer: an inclined eyepiece over a prism box."""
    _, _, height, hw, hd = size
    yield rounded("powder_dark", span(hw), span(hd), (0.0, 0.03), 0.02)
    yield rounded("plastic_white", span(hw * 0.45), (-hd * 0.7, hd * 0.1), (0.03, height * 0.72), 0.02)
    yield rounded("plastic_grey", span(hw * 0.3), (hd * 0.05, hd * 0.5), (height * 0.30, height * 0.55), 0.01)
    yield rod("plastic_black", 0.036, (0.0, -hd * 0.5, height * 0.62), (0.0, hd * 0.45, height - 0.009))
    yield cylinder("chrome", 0.05, 0.03, (hw * 0.5, -hd * 0.25, height * 0.4), turned((0.0, 1.0, 0.0), math.pi / 2.0))
    yield from panel_screen("display_lcd", span(hw * 0.3), hd * 0.5, (height * 0.36, height * 0.5))


def _chamber(size: Extents) -> Iterator[Part]:
    """A freeze dryer: a condenser chest with a clear drum of shelves on top."""
    width, depth, height, hw, hd = size
    top = height * 0.55
    yield from _housing(size, top, "powder_white")
    yield from _panel(size, True, False, top)
    drum = min(width, depth) * 0.78
    yield column("stainless", drum * 1.06, 0.0, -hd * 0.1, (top, top + 0.02))
    for k in range(3):
        z = top + 0.05 + k * (height - top - 0.07) / 3.0
        yield column("stainless", drum * 0.82, 0.0, -hd * 0.1, (z, z + 0.006))
    yield column("stainless", 0.02, 0.0, -hd * 0.1, (top, height - 0.02))
    yield column("borosilicate", drum, 0.0, -hd * 0.1, (top + 0.02, height - 0.018))
    yield column("plastic_dark", drum * 1.04, 0.0, -hd * 0.1, (height - 0.018, height))
    yield from louvres((-hw * 0.3, hw * 0.6), hd - FACE_M, (top * 0.06, top * 0.20), 4)


def _lamp(size: Extents) -> Iterator[Part]:
    """A photoreactor: a drum with a violet glow in its windows and a fan on top."""
    width, depth, height, hw, hd = size
    yield rounded("powder_dark", span(hw), span(hd), (0.0, height * 0.12), 0.03)
    yield column("aluminium", min(width, depth) * 0.92, 0.0, 0.0, (height * 0.12, height * 0.86))
    for k in range(6):
        x = (k - 2.5) * width * 0.11
        y = math.sqrt(max((0.46 * min(width, depth)) ** 2 - x * x, 0.0))
        yield block("lamp_uv", span(width * 0.03, x), (0.0, y + 0.003), (height * 0.28, height * 0.70))
    yield column("plastic_black", min(width, depth) * 0.8, 0.0, 0.0, (height * 0.86, height * 0.94))
    yield column("borosilicate", 0.03, 0.0, 0.0, (height * 0.9, height))


def _gauges(size: Extents) -> Iterator[Part]:
    """A hydrogenation apparatus: a frame with a reservoir, gauges, and a shaken bottle behind a guard."""
    _, depth, height, hw, hd = size
    yield rounded("powder_grey", span(hw), (-hd, hd - 0.003), (0.0, 0.08), 0.01)
    yield rounded("powder_white", span(hw), (-hd, -hd + 0.12), (0.08, height), 0.01)
    yield column("stainless", min(0.2, depth * 0.45), -hw * 0.62, 0.0, (0.08, height * 0.82))
    for x in (-hw * 0.05, hw * 0.3):
        yield from gauge(x, -hd + 0.12, -hd + 0.15, height * 0.82, 0.10)
    yield revolved(
        "thick_glass",
        [(0.05, 0.10), (0.055, 0.12), (0.055, height * 0.38), (0.02, height * 0.46), (0.02, height * 0.5)],
        (hw * 0.45, 0.0, 0.0),
    )
    yield column("clear_liquid", 0.09, hw * 0.45, 0.0, (0.11, height * 0.26))
    yield column("rubber", 0.05, hw * 0.45, 0.0, (height * 0.48, height * 0.54))
    yield rod("stainless", 0.010, (hw * 0.45, 0.0, height * 0.52), (hw * 0.3, -hd + 0.1, height * 0.72))
    yield block("sash_glass", (0.05, hw * 0.95), (hd * 0.72, hd * 0.72 + 0.006), (0.08, height * 0.7))
    yield block("safety_red", (-hw * 0.15, hw * 0.02), (hd - 0.02, hd), (0.03, 0.06))


def _viewer(size: Extents) -> Iterator[Part]:
    """An ultraviolet viewing cabinet: a hood with an eyepiece window and a glow inside."""
    width, _, height, hw, hd = size
    face = hd - 0.004
    outline = [(-hd, 0.0), (face, 0.0), (face, height * 0.45), (hd * 0.2, height), (-hd, height)]
    yield side_profile("powder_dark", outline, span(hw))
    slope = math.atan2(height * 0.55, hd * 0.8)
    facing = turned((1.0, 0.0, 0.0), -slope)
    yield plate("lamp_uv", (width * 0.55, 0.05, 0.006), (0.0, hd * 0.58, height * 0.74), facing)
    yield plate("plastic_black", (width * 0.7, 0.09, 0.004), (0.0, hd * 0.58, height * 0.738), facing)
    for x in (-hw * 0.4, hw * 0.4):
        yield block(
            "safety_red" if x > 0 else "abs_green", span(0.02, x), (hd - 0.004, hd), (height * 0.1, height * 0.18)
        )
    yield block("plastic_black", span(hw * 0.85), (hd - 0.006, hd - 0.002), (height * 0.22, height * 0.42))


def _syringe_drive(size: Extents) -> Iterator[Part]:
    """A syringe pump: a housing with a screen, and a syringe in a cradle along its top."""
    _, _, height, hw, _ = size
    top = height * 0.66
    yield from _housing(size, top, "plastic_light")
    yield from _panel(size, True, True, top)
    z = top + (height - top) * 0.45
    yield block("plastic_dark", (-hw * 0.1, hw * 0.06), span(0.03), (top, z))
    yield rod("polypropylene", 0.026, (-hw * 0.55, 0.0, z), (hw * 0.1, 0.0, z), flat=True)
    yield rod("blue_liquid", 0.022, (-hw * 0.54, 0.0, z), (-hw * 0.2, 0.0, z), flat=True)
    yield rod("plastic_white", 0.010, (hw * 0.1, 0.0, z), (hw * 0.7, 0.0, z), flat=True)
    yield block("plastic_dark", (hw * 0.66, hw * 0.84), span(0.05), (top, height))
    yield rod("stainless", 0.008, (-hw * 0.9, -0.05, top + 0.012), (hw * 0.9, -0.05, top + 0.012), flat=True)


def _rotor(size: Extents) -> Iterator[Part]:
    """A peristaltic pump: a roller head in front with a loop of tubing."""
    _, depth, height, hw, hd = size
    face = hd - 0.045
    yield rounded("plastic_white", span(hw), (-depth / 2.0, face), (0.0, height), 0.02)
    yield cylinder("plastic_dark", height * 0.62, 0.03, (hw * 0.36, face + 0.015, height * 0.52), ALONG_Y)
    yield cylinder("polypropylene", height * 0.66, 0.010, (hw * 0.36, face + 0.034, height * 0.52), ALONG_Y)
    for k in range(3):
        angle = 2.0 * math.pi * k / 3.0
        yield cylinder(
            "stainless",
            0.018,
            0.045,
            (hw * 0.36 + 0.03 * math.cos(angle), face + 0.0225, height * 0.52 + 0.03 * math.sin(angle)),
            ALONG_Y,
        )
    yield from panel_screen("screen_green", (-hw * 0.8, -hw * 0.2), face, (height * 0.5, height * 0.8))
    yield from keypad((-hw * 0.8, -hw * 0.2), face, (height * 0.18, height * 0.42), 3, 2)


def _water_dispenser(size: Extents) -> Iterator[Part]:
    """A water purifier: a tall cabinet with a dispensing gun on an arm and a drip tray."""
    _, _, height, hw, hd = size
    face = hd - 0.14
    yield rounded("plastic_white", span(hw), (-hd, face), (0.0, height), 0.04)
    yield rounded("plastic_grey", span(hw * 0.9), (face - 0.04, hd), (0.0, 0.03), 0.04)
    yield from panel_screen("screen", span(hw * 0.45), face, (height * 0.70, height * 0.88))
    yield block("signal_blue", span(hw * 0.98), (face - 0.004, face + 0.002), (height * 0.58, height * 0.62))
    yield rounded("plastic_dark", span(0.03), (face, hd - 0.03), (height * 0.44, height * 0.52), 0.015)
    yield column("stainless", 0.012, 0.0, hd - 0.06, (height * 0.34, height * 0.45))


def _electrode(size: Extents) -> Iterator[Part]:
    """A pH meter: a sloping housing with a display and keys, and an electrode on an arm."""
    width, depth, height, hw, hd = size
    low = height * 0.28
    yield side_profile(
        "plastic_light",
        [(-hd, 0.0), (hd, 0.0), (hd, low), (-hd * 0.5, height * 0.7), (-hd, height * 0.7)],
        (-hw, hw * 0.7),
    )
    slope = math.atan2(height * 0.7 - low, hd * 1.5)
    facing = turned((1.0, 0.0, 0.0), -slope)
    middle = low + (height * 0.7 - low) * 0.62
    yield plate("display_lcd", (width * 0.5, depth * 0.30, 0.003), (-hw * 0.15, hd * 0.07, middle), facing)
    for k in range(4):
        yield plate(
            "abs_blue",
            (0.016, 0.012, 0.004),
            (-hw * 0.62 + k * 0.030, hd * 0.72, low + (height * 0.7 - low) * 0.19),
            facing,
        )
    x = hw - 0.018
    yield block("plastic_dark", (hw * 0.7, hw), (-hd, 0.0), (0.0, 0.012))
    yield column("stainless", 0.008, x, -hd + 0.02, (0.0, height))
    yield rod("plastic_dark", 0.010, (x, -hd + 0.02, height - 0.006), (x, hd * 0.3, height - 0.006))
    yield column("borosilicate", 0.012, x, hd * 0.3, (0.004, height - 0.004))


def _wall_unit(size: Extents) -> Iterator[Part]:
    """A gas detector for a wall: housing, display, sensor grille, lamp."""
    width, depth, height, hw, hd = size
    yield rounded("safety_yellow", span(hw), (-hd, hd - FACE_M), (height * 0.22, height), 0.02)
    yield column("plastic_dark", min(width, depth) * 0.55, 0.0, 0.0, (0.0, height * 0.24))
    yield from panel_screen("screen_green", span(hw * 0.6), hd - FACE_M, (height * 0.58, height * 0.82))
    yield cylinder("safety_red", 0.022, FACE_M, (0.0, hd - FACE_M / 2.0, height * 0.42), ALONG_Y)


FEATURES: dict[str, Callable[[Extents], Iterator[Part]]] = {
    "tower": _mass_spectrometer,
    "oven": _oven_front,
    "lid": _with_lid,
    "atr": _attenuated_reflection,
    "eyepiece": _eyepiece,
    "chamber": _chamber,
    "lamp": _lamp,
    "gauge": _gauges,
    "viewer": _viewer,
    "syringe": _syringe_drive,
    "rotor": _rotor,
    "dispenser": _water_dispenser,
    "electrode": _electrode,
    "wall": _wall_unit,
}
"""Flags that give an instrument an individual form, the more specific first."""
