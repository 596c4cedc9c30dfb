"""Floors furnished around what is there: fixed pieces, keep-outs, service points, an inventory; checked by polygons."""

import math
from collections import Counter

import pytest
from furnished_floors import ell, suite
from shapely import Point, Polygon

from labgym.errors import InfeasibleError
from labgym.layouts import Placement, generate
from labgym.layouts.floor import Door, Floor, KeepOut, Room, Service
from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Holdings
from labgym.layouts.rules import evaluate_layout
from labgym.layouts.rules.thresholds import EXHAUST_REACH, WATER_REACH

WATER = {"SinkBench", "HandWashSink", "EyewashStation", "EmergencyShower", "IceMachine"}
HALL = Room(width=10.0, depth=8.0, doors=(Door(wall="front", offset=1.5), Door(wall="right", offset=6.5))).floor


def proposed(floor: Floor, seed=1, protocol="sub_01", **options):
    request = resolve_request(protocol, seed, None, "default", None, **{"fixed": (), "floor": floor, **options})
    return FloorProposer().propose(request)


def shape(layout, placement_id) -> Polygon:
    return Polygon(layout.box(placement_id).corners())


def floor_ids(layout, assets=None):
    return [p.id for p in layout.placements if p.support == FLOOR and (assets is None or p.asset in assets)]


def hoods(layout):
    return [p.id for p in layout.placements if layout.asset(p.id).fume_hood]


def with_services(floor: Floor, *services: Service) -> Floor:
    return floor.model_copy(update={"services": services})


@pytest.mark.parametrize("seed", range(4))
def test_sinks_stand_near_the_water_and_hoods_near_the_exhaust(seed):
    water, exhaust = Service(kind="water", x=9.9, y=2.0), Service(kind="exhaust", x=3.0, y=7.9, z=2.9)
    layout = proposed(with_services(HALL, water, exhaust), seed)
    assert floor_ids(layout, WATER)
    assert hoods(layout)
    for name in floor_ids(layout, WATER):
        assert shape(layout, name).distance(Point(9.9, 2.0)) <= WATER_REACH + 1e-6
    for name in hoods(layout):
        assert shape(layout, name).distance(Point(3.0, 7.9)) <= EXHAUST_REACH + 1e-6


def test_a_service_in_another_room_draws_what_needs_it_there():
    floor = suite()
    for room, x, y in (("synthesis", 3.0, 0.1), ("analysis", 11.0, 0.1)):
        wet = with_services(floor, Service(kind="water", x=x, y=y, required=True))
        layout = proposed(wet, seed=4)
        for name in floor_ids(layout, WATER):
            box = layout.box(name)
            assert layout.floor.space_at(box.x, box.y).id == room


def test_what_a_floor_requires_is_met_or_refused_by_name():
    far = Service(kind="exhaust", x=5.0, y=7.9, z=2.9, reach=0.5, required=True)
    layout = proposed(with_services(HALL, far))
    assert all(shape(layout, name).distance(Point(5.0, 7.9)) <= 0.5 + 1e-6 for name in hoods(layout))
    blocked = HALL.model_copy(
        update={"services": (far,), "keep_outs": (KeepOut(id="hatch", x=5.0, y=7.0, width=5.0, depth=2.0),)}
    )
    with pytest.raises(InfeasibleError, match="cannot hold"):
        proposed(blocked)


