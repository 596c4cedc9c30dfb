"""Installations that join furniture and devices with the building: ducts, trunking, taps, cables, hoses, chains.

These parts are visible only: they have no solids. They follow from the layout alone.
"""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets import Asset
from labgym.assets.shapes.registry import EMPTY, INVERTED
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.scenes.fittings.cables import cables
from labgym.scenes.fittings.cylinders import cylinders
from labgym.scenes.fittings.evaporators import evaporator_hoses
from labgym.scenes.fittings.hoods import ducts, hood_hoses
from labgym.scenes.fittings.hosts import Host, Installation, hosts
from labgym.scenes.fittings.outlets import Outlet, sinks, supplies

__all__ = ["Installation", "drawn_asset", "installations"]
STORES = ("glassware_cabinet", "rack")
"""Subtypes of furniture in which glassware is stored clean."""
FUNNEL = "funnel"
"""Shape of conical funnels, which cannot stand on their stem."""


def drawn_asset(layout: Layout, placement_id: str) -> Asset:
    """Return the catalog entry whose shape a scene shows for a placement.

    Stored glassware has no liquid on floors with service points.
    """
    asset = layout.asset(placement_id)
    support = layout.placement(placement_id).support
    if asset.category != "glassware" or support in (FLOOR, WALL) or not layout.floor.services:
        return asset
    if layout.asset(support).subtype not in STORES:
        return asset
    parameters = {**asset.shape.parameters, EMPTY: True, **({INVERTED: True} if asset.shape.name == FUNNEL else {})}
    return asset.model_copy(update={"shape": asset.shape.model_copy(update={"parameters": parameters})})


def installations(layout: Layout) -> tuple[Installation, ...]:
    """Return the installations of a layout, in the order of their furniture; none without service points."""
    if not layout.floor.services:
        return ()
    return tuple(installation for host in hosts(layout) for installation in _of(host))


def _of(host: Host) -> Iterator[Installation]:
    yield from ducts(host)
    yield from cylinders(host)
    basins = list(sinks(host))
    for sink in basins:
        yield host.installation("sink", sink.parts)
    built_in = [sink.box for sink in basins]
    outlets: list[Outlet] = []
    for supply in supplies(host, built_in):
        outlets += supply.outlets
        if supply.parts:
            yield host.installation(supply.kind, supply.parts, supply.wall)
    yield from cables(host, outlets, built_in)
    yield from evaporator_hoses(host)
    yield from hood_hoses(host)
