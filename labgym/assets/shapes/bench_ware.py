"""Small tools on a bench: rods, pipettes, stands, clamps, rings, plates."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.assets.model import Asset
from labgym.assets.shapes.materials import substance
from labgym.assets.shapes.parts import (
    ALONG_X,
    ALONG_Y,
    Part,
    block,
    column,
    cylinder,
    ellipsoid,
    plate,
    revolved,
    rod,
    rounded,
    sphere,
    turned,
)
from labgym.assets.shapes.registry import extents, flag, shape, text
from labgym.assets.shapes.vessels import hollow


@shape("rod")
def straight_tool(asset: Asset) -> Iterator[Part]:
    """A rod or a long hand tool, standing; `horizontal` lays it along x."""
    width, depth, height = extents(asset)
    material = substance(text(asset, "material", "steel"))
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "horizontal"):
        yield Part("capsule", (height, height, width), (0.0, 0.0, hd), ALONG_X, material)
        yield cylinder(material, height, height * 0.25, (0.0, 0.0, hd), ALONG_X)
    elif flag(asset, "spatula"):
        yield column(material, min(width, depth) * 0.3, 0.0, 0.0, (height * 0.2, height * 0.75))
        yield block(material, (-hw, hw), (-0.0012, 0.0012), (0.0, height * 0.22))
        yield ellipsoid(material, (width, depth, height * 0.28), (0.0, 0.0, height * 0.86))
    elif flag(asset, "forceps") or flag(asset, "tongs"):
        tongs = flag(asset, "tongs")
        thick = min(depth, 0.010)
        grip = height * (0.55 if tongs else 1.0)
        for side in (-1.0, 1.0):
            bottom, top = (side * 0.006, side * (hw - 0.006)) if tongs else (side * 0.002, side * (hw - 0.005))
            yield rod(material, 0.008, (bottom, 0.0, 0.0005), (-bottom if tongs else 0.0, 0.0, grip))
            if tongs:
                yield rod(material, 0.007, (-bottom, 0.0, grip), (-top, 0.0, height * 0.9))
                yield cylinder(material, 0.024, thick, (side * (hw - 0.012), 0.0, height - 0.012), ALONG_Y)
        if not tongs:
            yield block(material, (-hw, hw), (-hd, hd), (height * 0.55, height * 0.62))
        else:
            yield cylinder("chrome", 0.016, depth, (0.0, 0.0, grip), ALONG_Y)
    else:
        scaled = flag(asset, "scale")
        yield column(material, width * (0.9 if scaled else 1.0), 0.0, 0.0, (0.0, height))
        if scaled:
            yield column("print_red", width * 0.92, 0.0, 0.0, (0.0, height * 0.06))
            yield column("paper", width, 0.0, 0.0, (height * 0.2, height * 0.9))


@shape("pipette")
def pipette(asset: Asset) -> Iterator[Part]:
    """A pipette, tip down; `bulb`, `micro` and `syringe` vary it."""
    width, depth, height = extents(asset)
    r, hw, hd = min(width, depth) / 2.0, width / 2.0, depth / 2.0
    if flag(asset, "micro"):
        yield revolved("polypropylene", [(0.001, 0.0), (0.004, height * 0.24), (0.006, height * 0.25)])
        yield revolved("plastic_light", [(0.006, height * 0.24), (0.009, height * 0.5), (0.012, height * 0.55)])
        yield rounded("plastic_white", (-hw, hw), (-hd * 0.55, hd * 0.6), (height * 0.52, height * 0.90), 0.012)
        yield block("screen_dark", (-hw * 0.5, hw * 0.5), (hd * 0.6 - 0.001, hd * 0.62), (height * 0.62, height * 0.76))
        yield block("abs_blue", (-hw * 0.6, hw * 0.6), (-hd, -hd * 0.5), (height * 0.83, height * 0.88))
        yield block("plastic_white", (-hw * 0.3, hw * 0.3), (hd * 0.55, hd), (height * 0.80, height * 0.84))
        yield column("abs_blue", 0.016, 0.0, 0.0, (height * 0.9, height))
    elif flag(asset, "syringe"):
        yield revolved("ptfe", [(0.0006, 0.0), (0.002, height * 0.12), (0.002, height * 0.16)])
        yield column("polypropylene", 1.4 * r, 0.0, 0.0, (height * 0.14, height * 0.72))
        yield column("rubber", 1.2 * r, 0.0, 0.0, (height * 0.36, height * 0.42))
        yield column("blue_liquid", 1.2 * r, 0.0, 0.0, (height * 0.15, height * 0.36))
        yield column("polypropylene", 2.0 * r, 0.0, 0.0, (height * 0.71, height * 0.74))
        yield column("plastic_white", 0.6 * r, 0.0, 0.0, (height * 0.42, height))
        yield column("plastic_white", 1.6 * r, 0.0, 0.0, (height * 0.98, height))
    elif flag(asset, "bulb"):
        yield revolved(
            "borosilicate",
            [(r * 0.15, 0.0), (r * 0.25, height * 0.4), (r * 0.7, height * 0.48), (r * 0.7, height * 0.8)],
        )
        yield revolved("rubber", [(r * 0.8, height * 0.78), (r, height * 0.84), (r, height * 0.95), (r * 0.5, height)])
    else:
        belly = [
            (r * 0.12, 0.0),
            (r * 0.4, height * 0.08),
            (r * 0.4, height * 0.42),
            (r, height * 0.46),
            (r, height * 0.56),
        ]
        yield revolved("borosilicate", [*belly, (r * 0.4, height * 0.6), (r * 0.4, height)])
        yield column("abs_blue", r * 0.9, 0.0, 0.0, (height * 0.78, height * 0.785))


@shape("ring")
def ring(asset: Asset) -> Iterator[Part]:
    """A ring lying flat; `rod` gives it the arm of a retort ring."""
    width, depth, height = extents(asset)
    material = substance(text(asset, "material", "cork"))
    outer, arm = depth / 2.0, flag(asset, "rod")
    thick = height if arm else outer * 0.42
    inner = outer - min(thick, 0.010 if arm else thick)
    low, high = (height * 0.3, height * 0.7) if arm else (0.0, height)
    x = -width / 2.0 + outer if arm else 0.0
    yield revolved(material, [(inner, low), (outer, low), (outer, high), (inner, high), (inner, low)], (x, 0.0, 0.0))
    if arm:
        yield cylinder(
            material,
            0.010,
            width - depth - 0.02,
            (x + outer + (width - depth) / 2.0 - 0.012, 0.0, height / 2.0),
            ALONG_X,
        )
        yield block("cast_iron", (width / 2.0 - 0.03, width / 2.0), (-0.013, 0.013), (0.0, height))


@shape("stand")
def stand(asset: Asset) -> Iterator[Part]:
    """A retort stand; `tripod` is a burner's tripod, `pipettes` a carousel of pipettes."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    if flag(asset, "tripod"):
        outer = width / 2.0
        yield revolved(
            "cast_iron",
            [
                (outer - 0.016, height - 0.008),
                (outer, height - 0.008),
                (outer, height),
                (outer - 0.016, height),
                (outer - 0.016, height - 0.008),
            ],
        )
        for k in range(3):
            angle = math.pi / 2.0 + k * 2.0 * math.pi / 3.0
            x, y = (outer - 0.008) * math.cos(angle), (outer - 0.008) * math.sin(angle)
            yield column("cast_iron", 0.009, x, y, (0.0, height - 0.004))
    elif flag(asset, "pipettes"):
        yield column("plastic_dark", width, 0.0, 0.0, (0.0, 0.018))
        yield column("plastic_grey", 0.03, 0.0, 0.0, (0.018, height * 0.85))
        yield column("plastic_grey", width * 0.72, 0.0, 0.0, (height * 0.78, height * 0.82))
        yield sphere("plastic_dark", 0.04, (0.0, 0.0, height * 0.86))
        for k, colour in enumerate(
            ("abs_blue", "abs_red", "safety_yellow", "abs_green", "plastic_white", "poison_purple")
        ):
            angle = k * math.pi / 3.0
            x, y = (hw - 0.022) * math.cos(angle), (hd - 0.022) * math.sin(angle)
            yield revolved(
                "polypropylene", [(0.0012, height * 0.12), (0.004, height * 0.36), (0.006, height * 0.5)], (x, y, 0.0)
            )
            yield rounded(
                "plastic_white", (x - 0.012, x + 0.012), (y - 0.014, y + 0.014), (height * 0.48, height * 0.93), 0.008
            )
            yield column(colour, 0.015, x, y, (height * 0.93, height))
    else:
        yield rounded("cast_iron", (-hw, hw), (-hd, hd), (0.0, 0.014), 0.012)
        yield column("stainless", 0.012, 0.0, -hd + 0.03, (0.014, height))
        yield block("cast_iron", (-0.014, 0.014), (-hd + 0.012, -hd + 0.048), (height * 0.70, height * 0.74))
        yield cylinder("stainless", 0.009, depth * 0.6, (0.0, -hd + 0.03 + depth * 0.3, height * 0.72), ALONG_Y)
        for side in (-1.0, 1.0):
            yield rod(
                "chrome", 0.008, (side * 0.008, hd - 0.06, height * 0.72), (side * 0.024, hd - 0.022, height * 0.72)
            )


