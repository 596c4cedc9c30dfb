"""What a user can rely on from `generate`."""

import os
import subprocess
import sys
import warnings

import pytest
from shapely import Polygon

from labgym.assets import Catalog
from labgym.errors import InfeasibleError, OptionError, SearchLimitWarning, UnknownNameError
from labgym.layouts import Door, Room, generate, room_presets
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.method import Method
from labgym.layouts.rules import rule_set
from labgym.layouts.rules.building import swing_area
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.zones import standing_in
from labgym.protocols import protocols

ROOMS = ("default", "tight", "roomy", "two_exits")
CASES = [(protocol, 7 + index, ROOMS[index % 4]) for index, protocol in enumerate(sorted(protocols()))]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join(map(str, case)))
def layout(request):
    return generate(*request.param)


def footprint(layout, placement_id):
    return Polygon(layout.box(placement_id).corners())


def floor_objects(layout):
    return [placement for placement in layout.placements if placement.support == "floor"]


@pytest.mark.cases(10)
def test_a_generated_layout_has_no_violation_and_everything_the_protocol_needs(layout):
    assessment = evaluate_layout(layout, layout.protocol, navigation=True, rules="paper")
    assert assessment.v == 0
    assert assessment.missing == ()
    assert assessment.fitness == pytest.approx(1.0)
    assert assessment.transitions
    assert all(transition.feasible for transition in assessment.transitions)


def test_floor_footprints_are_disjoint_and_inside_the_room(layout):
    room = Polygon([(0, 0), (layout.room.width, 0), (layout.room.width, layout.room.depth), (0, layout.room.depth)])
    shapes = [footprint(layout, placement.id) for placement in floor_objects(layout)]
    assert all(room.buffer(1e-6).covers(shape) for shape in shapes)
    for index, shape in enumerate(shapes):
        assert all(shape.intersection(other).area < 1e-9 for other in shapes[index + 1 :])


def test_it_looks_like_a_laboratory(layout):
    assets = {placement.asset for placement in layout.placements}
    assert {
        "FumeHood",
        "PreparationBench",
        "ValidationPlatform",
        "SinkBench",
        "EmergencyShower",
        "EyewashStation",
    } <= assets
    assert "WasteStation" in assets
    if layout.floor.name in ("roomy", "two_exits"):  # smaller rooms may have no place with an aisle on all sides
        assert any(name.startswith(("IslandBench", "Peninsula", "LabBench")) for name in assets)
    assert any(Catalog.load().get(name).storage_class for name in assets)
    assert len(layout.placements) >= 23


def test_hoods_stand_with_their_backs_to_a_wall_and_a_metre_of_free_floor_before_them(layout):
    for placement in floor_objects(layout):
        if not layout.asset(placement.id).fume_hood:
            continue
        box = layout.box(placement.id)
        back = box.to_world(0.0, -box.depth / 2.0)
        gaps = (back[0], back[1], layout.room.width - back[0], layout.room.depth - back[1])
        assert min(gaps) < 0.02
        corners = [(-0.5, 0.5, 0.01), (0.5, 0.5, 0.01), (0.5, 0.5, 1.0), (-0.5, 0.5, 1.0)]
        front = Polygon([box.to_world(sx * box.width, sy * box.depth + out) for sx, sy, out in corners])
        for other in floor_objects(layout):
            if other.id != placement.id and other.asset != "LabStool":
                assert front.intersection(footprint(layout, other.id)).area < 1e-6


def test_islands_keep_an_aisle(layout):
    """Benches that stand end to end are one island."""
    for placement in floor_objects(layout):
        if placement.asset.startswith(("IslandBench", "Peninsula")):
            shape = footprint(layout, placement.id)
            for other in floor_objects(layout):
                bench = (
                    layout.asset(other.id).subtype == "workbench" and shape.distance(footprint(layout, other.id)) < 0.03
                )
                if (
                    other.id != placement.id
                    and other.asset != "LabStool"
                    and not (bench or other.asset.endswith("Bin"))
                ):
                    assert shape.distance(footprint(layout, other.id)) >= 1.2 - 1e-6


def test_doors_stay_free(layout):
    arrangement = evaluate_layout(layout, rules="paper").arrangement
    for way in layout.floor.doorways:
        (inner,) = set(way.spaces) - {"outside"}
        assert standing_in(arrangement, swing_area(way, inner)) == ()


def test_the_same_arguments_give_the_same_hash_in_another_process():
    code = "from labgym.layouts import generate; print(generate('red_02', 11, 'tight').hash)"
    environment = {**os.environ, "PYTHONHASHSEED": "123"}
    other = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert other.stdout.strip() == generate("red_02", 11, "tight").hash


def test_seeds_and_protocols_make_different_rooms():
    hashes = {generate(protocol, seed).hash for protocol in ("sub_01", "pro_01") for seed in range(3)}
    assert len(hashes) == 6


@pytest.mark.parametrize("profile", ["strict", "paper"])
def test_other_profiles_are_satisfied_too(profile):
    layout = generate("sub_01", 2, "roomy", profile=profile)
    assessment = evaluate_layout(layout, protocols()["sub_01"], rule_set(profile=profile), navigation=True)
    assert assessment.v == 0
    assert assessment.missing == ()


def test_a_room_that_is_too_small_says_what_clashes_and_what_fits():
    with pytest.raises(InfeasibleError) as caught:
        generate("alk_02", 0, Room(name="closet", width=3.0, depth=3.0))
    assert caught.value.smallest_preset in room_presets()
    assert caught.value.conflicts
    assert "pieces are" in str(caught.value)
    assert "\n" not in str(caught.value)
    generate("alk_02", 0, caught.value.smallest_preset)


@pytest.mark.parametrize(("furnishing", "count"), [("full", 0), ("reduced", 1)])
def test_a_room_that_is_furnished_less_because_searches_stopped_is_a_warning(furnishing, count):
    class Hurried:
        def propose(self, request):
            layout = FloorProposer().propose(request)
            options = {"furnishing": furnishing, "note": "no place for LabBench_1", "attempts": {"stopped": 7}}
            return layout.replace(provenance=layout.provenance.model_copy(update={"options": options}))

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        generate("sub_01", 1, method=Method(proposer=Hurried()))
    messages = [str(each.message) for each in caught if each.category is SearchLimitWarning]
    assert len(messages) == count
    assert all("reduced furnishing only" in message for message in messages)


def test_an_unusual_room_is_furnished():
    doors = (Door(wall="back", offset=3.0), Door(wall="right", offset=3.0))
    layout = generate("sub_02", 0, Room(width=12.0, depth=6.0, doors=doors))
    assert evaluate_layout(layout, protocols()["sub_02"], navigation=True, rules="paper").v == 0


@pytest.mark.parametrize("seed", [-1, 2**53, 1.5, True, "0"])
def test_a_seed_out_of_range_is_refused(seed):
    with pytest.raises(OptionError, match="seed"):
        generate("sub_01", seed)


def test_unknown_names_say_what_exists():
    with pytest.raises(UnknownNameError, match="sub_01"):
        generate("sub_99")
    with pytest.raises(UnknownNameError, match="default"):
        generate("sub_01", room="cellar")
    with pytest.raises(UnknownNameError, match="strict"):
        generate("sub_01", profile="lenient")
