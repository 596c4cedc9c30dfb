"""Bench ware: tools, stands and clamps, and stands that hold a whole apparatus."""

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
    collar,
    column,
    cylinder,
    ellipsoid,
    plate,
    revolved,
    rod,
    rounded,
    span,
    sphere,
    tube,
    turned,
)
from labgym.assets.shapes.registry import extents, flag, shape, text
from labgym.assets.shapes.vessels import GLASS, bulb, hollow
from labgym.errors import OptionError


@shape("rod")
def straight_tool(asset: Asset) -> Iterator[Part]:
    """A rod or a long hand tool, standing; `horizontal` lays it along x."""
    width, depth, height, hw, hd = extents(asset)
    material = substance(text(asset, "material", "steel"))
    if flag(asset, "horizontal"):
        yield Part("capsule", (height, height, width), (0.0, 0.0, hd), ALONG_X, material)
        yield cylinder(material, height, height * 0.25, (0.0, 0.0, hd), ALONG_X)
    elif flag(asset, "spatula"):
        yield column(material, min(width, depth) * 0.3, 0.0, 0.0, (height * 0.2, height * 0.75))
        yield block(material, span(hw), span(0.0012), (0.0, height * 0.22))
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
            yield block(material, span(hw), span(hd), (height * 0.55, height * 0.62))
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
    width, depth, height, *_ = extents(asset)
    r, hw, hd = min(width, depth) / 2.0, width / 2.0, depth / 2.0
    if flag(asset, "micro"):
        yield revolved("polypropylene", [(0.001, 0.0), (0.004, height * 0.24), (0.006, height * 0.25)])
        yield revolved("plastic_light", [(0.006, height * 0.24), (0.009, height * 0.5), (0.012, height * 0.55)])
        yield rounded("plastic_white", span(hw), (-hd * 0.55, hd * 0.6), (height * 0.52, height * 0.90), 0.012)
        yield block("screen_dark", span(hw * 0.5), (hd * 0.6 - 0.001, hd * 0.62), (height * 0.62, height * 0.76))
        yield block("abs_blue", span(hw * 0.6), (-hd, -hd * 0.5), (height * 0.83, height * 0.88))
        yield block("plastic_white", span(hw * 0.3), (hd * 0.55, hd), (height * 0.80, height * 0.84))
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
    width, depth, height, *_ = extents(asset)
    material = substance(text(asset, "material", "cork"))
    outer, arm = depth / 2.0, flag(asset, "rod")
    thick = height if arm else outer * 0.42
    inner = outer - min(thick, 0.010 if arm else thick)
    low, high = (height * 0.3, height * 0.7) if arm else (0.0, height)
    x = -width / 2.0 + outer if arm else 0.0
    yield collar(material, (inner, outer), (low, high), (x, 0.0, 0.0))
    if arm:
        yield cylinder(
            material,
            0.010,
            width - depth - 0.02,
            (x + outer + (width - depth) / 2.0 - 0.012, 0.0, height / 2.0),
            ALONG_X,
        )
        yield block("cast_iron", (width / 2.0 - 0.03, width / 2.0), span(0.013), (0.0, height))


@shape("stand")
def stand(asset: Asset) -> Iterator[Part]:
    """A retort stand; `tripod` is a burner's tripod, `pipettes` a carousel of pipettes."""
    width, depth, height, hw, hd = extents(asset)
    if flag(asset, "tripod"):
        outer = width / 2.0
        yield collar("cast_iron", (outer - 0.016, outer), (height - 0.008, height))
        for k in range(3):
            angle = math.pi / 2.0 + k * 2.0 * math.pi / 3.0
            x, y = (outer - 0.008) * math.cos(angle), (outer - 0.008) * math.sin(angle)
            yield column("cast_iron", 0.009, x, y, (0.0, height - 0.004))
    elif flag(asset, "pipettes"):
        yield column("plastic_dark", width, 0.0, 0.0, (0.0, 0.018))
        yield column("plastic_grey", 0.03, 0.0, 0.0, (0.018, height * 0.85))
        yield column("plastic_grey", width * 0.72, 0.0, 0.0, (height * 0.78, height * 0.82))
        yield sphere("plastic_dark", 0.04, (0.0, 0.0, height * 0.86))
        for k, color in enumerate(
            ("abs_blue", "abs_red", "safety_yellow", "abs_green", "plastic_white", "poison_purple")
        ):
            angle = k * math.pi / 3.0
            x, y = (hw - 0.022) * math.cos(angle), (hd - 0.022) * math.sin(angle)
            yield revolved(
                "polypropylene", [(0.0012, height * 0.12), (0.004, height * 0.36), (0.006, height * 0.5)], (x, y, 0.0)
            )
            yield rounded("plastic_white", span(0.012, x), span(0.014, y), (height * 0.48, height * 0.93), 0.008)
            yield column(color, 0.015, x, y, (height * 0.93, height))
    else:
        yield rounded("cast_iron", span(hw), span(hd), (0.0, 0.014), 0.012)
        yield column("stainless", 0.012, 0.0, -hd + 0.03, (0.014, height))
        yield block("cast_iron", span(0.014), (-hd + 0.012, -hd + 0.048), (height * 0.70, height * 0.74))
        yield cylinder("stainless", 0.009, depth * 0.6, (0.0, -hd + 0.03 + depth * 0.3, height * 0.72), ALONG_Y)
        for side in (-1.0, 1.0):
            yield rod(
                "chrome", 0.008, (side * 0.008, hd - 0.06, height * 0.72), (side * 0.024, hd - 0.022, height * 0.72)
            )


