"""Cabinets, refrigerators, shelves, bins, cylinders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from labgym.assets.model import SHELL, Asset, Cavity
from labgym.assets.shapes.fixtures import bar_handle, diamond, frame, gauge, knob, lines, louvres, panel_screen
from labgym.assets.shapes.joints import Joint, door, moving
from labgym.assets.shapes.materials import coating, substance
from labgym.assets.shapes.parts import ALONG_Y, Part, Spans, band, block, column, cylinder, revolved, rod, rounded, span
from labgym.assets.shapes.registry import count, extents, flag, shape, text
from labgym.errors import OptionError

LEAF_M = 0.007
"""Thickness of a door leaf, meters."""
HANDLE_M = 0.012
"""Depth in front of a door that its handle takes, meters."""


def cavity(asset: Asset) -> Cavity:
    """Return the cavity of an asset whose shape requires one.

    Raises:
        OptionError: the asset is not hollow.
    """
    if asset.cavity is None:
        raise OptionError(
            f"shape {asset.shape.name!r} of asset {asset.name!r} needs a cavity; give it one, or another shape"
        )
    return asset.cavity


def carcass(asset: Asset, material: str, lining: str | None = None, front: float | None = None) -> Iterator[Part]:
    """Sides, back, floor, top and shelves round an asset's hollow, up to `front` along y."""
    _, _, height, hw, hd = extents(asset)
    hollow = cavity(asset)
    x0, x1, back, inner = hollow.edges
    face = hd if front is None else front
    yield block(material, span(hw), (-hd, face), (hollow.z1, height))
    yield block(material, (-hw, x0), (-hd, face), (0.0, hollow.z1))
    yield block(material, (x1, hw), (-hd, face), (0.0, hollow.z1))
    yield block(material, (x0, x1), (-hd, back), (0.0, hollow.z1))
    yield block(lining or material, (x0, x1), (back, face), (hollow.z0 - min(SHELL, hollow.z0), hollow.z0))
    for surface in asset.surfaces:
        if hollow.z0 + SHELL < surface.z < hollow.z1:
            yield block(lining or material, (x0, x1), (back, inner - 0.004), (surface.z - SHELL, surface.z))


@shape("cabinet")
def cabinet(asset: Asset) -> Iterator[Part]:
    """A chemicals cabinet with one or two doors, handles, vents and a hazard diamond; `glass` glazes the doors."""
    width, _, height, hw, hd = extents(asset)
    color = coating(text(asset, "colour", "grey"))
    hollow = cavity(asset)
    face = hd - HANDLE_M
    yield from carcass(asset, color, "galvanised", face - LEAF_M)
    low = max(hollow.z0 - SHELL, 0.04)
    yield block("powder_dark", span(hw - 0.01), (hd - HANDLE_M - LEAF_M - 0.02, face - LEAF_M + 0.004), (0.0, low))
    doors = count(asset, "doors", 2)
    pitch, glazed = width / doors, flag(asset, "glass")
    y, z = (face - LEAF_M, face), (low + 0.004, height - 0.008)
    joints = []
    for k in range(doors):
        x = (-hw + k * pitch + 0.003, -hw + (k + 1) * pitch - 0.003)
        # Two doors meet in the middle; a single one opens at its left edge as seen from the front.
        left = doors == 2 and k == 0
        kind = "glazed door" if glazed else "cabinet door"
        joint = door(f"door_{k + 1}", kind, (x, y, z), "low" if left else "high", closes=True)
        yield from moving(joint, glazed_door(color, (x, y, z)) if glazed else _plain_door(color, (x, y, z), low))
        edge = x[1] - 0.035 if left else x[0] + 0.035
        yield from moving(joint, _grip(edge, face, hd, height))
        joints.append(joint)
    if "sign" in asset.shape.parameters:
        yield from _hazard_front(asset, text(asset, "sign", "warning"), joints, face)


def _plain_door(material: str, leaf: Spans, low: float) -> Iterator[Part]:
    """A plain door with vents above a height."""
    x, y, z = leaf
    middle = (x[0] + x[1]) / 2.0
    yield block(material, x, y, z)
    yield from louvres(span(0.06, middle), y[1], (low + 0.03, low + 0.07), 3)


def _grip(edge: float, face: float, front: float, height: float) -> Iterator[Part]:
    """The handle of a cabinet's door and a lock below it."""
    grip = min(0.28, height * 0.22)
    yield from bar_handle(edge, face, front, span(grip / 2.0, height * 0.52), "plastic_black")
    yield cylinder("chrome", 0.018, 0.006, (edge, face + 0.003, height * 0.52 - grip / 2.0 - 0.04), ALONG_Y)


