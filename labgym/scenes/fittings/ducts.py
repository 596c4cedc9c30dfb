"""Exhaust ducts from hoods and ventilated cabinets to the ceiling."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.shapes.parts import Part, column
from labgym.scenes.fittings.hosts import Host
from labgym.scenes.fittings.installation import Installation

HOOD_BORE, CABINET_BORE = 0.25, 0.10
"""Diameters of the ducts of hoods and of ventilated cabinets, meters; a hood's is that of the stub on its top."""
STUB_Y = -0.05
"""Place of a hood's stub along its depth, meters."""
CUFF, SEAM, FLANGE = 0.08, 0.30, 0.012
"""Height of the flexible cuff above the hood, distance between the seams of a duct, and thickness of its ceiling
flange, meters."""


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
