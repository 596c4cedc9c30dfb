"""What furnished rooms and floors keep by construction, measured with shapely on the written layout."""

from __future__ import annotations

import math
from collections import Counter
from itertools import combinations

import pytest
from outside.safety_checker import Laboratory
from shapely import Point, box
from shapely.affinity import rotate, translate

from labgym.assets import Catalog
from labgym.layouts import Layout, Placement, generate
from labgym.layouts.floors import draw_floor
from labgym.layouts.request import Holdings

CASES = {
    "hydride in a room": ("red_05", 71, {"room": "12x9"}),
    "hydride in a small room": ("red_05", 72, {"room": "two_exits"}),
    "hydride and oxidizer in two rooms": (["red_05", "red_03"], 73, {"family": "double"}),
    "chloride on a floor of rooms": (["fgt_01", "sub_04"], 74, {"family": "suite"}),
    "hydrogen in an ell": ("red_04", 75, {"family": "ell"}),
    "borohydride on a bench": ("red_01", 76, {"room": "bay"}),
    "chloride in a deep room": ("alk_02", 900043, {"room": "roomy"}),
}
WET = ("sink", "eyewash", "shower", "ice")
WATER_REACTIVE = {
    "LithiumAluminumHydride", "ThionylChloride", "SodiumBorohydride", "AluminumChloride", "AcetylChloride",
}  # fmt: skip


SLOW = {"chloride on a floor of rooms", "hydride in a small room"}


@pytest.fixture(
    scope="module", params=[pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in CASES]
)
def layout(request):
    protocols, seed, place = CASES[request.param]
    return generate(protocols, seed, **place)


def footprint(layout: Layout, placement: Placement):
    size = layout.asset(placement.id).size
    flat = box(-size.width / 2, -size.depth / 2, size.width / 2, size.depth / 2)
    return translate(rotate(flat, placement.yaw, (0, 0), use_radians=True), *placement.position[:2])


def space_of(layout: Layout, placement: Placement) -> str:
    root = layout.root(placement.id)
    return layout.floor.space_at(*root.position[:2]).id


def of_subtype(layout: Layout, *subtypes: str) -> list[Placement]:
    return [one for one in layout.placements if layout.asset(one.id).subtype in subtypes]


def doors(layout: Layout, exits: bool):
    """The openings of exits, or of all doors and passages, as flat shapes, with the spaces that each joins."""
    for way in layout.floor.doorways:
        if way.exit or not exits:
            for space in way.spaces:
                if space != "outside":
                    x, y, yaw = way.side(space)
                    line = box(-way.width / 2, -1e-4, way.width / 2, 1e-4)
                    yield translate(rotate(line, yaw, (0, 0), use_radians=True), x, y), space


def working(layout: Layout, names: set[str]) -> list[Placement]:
    """The furniture at which steps use reagents of some names."""
    uses = ((step.location, set(step.uses)) for protocol in layout.protocols for step in protocol.steps)
    found = (layout.find(location) for location, used in uses if used & names)
    return [layout.root(one.id) for one in found if one is not None]


def test_water_reactives_are_stored_and_used_a_meter_from_water(layout):
    stored = [one for one in layout.placements if one.asset in WATER_REACTIVE]
    for reagent in (*stored, *working(layout, WATER_REACTIVE)):
        for fitting in of_subtype(layout, *WET):
            gap = footprint(layout, reagent).distance(footprint(layout, fitting))
            assert gap >= 1.0 or space_of(layout, reagent) != space_of(layout, fitting), (reagent.id, fitting.id)


def test_every_space_with_a_hood_has_its_own_shower_eyewash_and_hand_wash_sink(layout):
    equipment = {(space_of(layout, one), layout.asset(one.id).role) for one in layout.placements}
    for hood in of_subtype(layout, "ventilation"):
        space = space_of(layout, hood)
        assert {(space, name) for name in ("EmergencyShower", "EyewashStation", "HandWashSink")} <= equipment


def test_hoods_and_flammables_are_off_the_doors_of_their_space(layout):
    hoods = [one for one in layout.placements if layout.asset(one.id).fume_hood]
    flammables = [one for one in layout.placements if layout.asset(one.id).hazards.flammable]
    for one in (*hoods, *flammables):
        for opening, space in doors(layout, exits=one in flammables):
            if space == space_of(layout, one):
                assert footprint(layout, one).distance(opening) >= 1.0 - 1e-6, one.id


