"""Adds equipment that safety requires: extinguishers, detectors, kits and signs on walls, containers on stations."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox
from labgym.layouts.fitting import Keepouts, on_surface, on_wall, over_door
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move, without
from labgym.layouts.placement import WALL
from labgym.layouts.request import Holdings, Request
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.equipment import Requirement, missing_equipment, required_equipment
from labgym.layouts.rules.regulations.premises import PERSON
from labgym.layouts.rules.safety.heights import gases
from labgym.layouts.rules.safety.rooms import Lacking, lacking_equipment
from labgym.layouts.rules.safety.signs import EXIT_SIGN, EXIT_SIGNS, marks, stray_signs, unmarked_exits
from labgym.layouts.rules.site import Site
from labgym.protocols import Protocol

STEP = 0.05
"""Gap between a person and what is taken from a wall, meters."""
TRIES = 200
"""Places on the walls of a space for which it is asked whether a person comes there."""
CARRIED_STREAM = 0xCA
"""Sub-stream of the seed for the places of equipment on its carriers."""
LOW = 0.3
"""Height of the bottom of a detector for a gas heavier than air, meters."""


def equipped(layout: Layout, request: Request) -> Layout:
    """Return a layout with the wall equipment that its rooms lack, near what calls for it.

    Nothing is added where the walls are full, or where nothing may be bought.
    """
    site, holdings = Site(Arrangement.of(layout), request.protocol), request.holdings
    for one in lacking_equipment(site):
        asset, placed = request.catalog.get(one.asset), [placement.asset for placement in layout.placements]
        if asset.placing != WALL or not (holdings is None or holdings.equips(asset.name, placed)):
            continue
        for height in heights(site, asset, one):
            layout = next(hung(layout, site, asset, one, height, request.protocol), layout)
    return layout


def supplied(layout: Layout, request: Request) -> Layout:
    """Return a layout with the equipment that it lacks on walls and on what carries it, and with signs at its exits.

    Nothing is added where walls and carriers are full, or where nothing may be bought.
    """
    arrangement = Arrangement.of(layout)
    required = required_equipment(arrangement, request.protocol, request.rules.equipment)
    absent = missing_equipment(arrangement, required, frozenset())
    for one in required:
        if one.asset in absent:
            layout = next(_carried(layout, request, one), layout)
    return marked(layout, request.protocol, request.holdings) if EXIT_SIGNS in request.rules.facility else layout


def marked(layout: Layout, protocol: Protocol | None, holdings: Holdings | None = None) -> Layout:
    """Return a layout with a sign at each exit that needs one; those that mark no exit are used first."""
    site, asset = Site(Arrangement.of(layout), protocol), layout.catalog.get(EXIT_SIGN)
    loose = [sign for sign in stray_signs(site) if may_move(layout, sign)]
    unmarked = unmarked_exits(site)
    layout = without(layout, loose)
    for way in (way for way in layout.floor.doorways if way.exit):
        entrance = next((one for one in unmarked if one.label == way.label), None)
        placed = [placement.asset for placement in layout.placements]
        if entrance is None or not (loose or holdings is None or holdings.equips(EXIT_SIGN, placed)):
            continue
        place = over_door(layout, asset, way, way.spaces[0]) or on_wall(
            layout,
            asset,
            Keepouts.of(layout, protocol),
            entrance.pose[:2],
            space=way.spaces[0],
            accept=partial(marks, way_out=entrance),
        )
        if place is not None:
            layout = layout.replace(placements=(*layout.placements, place))
            loose = loose[1:]
    return layout


def _carried(layout: Layout, request: Request, requirement: Requirement) -> Iterator[Layout]:
    """Yield layouts with one more piece, which meets a requirement, on a wall or on each free slot of its carrier."""
    holdings, generator = request.holdings, np.random.default_rng([request.seed, CARRIED_STREAM])
    placed = [placement.asset for placement in layout.placements]
    for name in sorted(requirement.accepted, key=lambda name: (name != requirement.asset, name)):
        if holdings is not None and not holdings.equips(name, placed):
            continue
        if requirement.carrier == WALL:
            yield from added_on_wall(layout, request.catalog.get(name), request.protocol)
            continue
        for carrier in (p.id for p in layout.placements if layout.asset(p.id).role == requirement.carrier):
            for slot in range(len(layout.asset(carrier).surfaces)):
                asset = request.catalog.get(name)
                piece = on_surface(layout, asset, carrier, slot, request.profile, generator)
                if piece is not None:
                    yield layout.replace(placements=(*layout.placements, piece))


def added_on_wall(layout: Layout, asset: Asset, protocol: Protocol | None) -> list[Layout]:
    """Return layouts with one more wall unit, each at the free place nearest to another exit."""
    keepouts = Keepouts.of(layout, protocol)
    doors = [way.side(way.spaces[0])[:2] for way in layout.floor.doorways if way.exit]
    places = [on_wall(layout, asset, keepouts, door) for door in doors]
    return [layout.replace(placements=(*layout.placements, place)) for place in places if place is not None]


def heights(site: Site, asset: Asset, lacking: Lacking) -> list[float]:
    """Return the heights of the bottom at which a room needs a piece of equipment, meters.

    A gas detector hangs low for a gas heavier than air; a room with gases of both kinds needs two.
    """
    densities = gases(site).get(int(site.rooms[lacking.spaces[0]]), {}) if asset.subtype == "sensor" else {}
    own = {LOW if density == "heavy" else asset.mount_height for density in densities}
    return sorted(own or {asset.mount_height})


def hung(
    layout: Layout, site: Site, asset: Asset, lacking: Lacking, height: float, protocol: Protocol | None
) -> Iterator[Layout]:
    """Yield layouts with an asset on walls of a room that lacks it, those nearest to what calls for it first.

    Extinguishers hang where a person who comes from there can take them, with a free front if there is such a place.
    Last come the places nearest to the middle and the corners of each space, which may be out of reach.

    Args:
        layout: the layout of the site, or a later one with more objects.
        height: of the bottom, meters.
    """
    x, y, _ = layout.root(lacking.causes[0]).position
    keepouts, premises = Keepouts.of(layout, protocol), site.roadmap.premises
    start = premises.pose(site.arrangement.row(lacking.causes[0]))

    def reached(box: OrientedBox) -> bool:
        """Whether a person who stands before the object can come from what calls for it."""
        stand = box.to_world(0.0, box.depth / 2.0 + PERSON + STEP)
        return premises.paths.free(*stand) and premises.paths.connected(start, (*stand, 0.0))

    accept = reached if asset.subtype == "fire" else None
    spaces = [layout.floor.spaces[index] for index in lacking.spaces]
    boxes = [(space.id, box) for space in spaces for box in space.boxes]
    elsewhere = [(space, (px, py)) for space, box in boxes for px, py in [(box.x, box.y), *box.corners().tolist()]]
    ways = [(space.id, (x, y), accept, asset.clearance) for space in spaces]
    ways += [(space.id, (x, y), accept, 0.0) for space in spaces]
    ways += [(space, near, None, 0.0) for space, near in elsewhere]
    yielded = set[tuple[float, float, float]]()
    for space_id, near, reachable, front in ways:
        placement = on_wall(
            layout, asset, keepouts, near, height=height, space=space_id, accept=reachable, front=front, tries=TRIES
        )
        if placement is not None and placement.position not in yielded:
            yielded.add(placement.position)
            yield layout.replace(placements=(*layout.placements, placement))