def _hazard_front(asset: Asset, symbol: str, joints: Sequence[Joint], face: float) -> Iterator[Part]:
    width, _, height, *_ = extents(asset)
    doors = len(joints)
    size = min(0.24, 0.42 * width / doors, 0.34 * height)
    for k, joint in enumerate(joints):
        x = -width / 2.0 + (k + 0.5) * width / doors
        yield from moving(joint, diamond(symbol, size, x, face, height * 0.74))
    x = -width / 2.0 + 0.5 * width / doors
    plate = min(0.30, 0.6 * width / doors)
    z = height * 0.74 - size * 0.5 - 0.06
    label = block("paper", span(plate / 2.0, x), (face, face + 0.001), span(0.028, z))
    yield from moving(joints[0], [label, *lines(plate * 0.86, 0.04, 2, x, face + 0.001, z)])


def glazed_door(material: str, leaf: Spans) -> Iterator[Part]:
    """A framed door with a pane."""
    (x, y, z), rail = leaf, 0.045
    yield from frame(material, x, y, z, rail)
    middle = (y[0] + y[1]) / 2.0
    yield block("sash_glass", (x[0] + rail, x[1] - rail), span(0.001, middle), (z[0] + rail, z[1] - rail))


@shape("wall_cabinet")
def wall_cabinet(asset: Asset) -> Iterator[Part]:
    """A wall cupboard with glazed doors."""
    width, _, height, hw, hd = extents(asset)
    face = hd - HANDLE_M
    yield from carcass(asset, "laminate_grey", "laminate_white", face - LEAF_M)
    doors = count(asset, "doors", 2)
    pitch = width / doors
    for k in range(doors):
        x = (-hw + k * pitch + 0.003, -hw + (k + 1) * pitch - 0.003)
        y, z = (face - LEAF_M, face), (0.004, height - 0.004)
        joint = door(f"door_{k + 1}", "glazed door", (x, y, z), "high" if k % 2 else "low", closes=True)
        yield from moving(joint, glazed_door("laminate_white", (x, y, z)))
        edge = x[1] - 0.022 if k % 2 == 0 else x[0] + 0.022
        yield from moving(joint, bar_handle(edge, face, hd, (0.06, 0.18)))


@shape("gas_cabinet")
def gas_cabinet(asset: Asset) -> Iterator[Part]:
    """A ventilated cylinder cabinet: a door with a wired window, a duct collar on top."""
    width, depth, height, hw, hd = extents(asset)
    hollow = cavity(asset)
    color, face = coating(text(asset, "colour", "grey")), depth / 2.0 - HANDLE_M
    roof = height - 0.04
    x0, x1, back, _ = hollow.edges
    yield block(color, span(hw), (-hd, face - LEAF_M), (hollow.z1, roof))
    for side in ((-hw, x0), (x1, hw)):
        yield block(color, side, (-hd, face - LEAF_M), (0.0, hollow.z1))
    yield block(color, (x0, x1), (-hd, back), (0.0, hollow.z1))
    yield block(color, (x0, x1), (back, face - LEAF_M), (0.0, hollow.z0))
    yield column("galvanised", min(width, depth) * 0.42, 0.0, 0.0, (roof, height))
    x, y, z = (-hw + 0.003, hw - 0.003), (face - LEAF_M, face), (0.05, roof - 0.01)
    leaf = [
        block(color, x, y, z),
        block("screen_dark", span(hw * 0.45), (face, face + 0.002), (height * 0.62, height * 0.82)),
        *bar_handle(-hw + 0.05, face, hd, (height * 0.44, height * 0.56), "plastic_black"),
        *louvres(span(hw * 0.6), face, (0.10, 0.24), 6),
        *diamond("warning", 0.16, 0.0, face, height * 0.50),
    ]
    yield from moving(door("door", "cabinet door", (x, y, z), "high", closes=True), leaf)


