"""Machines: pumps, chillers, centrifuges."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors, feet, gauge, keypad, knob, louvres, panel_screen
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    block,
    column,
    cylinder,
    revolved,
    rounded,
    side_profile,
    tube,
)
from labgym.assets.shapes.registry import extents, flag, shape

FACE = 0.012


@shape("pump")
def pump(asset: Asset) -> Iterator[Part]:
    """A diaphragm pump with a solvent flask, or with `oil` a rotary vane pump lying along x."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "oil"):
        barrel = min(depth, height * 0.72)
        yield block("cast_iron", (-hw, hw), (-hd, hd), (0.012, 0.03))
        yield from feet(hw * 0.85, hd * 0.8, 0.012)
        yield cylinder("powder_dark", barrel, width * 0.5, (-hw + width * 0.25, 0.0, 0.03 + barrel / 2.0), ALONG_X)
        for k in range(6):
            x = -hw + width * (0.06 + 0.07 * k)
            yield cylinder("powder_dark", barrel * 1.0, 0.006, (x, 0.0, 0.03 + barrel / 2.0), ALONG_X)
        yield rounded("signal_blue", (0.0, hw), (-hd, hd - 0.002), (0.03, height * 0.78), 0.02)
        yield cylinder("borosilicate", 0.04, 0.004, (hw * 0.55, hd - 0.002, height * 0.34), ALONG_Y)
        yield column("stainless", 0.035, hw * 0.3, 0.0, (height * 0.78, height))
        yield column("stainless", 0.045, hw * 0.7, 0.0, (height * 0.78, height * 0.9))
        yield block("plastic_black", (-hw * 0.7, -hw * 0.3), (-0.012, 0.012), (0.03 + barrel, height * 0.86))
        return
    yield rounded("plastic_white", (-hw + 0.002, hw * 0.55), (-hd, hd - FACE), (0.03, height), 0.03)
    yield from feet(hw * 0.75, hd * 0.8, 0.012)
    yield block("plastic_dark", (-hw, hw), (-hd, hd - FACE), (0.010, 0.03))
    yield from knob("abs_blue", height * 0.24, -hw * 0.55, hd - FACE, hd, height * 0.4)
    yield from gauge(-hw * 0.05, hd - FACE, hd - 0.002, height * 0.66, height * 0.26)
    yield from louvres((-hw * 0.8, -hw * 0.2), hd - FACE, (height * 0.66, height * 0.9), 4)
    yield revolved(
        "borosilicate",
        [(0.012, 0.03), (hw * 0.20, height * 0.2), (hw * 0.21, height * 0.4), (0.012, height * 0.6)],
        (hw * 0.78, hd * 0.3, 0.0),
    )
    yield column("plastic_dark", 0.03, hw * 0.78, hd * 0.3, (height * 0.58, height * 0.7))


@shape("chiller")
def chiller(asset: Asset) -> Iterator[Part]:
    """A recirculating chiller; `bath` gives it an open bath, `taps` makes it a water aspirator."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "taps"):
        yield from _aspirator(width, depth, height)
        return
    bath = flag(asset, "bath")
    low, top = 0.05, height - 0.05
    yield from castors(hw - 0.035, hd - 0.06, low)
    yield rounded("powder_white", (-hw, hw), (-hd, hd - FACE), (low, top), 0.02)
    yield from louvres((-hw * 0.75, hw * 0.75), hd - FACE, (low + 0.04, height * 0.46), 9)
    yield block(
        "plastic_dark", (-hw * 0.94, hw * 0.94), (hd - FACE - 0.002, hd - 0.005), (height * 0.58, height * 0.82)
    )
    yield from panel_screen("screen", (-hw * 0.6, hw * 0.25), hd - 0.005, (height * 0.66, height * 0.78))
    yield from knob("plastic_light", 0.03, hw * 0.6, hd - 0.005, hd, height * 0.70)
    yield block("abs_blue", (-hw * 0.9, hw * 0.9), (hd - FACE, hd), (height * 0.52, height * 0.545))
    if bath:
        yield rounded("stainless", (-hw * 0.85, hw * 0.85), (-hd * 0.5, hd * 0.75), (top, top + 0.012), 0.03)
        yield block("plastic_black", (-hw * 0.6, hw * 0.6), (-hd * 0.35, hd * 0.6), (top + 0.012, top + 0.018))
        yield rounded("plastic_dark", (-hw * 0.5, hw * 0.5), (-hd * 0.98, -hd * 0.55), (top, height), 0.02)
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
    yield rounded("polyethylene", (-hw, hw), (-hd, hd - 0.001), (0.0, top), 0.03)
    yield rounded("plastic_grey", (-hw * 0.96, hw * 0.96), (-hd * 0.96, hd * 0.96), (top - 0.005, top + 0.02), 0.03)
    yield column("powder_dark", min(width, depth) * 0.5, -hw * 0.35, 0.0, (top, height))
    yield block("plastic_dark", (hw * 0.05, hw * 0.85), (-hd * 0.5, hd * 0.3), (top, height * 0.86))
    for x in (hw * 0.25, hw * 0.65):
        yield from gauge(x, hd * 0.3, hd * 0.3 + 0.02, height * 0.76, 0.065)
        yield cylinder("brass", 0.012, 0.05, (x, hd * 0.3 + 0.02, height * 0.67), ALONG_Y)
    yield block("signal_blue", (-hw * 0.6, hw * 0.6), (hd - 0.002, hd), (height * 0.25, height * 0.34))


@shape("centrifuge")
def centrifuge(asset: Asset) -> Iterator[Part]:
    """A bench centrifuge: a sloping panel under a round lid."""
    width, depth, height = extents(asset)
    hw, hd, deck = width / 2.0, depth / 2.0, height * 0.86
    face = hd - 0.006
    yield side_profile(
        "plastic_white", [(-hd, 0.014), (face, 0.014), (face, height * 0.28), (hd * 0.62, deck), (-hd, deck)], (-hw, hw)
    )
    yield from feet(hw * 0.8, hd * 0.8, 0.014)
    lid = min(width, depth * 0.8) * 0.9
    yield revolved(
        "plastic_grey", [(lid / 2.0, deck), (lid / 2.0, deck + 0.012), (lid * 0.42, height)], (0.0, -hd * 0.18, 0.0)
    )
    yield column("window_glass", lid * 0.36, 0.0, -hd * 0.18, (height - 0.002, height))
    yield block("plastic_dark", (-hw * 0.16, hw * 0.16), (hd * 0.50, hd * 0.62), (deck - 0.01, deck + 0.010))
    yield block("plastic_dark", (-hw * 0.96, hw * 0.96), (hd - 0.012, hd - 0.003), (height * 0.06, height * 0.26))
    yield from panel_screen("screen", (-hw * 0.7, -hw * 0.1), hd - 0.003, (height * 0.10, height * 0.22))
    yield from keypad((hw * 0.1, hw * 0.7), hd - 0.003, (height * 0.09, height * 0.23), 4, 2)