@shape("clamp")
def clamp(asset: Asset) -> Iterator[Part]:
    """A three-pronged clamp lying along x."""
    width, depth, height = extents(asset)
    hw, hd, z = width / 2.0, depth / 2.0, height / 2.0
    yield cylinder("chrome", min(0.012, height), width * 0.62, (-hw + width * 0.31, 0.0, z), ALONG_X)
    yield block("cast_iron", (hw * 0.1, hw * 0.38), (-0.016, 0.016), (0.0, height))
    yield cylinder("chrome", 0.008, depth * 0.9, (hw * 0.24, 0.0, z), ALONG_Y)
    for side in (-1.0, 1.0):
        yield rod("rubber", 0.010, (hw * 0.3, side * 0.008, z), (hw * 0.7, side * (hd - 0.005), z))
        yield rod("rubber", 0.010, (hw * 0.66, side * (hd - 0.005), z), (hw - 0.0005, side * (hd * 0.72), z))


@shape("jack")
def jack(asset: Asset) -> Iterator[Part]:
    """A scissor lift: two plates, crossed arms, and a spindle."""
    width, depth, height = extents(asset)
    hw, hd = width / 2.0, depth / 2.0
    yield block("aluminium", (-hw, hw), (-hd, hd), (0.0, 0.008))
    yield block("aluminium", (-hw, hw), (-hd, hd), (height - 0.008, height))
    reach, rise = width * 0.78, height - 0.03
    lean = math.atan2(rise, reach)
    for y in (-hd + 0.02, hd - 0.02):
        for way in (-1.0, 1.0):
            size = (math.hypot(reach, rise) - 0.012, 0.006, 0.012)
            yield plate("stainless", size, (0.0, y + way * 0.004, height / 2.0), turned((0.0, 1.0, 0.0), way * lean))
    yield cylinder("stainless", 0.010, width * 0.8, (0.0, 0.0, height / 2.0), ALONG_X)
    yield cylinder("plastic_black", min(0.04, height * 0.4), 0.016, (hw - 0.010, 0.0, height / 2.0), ALONG_X)


@shape("plate")
def flat_plate(asset: Asset) -> Iterator[Part]:
    """A wire gauze: a thin square with a ceramic disc."""
    width, depth, height = extents(asset)
    yield block(
        substance(text(asset, "material", "steel")),
        (-width / 2.0, width / 2.0),
        (-depth / 2.0, depth / 2.0),
        (0.0, height * 0.6),
    )
    yield column("porcelain", min(width, depth) * 0.62, 0.0, 0.0, (0.0, height))


@shape("balloon")
def balloon(asset: Asset) -> Iterator[Part]:
    """A gas balloon on a needle adapter, standing on its tap."""
    width, _, height = extents(asset)
    yield ellipsoid("abs_red", (width, width, height * 0.82), (0.0, 0.0, height * 0.59))
    yield revolved("abs_red", [(0.010, height * 0.12), (0.014, height * 0.16), (0.022, height * 0.22)])
    yield hollow("ptfe", [(0.0, 0.0), (0.012, 0.0), (0.008, height * 0.15)], 0.003)
