"""Necks: things parked at a route until a disc of one radius reaches the goal and a wider one does not."""

from __future__ import annotations

import math

import numpy as np

from labgym.envs.conditions.parked import ParkedThing, with_things
from labgym.errors import OptionError
from labgym.geometry import Array, OrientedBox
from labgym.layouts import Layout
from labgym.navigation import GoalPair, ShortestPaths

ASSETS = ("Carton", "SteelDrum", "InstrumentTrolley", "ServiceTrolley")
"""Things that stand in aisles; floors with clutter have all of them."""
MOST = 6
"""Greatest number of things that are parked for one drive."""
PLACES = 40
"""Number of places that are tried for each of them."""
FREE = 1.2
"""Distance from start and goal within which nothing is parked, meters."""

RADII = (0.30, 0.35, 0.40, 0.45)
"""Radii of the discs by which drives are classed, meters: that of planning first."""


def widest_disc(layout: Layout, pair: GoalPair) -> float | None:
    """Return the radius of the widest disc of `RADII` for which a path joins start and goal; None if none does."""
    ends = pair.start[:2], pair.goal[:2]
    return next((radius for radius in RADII[::-1] if ShortestPaths(layout, radius).connected(*ends)), None)


def has_neck(layout: Layout, pair: GoalPair, neck: tuple[float, float]) -> bool:
    """Whether all routes of a pair lead through a neck: the first disc reaches the goal, and the second does not.

    Both discs must fit at start and goal, so that the neck is on the way.
    """
    passes, stops = (ShortestPaths(layout, radius) for radius in neck)
    ends = pair.start[:2], pair.goal[:2]
    return all(stops.free(*end) for end in ends) and passes.connected(*ends) and not stops.connected(*ends)


def neck_things(
    layout: Layout, pair: GoalPair, neck: tuple[float, float], rng: np.random.Generator
) -> tuple[ParkedThing, ...] | None:
    """Return things that make a neck on every route of a pair; None if none were found.

    A thing is parked next to the shortest route of the wider disc, so that the narrower one still passes, until no
    route of the wider disc is left.

    Args:
        layout: the floor. pair: the drive.
        neck: radii of the disc that passes and of the one that does not, meters.
        rng: draws the places.
    """
    passing, stopped = neck
    ends = pair.start[:2], pair.goal[:2]
    things: tuple[ParkedThing, ...] = ()
    wide = ShortestPaths(layout, stopped)
    if not all(wide.free(*end) for end in ends):
        return None
    while (route := wide.path(*ends)) is not None:
        if len(things) == MOST:
            return None
        parked = _parked(layout, things, route.points, ends, neck, rng)
        if parked is None:
            return None
        things = (*things, parked)
        wide = ShortestPaths(with_things(layout, things), stopped)
    if not ShortestPaths(with_things(layout, things), passing).connected(*ends):
        return None
    return things


def _parked(
    layout: Layout,
    things: tuple[ParkedThing, ...],
    route: Array,
    ends: tuple[tuple[float, ...], tuple[float, ...]],
    neck: tuple[float, float],
    rng: np.random.Generator,
) -> ParkedThing | None:
    """Return a thing next to a route that changes it, and leaves a way for the narrower disc."""
    passing, stopped = neck
    here = with_things(layout, things)
    room = ShortestPaths(here, passing)
    for _ in range(PLACES):
        x, y, along = _place(route, float(rng.random()))
        asset = ASSETS[int(rng.integers(len(ASSETS)))]
        measures = layout.catalog.get(asset).size
        size = measures.width, measures.depth
        # The thing's middle is off the route, so that the gap on the other side is between both diameters.
        side, gap = 1.0 if rng.random() < 0.5 else -1.0, float(rng.uniform(passing + 0.01, stopped - 0.01))
        off = gap + float(rng.uniform(0.3, 0.7)) * size[1] / 2.0
        yaw = along + float(rng.uniform(-0.2, 0.2))
        px, py = x - side * off * math.sin(along), y + side * off * math.cos(along)
        if min(math.dist((px, py), end) for end in ends) < FREE + max(size) / 2.0:
            continue
        thing = ParkedThing(asset, round(px, 3), round(py, 3), round(yaw, 4))
        if not _stands(room, thing, size):
            continue
        try:
            then = with_things(layout, (*things, thing))
        except OptionError:
            continue
        if ShortestPaths(then, passing).connected(*ends) and not ShortestPaths(then, stopped).space.holds(route).all():
            return thing
    return None


def _place(route: Array, share: float) -> tuple[float, float, float]:
    """Return a point of a route at a share of its length, and the direction of the route there."""
    steps = np.linalg.norm(np.diff(route, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    place = share * float(along[-1])
    leg = min(int(np.searchsorted(along, place, side="right")) - 1, len(steps) - 1)
    part = (place - float(along[leg])) / max(float(steps[leg]), 1e-9)
    (x, y), (u, v) = route[leg], route[leg + 1] - route[leg]
    return float(x + part * u), float(y + part * v), math.atan2(v, u)


def _stands(room: ShortestPaths, thing: ParkedThing, size: tuple[float, float]) -> bool:
    """Whether nothing is within 2 cm of a thing on the floor."""
    corners = OrientedBox(thing.x, thing.y, size[0] + 0.04, size[1] + 0.04, thing.yaw).corners()
    sides = np.roll(corners, -1, axis=0) - corners
    points = np.concatenate([[(thing.x, thing.y)], *(corners + sides * part for part in (0.0, 0.25, 0.5, 0.75))])
    barriers = room.space.barriers
    clearances = barriers.clearance(points)
    return bool(barriers.inside(points).all() and (clearances > 0.0).all() and clearances[0] > min(size) / 2.0)
