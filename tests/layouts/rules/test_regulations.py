"""Regulation profiles: each measure against a length by hand or by shapely, and the three outcomes."""

from __future__ import annotations

import math

import pytest
from laboratories import put
from shapely import Point, Polygon

from labgym.errors import UnknownNameError
from labgym.layouts import Door, Layout, Placement, Room
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations import REGULATIONS, LegalClause, Measured, Ruling, rulings
from labgym.layouts.rules.regulations import measures as measure
from labgym.layouts.rules.regulations.premises import Premises


def premises(*placements: Placement, doors: tuple[Door, ...] = (Door(wall="front", offset=1.0),)) -> Premises:
    """A room of 10 m x 8 m, 3 m high."""
    floor = Room(width=10.0, depth=8.0, height=3.0, doors=doors).floor
    return Premises(Arrangement.of(Layout(id="rules", floor=floor, placements=placements)))


def footprint(layout: Layout, name: str) -> Polygon:
    return Polygon(layout.box(name).corners())


def only(values: list[Measured]) -> float:
    assert len(values) == 1
    return values[0].value


HOOD = put("hood", "FumeHood", 5.0, 7.575, yaw=math.pi)


def test_distances_of_hoods_agree_with_shapely() -> None:
    there = premises(
        HOOD,
        put("bench", "LabBench1800", 5.2, 4.5),
        put("desk", "WritingDesk", 4.8, 5.2, yaw=0.4),
        put("second", "FumeHood", 5.5, 3.0),
    )
    layout = there.arrangement.layout
    hood = footprint(layout, "hood")
    assert only(measure.hood_to_opposite("bench")(there)) == pytest.approx(hood.distance(footprint(layout, "bench")))
    assert only(measure.hood_to_opposite("desk")(there)[:1]) == pytest.approx(hood.distance(footprint(layout, "desk")))
    assert measure.hood_to_opposite("hood")(there)[0].value == pytest.approx(hood.distance(footprint(layout, "second")))
    width = layout.asset("hood").size.width
    assert {one.name: one.value for one in measure.hood_to_side_wall(there)}["hood"] == pytest.approx(5.0 - width / 2.0)
    doorway = Polygon([(0.5, 0.0), (1.5, 0.0), (1.5, -1e-6), (0.5, -1e-6)])
    assert {one.name: one.value for one in measure.hood_to_door(there)}["hood"] == pytest.approx(
        hood.distance(doorway), abs=1e-4
    )


def test_the_wall_opposite_a_hood_is_measured_in_its_direction() -> None:
    there = premises(put("hood", "FumeHood", 9.575, 4.0, yaw=math.pi / 2.0))
    depth = there.arrangement.layout.asset("hood").size.depth
    assert only(measure.hood_to_opposite("wall")(there)) == pytest.approx(min(9.575 - depth / 2.0, measure.LOOKOUT))
    tall = premises(put("hood", "FumeHood", 9.575, 4.0, yaw=math.pi / 2.0), put("store", "FlammableCabinet", 7.0, 4.0))
    layout = tall.arrangement.layout
    gap = footprint(layout, "hood").distance(footprint(layout, "store"))
    assert only(measure.hood_to_opposite("wall")(tall)) == pytest.approx(gap)


def test_walks_of_people_pass_movable_objects_and_end_inside_the_door() -> None:
    bench = put("bench", "LabBench1800", 1.0, 7.0, yaw=math.pi)
    free = premises(bench)
    depth = free.arrangement.layout.asset("bench").size.depth
    assert only(measure.walks_out(free)) == pytest.approx(7.0 - depth / 2.0 - 0.6 - 0.35)
    stools = [put(f"stool{k}", "LabStool", 0.3 + 0.5 * k, 3.0) for k in range(20)]
    assert only(measure.walks_out(premises(bench, *stools))) == pytest.approx(only(measure.walks_out(free)))
    cabinets = [put(f"wall{k}", "FlammableCabinet", 0.5 + 1.0 * k, 3.0) for k in range(10)]
    cut_off = {one.name: one.value for one in measure.walks_out(premises(bench, *cabinets))}
    assert math.isinf(cut_off["bench"])


def test_the_walk_to_the_nearest_shower_is_a_straight_line_in_an_empty_room() -> None:
    shower, far = put("shower", "EmergencyShower", 2.0, 7.6, yaw=math.pi), put("far", "EmergencyShower", 9.6, 1.0)
    there = premises(HOOD, shower, far)
    layout = there.arrangement.layout
    ends = [
        (x, layout.box(name).y - layout.box(name).depth / 2.0 - 0.6) for name, x in (("hood", 5.0), ("shower", 2.0))
    ]
    assert only(measure.walks_to("shower", "hood")(there)) == pytest.approx(math.dist(*ends))
    assert math.isinf(only(measure.walks_to("shower", "hood")(premises(HOOD))))
    assert measure.walks_to("shower", "hood")(premises(shower)) == []