@shape("fridge")
def fridge(asset: Asset) -> Iterator[Part]:
    """A refrigerator, freezer or ice machine with one door."""
    width, depth, height, hw, hd = extents(asset)
    face = hd - 0.035
    if flag(asset, "ice"):
        yield from _ice_machine(width, depth, height)
        return
    freezer, hollow = flag(asset, "freezer"), cavity(asset)
    body = "powder_white"
    inner = max(face - 0.05, hollow.edges[3])
    yield from carcass(asset, body, "plastic_light", inner)
    base = min(0.12, hollow.z0 * 0.8)
    yield block("powder_dark", span(hw - 0.001), (inner - 0.002, face - 0.02), (0.0, base))
    yield from louvres(span(hw * 0.8), face - 0.02, (base * 0.25, base * 0.85), 4)
    z = (base + 0.006, height - (0.16 if freezer else 0.10 if height > 1.0 else 0.07))
    yield block("plastic_light", span(hw), (inner, face - 0.01), (z[1] + 0.006, height))
    yield from panel_screen("screen", span(0.07), face - 0.01, (z[1] + 0.022, height - 0.016))
    joint = door("door", "appliance door", (span(hw), (inner, face), z), "high", closes=True)
    if flag(asset, "glass_door"):
        yield from moving(joint, glazed_door("powder_grey", (span(hw - 0.002), (inner, face), z)))
        yield block("lamp", span(hw * 0.6), (hollow.y, hollow.y + 0.03), (hollow.z1 - 0.008, hollow.z1 - 0.001))
    else:
        yield from moving(joint, [rounded(body, span(hw), (inner, face), z, 0.012)])
    grip = z[0] + 0.35 * (z[1] - z[0]), z[0] + 0.75 * (z[1] - z[0])
    yield from moving(joint, bar_handle(-hw + 0.05, face, hd, grip))
    if "sign" in asset.shape.parameters:
        sign = diamond(text(asset, "sign", "warning"), min(0.16, 0.3 * height), 0.0, face, height * 0.62)
        yield from moving(joint, sign)
    if freezer:
        yield from moving(joint, bar_handle(hw * 0.2, face, hd, (height * 0.42, height * 0.55), "plastic_dark"))
        stripe = block("signal_blue", (-hw * 0.5, hw * 0.7), (face, face + 0.002), (height * 0.72, height * 0.76))
        yield from moving(joint, [stripe])


def _ice_machine(width: float, depth: float, height: float) -> Iterator[Part]:
    hw, hd = width / 2.0, depth / 2.0
    yield rounded("stainless", span(hw), (-hd, hd - 0.03), (0.05, height), 0.015)
    for x in (-hw + 0.04, hw - 0.04):
        for y in (-hd + 0.04, hd - 0.08):
            yield column("plastic_black", 0.04, x, y, (0.0, 0.05))
    yield rounded("plastic_dark", span(hw * 0.85), (hd - 0.032, hd - 0.010), (height * 0.50, height * 0.88), 0.01)
    yield block("stainless", span(hw * 0.4), (hd - 0.010, hd), (height * 0.52, height * 0.55))
    yield from louvres(span(hw * 0.8), hd - 0.03, (height * 0.12, height * 0.34), 7)


@shape("shelf")
def shelf(asset: Asset) -> Iterator[Part]:
    """Open shelving of steel or wood, standing on a floor or bench or hung on a wall."""
    _, _, height, hw, hd = extents(asset)
    hollow = cavity(asset)
    steel = text(asset, "material", "steel") == "steel"
    board, frame = ("laminate_white", "powder_grey") if steel else (substance("wood"), "powder_dark")
    x0, x1, back, _ = hollow.edges
    for x in ((-hw, x0), (x1, hw)):
        yield block(frame, x, span(hd), (0.0, height))
    # On a bench's middle it is looked through from behind.
    pane = "window_glass" if asset.placing == "desktop" else frame
    yield block(pane, (x0, x1), (-hd, back), (hollow.z0 - SHELL if hollow.z0 > SHELL else 0.0, height))
    for z in [hollow.z1 + SHELL if height - hollow.z1 >= SHELL - 1e-9 else height, hollow.z0]:
        yield block(board, (x0, x1), (back, hd - 0.004), (max(z - SHELL, 0.0), min(z, height)))
    for surface in asset.surfaces:
        if hollow.z0 + SHELL < surface.z < hollow.z1:
            yield block(board, (x0, x1), (back, hd - 0.004), (surface.z - SHELL, surface.z))
    for surface in asset.surfaces:
        yield block("edge_blue" if steel else "powder_dark", (x0, x1), (hd - 0.004, hd), (surface.z - SHELL, surface.z))


