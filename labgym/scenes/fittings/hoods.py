"""Ducts of hoods, and hoses in them: cooling water of condensers and vacuum of filter flasks."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.shapes.parts import ALONG_Y, Part, Vector, block, column, cylinder, rod
from labgym.geometry import OrientedBox
from labgym.scenes.fittings.hosts import Host, Installation, Item, moved, overlap
from labgym.scenes.fittings.sweep import curve, hose

NOZZLES = 0.17
"""Height of the nozzles above the work surface of a hood, meters."""
SPREAD = 0.05
"""Distance of the two water nozzles from the middle of their condenser, meters."""
BORE, VACUUM_BORE = 0.010, 0.013
"""Diameters of water and vacuum hoses, meters."""
REACH = 0.06
"""Length of a nozzle, meters."""
HOOD_BORE, CABINET_BORE = 0.25, 0.10
"""Diameters of the ducts of hoods and of ventilated cabinets, meters; a hood's is that of the stub on its top."""
STUB_Y = -0.05
"""Place of a hood's stub along its depth, meters."""
CUFF, SEAM, FLANGE = 0.08, 0.30, 0.012
"""Height of the flexible cuff above the hood, distance between the seams of a duct, and thickness of its ceiling
flange, meters."""


def hood_hoses(host: Host) -> Iterator[Installation]:
    """Yield the hoses of the condensers and filter flasks that are assembled to apparatus in a hood.

    A piece has no hoses if something stands between its stand and the back wall.
    """
    cavity = host.asset.cavity
    if not host.asset.fume_hood or cavity is None:
        return
    back, level = cavity.y - cavity.depth / 2.0, cavity.z0 + NOZZLES
    for item in host.items:
        stand, name = item.stand, item.asset.shape.name
        if stand is None or name not in ("condenser", "filter_flask") or not _open_behind(host, stand, back, level):
            continue
        if name == "condenser":
            yield host.installation("hose", _water(item, back, level), owner=item.id)
        else:
            yield host.installation("hose", _vacuum(item, back, level), owner=item.id)


def _open_behind(host: Host, stand: OrientedBox, back: float, level: float) -> bool:
    """Whether nothing stands in the way from a stand to the back wall, at the height of the nozzles."""
    x0, _, x1, _ = stand.bounds()
    behind = OrientedBox(stand.x, (back + stand.y) / 2.0, x1 - x0, stand.y - back, 0.0, level - 0.03, level + 0.15)
    others = [item.box for item in host.items if item.box is not stand and item.stand is not stand]
    return not any(overlap(behind, box) for box in others if box != stand)


def _water(item: Item, back: float, level: float) -> Iterator[Part]:
    """Hoses from the ends of the jacket to two nozzles; the barbs are those of the condenser's shape."""
    size = item.asset.size
    for side, height in ((1.0, 0.14 * size.height + 0.03), (-1.0, 0.90 * size.height - 0.03)):
        x, y = item.box.to_world(side * size.width / 2.0, 0.0)
        barb: Vector = (x, y, item.box.z0 + height)
        dx, dy = item.box.to_world(side, 0.0)
        out = (0.10 * (dx - item.box.x), 0.10 * (dy - item.box.y), -0.03)
        nozzle = item.box.x + side * SPREAD
        yield from moved(_nozzle("signal_green" if side > 0.0 else "plastic_grey"), nozzle, back, level)
        end: Vector = (nozzle, back + REACH, level)
        yield hose("silicone_blue", BORE, curve(barb, out, (0.0, -0.12, 0.0), end))


def _vacuum(item: Item, back: float, level: float) -> Iterator[Part]:
    """A hose from the barb of a filter flask to a nozzle."""
    size = item.asset.size
    x, y = item.box.to_world(size.width / 2.0, 0.0)
    dx, dy = item.box.to_world(1.0, 0.0)
    out = (0.09 * (dx - item.box.x), 0.09 * (dy - item.box.y), -0.02)
    barb: Vector = (x, y, item.box.z0 + 0.80 * size.height)
    yield from moved(_nozzle("safety_yellow"), x, back, level)
    yield hose("hose_red", VACUUM_BORE, curve(barb, out, (0.0, -0.12, 0.0), (x, back + REACH, level)))


def _nozzle(color: str) -> Iterator[Part]:
    """A nozzle with a valve on a wall at y = 0, its barb towards +y."""
    yield cylinder("chrome", 0.034, 0.008, (0.0, 0.004, 0.0), ALONG_Y)
    yield rod("chrome", 0.013, (0.0, 0.0, 0.0), (0.0, REACH + 0.005, 0.0))
    yield block(color, (-0.013, 0.013), (0.014, 0.026), (0.006, 0.024))


def ducts(host: Host) -> Iterator[Installation]:
    """Yield the duct of a hood or a ventilated cabinet, from its top to the ceiling."""
    height = host.asset.size.height
    if host.asset.fume_hood:
        bore, y = HOOD_BORE, STUB_Y
    elif "ventilated" in host.asset.specs.features:
        bore, y = CABINET_BORE, 0.0
    else:
        return
    if host.ceiling - height > 2.0 * FLANGE:
        yield host.installation("duct", _duct(bore, y, height, host.ceiling))


def _duct(bore: float, y: float, low: float, high: float) -> Iterator[Part]:
    cuff = min(CUFF, (high - low) / 3.0)
    yield column("plastic_dark", bore + 0.012, 0.0, y, (low, low + cuff))
    yield column("duct_steel", bore, 0.0, y, (low, high))
    seams = int((high - low - cuff) / SEAM)
    for k in range(1, seams + 1):
        z = low + cuff + k * (high - low - cuff) / (seams + 1)
        yield column("galvanised", bore + 0.010, 0.0, y, (z - 0.006, z + 0.006))
    yield column("galvanised", bore + 0.08, 0.0, y, (high - FLANGE, high))