def test_work_rows_back_to_back_and_the_clear_radius_of_a_shower() -> None:
    there = premises(
        put("a", "LabBench1800", 5.0, 2.0),
        put("b", "LabBench1800", 5.5, 4.5, yaw=math.pi),
        put("aside", "LabBench1800", 5.0, 6.5, yaw=math.pi / 2.0),
        put("shower", "EmergencyShower", 1.0, 6.0),
        put("kit", "SpillKit", 1.8, 6.3, yaw=0.3),
    )
    layout = there.arrangement.layout
    between = only(measure.between_work_rows(there))
    assert between == pytest.approx(footprint(layout, "a").distance(footprint(layout, "b")))
    center = Point(1.0, 6.0)
    assert only(measure.shower_radius(there)) == pytest.approx(center.distance(footprint(layout, "kit")))


def test_doors_rooms_and_ceilings() -> None:
    two = premises(doors=(Door(wall="front", offset=1.0, width=0.8), Door(wall="back", offset=1.0, width=1.2)))
    assert sorted(one.value for one in measure.door_widths(two)) == [0.8, 1.2]
    assert only(measure.doors_of_rooms(79.0)(two)) == 2.0
    assert measure.doors_of_rooms(80.0)(two) == []
    assert only(measure.ceilings(50.0, 100.0)(two)) == 3.0
    assert measure.ceilings(100.0)(two) == []
    blocked = premises(put("stool", "LabStool", 1.0, 0.5))
    assert only(measure.objects_at_doors(blocked)) == 1.0


def test_reagents_share_a_cabinet_or_do_not() -> None:
    acid, base = put("acids", "AcidCabinet", 1.0, 7.6, yaw=math.pi), put("bases", "BaseCabinet", 3.0, 7.6, yaw=math.pi)

    def at(name: str, asset: str, cabinet: str, x: float) -> Placement:
        height = premises(acid, base).arrangement.layout.surface(cabinet, 0).z0
        return put(name, asset, x, 7.6, height, on=cabinet, slot=0)

    apart = premises(acid, base, at("a", "HydrochloricAcid", "acids", 1.0), at("b", "SodiumHydroxide", "bases", 3.0))
    assert measure.incompatibles_outside_cabinets(apart) == []
    assert only(measure.incompatible_pairs_together(apart)) == 0.0
    together = premises(acid, base, at("a", "HydrochloricAcid", "acids", 0.9), at("b", "SodiumHydroxide", "acids", 1.1))
    layout = together.arrangement.layout
    gap = footprint(layout, "a").distance(footprint(layout, "b"))
    assert only(measure.incompatibles_outside_cabinets(together)) == pytest.approx(gap)
    assert only(measure.incompatible_pairs_together(together)) == 1.0
    assert measure.flammables_outside(together) == []


def outcome(clause_limit: float, values: list[float]) -> Ruling:
    listed = [Measured(f"object {k}", value) for k, value in enumerate(values)]
    return LegalClause("standard, 1.2", "a distance", "at least", clause_limit, lambda _: listed, "read").rule(
        premises()
    )


def test_a_clause_passes_fails_or_does_not_apply_and_names_the_worst_object() -> None:
    assert (outcome(1.0, [1.0, 2.0]).outcome, outcome(1.0, [1.0, 2.0]).value) == ("pass", 1.0)
    failed = outcome(1.0, [1.2, 0.9])
    assert (failed.outcome, failed.value, failed.where) == ("fail", 0.9, "object 1")
    assert (outcome(1.0, []).outcome, outcome(1.0, []).value) == ("does not apply", None)
    walk = LegalClause("standard, 3", "a walk", "at most", 15.0, lambda _: [Measured("hood", math.inf)], "read")
    assert (walk.rule(premises()).outcome, walk.rule(premises()).value) == ("fail", None)


@pytest.mark.parametrize("name", REGULATIONS)
def test_every_profile_rules_on_an_empty_room_and_names_its_sources(name: str) -> None:
    result = rulings(premises().arrangement, name)
    assert len(result) == len(REGULATIONS[name])
    assert all(ruling.source and ruling.requires for ruling in result)
    assert any(ruling.outcome == "does not apply" for ruling in result)


def test_an_unknown_profile_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="available"):
        rulings(premises().arrangement, "UK")