@shape("clamp")
def clamp(asset: Asset) -> Iterator[Part]:
    """A three-pronged clamp lying along x."""
    width, depth, height, hw, hd = extents(asset)
    z = height / 2.0
    yield cylinder("chrome", min(0.012, height), width * 0.62, (-hw + width * 0.31, 0.0, z), ALONG_X)
    yield block("cast_iron", (hw * 0.1, hw * 0.38), span(0.016), (0.0, height))
    yield cylinder("chrome", 0.008, depth * 0.9, (hw * 0.24, 0.0, z), ALONG_Y)
    for side in (-1.0, 1.0):
        yield rod("rubber", 0.010, (hw * 0.3, side * 0.008, z), (hw * 0.7, side * (hd - 0.005), z))
        yield rod("rubber", 0.010, (hw * 0.66, side * (hd - 0.005), z), (hw - 0.0005, side * (hd * 0.72), z))


@shape("jack")
def jack(asset: Asset) -> Iterator[Part]:
    """A scissor lift: two plates, crossed arms, and a spindle."""
    width, _, height, hw, hd = extents(asset)
    yield block("aluminium", span(hw), span(hd), (0.0, 0.008))
    yield block("aluminium", span(hw), span(hd), (height - 0.008, height))
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
    width, depth, height, *_ = extents(asset)
    yield block(substance(text(asset, "material", "steel")), span(width / 2.0), span(depth / 2.0), (0.0, height * 0.6))
    yield column("porcelain", min(width, depth) * 0.62, 0.0, 0.0, (0.0, height))


@shape("balloon")
def balloon(asset: Asset) -> Iterator[Part]:
    """A gas balloon on a needle adapter, standing on its tap."""
    width, _, height, *_ = extents(asset)
    yield ellipsoid("abs_red", (width, width, height * 0.82), (0.0, 0.0, height * 0.59))
    yield revolved("abs_red", [(0.010, height * 0.12), (0.014, height * 0.16), (0.022, height * 0.22)])
    yield hollow("ptfe", [(0.0, 0.0), (0.012, 0.0), (0.008, height * 0.15)], 0.003)


ROD_M = 0.012
"""Diameter of a rod, meters."""
BASE_M = 0.010
"""Thickness of a base plate, meters."""
PLATE_M = 0.006
"""Thickness of the plate below a well, meters."""
PAD_M = 0.006
"""Thickness of the pads of a clamp, meters."""


@shape("apparatus_stand")
def apparatus_stand(asset: Asset) -> Iterator[Part]:
    """A stand for an apparatus.

    The parameters are lists of numbers in meters, separated by spaces, of several parts separated by semicolons:
    `rods` (x, y, top), `clamps` (x, y, z, radius of what they hold, y of their rod), `rings` (the same,
    of steel), `corks` and `wells` for joints (x, y, top, inner and outer radius), `blocks` (x, y, bottom, top,
    radius of the flask), `cones` of rubber (x, y, bottom, top, radii there and of the hole), `bends` of glass (x
    and z of both ends; y), `rack` (plates with holes).
    """
    _, _, height, hw, hd = extents(asset)
    if flag(asset, "rack"):
        yield from _rack(asset, hw, hd)
    else:
        yield from _base(asset, hw, hd, height)
    for x, y, top in _rows(asset, "rods", 3):
        yield column("stainless", ROD_M, x, y, (height, top))
    for x, y, z, radius, back in _rows(asset, "clamps", 5):
        yield from _arm(x, back, y - radius - 0.012, z)
        yield from _jaws(x, y, z, radius)
    for x, y, z, radius, back in _rows(asset, "rings", 5):
        yield from _arm(x, back, y - radius - 0.004, z - 0.004)
        outer = radius + 0.008
        yield collar("cast_iron", (radius, outer), (z - 0.008, z), (x, y, 0.0))
    for x, y, low, high, radius in _rows(asset, "blocks", 5):
        yield _block(x, y, low, high, radius)
    for x, y, low, high, below, above, bore in _rows(asset, "cones", 7):
        yield revolved("rubber", [(bore, low), (below, low), (above, high), (bore, high), (bore, low)], (x, y, 0.0))
    for x0, z0, x1, z1, y in _rows(asset, "bends", 5):
        rise = x1 - x0
        yield from tube(GLASS, 0.020, [(x0, y, z0), (x0 + rise, y, z0 + rise), (x1, y, z1 - 0.012)])
        yield revolved(GLASS, [(0.011, z1 - 0.02), (0.0135, z1 - 0.01), (0.0135, z1)], (x1, y, 0.0))


