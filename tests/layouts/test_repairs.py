"""What a user gets back from the repair of a layout."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from laboratories import island_laboratory, put
from shapely import LineString, Polygon
from spoiling import SPOILINGS

from labgym.assets import Size
from labgym.layouts import Layout, Placement, generate
from labgym.layouts.moves import Move, Place, Rotate, Settle, apply, replaced
from labgym.layouts.repairs import repair_layout
from labgym.layouts.repairs.berths import berths
from labgym.layouts.repairs.furniture import flush
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.repairs.reinsertion import reinserted
from labgym.layouts.repairs.resettling import lying
from labgym.layouts.rules import rule_set, thresholds
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import blocked_places
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.settling import free_spots, homes
from labgym.paper.damage import damaged

SECOND = rule_set("touchstone")


@pytest.fixture(scope="module")
def room() -> Layout:
    return generate("sub_01", 3, "roomy")


def outline(layout: Layout, item: str) -> Polygon:
    return Polygon(layout.box(item).corners())


def harmed(layout: Layout, kind: str, pieces: int, seed: int = 5) -> tuple[Layout, tuple[str, ...]]:
    damage = damaged(layout, kind, pieces, np.random.default_rng(seed))
    return damage.layout, damage.ids


def pinned(layout: Layout, *ids: str) -> Layout:
    return replaced(layout, {item: layout.placement(item).model_copy(update={"fixed": True}) for item in ids})


def on_floor(layout: Layout, item: str, x: float, y: float) -> Layout:
    """Let an item lie on the floor."""
    placement = layout.placement(item)
    lying = placement.model_copy(update={"position": (x, y, 0.0), "support": "floor", "slot": None})
    return replaced(layout, {item: lying})


def test_a_sound_layout_is_returned_as_it_is(room):
    result = repair_layout(room, rules="paper")
    assert result.layout is room
    assert result.changes == ()
    assert result.problems == ()


def test_an_instrument_of_floor_standing_size_belongs_on_the_floor(room):
    small = Placement(id="Small", asset="RotaryEvaporator", position=(5.0, 5.0, 0.0))
    tall = Placement(
        id="Tall", asset="RotaryEvaporator", position=(5.0, 5.0, 0.8), size=Size(width=2.3, depth=0.9, height=2.37)
    )
    assert lying(room.replace(placements=(*room.placements, small, tall))) == ("Small",)


def test_items_that_lie_on_the_floor_return_to_surfaces(room):
    items = [p.id for p in room.placements if room.asset(p.id).placing == "desktop" and not room.children(p.id)][::17]
    spoilt = room
    for k, item in enumerate(items):
        spoilt = on_floor(spoilt, item, 2.0 + 0.5 * k, 4.0)
    after = repair_layout(spoilt, rules="paper").layout
    for item in items:
        placement = after.placement(item)
        assert placement.support in after.by_id
        surface = after.surface(placement.support, placement.slot)
        assert Polygon(surface.corners()).buffer(0.005).covers(outline(after, item))
        assert placement.position[2] == pytest.approx(surface.z0, abs=0.005)
    assert evaluate_layout(after, after.protocol, navigation=True, rules="paper").cost == 0
    assert all(after.placement(p.id) == p for p in room.placements if p.id not in items)


@pytest.mark.slow
def test_many_items_on_the_floor_return_to_surfaces_with_few_assessments(room):
    spoilt = SPOILINGS["instruments_on_floor"].spoil(room, room.protocol)
    fallen = lying(spoilt)
    assert len(fallen) > 20
    result = repair_layout(spoilt, units=10 * len(room.placements), rules="paper")
    assert result.problems == ()
    assert lying(result.layout) == ()
    assert evaluate_layout(result.layout, room.protocol, navigation=True, rules="paper").cost == 0


def test_furniture_returns_under_the_load_that_it_has_left(room):
    spoilt, ids = harmed(room, "load_left", 2)
    result = repair_layout(spoilt, rules="paper")
    assert result.problems == ()
    moved = {change.id for change in result.changes}
    assert moved <= set(ids)
    for carrier in ids:
        for child in result.layout.children(carrier):
            assert outline(result.layout, carrier).buffer(0.01).covers(outline(result.layout, child.id))


def test_what_the_protocol_requires_and_is_missing_is_added(room):
    spoilt, _ = harmed(room, "removed", 3)
    before = evaluate_layout(spoilt, room.protocol, rules="paper")
    result = repair_layout(spoilt, rules="paper")
    assert before.missing
    assert result.after.missing == ()
    assert result.problems == ()
    added = [result.layout.placement(change.id).asset for change in result.changes if change.kind == "added"]
    assert sorted(added) == sorted(room.catalog.find(name).name for name in before.missing)
    assert {placement.id for placement in spoilt.placements} <= {placement.id for placement in result.layout.placements}


def test_fixed_objects_stay_exactly_where_they_are(room):
    spoilt, _ = harmed(room, "furniture_stacked", 3)
    spoilt = pinned(spoilt, "SinkBench_1", *[p.id for p in spoilt.placements if p.asset == "HotPlate"])
    after = repair_layout(spoilt, rules="paper").layout
    for placement in spoilt.placements:
        if placement.fixed:
            assert after.placement(placement.id) == placement
            root = spoilt.root(placement.id)
            assert after.placement(root.id) == root


def test_what_cannot_be_repaired_is_named_with_the_reason(room):
    first, second = "SinkBench_1", "GlasswareCabinet_1"
    here, there = room.placement(second).position, room.placement(first).position
    spoilt = pinned(apply(room, Move(second, there[0] - here[0], there[1] - here[1])), first, second)
    result = repair_layout(spoilt, rules="paper")
    assert result.problems
    assert any(first in problem and second in problem for problem in result.problems)


def test_a_repair_moves_little(room):
    spoilt = apply(room, Rotate("FumeHood_1", room.placement("FumeHood_1").yaw + math.pi))
    result = repair_layout(spoilt, rules="paper")
    assert result.problems == ()
    assert [change.id for change in result.changes] == ["FumeHood_1"]


def test_the_same_layout_is_repaired_in_the_same_way(room):
    spoilt, _ = harmed(room, "moved", 2)
    assert repair_layout(spoilt, rules="paper").layout.hash == repair_layout(spoilt, rules="paper").layout.hash


def test_free_spots_are_inside_their_surface_and_overlap_nothing(room):
    profile = thresholds.profile("default")
    items = [p.id for p in room.placements if room.asset(p.id).placing == "desktop" and not room.children(p.id)][::14]
    tried = 0
    for item in items:
        for support, slot in list(homes(room, item, room.protocol))[:6]:
            for spot in free_spots(room, item, support, slot, profile, 2):
                tried += 1
                after = apply(room, spot)
                footprint, box = outline(after, item), after.box(item)
                surface = after.surface(support, slot)
                assert Polygon(surface.corners()).buffer(0.005).covers(footprint)
                assert box.z0 == pytest.approx(surface.z0)
                for other in after.placements:
                    for solid in after.solids(other.id) if other.id != item else ():
                        if min(solid.z1, box.z1) - max(solid.z0, box.z0) > 1e-3:
                            assert Polygon(solid.corners()).intersection(footprint).area < 1e-6
    assert tried > 15


def test_a_required_piece_that_is_out_of_bounds_comes_back_and_is_not_added_again(room):
    front = room.box("FumeHood_1").front
    spoilt = apply(room, Move("FumeHood_1", -0.4 * front[0], -0.4 * front[1]))
    assert "FumeHood" in (evaluate_layout(spoilt, room.protocol, rules="paper").missing or ())
    result = repair_layout(spoilt, rules="paper")
    assert result.problems == ()
    assert [change.id for change in result.changes] == ["FumeHood_1"]


def test_a_vessel_returns_to_its_hood_under_touchstone_2(room):
    vessel = next(p.id for p in room.placements if p.asset == "GraduatedCylinder" and p.support.startswith("FumeHood"))
    spoilt = apply(room, Settle(vessel, "PreparationBench_1", 0, 0.0, 0.0))
    assert room.asset(repair_layout(spoilt, rules="paper").layout.root(vessel).id).subtype == "workbench"
    result = repair_layout(spoilt, rules=SECOND)
    assert result.problems == ()
    assert room.asset(result.layout.root(vessel).id).fume_hood


@pytest.mark.parametrize("way", ["no_extinguisher", "bare_necessities", "one_flask_on_floor"])
def test_safety_equipment_and_glass_are_put_in_place_under_touchstone_2(room, way):
    spoilt = SPOILINGS[way].spoil(room, room.protocol)
    result = repair_layout(spoilt, rules=SECOND)
    assert result.before.v > 0
    assert result.problems == ()
    assert evaluate_layout(result.layout, room.protocol, SECOND, navigation=True).v == 0


def test_wall_units_return_to_walls(room):
    units = [p.id for p in room.placements if p.support == "wall"]
    after = repair_layout(SPOILINGS["wall_units_on_floor"].spoil(room, room.protocol), rules="paper").layout
    width, depth = room.room.width, room.room.depth
    for unit in units:
        placement = after.placement(unit)
        corners = np.array(outline(after, unit).exterior.coords)
        gaps = [corners[:, 0].min(), corners[:, 1].min(), width - corners[:, 0].max(), depth - corners[:, 1].max()]
        assert placement.support == "wall"
        assert 0.0 <= min(gaps) <= 0.02


def test_furniture_that_is_taken_out_comes_back_without_overlaps(room):
    spoilt, ids = harmed(room, "furniture_stacked", 3)
    state = reinserted(RepairState.of(spoilt, room.protocol, "paper"), ids)
    standing = [p.id for p in state.layout.placements if p.support == "floor"]
    assert sorted(p.id for p in state.layout.placements) == sorted(p.id for p in spoilt.placements)
    assert state.rank.cost < RepairState.of(spoilt, room.protocol, "paper").rank.cost
    for item in ids:
        for other in standing:
            if other != item:
                assert outline(state.layout, item).intersection(outline(state.layout, other)).area < 1e-6


def test_berths_are_free_and_those_of_a_hood_keep_off_doors_if_any_does():
    layout, hood = island_laboratory(), "FumeHood_1"
    room = layout.room
    places = list(islice(berths(layout, hood), 40))
    assert len(places) == 40
    inside = Polygon([(0, 0), (room.width, 0), (room.width, room.depth), (0, room.depth)])
    rest = [outline(layout, p.id) for p in layout.placements if p.id != hood]
    gaps = []
    for place in places:
        footprint = outline(apply(layout, place), hood)
        assert inside.buffer(1e-6).covers(footprint)
        assert all(footprint.intersection(other).area < 1e-6 for other in rest)
        gaps.append(min(footprint.distance(door) for door in doorways(layout)))
    assert gaps[0] >= 3.0


def doorways(layout: Layout) -> list[LineString]:
    """The doors of a rectangular room as lines on its sides."""
    room, lines = layout.room, []
    for door in layout.room.doors:
        ends = (door.offset - door.width / 2, door.offset + door.width / 2)
        across = {"front": 0.0, "back": room.depth, "left": 0.0, "right": room.width}[door.wall]
        points = [(end, across) if door.wall in ("front", "back") else (across, end) for end in ends]
        lines.append(LineString(points))
    return lines


def test_a_bench_returns_behind_the_one_that_it_stood_back_to_back_with():
    first, second = put("front", "LabBench1200", 4.0, 3.4), put("behind", "LabBench1200", 4.0, 2.63, yaw=math.pi)
    layout = island_laboratory()
    layout = layout.replace(
        placements=(*(p for p in layout.placements if layout.asset(p.id).size.depth < 1.2), first, second)
    )
    sound = RepairState.of(layout, None, "paper")
    assert not sound.assessment.errors
    spoilt = apply(layout, Place("behind", 5.6, 2.2, 0.7))
    assert RepairState.of(spoilt, None, "paper").rank.cost > 0
    after = repair_layout(spoilt, rules="paper").layout
    assert after.placement("front") == first
    assert outline(after, "behind").distance(outline(after, "front")) < 0.01
    assert math.cos(after.placement("behind").yaw - first.yaw) == pytest.approx(-1.0)


def test_what_hangs_over_an_edge_within_the_tolerance_is_moved_back(room):
    state = RepairState.of(room, room.protocol, "paper")
    item = next(p for p in room.placements if p.asset == "Laptop" and not room.children(p.id))
    surface = room.surface(item.support, item.slot)
    reach = surface.to_local(*[float(c) for c in room.box(item.id).corners()[0]])
    axis = 0 if abs(reach[0]) / surface.width > abs(reach[1]) / surface.depth else 1
    ends = [surface.to_local(float(x), float(y))[axis] for x, y in room.box(item.id).corners()]
    limit = (surface.width, surface.depth)[axis] / 2 + 0.0049
    shift = min((limit - max(ends), -limit - min(ends)), key=abs)
    origin, there = surface.to_world(0.0, 0.0), surface.to_world(*((shift, 0.0) if axis == 0 else (0.0, shift)))
    hanging = apply(room, Move(item.id, there[0] - origin[0], there[1] - origin[1]))
    assert not Polygon(surface.corners()).buffer(0.004, join_style="mitre").covers(outline(hanging, item.id))
    after = flush(replace(state, layout=hanging, assessment=evaluate_layout(hanging, room.protocol, rules="paper")), ())
    assert Polygon(surface.corners()).buffer(1e-6).covers(outline(after.layout, item.id))


def test_a_place_of_work_inside_of_furniture_counts_as_a_narrow_way(room):
    cabinet = room.box("GlasswareCabinet_1")
    stool = next(p for p in room.placements if p.support == "floor" and room.asset(p.id).size.depth >= 1.2)
    x, y = (
        cabinet.x + cabinet.front[0] * (cabinet.depth / 2 + 0.6),
        cabinet.y + cabinet.front[1] * (cabinet.depth / 2 + 0.6),
    )
    assert "GlasswareCabinet_1" not in blocked_places(Arrangement.of(room))
    assert "GlasswareCabinet_1" in blocked_places(Arrangement.of(apply(room, Place(stool.id, x, y, 0.0))))


def test_a_repair_stops_at_its_limit_of_work_and_says_so(room):
    spoilt, _ = harmed(room, "furniture_stacked", 4)
    result = repair_layout(spoilt, units=300, rules="paper")
    assert result.after.cost <= result.before.cost
    assert "limit of work" in result.problems[-1]
    assert repair_layout(spoilt, units=300, rules="paper").layout.hash == result.layout.hash
