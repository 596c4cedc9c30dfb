"""Trolleys, cartons, drums, a pallet truck and a floor sign."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.fixtures import castors
from labgym.assets.shapes.materials import coating
from labgym.assets.shapes.parts import ALONG_X, Part, block, column, cylinder, revolved, rod, side_profile
from labgym.assets.shapes.registry import count, extents, shape, text

WHEEL = 0.12
"""Height of a trolley's castors, meters."""
RAIL = 0.06
"""Height of the rail around a tray, meters."""
BAR = 0.022
"""Diameter of a trolley's tubes, meters."""


@shape("trolley")
def trolley(asset: Asset) -> Iterator[Part]:
    """A service trolley: trays with rails between four tubes, on castors."""
    width, depth, height = extents(asset)
    hw, hd, half = width / 2.0, depth / 2.0, BAR / 2.0
    yield from castors(hw - 0.05, hd - 0.05, WHEEL)
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield column("chrome", BAR, sx * (hw - half), sy * (hd - half), (WHEEL, height))
    trays = count(asset, "trays", 2)
    for k in range(trays):
        low = WHEEL + k * (height - RAIL - 0.02 - WHEEL) / max(trays - 1, 1)
        yield block("stainless", (-hw + half, hw - half), (-hd + half, hd - half), (low, low + 0.02))
        rail = low + RAIL
        for sign in (-1.0, 1.0):
            x, y = sign * (hw - half), sign * (hd - half)
            yield block("chrome", (-hw, hw), (y - half, y + half), (rail, rail + 0.02))
            yield block("chrome", (x - half, x + half), (-hd, hd), (rail, rail + 0.02))


@shape("cylinder_trolley")
def cylinder_trolley(asset: Asset) -> Iterator[Part]:
    """A gas cylinder strapped to a two-wheeled trolley."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    wheel, radius = 0.25, 0.115
    y, back = hd - radius - 0.01, hd - 2.0 * radius - 0.03
    for sign in (-1.0, 1.0):
        yield cylinder("rubber", wheel, 0.05, (sign * (hw - 0.025), -hd + wheel / 2.0, wheel / 2.0), ALONG_X)
        yield rod("safety_yellow", 0.03, (sign * 0.14, back, 0.05), (sign * 0.14, back, height * 0.72))
        yield rod("safety_yellow", 0.03, (sign * 0.14, back, height * 0.72), (sign * 0.14, -hd + 0.016, height * 0.82))
    yield cylinder("galvanised", 0.03, 2.0 * hw - 0.1, (0.0, -hd + wheel / 2.0, wheel / 2.0), ALONG_X)
    yield rod("rubber", 0.032, (-0.14, -hd + 0.016, height * 0.82), (0.14, -hd + 0.016, height * 0.82))
    yield block("safety_yellow", (-0.16, 0.16), (back, hd), (0.0, 0.04))
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
        yield block("plastic_black", (-radius - 0.01, radius + 0.01), (back, y), (z, z + 0.04))


@shape("carton")
def carton(asset: Asset) -> Iterator[Part]:
    """A closed cardboard box with tape along its flaps and a label."""
    width, depth, height = extents(asset)
    hw, hd, tape = width / 2.0, depth / 2.0, 0.001
    yield block("cardboard", (-hw, hw), (-hd, hd - tape), (0.0, height - tape))
    yield block("oil", (-hw, hw), (-0.025, 0.025), (height - tape, height))
    yield block("paper", (-0.3 * width, 0.0), (hd - tape, hd), (0.55 * height, 0.8 * height))


@shape("steel_drum")
def steel_drum(asset: Asset) -> Iterator[Part]:
    """A steel drum with rims, two rolling hoops and bungs."""
    width, _, height = extents(asset)
    rim, radius = width / 2.0, width / 2.0 - 0.008
    colour = coating(text(asset, "colour", "blue"))
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
    yield revolved(colour, profile)
    yield column("galvanised", 0.07, 0.65 * radius, 0.0, (height - 0.016, height - 0.004))
    yield column("galvanised", 0.04, -0.65 * radius, 0.0, (height - 0.016, height - 0.004))


@shape("pallet_truck")
def pallet_truck(asset: Asset) -> Iterator[Part]:
    """A hand pallet truck: two forks, a pump on steered wheels, an upright handle; the forks point along +y."""
    width, depth, height = extents(asset)
    hw, hd, fork = width / 2.0, depth / 2.0, 0.16
    heel = -hd + 0.36
    for sign in (-1.0, 1.0):
        x = sign * hw, sign * (hw - fork)
        yield block("safety_orange", x, (heel, hd), (0.035, 0.085))
        middle = sign * (hw - fork / 2.0)
        yield cylinder("rubber", 0.08, 0.07, (middle, hd - 0.15, 0.04), ALONG_X)
        yield cylinder("rubber", 0.18, 0.05, (sign * 0.06, -hd + 0.14, 0.09), ALONG_X)
    yield block("safety_orange", (-hw, hw), (heel - 0.08, heel), (0.035, 0.42))
    yield column("cast_iron", 0.11, 0.0, -hd + 0.14, (0.18, 0.46))
    top = height - 0.02
    yield rod("safety_orange", 0.04, (0.0, -hd + 0.14, 0.44), (0.0, -hd + 0.02, top - 0.16))
    for sign in (-1.0, 1.0):
        yield rod("safety_orange", 0.03, (0.0, -hd + 0.02, top - 0.16), (sign * 0.15, -hd + 0.02, top - 0.04))
    yield rod("rubber", 0.04, (-0.15, -hd + 0.02, top), (0.15, -hd + 0.02, top))


@shape("floor_sign")
def floor_sign(asset: Asset) -> Iterator[Part]:
    """A folding sign that warns of a wet floor: two plates that lean against each other."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    thick = 0.012
    for sign in (-1.0, 1.0):
        outline = [(sign * (hd - thick), 0.0), (sign * hd, 0.0), (sign * thick, height), (0.0, height)]
        yield side_profile("safety_yellow", outline if sign > 0 else outline[::-1], (-hw, hw))
    slope = (hd - thick) / height
    for low, high in ((0.62, 0.86), (0.50, 0.57)):  # an exclamation mark on the front
        y0, y1 = hd - slope * low * height, hd - slope * high * height
        mark = [(y0 - 0.002, low * height), (y0 + 0.001, low * height)]
        mark += [(y1 + 0.001, high * height), (y1 - 0.002, high * height)]
        yield side_profile("print_black", mark, (-0.12 * hw, 0.12 * hw))
