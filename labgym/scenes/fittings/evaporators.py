"""Hoses of a rotary evaporator: cooling water from two valves on the wall, and vacuum from a pump next to it."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.shapes.parts import ALONG_Y, Part, Vector, block, cylinder, rod
from labgym.scenes.fittings.hosts import Host, Installation, Item, moved
from labgym.scenes.fittings.outlets import DEEP, RISE, TALL
from labgym.scenes.fittings.sweep import curve, hose

CONDENSER_X, HEAD = -0.19, 0.60
"""Place of the condenser along the evaporator's width, meters, and of its lower end as a share of the height."""
JACKET = 0.045
"""Radius of the condenser's jacket, meters."""
BORE = 0.010
"""Diameter of the hoses, meters."""
TAPS = 0.07
"""Distance between the two water valves, meters."""
PUMP_REACH = 1.6
"""Largest distance to a pump that is connected, meters."""


def evaporator_hoses(host: Host) -> Iterator[Installation]:
    """Yield the hoses of each rotary evaporator on a bench."""
    for item in host.items:
        if item.asset.shape.name != "rotavap":
            continue
        parts = [*_water(host, item), *_vacuum(host, item)]
        if parts:
            yield host.installation("hose", parts, owner=item.id)


def _on_jacket(item: Item, height: float, side: float = -1.0) -> Vector:
    x, y = item.box.to_world(CONDENSER_X, side * JACKET)
    return x, y, item.box.z0 + height


def _water(host: Host, item: Item) -> Iterator[Part]:
    """Two valves on the trunking behind the condenser, and their hoses to the ends of the jacket."""
    backing = host.backing
    if backing is None:
        return
    low = host.asset.size.height + RISE
    face, z = -host.half[1] + DEEP, low + TALL / 2.0
    height = item.asset.size.height
    middle = item.box.to_world(CONDENSER_X, 0.0)[0]
    if not backing.free((middle - TAPS, middle + TAPS), low, low + TALL):
        return
    for side, level in ((-1.0, height * HEAD + 0.05), (1.0, height - 0.07)):
        x = middle + side * TAPS / 2.0
        yield from moved(_tap(), x, face, z)
        end = _on_jacket(item, level)
        start = (x, face + 0.05, z)
        yield hose("silicone_blue", BORE, curve(start, (0.0, 0.05, 0.06), (0.0, 0.10, 0.02), end))


def _tap() -> Iterator[Part]:
    """A water valve on a face at y = 0, with its hose barb towards +y."""
    yield cylinder("chrome", 0.032, 0.008, (0.0, 0.004, 0.0), ALONG_Y)
    yield rod("chrome", 0.014, (0.0, 0.0, 0.0), (0.0, 0.055, 0.0))
    yield block("signal_green", (-0.014, 0.014), (0.014, 0.026), (0.008, 0.024))


def _vacuum(host: Host, item: Item) -> Iterator[Part]:
    """A hose from the top of the condenser to the flask of the nearest pump on the same bench."""
    pumps = [other for other in host.items if other.asset.shape.name == "pump" and other.asset.placing == "desktop"]
    top = _on_jacket(item, item.asset.size.height - 0.006, 0.0)
    reachable = []
    for pump in pumps:
        size = pump.asset.size
        x, y = pump.box.to_world(0.39 * size.width, 0.15 * size.depth)
        inlet = (x, y, pump.box.z0 + 0.69 * size.height)
        distance = ((x - top[0]) ** 2 + (y - top[1]) ** 2) ** 0.5
        if distance <= PUMP_REACH:
            reachable.append((distance, pump.id, inlet))
    if reachable:
        inlet = min(reachable)[2]
        yield hose("hose_red", 0.013, curve(top, (0.0, 0.0, 0.07), (0.0, 0.0, -0.22), inlet))
