"""Safety equipment: eyewash, shower, extinguishers, kits, signs."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import gauge, lines, triangle
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import (
    ALONG_Y,
    Part,
    band,
    block,
    column,
    cylinder,
    revolved,
    rod,
    rounded,
    span,
    tube,
)
from labgym.assets.shapes.registry import extents, flag, shape, text
from labgym.assets.shapes.vessels import hollow


@shape("eyewash")
def eyewash(asset: Asset) -> Iterator[Part]:
    """A pedestal eyewash: a green bowl with two nozzles, a push plate, a sign."""
    width, depth, height, *_ = extents(asset)
    radius, rim = min(width, depth) / 2.0, height - 0.14
    yield column("powder_grey", radius * 1.3, 0.0, 0.0, (0.0, 0.02))
    yield column("signal_green", 0.06, 0.0, 0.0, (0.02, rim - 0.10))
    outline = [(0.02, rim - 0.12), (radius * 0.6, rim - 0.10), (radius * 0.97, rim - 0.02), (radius, rim)]
    yield hollow("signal_green", [(0.0, rim - 0.12), *outline], 0.010)
    yield column("stainless", radius * 1.1, 0.0, 0.0, (rim - 0.095, rim - 0.09))
    for x in (-0.05, 0.05):
        yield column("chrome", 0.014, x, 0.0, (rim - 0.09, rim - 0.01))
        yield column("safety_yellow", 0.034, x, 0.0, (rim - 0.012, rim + 0.02))
    yield block("signal_green", span(0.012), (-radius, -radius + 0.015), (rim - 0.06, height))
    yield block("signal_green", span(0.09), (-radius + 0.002, -radius + 0.010), (height - 0.13, height))
    yield block("paper", span(0.055), (-radius + 0.010, -radius + 0.012), (height - 0.105, height - 0.085))
    yield cylinder("paper", 0.05, 0.002, (0.0, -radius + 0.011, height - 0.05), ALONG_Y)
    yield rod("chrome", 0.012, (radius * 0.6, 0.0, rim - 0.06), (radius - 0.006, radius * 0.3, rim + 0.03))


@shape("shower")
def emergency_shower(asset: Asset) -> Iterator[Part]:
    """An emergency shower: a green stand pipe, a yellow shower head over a hatched mat, a pull rod, an eye bowl."""
    width, _, height, hw, hd = extents(asset)
    pipe, y = 0.05, -hd + 0.06
    yield block("safety_yellow", span(hw), span(hd), (0.0, 0.008))
    for k in range(5):
        x = -hw + width * (0.1 + 0.2 * k)
        yield block("print_black", span(width * 0.045, x), span(hd - 0.02), (0.004, 0.0085))
    yield column("powder_grey", 0.22, 0.0, y + 0.05, (0.008, 0.03))
    yield column("signal_green", pipe, 0.0, y, (0.02, height))
    yield rod("signal_green", pipe, (0.0, y, height - pipe / 2.0), (0.0, hd * 0.1, height - pipe / 2.0))
    head = min(0.13, hw * 0.5)
    yield revolved(
        "safety_yellow", [(head, height - 0.16), (head, height - 0.145), (0.03, height - 0.05)], (0.0, hd * 0.1, 0.0)
    )
    yield column("chrome", head * 1.8, 0.0, hd * 0.1, (height - 0.165, height - 0.158))
    yield rod("chrome", 0.012, (hw * 0.45, hd * 0.1, height - 0.10), (hw * 0.45, hd * 0.1, height - 0.75))
    yield rod("chrome", 0.012, (0.0, hd * 0.02, height - 0.05), (hw * 0.45, hd * 0.1, height - 0.10))
    yield from tube(
        "safety_red",
        0.014,
        [
            (hw * 0.45, hd * 0.1, height - 0.75),
            (hw * 0.45 - 0.06, hd * 0.1, height - 0.85),
            (hw * 0.45 + 0.06, hd * 0.1, height - 0.85),
            (hw * 0.45, hd * 0.1, height - 0.75),
        ],
    )
    rim = height * 0.42
    yield hollow(
        "signal_green",
        [(0.0, rim - 0.08), (0.05, rim - 0.08), (0.13, rim - 0.02), (0.14, rim)],
        0.008,
        (0.0, y + 0.16, 0.0),
    )
    for x in (-0.04, 0.04):
        yield column("safety_yellow", 0.03, x, y + 0.16, (rim - 0.03, rim + 0.02))
    yield block("signal_green", span(0.12), (y - 0.05, y - 0.04), (height * 0.66, height * 0.78))
    yield block("paper", span(0.08), (y - 0.04, y - 0.036), (height * 0.69, height * 0.75))


@shape("extinguisher")
def extinguisher(asset: Asset) -> Iterator[Part]:
    """A fire extinguisher with a label, a lever, and a hose or, with `horn`, a discharge horn."""
    _, _, height, hw, hd = extents(asset)
    body, horn = coating(text(asset, "colour", "red")), flag(asset, "horn")
    radius = hd if horn else min(hw, hd)
    x = -hw + radius if horn else 0.0
    top = height * 0.82
    shell = radius - 0.0008
    outline = [(shell * 0.92, 0.0), (shell, 0.02), (shell, top - radius * 0.5), (shell * 0.8, top - radius * 0.2)]
    yield revolved(body, [*outline, (0.025, top)], (x, 0.0, 0.0))
    yield band("paper", 2.0 * radius, (height * 0.34, height * 0.50), x)
    stripe = "safety_yellow" if body == "safety_red" else "safety_red"
    yield band(stripe, 2.0 * radius - 0.0004, (height * 0.50, height * 0.53), x)
    yield column("brass", 0.034, x, 0.0, (top - 0.01, height * 0.90))
    for z, reach in ((height * 0.90, 0.085), (height - 0.012, 0.075)):
        yield block("plastic_black", span(0.012, x), (-0.02, min(reach, hd)), (z, z + 0.012))
    yield from gauge(x, -0.026, -0.020, height * 0.87, 0.03)
    if horn:
        yield rod("rubber", 0.022, (x, 0.0, height * 0.87), (hw - 0.03, 0.0, height * 0.80))
        yield revolved(
            "plastic_black",
            [(0.030, height * 0.42), (0.012, height * 0.78), (0.012, height * 0.82)],
            (hw - 0.030, 0.0, 0.0),
        )
    else:
        r = radius - 0.011
        yield from tube(
            "rubber",
            0.018,
            [(x, 0.0, height * 0.87), (x + r * 0.9, 0.0, height * 0.80), (x + r + 0.002, 0.0, height * 0.70)],
        )
        yield rod("rubber", 0.02, (x + r, 0.0, height * 0.75), (x + r, 0.0, height * 0.66))


@shape("kit")
def kit(asset: Asset) -> Iterator[Part]:
    """A case on a wall; `sign` "cross" marks first aid, otherwise it is a fire blanket with pull tabs."""
    width, _, height, hw, hd = extents(asset)
    body = coating(text(asset, "colour", "white"))
    first_aid = text(asset, "sign", "") == "cross"
    inset, top = (0.001, height - 0.003) if first_aid else (0.0, height)
    yield rounded(body, span(hw - inset), (-hd, hd - 0.003), (0.0 if first_aid else 0.04, top), 0.015)
    if first_aid:
        yield block("plastic_grey", span(hw), span(0.002), (0.001, height - 0.001))
        arm, z, y = min(width, height) * 0.27, height / 2.0, (hd - 0.003, hd)
        yield block("signal_green", span(arm), y, span(arm * 0.34, z))
        yield block("signal_green", span(arm * 0.34), y, span(arm, z))
        yield block("plastic_dark", span(hw * 0.2), span(0.012), (height - 0.012, height))
    else:
        for x in (-hw * 0.45, hw * 0.45):
            yield block("print_black", span(0.012, x), span(0.003), (0.0, 0.05))
        yield block("paper", span(hw * 0.75), (hd - 0.003, hd - 0.001), (height * 0.30, height * 0.86))
        yield from lines(width * 0.6, height * 0.25, 4, 0.0, hd - 0.001, height * 0.5)
        yield block("safety_red", span(hw * 0.6), (hd - 0.002, hd), (height * 0.72, height * 0.82))


@shape("sign")
def sign(asset: Asset) -> Iterator[Part]:
    """A safety sign: a warning triangle over lines of print."""
    width, _, height, hw, hd = extents(asset)
    face = hd - 0.0024
    yield block("paper", span(hw), (-hd, face), (0.0, height))
    yield block("safety_yellow", span(hw * 0.94), (face - 0.001, face + 0.0004), (height * 0.36, height * 0.98))
    yield from triangle(height * 0.44, 0.0, face, height * 0.62)
    yield from lines(width * 0.8, height * 0.24, 4, 0.0, face, height * 0.18)


@shape("exit_sign")
def exit_sign(asset: Asset) -> Iterator[Part]:
    """A green plate with a white door, a walking figure and an arrow toward the door."""
    _, _, height, hw, hd = extents(asset)
    face, print_ = hd - 0.002, (hd - 0.002, hd)
    yield block("plastic_white", span(hw), (-hd, hd - 0.006), (0.0, height))
    yield block("signal_green", span(hw - 0.006), (hd - 0.006, face), (0.006, height - 0.006))
    # The front is seen with +x to its left.
    yield block("paper", (-0.86 * hw, -0.52 * hw), print_, (0.14 * height, 0.86 * height))
    yield cylinder("paper", 0.14 * height, 0.002, (-0.18 * hw, hd - 0.001, 0.78 * height), ALONG_Y)
    yield block("paper", (-0.24 * hw, -0.10 * hw), print_, (0.40 * height, 0.68 * height))
    for low, high in ((-0.38, -0.20), (-0.14, 0.06)):
        yield block("paper", (low * hw, high * hw), print_, (0.16 * height, 0.26 * height))
    yield block("paper", (-0.24 * hw, -0.10 * hw), print_, (0.26 * height, 0.40 * height))
    yield block("paper", (0.20 * hw, 0.80 * hw), print_, (0.46 * height, 0.56 * height))
    yield block("paper", (0.20 * hw, 0.32 * hw), print_, (0.34 * height, 0.68 * height))
