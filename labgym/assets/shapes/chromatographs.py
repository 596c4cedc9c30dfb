"""Stacks of chromatography modules, reactors, and magnets."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors, curve_screen, feet, knob, louvres, panel_screen
from labgym.assets.shapes.flasks import bulb
from labgym.assets.shapes.parts import ALONG_Y, Part, Point, block, column, cylinder, revolved, rod, rounded, tube
from labgym.assets.shapes.registry import count, extents, flag, shape
from labgym.assets.shapes.vessels import hollow

FACE = 0.012


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
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "trolley"):
        yield from _on_trolley(width, depth, height, count(asset, "modules", 4))
        return
    bottles, columns = flag(asset, "bottles"), flag(asset, "columns")
    top = height * (0.80 if bottles else 0.88 if columns else 1.0)
    yield from feet(hw * 0.8, hd * 0.8, 0.012)
    yield from _stack((-hw, hw), (-hd, hd), (0.012, top), count(asset, "modules", 4), flag(asset, "screen"))
    if bottles:
        yield from _bottle_tray((-hw, hw), hd, top, height)
    if flag(asset, "screen"):
        yield from curve_screen((-hw * 0.75, hw * 0.2), hd - FACE, (top * 0.72, top * 0.94))
    if columns:
        for x, colour in ((hw * 0.55, "plastic_white"), (hw * 0.8, "abs_blue")):
            yield column(colour, 0.04, x, 0.0, (top, height))
        yield block("stainless", (-hw * 0.8, hw * 0.2), (-hd * 0.6, hd * 0.6), (top, top + 0.006))
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
    face, pitch, wide = y[1] - FACE, (z[1] - z[0]) / modules, x[1] - x[0]
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
                yield block("stainless", (at - 0.008, at + 0.008), (face, face + 0.006), (low + 0.04, high - 0.03))
        elif k < modules - 1 or not screen:
            panel = (x[0] + 0.03, x[0] + 0.7 * wide)
            yield block("plastic_light", panel, (face, face + 0.004), (low + 0.02, high - 0.02))
        yield block("abs_blue", (x[1] - 0.06, x[1] - 0.02), (face, y[1]), (middle - 0.004, middle + 0.004))
        yield cylinder("lamp_green", 0.010, 0.004, (x[1] - 0.04, face + 0.002, middle + 0.03), ALONG_Y)


def _bottle_tray(x: Point, half_depth: float, low: float, height: float) -> Iterator[Part]:
    yield rounded("plastic_grey", x, (-half_depth, half_depth - FACE), (low - 0.004, low + 0.05), 0.02)
    yield from solvent_bottles((x[0] + 0.03, x[1] - 0.03), 0.0, low + 0.05, height - low - 0.05, 4)
    for k in range(3):
        at = x[0] + (0.25 + 0.2 * k) * (x[1] - x[0])
        yield rod("silicone_blue", 0.005, (at, 0.0, height - 0.01), (at, half_depth - 0.02, low - 0.05))


def _on_trolley(width: float, depth: float, height: float, modules: int) -> Iterator[Part]:
    """A chromatography stack and a mass spectrometer side by side on a wheeled table."""
    hw, hd, table = width / 2.0, depth / 2.0, height * 0.50
    yield block("laminate_grey", (-hw, hw), (-hd, hd), (table - 0.035, table))
    yield from castors(hw - 0.06, hd - 0.06, 0.09)
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield block(
                "powder_grey",
                (sx * (hw - 0.04), sx * (hw - 0.08)),
                (sy * (hd - 0.04), sy * (hd - 0.08)),
                (0.09, table - 0.03),
            )
    yield rounded("powder_dark", (-hw + 0.1, hw - 0.1), (-hd + 0.1, hd - 0.05), (0.12, 0.42), 0.02)
    yield from louvres((-hw + 0.2, hw - 0.2), hd - 0.05, (0.16, 0.38), 6)
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
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "benchtop"):
        yield rounded("plastic_white", (-hw, hw), (-hd, hd - FACE), (0.015, height * 0.93), 0.07)
        yield from feet(hw * 0.7, hd * 0.7, 0.015)
        yield rounded(
            "plastic_dark",
            (-hw * 0.98, hw * 0.98),
            (-hd * 0.98, hd - FACE + 0.004),
            (height * 0.30, height * 0.36),
            0.07,
        )
        yield column("plastic_dark", 0.10, -hw * 0.4, 0.0, (height * 0.92, height * 0.97))
        yield column("borosilicate", 0.005, -hw * 0.4, 0.0, (height * 0.95, height))
        yield from curve_screen((-hw * 0.1, hw * 0.75), hd - FACE, (height * 0.5, height * 0.82))
        yield block("abs_blue", (-hw * 0.8, -hw * 0.3), (hd - FACE, hd), (height * 0.62, height * 0.68))
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


@shape("reactor")
def jacketed_reactor(asset: Asset) -> Iterator[Part]:
    """A jacketed glass reactor in a wheeled steel frame, with a stirrer motor and a bottom valve."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    yield from castors(hw - 0.04, hd - 0.04, 0.08)
    for sx in (-1.0, 1.0):
        yield block("stainless", (sx * hw, sx * (hw - 0.03)), (-hd, hd), (0.08, 0.11))
        yield block("stainless", (sx * hw, sx * (hw - 0.03)), (-hd, -hd + 0.03), (0.08, height * 0.94))
    yield block("stainless", (-hw, hw), (-hd, -hd + 0.03), (height * 0.90, height * 0.94))
    yield block("stainless", (-hw, hw), (hd - 0.03, hd), (0.08, 0.11))
    yield block("stainless", (-hw, hw), (-hd, -hd + 0.03), (0.30, 0.33))
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
    yield rounded("plastic_dark", (-0.06, 0.06), (-0.09, 0.07), (height * 0.80, height), 0.03)
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