@shape("bin")
def waste_bin(asset: Asset) -> Iterator[Part]:
    """A waste bin: a tapering box, with `lid` a pedal bin with a hazard mark."""
    width, _, height, hw, hd = extents(asset)
    lid = flag(asset, "lid")
    color = coating(text(asset, "colour", "grey"))
    top = height * 0.88 if lid else height
    if not lid:
        yield rounded(color, span(hw * 0.9), span(hd * 0.9), (0.0, top - 0.02), 0.05)
        yield rounded(color, span(hw), span(hd), (top - 0.05, top - 0.006), 0.05)
        yield rounded("plastic_black", span(hw * 0.86), span(hd * 0.86), (top - 0.01, top), 0.05)
        return
    yield rounded(color, span(hw * 0.93), (-hd * 0.93, hd * 0.90), (0.02, top), 0.04)
    yield rounded("plastic_dark", span(hw * 0.9), (-hd * 0.9, hd * 0.86), (0.0, 0.02), 0.04)
    yield rounded(color, span(hw), (-hd, hd * 0.97), (top + 0.004, height - 0.008), 0.04)
    yield rounded("plastic_dark", span(hw * 0.5), span(hd * 0.5), (height - 0.008, height), 0.03)
    yield block("plastic_dark", span(hw * 0.3), (hd * 0.8, hd), (0.01, 0.03))
    yield from diamond("warning", min(width, height) * 0.42, 0.0, hd * 0.90, height * 0.52)


@shape("waste_station")
def waste_station(asset: Asset) -> Iterator[Part]:
    """A waste bay: a steel tray with shelves, canister bays and a top board."""
    _, _, height, hw, hd = extents(asset)
    hollow = cavity(asset)
    x0, x1, back, _ = hollow.edges
    for x in ((-hw, x0), (x1, hw)):
        yield block("powder_grey", x, span(hd), (0.0, height))
    yield block("powder_grey", (x0, x1), (-hd, back), (0.0, height))
    yield block("laminate_grey", (x0, x1), (back, hd - 0.008), (hollow.z1, height))
    yield block("safety_yellow", (x0, x1), (hd - 0.008, hd), (hollow.z1, height))
    for surface in asset.surfaces:
        yield block("galvanised", (x0, x1), (back, hd - 0.004), (surface.z - SHELL, surface.z))
        yield block("safety_yellow", (x0, x1), (hd - 0.004, hd), (surface.z - SHELL, surface.z))
    yield block("powder_dark", (x0, x1), (back, hd - 0.06), (0.0, hollow.z0 - SHELL))


SHOULDERS = {"black": "gas_black", "green": "gas_red", "grey": "gas_dark_green"}
"""Shoulder colors of EN 1089-3 by the catalog's body colour: nitrogen black, hydrogen red, argon dark green."""
BODIES = {"black": "gas_grey", "green": "gas_red", "grey": "gas_grey"}


@shape("gas_cylinder")
def gas_cylinder(asset: Asset) -> Iterator[Part]:
    """A gas cylinder: colored shoulder, valve with handwheel, regulator with two gauges, label."""
    width, _, height, *_ = extents(asset)
    radius, color = width / 2.0, text(asset, "colour", "grey")
    body, shoulder = BODIES.get(color, "gas_grey"), SHOULDERS.get(color, "gas_grey")
    straight, neck = height * 0.80, height * 0.90
    shell = radius - 0.0008
    yield revolved(body, [(shell * 0.86, 0.0), (shell, 0.02), (shell, straight * 0.9)])
    yield revolved(
        shoulder,
        [
            (shell, straight * 0.9),
            (shell, straight),
            (radius * 0.86, height * 0.85),
            (radius * 0.5, height * 0.885),
            (radius * 0.28, neck),
        ],
    )
    yield column("brass", 0.034, 0.0, 0.0, (neck, height - 0.02))
    yield column("cast_iron", 0.065, 0.0, 0.0, (height - 0.022, height))
    yield cylinder("brass", 0.022, radius * 0.8, (0.0, radius * 0.4, height * 0.945), ALONG_Y)
    for side in (-1.0, 1.0):
        yield from gauge(side * 0.045, radius * 0.55, radius * 0.75, height * 0.955, 0.058)
        yield rod("brass", 0.010, (0.0, radius * 0.6, height * 0.945), (side * 0.045, radius * 0.6, height * 0.95))
    yield from knob("plastic_black", 0.04, 0.0, radius * 0.7, radius, height * 0.93)
    yield band("paper", 2.0 * radius, (height * 0.55, height * 0.64))