def _base(asset: Asset, hw: float, hd: float, height: float) -> Iterator[Part]:
    """The base of a stand with rods, or a block or ring of cork."""
    wells, corks = _rows(asset, "wells", 5), _rows(asset, "corks", 5)
    if wells:
        yield rounded("cork", span(hw), span(hd), (0.0, PLATE_M), 0.008)
    elif not corks:
        yield rounded("cast_iron", span(hw), span(hd), (0.0, height), 0.012)
    elif max(hw, hd) > max(outer for *_, outer in corks) + 1e-6:
        yield rounded("cork", span(hw), span(hd), (0.0, BASE_M), 0.012)
    for low, rings in ((PLATE_M, wells), (0.0, corks)):
        for x, y, top, inner, outer in rings:
            yield collar("cork", (inner, outer), (low, top), (x, y, 0.0))


def _arm(x: float, back: float, front: float, z: float) -> Iterator[Part]:
    """The boss on a rod at y = `back`, and the arm from it to y = `front`."""
    yield block("cast_iron", span(0.014, x), (back - 0.014, back + 0.022), span(0.010, z))
    yield cylinder("chrome", 0.009, front - back, (x, (front + back) / 2.0, z), ALONG_Y)
    yield cylinder("cast_iron", 0.018, 0.006, (x + 0.016, back, z), (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0))


def _jaws(x: float, y: float, z: float, radius: float) -> Iterator[Part]:
    """Two jaws whose pads touch a round piece from both sides."""
    root = y - radius - 0.014
    for side in (-1.0, 1.0):
        outer = side * (radius + PAD_M + 0.004)
        yield rod("cast_iron", 0.009, (x, root, z), (x + outer, root + 0.006, z))
        yield rod("cast_iron", 0.009, (x + outer, root + 0.006, z), (x + outer, y + 0.008, z))
        faces = sorted((x + side * radius, x + side * (radius + PAD_M)))
        yield block("rubber", (faces[0], faces[1]), span(0.007, y), span(0.008, z))


def _block(x: float, y: float, low: float, high: float, radius: float) -> Part:
    """An aluminum heating block with a nest for the lower third of a flask."""
    wall = radius + 0.014
    nest = [(r, low + 0.006 + z) for r, z in bulb(radius + 0.001, radius, 0.0, 1.25, 6)]
    sides = [(0.0, low), (wall, low), (wall, high), (nest[-1][0], high)]
    return revolved("aluminium", [*sides, *reversed(nest)], (x, y, 0.0))


def _rack(asset: Asset, hw: float, hd: float) -> Iterator[Part]:
    """A rack of two posts and two plates; every slot of the asset has a sleeve in the upper one."""
    _, _, height, *_ = extents(asset)
    top = max(fitting.z1 for fitting in asset.fittings)
    yield rounded("plastic_white", span(hw), span(hd), (0.0, height), 0.008)
    for side in (-1.0, 1.0):
        yield block("plastic_white", (side * hw, side * (hw - 0.012)), span(hd * 0.5), (height, top))
    for z in (top - 0.006, (height + top) / 2.0):
        reach = hd * 0.8
        for surface in asset.surfaces:
            bore = surface.width / 2.0
            yield collar("plastic_light", (bore, bore + 0.004), (z - 0.002, z + 0.006), (surface.x, surface.y, 0.0))
        yield block("plastic_white", span(hw), (-reach, -reach + 0.008), (z - 0.002, z + 0.006))
        yield block("plastic_white", span(hw), (reach - 0.008, reach), (z - 0.002, z + 0.006))


def _rows(asset: Asset, name: str, length: int) -> list[tuple[float, ...]]:
    """Return a parameter's parts, each with that many numbers.

    Raises:
        OptionError: it has another number of numbers, or something else.
    """
    rows = []
    for row in filter(None, (part.strip() for part in text(asset, name, "").split(";"))):
        try:
            numbers = tuple(float(word) for word in row.split())
        except ValueError:
            numbers = ()
        if len(numbers) != length:
            raise OptionError(
                f"shape parameter {name!r} of asset {asset.name!r} must hold {length} numbers a part, got {row!r}"
            )
        rows.append(numbers)
    return rows
