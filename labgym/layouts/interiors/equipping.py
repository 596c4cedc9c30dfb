"""Hangs the extinguishers and gas detectors that the rooms of a layout need."""

from __future__ import annotations

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.fitting import Keepouts, on_wall
from labgym.layouts.model import Layout
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations.premises import PERSON
from labgym.layouts.rules.safety.heights import gases
from labgym.layouts.rules.safety.rooms import Lacking, lacking_equipment
from labgym.layouts.rules.safety.site import Site

STEP = 0.05
"""Gap between a person and what is taken from a wall, meters."""
TRIES = 200
"""Places on the walls of a space for which it is asked whether a person comes there."""
LOW = 0.3
"""Height of the bottom of a detector for a gas heavier than air, meters."""


def equipped(layout: Layout, request: Request) -> Layout:
    """Return a layout with the wall equipment that its rooms lack, near what calls for it.

    Nothing is added where the walls are full, or where nothing may be bought.
    """
    site = Site.of(Arrangement.of(layout), request.protocol)
    for one in lacking_equipment(site):
        asset = request.catalog.get(one.asset)
        if asset.placing != WALL or not _may_add(layout, asset, request):
            continue
        densities = gases(site).get(int(site.rooms[one.spaces[0]]), {}) if asset.subtype == "sensor" else {}
        heights = {LOW if density == "heavy" else asset.mount_height for density in densities} or {asset.mount_height}
        for height in sorted(heights):
            layout = _hung(layout, site, asset, one, height, request)
    return layout


def _may_add(layout: Layout, asset: Asset, request: Request) -> bool:
    holdings = request.holdings
    if holdings is None or holdings.purchases != "none":
        return True
    return holdings.adds(asset.name, (placement.asset for placement in layout.placements))


def _hung(layout: Layout, site: Site, asset: Asset, lacking: Lacking, height: float, request: Request) -> Layout:
    """The layout with an asset on the wall nearest to what calls for it, in one of the spaces of the room.

    Where no place has a free front, it hangs where a person comes to it all the same.
    """
    x, y, _ = layout.root(lacking.causes[0]).position
    keepouts, premises = Keepouts.of(layout, request.protocol), site.roadmap.premises
    start = premises.pose(site.arrangement.row(lacking.causes[0]))

    def reached(box: OrientedBox) -> bool:
        """Whether a person who stands before the object can come from what calls for it."""
        stand = box.to_world(0.0, box.depth / 2.0 + PERSON + STEP)
        return premises.paths.free(*stand) and premises.paths.connected(start, (*stand, 0.0))

    accept = reached if asset.subtype == "fire" else None
    spaces = [layout.floor.spaces[index].id for index in lacking.spaces]
    ways = [(space, accept, asset.clearance) for space in spaces] + [(space, accept, 0.0) for space in spaces]
    for space, reachable, front in ways:
        placement = on_wall(layout, asset, keepouts, (x, y), height, space, reachable, front, TRIES)
        if placement is not None:
            return layout.replace(placements=(*layout.placements, placement))
    return layout