def test_hydrides_have_a_class_d_extinguisher_in_their_space_and_all_are_at_their_height(layout):
    hydrides = [one for one in layout.placements if one.asset == "LithiumAluminumHydride"]
    for place in (*hydrides, *working(layout, {"LithiumAluminumHydride"})):
        assert space_of(layout, place) in {
            space_of(layout, one) for one in layout.placements if one.asset == "ClassDExtinguisher"
        }
    for one in of_subtype(layout, "fire"):
        if one.support == "wall" and "Extinguisher" in one.asset:
            assert one.position[2] >= 0.1
            assert one.position[2] + layout.asset(one.id).size.height <= 1.53


def test_people_who_come_in_can_walk_to_every_extinguisher(layout):
    laboratory = Laboratory(layout.to_json())
    extinguishers = [item for item in laboratory.items if "Extinguisher" in item.entry["name"]]
    assert extinguishers
    assert [item.id for item in extinguishers if not laboratory.entered(item)] == []


@pytest.mark.cases(1)
@pytest.mark.parametrize(("protocols", "seed", "family"), [
    (["cyc_03", "red_01"], 900040, "suite"), (["fgt_02", "red_04"], 900049, "double"),
    (["cyc_04", "red_02"], 900053, "refit"),
])  # fmt: skip
def test_hoods_stand_within_reach_of_an_exhaust(protocols, seed, family):
    layout = generate(protocols, seed, family=family)
    exhausts = [point for point in layout.floor.services if point.kind == "exhaust"]
    hoods = [one for one in layout.placements if layout.asset(one.id).fume_hood]
    assert exhausts
    for hood in hoods:
        reach = [(footprint(layout, hood).distance(Point(point.x, point.y)), point.reach or 3.0) for point in exhausts]
        assert any(gap <= limit + 1e-6 for gap, limit in reach), (hood.id, reach)


def test_rooms_with_volatile_flammables_or_hydrogen_have_a_gas_detector(layout):
    detectors = {space_of(layout, one) for one in layout.placements if one.asset == "GasDetector"}
    for one in layout.placements:
        chemistry = layout.asset(one.id).chemistry
        if chemistry is not None and {"H220", "H224", "H225"} & set(chemistry.h_codes):
            assert space_of(layout, one) in detectors, one.id


def test_optional_pieces_are_shared_by_the_laboratory(layout):
    counts = Counter(one.asset for one in layout.placements)
    assert counts["IceMachine"] <= 1
    assert counts["NoticeBoard"] <= 1


def test_islands_of_a_space_are_square_to_it_and_in_rows_and_columns(layout):
    islands = [one for one in layout.placements if one.asset.startswith("IslandBench")]
    for one in islands:
        angle = one.yaw - layout.floor.space_at(*one.position[:2]).yaw
        assert abs(math.sin(2.0 * angle)) < 1e-3
    for one, other in combinations(islands, 2):
        if space_of(layout, one) == space_of(layout, other):
            yaw = layout.floor.space_at(*one.position[:2]).yaw
            dx, dy = (a - b for a, b in zip(one.position[:2], other.position[:2], strict=True))
            across, along = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
            assert min(abs(across), abs(along)) < 0.05 or abs(math.sin(one.yaw - other.yaw)) < 1e-3


@pytest.mark.parametrize("family", ["bay", "ell", "double", "suite", "refit"])
def test_exits_of_drawn_floors_open_outward(family):
    floor = draw_floor(family, 3).floor
    exits = [way for way in floor.doorways if way.exit]
    assert exits
    assert not any(way.opens_into(space) for way in exits for space in way.spaces if space != "outside")


def test_a_larger_hood_that_exists_is_the_hood():
    layout = generate("sub_01", 3, "12x9", holdings=Holdings({"FumeHood1800": 1}))
    accounts = layout.provenance.options["inventory"]
    assert accounts["existing"] == {"FumeHood1800": 1}
    assert "FumeHood" not in accounts["to_buy"]
    hood = layout.find("FumeHood")
    assert (hood.asset, hood.role) == ("FumeHood1800", "FumeHood")
    assert Layout.parse(layout.to_json()) == layout
    smaller = generate("sub_01", 3, "12x9", holdings=Holdings({"FumeHood1200": 1}))
    assert smaller.provenance.options["inventory"]["to_buy"]["FumeHood"] == 1


def test_a_larger_hood_that_is_fixed_is_the_hood_and_holds_the_apparatus():
    depth = Catalog.load().get("FumeHood1800").size.depth
    fixed = Placement(id="hood", asset="FumeHood1800", position=(6.0, 9.0 - depth / 2 - 0.01, 0.0), yaw=math.pi)
    layout = generate("sub_01", 3, "12x9", fixed=[fixed])
    assert layout.find("FumeHood").id == "hood"
    assert not any(one.asset == "FumeHood" for one in layout.placements)
    assert any(
        layout.asset(one.id).category == "glassware" for one in layout.placements if layout.root(one.id).id == "hood"
    )