def test_a_sink_out_of_reach_is_a_warning_and_an_error_where_the_floor_requires_it():
    layout = proposed(HALL)
    sink = layout.find("SinkBench")
    box = layout.box(sink.id)
    for required in (False, True):
        corner = max(((0.1, 0.1), (9.9, 0.1), (0.1, 7.9), (9.9, 7.9)), key=lambda c: math.dist(c, (box.x, box.y)))
        point = Service(kind="water", x=corner[0], y=corner[1], required=required)
        moved = layout.replace(floor=with_services(HALL, point))
        issues = [
            issue
            for issue in evaluate_layout(moved, rules="paper").errors
            if issue.rule == "supply" and sink.id in issue.ids
        ]
        assert bool(issues) == required
        for issue in issues:
            assert issue.value == pytest.approx(shape(layout, sink.id).distance(Point(corner)) - WATER_REACH, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_keep_outs_stay_free_of_everything(seed):
    areas = (
        KeepOut(id="hatch", x=2.0, y=4.0, yaw=0.4, width=1.4, depth=1.0),
        KeepOut(id="panel", x=5.0, y=0.5, width=1.2, depth=1.0),
    )
    layout = generate("sub_01", seed, floor=HALL.model_copy(update={"keep_outs": areas}))
    for area in areas:
        zone = Polygon(area.box.corners()).buffer(-0.051)
        for name in floor_ids(layout):
            assert not shape(layout, name).intersects(zone), (name, area.id)


def test_fixed_pieces_stay_take_their_role_and_are_obstacles():
    pieces = (
        Placement(id="old_sink", asset="SinkBench", position=(0.4, 5.0, 0.0), yaw=-math.pi / 2.0),
        Placement(id="old_cabinet", asset="FlammableCabinet90", position=(3.0, 0.35, 0.0)),
        Placement(id="old_bench", asset="IslandBench1800", position=(2.0, 3.0, 0.0), yaw=0.2),
    )
    floor = ell()
    layout = generate("sub_01", 2, floor=floor, fixed=pieces, rules="paper")
    for piece in pieces:
        placed = layout.placement(piece.id)
        assert (placed.position, placed.yaw, placed.fixed) == (piece.position, piece.yaw, True)
        for name in floor_ids(layout):
            assert name == piece.id or shape(layout, name).intersection(shape(layout, piece.id)).area < 1e-9
    counts = Counter(placement.asset for placement in layout.placements)
    assert counts["SinkBench"] == 1
    assert counts["FlammableCabinet"] == 0
    assert layout.children("old_cabinet")


def test_what_exists_is_used_first_and_nothing_is_added_beyond_it():
    existing = {
        "FumeHood": 1,
        "SinkBench": 1,
        "LabBench": 2,
        "IslandBench2400": 1,
        "FlammableCabinet90": 1,
        "LabStool": 1,
    }
    layout = generate("sub_01", 3, room="12x9", holdings=Holdings(existing))
    counts = Counter(placement.asset for placement in layout.placements)
    required = proposed(Room(width=12.0, depth=9.0).floor, 3, holdings=Holdings())
    needed = Counter(placement.asset for placement in required.placements)
    # For hazardous liquids (40 CFR 262.15) and work (29 CFR 1910.151); they are placed after the furniture.
    needed["SolventWasteContainer"] = needed["FirstAidKit"] = 1
    assert all(counts[name] <= max(existing.get(name, 0), needed[name]) for name in counts)
    assert {name: counts[name] for name in existing} == existing
    accounts = layout.provenance.options["inventory"]
    equipment = {name for name in counts if layout.catalog.get(name).kind != "reagent"}
    bought = {name: counts[name] - existing.get(name, 0) for name in equipment if counts[name] > existing.get(name, 0)}
    assert accounts["to_buy"] == bought
    assert accounts["unused"] == {}


def test_without_purchases_what_is_missing_is_named():
    with pytest.raises(InfeasibleError, match=r"missing: .*1 EmergencyShower.*buy them"):
        proposed(HALL, holdings=Holdings({"FumeHood": 1}, "none"))
    layout = proposed(HALL)
    everything = Counter(placement.asset for placement in layout.placements)
    again = proposed(HALL, seed=5, holdings=Holdings(everything, "none"))
    assert not Counter(placement.asset for placement in again.placements) - everything


def test_purchases_of_any_kind_fill_the_floor_as_without_an_inventory():
    sizes = [
        len(proposed(HALL, holdings=holdings).placements) for holdings in (Holdings(), Holdings(purchases="any"), None)
    ]
    assert sizes[0] < sizes[1] == sizes[2]
