"""Machines: pumps, chillers, centrifuges, chromatographs, reactors and magnets."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors, curve_screen, feet, gauge, keypad, knob, louvres, panel_screen
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    Point,
    block,
    column,
    cylinder,
    revolved,
    rod,
    rounded,
    side_profile,
    span,
    tube,
)
from labgym.assets.shapes.registry import count, extents, flag, shape
from labgym.assets.shapes.vessels import bulb, hollow

FACE_M = 0.012
"""Depth that a housing leaves to its screens, gauges and knobs in front, meters."""


@shape("pump")
def pump(asset: Asset) -> Iterator[Part]:
    """A diaphragm pump with a solvent flask, or with `oil` a rotary vane pump lying along x."""
    width, depth, height, hw, hd = extents(asset)
    if flag(asset, "oil"):
        barrel = min(depth, height * 0.72)
        yield block("cast_iron", span(hw), span(hd), (0.012, 0.03))
        yield from feet(hw * 0.85, hd * 0.8, 0.012)
        yield cylinder("powder_dark", barrel, width * 0.5, (-hw + width * 0.25, 0.0, 0.03 + barrel / 2.0), ALONG_X)
        for k in range(6):
            x = -hw + width * (0.06 + 0.07 * k)
            yield cylinder("powder_dark", barrel * 1.0, 0.006, (x, 0.0, 0.03 + barrel / 2.0), ALONG_X)
        yield rounded("signal_blue", (0.0, hw), (-hd, hd - 0.002), (0.03, height * 0.78), 0.02)
        yield cylinder("borosilicate", 0.04, 0.004, (hw * 0.55, hd - 0.002, height * 0.34), ALONG_Y)
        yield column("stainless", 0.035, hw * 0.3, 0.0, (height * 0.78, height))
        yield column("stainless", 0.045, hw * 0.7, 0.0, (height * 0.78, height * 0.9))
        yield block("plastic_black", (-hw * 0.7, -hw * 0.3), span(0.012), (0.03 + barrel, height * 0.86))
        return
    yield rounded("plastic_white", (-hw + 0.002, hw * 0.55), (-hd, hd - FACE_M), (0.03, height), 0.03)
    yield from feet(hw * 0.75, hd * 0.8, 0.012)
    yield block("plastic_dark", span(hw), (-hd, hd - FACE_M), (0.010, 0.03))
    yield from knob("abs_blue", height * 0.24, -hw * 0.55, hd - FACE_M, hd, height * 0.4)
    yield from gauge(-hw * 0.05, hd - FACE_M, hd - 0.002, height * 0.66, height * 0.26)
    yield from louvres((-hw * 0.8, -hw * 0.2), hd - FACE_M, (height * 0.66, height * 0.9), 4)
    yield revolved(
        "borosilicate",
        [(0.012, 0.03), (hw * 0.20, height * 0.2), (hw * 0.21, height * 0.4), (0.012, height * 0.6)],
        (hw * 0.78, hd * 0.3, 0.0),
    )
    yield column("plastic_dark", 0.03, hw * 0.78, hd * 0.3, (height * 0.58, height * 0.7))


@shape("chiller")
def chiller(asset: Asset) -> Iterator[Part]:
    """A recirculating chiller; `bath` gives it an open bath, `taps` makes it a water aspirator."""
    width, depth, height, hw, hd = extents(asset)
    if flag(asset, "taps"):
        yield from _aspirator(width, depth, height)
        return
    bath = flag(asset, "bath")
    low, top = 0.05, height - 0.05
    yield from castors(hw - 0.035, hd - 0.06, low)
    yield rounded("powder_white", span(hw), (-hd, hd - FACE_M), (low, top), 0.02)
    yield from louvres(span(hw * 0.75), hd - FACE_M, (low + 0.04, height * 0.46), 9)
    yield block("plastic_dark", span(hw * 0.94), (hd - FACE_M - 0.002, hd - 0.005), (height * 0.58, height * 0.82))
    yield from panel_screen("screen", (-hw * 0.6, hw * 0.25), hd - 0.005, (height * 0.66, height * 0.78))
    yield from knob("plastic_light", 0.03, hw * 0.6, hd - 0.005, hd, height * 0.70)
    yield block("abs_blue", span(hw * 0.9), (hd - FACE_M, hd), (height * 0.52, height * 0.545))
    if bath:
        yield rounded("stainless", span(hw * 0.85), (-hd * 0.5, hd * 0.75), (top, top + 0.012), 0.03)
        yield block("plastic_black", span(hw * 0.6), (-hd * 0.35, hd * 0.6), (top + 0.012, top + 0.018))
        yield rounded("plastic_dark", span(hw * 0.5), (-hd * 0.98, -hd * 0.55), (top, height), 0.02)
    else:
        yield column("plastic_black", 0.06, -hw * 0.3, hd * 0.3, (top, height - 0.012))
        for x in (hw * 0.2, hw * 0.6):
            yield from tube(
                "silicone_blue",
                0.018,
                [(x, -hd * 0.55, top), (x, -hd * 0.55, height - 0.009), (x, -hd * 0.9, height - 0.03)],
            )


def _aspirator(width: float, depth: float, height: float) -> Iterator[Part]:
    hw, hd, top = width / 2.0, depth / 2.0, height * 0.62
    yield rounded("polyethylene", span(hw), (-hd, hd - 0.001), (0.0, top), 0.03)
    yield rounded("plastic_grey", span(hw * 0.96), span(hd * 0.96), (top - 0.005, top + 0.02), 0.03)
    yield column("powder_dark", min(width, depth) * 0.5, -hw * 0.35, 0.0, (top, height))
    yield block("plastic_dark", (hw * 0.05, hw * 0.85), (-hd * 0.5, hd * 0.3), (top, height * 0.86))
    for x in (hw * 0.25, hw * 0.65):
        yield from gauge(x, hd * 0.3, hd * 0.3 + 0.02, height * 0.76, 0.065)
        yield cylinder("brass", 0.012, 0.05, (x, hd * 0.3 + 0.02, height * 0.67), ALONG_Y)
    yield block("signal_blue", span(hw * 0.6), (hd - 0.002, hd), (height * 0.25, height * 0.34))


@shape("centrifuge")
def centrifuge(asset: Asset) -> Iterator[Part]:
    """A bench centrifuge: a sloping panel under a round lid."""
    width, depth, height, hw, hd = extents(asset)
    deck = height * 0.86
    face = hd - 0.006
    yield side_profile(
        "plastic_white", [(-hd, 0.014), (face, 0.014), (face, height * 0.28), (hd * 0.62, deck), (-hd, deck)], span(hw)
    )
    yield from feet(hw * 0.8, hd * 0.8, 0.014)
    lid = min(width, depth * 0.8) * 0.9
    yield revolved(
        "plastic_grey", [(lid / 2.0, deck), (lid / 2.0, deck + 0.012), (lid * 0.42, height)], (0.0, -hd * 0.18, 0.0)
    )
    yield column("window_glass", lid * 0.36, 0.0, -hd * 0.18, (height - 0.002, height))
    yield block("plastic_dark", span(hw * 0.16), (hd * 0.50, hd * 0.62), span(0.01, deck))
    yield block("plastic_dark", span(hw * 0.96), (hd - 0.012, hd - 0.003), (height * 0.06, height * 0.26))
    yield from panel_screen("screen", (-hw * 0.7, -hw * 0.1), hd - 0.003, (height * 0.10, height * 0.22))
    yield from keypad((hw * 0.1, hw * 0.7), hd - 0.003, (height * 0.09, height * 0.23), 4, 2)


def solvent_bottles(x: Point, y: float, z: float, height: float, amount: int) -> Iterator[Part]:
    """A row of clear mobile-phase bottles with blue caps."""
    pitch = (x[1] - x[0]) / amount
    radius = min(pitch * 0.46, height * 0.3)
    for k in range(amount):
        middle = x[0] + (k + 0.5) * pitch
        outline = [
            (radius, z),
            (radius, z + height * 0.66),
            (radius * 0.4, z + height * 0.82),
            (radius * 0.4, z + height * 0.9),
        ]
        yield revolved("borosilicate", outline, (middle, y, 0.0))
        yield column("clear_liquid", 1.9 * radius, middle, y, (z + 0.002, z + height * (0.55 - 0.1 * k)))
        yield column("abs_blue", radius, middle, y, (z + height * 0.84, z + height))


@shape("chromatograph")
def chromatograph(asset: Asset) -> Iterator[Part]:
    """A stack of modules; `bottles` on top, `screen` and `columns` in front, `trolley` next to a mass spectrometer."""
    width, depth, height, hw, hd = extents(asset)
    if flag(asset, "trolley"):
        yield from _on_trolley(width, depth, height, count(asset, "modules", 4))
        return
    bottles, columns = flag(asset, "bottles"), flag(asset, "columns")
    top = height * (0.80 if bottles else 0.88 if columns else 1.0)
    yield from feet(hw * 0.8, hd * 0.8, 0.012)
    yield from _stack(span(hw), span(hd), (0.012, top), count(asset, "modules", 4), flag(asset, "screen"))
    if bottles:
        yield from _bottle_tray(span(hw), hd, top, height)
    if flag(asset, "screen"):
        yield from curve_screen((-hw * 0.75, hw * 0.2), hd - FACE_M, (top * 0.72, top * 0.94))
    if columns:
        for x, color in ((hw * 0.55, "plastic_white"), (hw * 0.8, "abs_blue")):
            yield column(color, 0.04, x, 0.0, (top, height))
        yield block("stainless", (-hw * 0.8, hw * 0.2), span(hd * 0.6), (top, top + 0.006))
        for k in range(5):
            for j in range(3):
                yield column(
                    "borosilicate",
                    0.016,
                    -hw * 0.7 + k * hw * 0.2,
                    -hd * 0.4 + j * hd * 0.35,
                    (top + 0.006, height - 0.012),
                )


def _stack(x: Point, y: Point, z: Point, modules: int, screen: bool = False) -> Iterator[Part]:
    face, pitch, wide = y[1] - FACE_M, (z[1] - z[0]) / modules, x[1] - x[0]
    for k in range(modules):
        low, high = z[0] + k * pitch, z[0] + (k + 1) * pitch - 0.006
        yield rounded("plastic_white", x, (y[0], face), (low, high), 0.015)
        yield block(
            "plastic_grey", (x[0] + 0.01, x[1] - 0.01), (y[0] + 0.01, face - 0.006), (high - 0.001, high + 0.006)
        )
        middle = (low + high) / 2.0
        if k == modules - 2:
            # The column oven: a dark window with two columns behind it.
            yield block("screen_dark", (x[0] + 0.05, x[1] - 0.05), (face, face + 0.004), (low + 0.03, high - 0.02))
            for share in (0.4, 0.55):
                at = x[0] + share * wide
                yield block("stainless", span(0.008, at), (face, face + 0.006), (low + 0.04, high - 0.03))
        elif k < modules - 1 or not screen:
            panel = (x[0] + 0.03, x[0] + 0.7 * wide)
            yield block("plastic_light", panel, (face, face + 0.004), (low + 0.02, high - 0.02))
        yield block("abs_blue", (x[1] - 0.06, x[1] - 0.02), (face, y[1]), span(0.004, middle))
        yield cylinder("lamp_green", 0.010, 0.004, (x[1] - 0.04, face + 0.002, middle + 0.03), ALONG_Y)


def _bottle_tray(x: Point, half_depth: float, low: float, height: float) -> Iterator[Part]:
    yield rounded("plastic_grey", x, (-half_depth, half_depth - FACE_M), (low - 0.004, low + 0.05), 0.02)
    yield from solvent_bottles((x[0] + 0.03, x[1] - 0.03), 0.0, low + 0.05, height - low - 0.05, 4)
    for k in range(3):
        at = x[0] + (0.25 + 0.2 * k) * (x[1] - x[0])
        yield rod("silicone_blue", 0.005, (at, 0.0, height - 0.01), (at, half_depth - 0.02, low - 0.05))


def _on_trolley(width: float, depth: float, height: float, modules: int) -> Iterator[Part]:
    """A chromatography stack and a mass spectrometer side by side on a wheeled table."""
    hw, hd, table = width / 2.0, depth / 2.0, height * 0.50
    yield block("laminate_grey", span(hw), span(hd), (table - 0.035, table))
    yield from castors(hw - 0.06, hd - 0.06, 0.09)
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield block(
                "powder_grey",
                (sx * (hw - 0.04), sx * (hw - 0.08)),
                (sy * (hd - 0.04), sy * (hd - 0.08)),
                (0.09, table - 0.03),
            )
    yield rounded("powder_dark", span(hw - 0.1), (-hd + 0.1, hd - 0.05), (0.12, 0.42), 0.02)
    yield from louvres(span(hw - 0.2), hd - 0.05, (0.16, 0.38), 6)
    stack = (-hw + 0.03, -hw + 0.41)
    yield from _stack(stack, (-hd + 0.15, hd - 0.12), (table, height - 0.16), modules)
    yield from solvent_bottles(stack, 0.0, height - 0.16, 0.16, 3)
    body, top = (-hw + 0.46, hw - 0.03), height * 0.88
    yield rounded("plastic_white", body, (-hd + 0.05, hd - 0.08), (table, top), 0.05)
    yield rounded(
        "plastic_dark", (body[0] + 0.05, body[0] + 0.30), (hd - 0.1, hd - 0.04), (table + 0.12, top - 0.1), 0.03
    )
    yield cylinder("stainless", 0.12, 0.05, (body[0] + 0.175, hd - 0.05, (table + top) / 2.0), ALONG_Y)
    yield block("signal_blue", (body[0] + 0.34, body[1] - 0.03), (hd - 0.081, hd - 0.076), (top - 0.10, top - 0.05))
    yield from louvres((body[0] + 0.40, body[1] - 0.05), hd - 0.08, (table + 0.08, table + 0.24), 6)


@shape("nmr")
def magnet(asset: Asset) -> Iterator[Part]:
    """A superconducting magnet on three legs, or a benchtop spectrometer."""
    _, _, height, hw, hd = extents(asset)
    if flag(asset, "benchtop"):
        yield rounded("plastic_white", span(hw), (-hd, hd - FACE_M), (0.015, height * 0.93), 0.07)
        yield from feet(hw * 0.7, hd * 0.7, 0.015)
        yield rounded(
            "plastic_dark", span(hw * 0.98), (-hd * 0.98, hd - FACE_M + 0.004), (height * 0.30, height * 0.36), 0.07
        )
        yield column("plastic_dark", 0.10, -hw * 0.4, 0.0, (height * 0.92, height * 0.97))
        yield column("borosilicate", 0.005, -hw * 0.4, 0.0, (height * 0.95, height))
        yield from curve_screen((-hw * 0.1, hw * 0.75), hd - FACE_M, (height * 0.5, height * 0.82))
        yield block("abs_blue", (-hw * 0.8, -hw * 0.3), (hd - FACE_M, hd), (height * 0.62, height * 0.68))
        return
    radius, low = min(hw, hd), height * 0.16
    body = [
        (radius * 0.72, low),
        (radius, low + 0.10),
        (radius, height * 0.66),
        (radius * 0.86, height * 0.73),
        (radius * 0.32, height * 0.78),
    ]
    yield revolved("powder_white", [*body, (radius * 0.30, height * 0.80)])
    yield revolved(
        "signal_blue",
        [
            (radius - 0.004, height * 0.42),
            (radius, height * 0.42),
            (radius, height * 0.46),
            (radius - 0.004, height * 0.46),
        ],
    )
    yield column("stainless", radius * 0.3, 0.0, 0.0, (height * 0.78, height * 0.86))
    for x in (-radius * 0.45, radius * 0.45):
        yield column("stainless", 0.10, x, 0.0, (height * 0.74, height * 0.96))
        yield column("chrome", 0.13, x, 0.0, (height * 0.96, height))
    for x, y in ((0.0, -0.75), (0.65, 0.4), (-0.65, 0.4)):
        yield column("powder_grey", 0.14, x * radius, y * radius, (0.0, low + 0.14))
        yield column("plastic_dark", 0.20, x * radius, y * radius, (0.0, 0.03))
    yield column("aluminium", 0.16, 0.0, 0.0, (low - 0.2, low))


@shape("autoclave")
def stirred_autoclave(asset: Asset) -> Iterator[Part]:
    """A stirred autoclave: a steel vessel in its heater, a head with a gauge, and a drive on a column."""
    _, _, height, hw, hd = extents(asset)
    radius = min(hw, hd) * 0.55
    yield rounded("powder_grey", span(hw), span(hd), (0.0, height * 0.06), 0.01)
    yield rounded("powder_white", span(radius * 0.8), (-hd, -hd * 0.72), (height * 0.06, height), 0.01)
    yield column("powder_dark", radius * 2.0, 0.0, 0.0, (height * 0.06, height * 0.42))
    yield column("stainless", radius * 1.7, 0.0, 0.0, (height * 0.42, height * 0.50))
    yield column("stainless", radius * 2.1, 0.0, 0.0, (height * 0.50, height * 0.55))
    for x, y in ((-0.8, -0.45), (-0.8, 0.45), (0.8, -0.45), (0.8, 0.45)):
        yield column("chrome", radius * 0.16, x * radius, y * radius, (height * 0.55, height * 0.58))
    yield column("chrome", radius * 0.25, 0.0, 0.0, (height * 0.55, height * 0.80))
    yield rounded("plastic_dark", span(radius * 0.5), (-hd * 0.72, radius * 0.5), (height * 0.80, height * 0.99), 0.02)
    yield rod("stainless", radius * 0.12, (radius * 0.5, 0.0, height * 0.55), (radius * 0.5, 0.0, height * 0.66))
    yield from gauge(radius * 0.5, radius * 0.1, radius * 0.3, height * 0.68, radius * 0.6)
    yield rod("safety_red", radius * 0.1, (-radius * 0.5, 0.0, height * 0.55), (-radius * 0.5, 0.0, height * 0.62))
    yield from panel_screen("screen", span(radius * 0.4), hd * 0.98, (height * 0.015, height * 0.05))


@shape("reactor")
def jacketed_reactor(asset: Asset) -> Iterator[Part]:
    """A jacketed glass reactor in a wheeled steel frame, with a stirrer motor and a bottom valve."""
    _, _, height, hw, hd = extents(asset)
    yield from castors(hw - 0.04, hd - 0.04, 0.08)
    for sx in (-1.0, 1.0):
        yield block("stainless", (sx * hw, sx * (hw - 0.03)), span(hd), (0.08, 0.11))
        yield block("stainless", (sx * hw, sx * (hw - 0.03)), (-hd, -hd + 0.03), (0.08, height * 0.94))
    yield block("stainless", span(hw), (-hd, -hd + 0.03), (height * 0.90, height * 0.94))
    yield block("stainless", span(hw), (hd - 0.03, hd), (0.08, 0.11))
    yield block("stainless", span(hw), (-hd, -hd + 0.03), (0.30, 0.33))
    radius, low, top = min(hw, hd) * 0.56, height * 0.30, height * 0.70
    yield revolved(
        "borosilicate",
        [(0.02, low - 0.08), (0.02, low - 0.02), *bulb(radius, low + radius * 0.72, 0.45, 1.55, 5), (radius, top)],
    )
    yield revolved(
        "yellow_liquid", [*bulb(radius * 0.86, low + radius * 0.74, 0.3, 1.55, 5), (radius * 0.86, top * 0.82)]
    )
    yield column("stainless", radius * 2.3, 0.0, 0.0, (top, top + 0.03))
    for x in (-0.06, 0.06):
        yield column("borosilicate", 0.04, x, 0.05, (top + 0.03, top + 0.11))
        yield column("abs_blue", 0.045, x, 0.05, (top + 0.10, top + 0.13))
    yield column("stainless", 0.016, 0.0, 0.0, (low + 0.04, height * 0.86))
    yield rounded("plastic_dark", span(0.06), (-0.09, 0.07), (height * 0.80, height), 0.03)
    yield rounded(
        "plastic_light", (hw - 0.18, hw - 0.002), (-hd + 0.002, -hd + 0.12), (height * 0.62, height * 0.80), 0.01
    )
    yield from panel_screen("screen", (hw - 0.15, hw - 0.03), -hd + 0.12, (height * 0.68, height * 0.78))
    yield column("stainless", 0.06, 0.0, 0.0, (low - 0.12, low - 0.06))
    yield from knob("safety_red", 0.05, 0.0, 0.03, 0.09, low - 0.09)
    yield hollow("polyethylene", [(0.0, 0.11), (0.11, 0.11), (0.13, 0.24)], 0.004)
    yield from tube(
        "silicone_blue",
        0.022,
        [(radius, 0.0, low + 0.12), (hw - 0.03, -0.04, low + 0.04), (hw - 0.03, -hd + 0.06, 0.30)],
    )
