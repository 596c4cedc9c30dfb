"""Accessories of floors: every space has its own, as rules and habits ask."""

from __future__ import annotations

import math

import pytest

from labgym.layouts import generate

REACH = 15.2
"""Greatest walk from places of work to an extinguisher, meters (NFPA 10: 9.1 to 15.2 m); 9.1 m is preferred, but the
wall near a place of work may have no part with the free space in front that an extinguisher needs."""
SHOWER_WALK = 16.8
"""Greatest walk to an eyewash, meters (ANSI/ISEA Z358.1: 10 s)."""


@pytest.fixture(scope="module", params=[("suite", 34), ("double", 33)], ids=lambda param: param[0])
def layout(request):
    family, seed = request.param
    return generate("red_03", seed, family=family)


def inside(layout, space):
    """The floor and wall objects of a space."""
    where = {p.id: layout.floor.space_at(*p.position[:2]) for p in layout.placements if p.support in ("floor", "wall")}
    return [layout.placement(name) for name, found in where.items() if found is not None and found.id == space.id]


def spaces(layout, *uses):
    return [space for space in layout.floor.spaces if space.use in uses]


def test_an_extinguisher_is_near_every_place_of_work_of_its_space(layout):
    for space in spaces(layout, "laboratory", "instrument"):
        placed = inside(layout, space)
        stands = [p.position for p in placed if layout.asset(p.id).subtype == "fire"]
        for place in placed:
            if place.support == "floor" and layout.asset(place.id).clearance > 0.0:
                assert min(math.dist(place.position[:2], at[:2]) for at in stands) <= REACH


def test_every_laboratory_has_an_eyewash_within_10_s(layout):
    for space in spaces(layout, "laboratory"):
        placed = inside(layout, space)
        washes = [p.position for p in placed if layout.asset(p.id).subtype in ("eyewash", "shower")]
        assert washes
        for place in placed:
            assert min(math.dist(place.position[:2], at[:2]) for at in washes) <= SHOWER_WALK


def test_a_sign_hangs_over_every_exit(layout):
    signs = [p for p in layout.placements if p.asset == "ExitSign"]
    for way in (way for way in layout.floor.doorways if way.exit):
        x, y, _ = way.side(way.spaces[0])
        over = [p for p in signs if math.dist(p.position[:2], (x, y)) < 0.05]
        room = layout.floor.space(way.spaces[0]).ceiling - way.opening.height
        assert len(over) == (1 if room > 0.27 else 0)
        assert all(sign.position[2] > way.opening.height for sign in over)


def test_rooms_where_people_work_have_stools_and_share_at_most_four_clocks(layout):
    worked = spaces(layout, "laboratory", "write-up")
    rooms = spaces(layout, "laboratory", "write-up", "instrument")
    clocks = [p for p in layout.placements if p.asset == "Clock"]
    assert len(clocks) == min(len(rooms), 4)
    assert len({layout.floor.space_at(*p.position[:2]).id for p in clocks}) == len(clocks)
    for space in worked:
        assets = [layout.asset(p.id) for p in inside(layout, space)]
        assert sum(asset.subtype == "seat" for asset in assets) <= 4
    seated = [layout.floor.space_at(*p.position[:2]) for p in layout.placements if layout.asset(p.id).subtype == "seat"]
    assert len({space.id for space in seated if space is not None}) >= 2
