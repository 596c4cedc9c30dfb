"""Distances of the rule set `touchstone` between the places where protocols work, on furnished floors."""

import math

import numpy as np
import pytest
from shapely import Polygon

from labgym.layouts.brief import Proximity, Unit
from labgym.layouts.generate import resolve_request
from labgym.layouts.ground import grounds
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.interiors.distances import neighborhoods
from labgym.layouts.interiors.distribution import distribute
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules import rule_set
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import goal_pose

SEVERAL = ("sub_01", "pro_05", "alk_04")
CASES = [("bay", 5, ("sub_01",)), ("double", 4, SEVERAL), ("suite", 6, SEVERAL), ("refit", 7, SEVERAL[:2])]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case[0])
def layout(request):
    family, seed, names = request.param
    return FloorProposer().propose(resolve_request(names, seed, None, "default", None, (), family=family))


def test_neighboring_places_share_a_space_and_flammables_keep_from_the_heat_of_others(layout):
    hood, station = layout.find("FumeHood"), layout.find("RotaryEvaporatorStation")
    ends = [goal_pose(layout.box(each.id))[:2] for each in (hood, station)]
    assert math.dist(*ends) <= 2.74
    assert layout.floor.space_at(*hood.position[:2]) is layout.floor.space_at(*station.position[:2])
    evaporator = next(p.id for p in layout.placements if layout.asset(p.id).name == "RotaryEvaporator")
    if layout.root(evaporator).id != hood.id:
        hot = Polygon(layout.box(evaporator).corners())
        inside = [p.id for p in layout.placements if p.support != FLOOR and layout.root(p.id).id == hood.id]
        assert all(Polygon(layout.box(item).corners()).distance(hot) >= 1.0 for item in inside)


def test_floors_of_several_protocols_have_no_violation_(layout):
    limits = rule_set("touchstone")
    for protocol in layout.protocols:
        assessment = evaluate_layout(layout, protocol, limits)
        of_places = [
            *assessment.of("near"),
            *assessment.of("ventilation"),
            *assessment.of("flammable"),
            *assessment.of("incompatible"),
        ]
        assert not [instance for instance in of_places if instance.hard]
        assert np.mean([instance.satisfaction for instance in of_places]) >= 0.99


def test_pairs_join_to_neighborhoods():
    pairs = [Proximity(*names, 1.0, "") for names in ("ab", "cd", "ef", "bc")]
    assert {"".join(sorted(group)) for group in neighborhoods(pairs)} == {"abcd", "ef"}


def test_a_neighborhood_stands_in_one_space():
    request = resolve_request("sub_01", 1, None, "default", None, (), family="suite")
    spaces, catalog = grounds(request.floor), request.catalog
    names = ("FumeHood", "RotaryEvaporatorStation", "PurificationBench")
    units = [
        Unit(name, asset, asset.size.width, asset.size.depth, 1.0)
        for name, asset in ((name, catalog.get(name)) for name in names)
    ]
    for seed in range(8):
        shares = distribute(units, spaces, request.habits, np.random.default_rng(seed), [frozenset(names)])
        assert [len(share) for share in shares.values() if share] == [3]
