"""Safety rules of the rule set `touchstone`: each answers to its planted fault with the value that shapely measures."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from laboratories import BY_HAND, orderly_laboratory, put
from outside.safety_checker import faults
from shapely import union_all
from shapely.affinity import rotate, translate
from shapely.geometry import LineString, Point, Polygon, box

from labgym.assets import Asset, Catalog
from labgym.eval import score
from labgym.layouts import Layout, Placement, load_published
from labgym.layouts.adjust import RuleAdjuster
from labgym.layouts.floor import Floor, Service
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules import Assessment, evaluate_layout, rule_set
from labgym.layouts.rules.rule import FacilityIssue
from labgym.layouts.rules.safety.hazards import fire_classes, water_reactive
from labgym.layouts.rules.safety.heights import MOUNTINGS
from labgym.layouts.rules.safety.rules import RULES
from labgym.layouts.rules.safety.standing import forbidden
from labgym.protocols import ReagentUse, Step
from labgym.protocols.constraints import derive

HALF = math.pi / 2.0
CATALOG = Catalog.load()
V2 = rule_set("touchstone")


def assess(layout: Layout, navigation: bool = False) -> Assessment:
    assessment = evaluate_layout(layout, layout.protocol, navigation=navigation, rules="touchstone")
    assert isinstance(assessment, Assessment)
    return assessment


def issues(layout: Layout, rule: str, navigation: bool = False) -> list[FacilityIssue]:
    assessment = assess(layout, navigation)
    own = [issue for issue in assessment.issues if issue.rule == rule]
    hard = [item for item in assessment.violations.of("facility") if item.ids in {issue.ids for issue in own}]
    assert len(hard) >= sum(issue.severity == "error" for issue in own)
    return own


def footprint(layout: Layout, placement: str) -> Polygon:
    item, size = layout.placement(placement), layout.asset(placement).size
    plain = box(-size.width / 2.0, -size.depth / 2.0, size.width / 2.0, size.depth / 2.0)
    return translate(rotate(plain, item.yaw, origin=(0.0, 0.0), use_radians=True), *item.position[:2])


def test_a_laboratory_in_order_breaks_no_safety_rule() -> None:
    names = {rule.name for rule in RULES} - {"exit_swing"}  # the doors of a room open inward
    assert [issue for issue in assess(orderly_laboratory(), navigation=True).issues if issue.rule in names] == []


def test_every_rule_has_its_own_name_source_and_limit() -> None:
    assert len({rule.name for rule in RULES}) == len(RULES)
    assert all(rule.source and rule.limit and rule.requires for rule in RULES)


# Reagents and the building.

WATER_REACTIVE = ("SodiumHydride", "LithiumAluminumHydride", "NButyllithium", "RaneyNickel", "AcetylChloride", "Sodium")
HARMLESS = ("SodiumChloride", "Ethanol", "MagnesiumSulfate", "HydrochloricAcid", "Acetone")


@pytest.mark.parametrize("name", WATER_REACTIVE)
def test_water_reactives_and_pyrophorics_keep_a_meter_from_the_shower(name: str) -> None:
    layout = orderly_laboratory(
        put("cabinet", "WaterReactiveCabinet", 7.7, 6.5, yaw=HALF),
        put("reagent", name, 7.7, 6.5, 0.1, on="cabinet", slot=0),
    )
    (issue,) = issues(layout, "water_distance")
    gap = footprint(layout, "reagent").distance(footprint(layout, "shower"))
    assert gap < 1.0
    assert issue.value == pytest.approx(gap, abs=1e-6)
    assert issue.ids == ("reagent", "shower")


@pytest.mark.parametrize("name", HARMLESS)
def test_other_reagents_may_stand_next_to_water(name: str) -> None:
    layout = orderly_laboratory(
        put("cabinet", "GeneralCabinet", 7.7, 6.5, yaw=HALF),
        put("reagent", name, 7.7, 6.5, 0.1, on="cabinet", slot=0),
    )
    assert issues(layout, "water_distance") == []


def handling(reagent: str, *changed: Placement) -> Layout:
    """Return the orderly laboratory, whose protocol adds a reagent in the hood; none of it is placed."""
    add = Step(index=3, location="FumeHood", action="Add", text="Add.", uses=(reagent, "RoundBottomFlask"))
    uses = (*BY_HAND.reagents, ReagentUse(name=reagent, role="reagent"))
    protocol = derive(BY_HAND.model_copy(update={"reagents": uses, "steps": (*BY_HAND.steps, add)}))
    return orderly_laboratory(*changed).replace(protocols=(protocol,))


@pytest.mark.parametrize("name", WATER_REACTIVE)
@pytest.mark.parametrize("along", [5.4, 5.7, 6.1])
@pytest.mark.parametrize(("fitting", "asset"), [("shower", "EmergencyShower"), ("eyewash", "EyewashStation")])
def test_water_reactives_are_handled_a_meter_from_wet_fittings(
    name: str, along: float, fitting: str, asset: str
) -> None:
    other = {
        "shower": put("eyewash", "EyewashStation", 2.0, 0.3),
        "eyewash": put("shower", "EmergencyShower", 2.0, 0.5),
    }
    layout = handling(name, put(fitting, asset, along, 7.6, yaw=math.pi), other[fitting])
    gap = footprint(layout, "hood").distance(footprint(layout, fitting))
    own = [issue for issue in issues(layout, "water_distance") if issue.ids == ("hood", fitting)]
    assert [issue.value for issue in own] == pytest.approx([gap] if gap < 1.0 else [], abs=1e-6)
    assert all(issue.severity == "error" and name in issue.message for issue in own)


@pytest.mark.parametrize("name", HARMLESS)
def test_other_reagents_may_be_handled_next_to_water(name: str) -> None:
    layout = handling(name, put("shower", "EmergencyShower", 5.4, 7.6, yaw=math.pi))
    assert issues(layout, "water_distance") == []


def test_cooling_water_of_a_hood_is_no_wet_fitting_where_reagents_are_handled() -> None:
    shower, eyewash = put("shower", "EmergencyShower", 7.0, 7.6), put("eyewash", "EyewashStation", 6.6, 0.3)
    layout = handling("SodiumHydride", shower, eyewash)
    point = Service(kind="water", x=4.2, y=7.9, z=0.9)
    assert issues(layout.replace(floor=layout.floor.model_copy(update={"services": (point,)})), "water_distance") == []


def reacts_with_water(asset: Asset) -> bool:
    chemistry = asset.chemistry
    return chemistry is not None and (chemistry.water_reactive or "H250" in chemistry.h_codes)


def used_at(layout: Layout) -> dict[str, Polygon]:
    """Return the footprints of the furniture at which steps use water-reactives, by id."""
    places = {}
    for protocol in layout.protocols:
        for step in protocol.steps:
            chemistry = [CATALOG.find(name).chemistry for name in step.uses]
            if any(one is not None and (one.water_reactive or "H250" in one.h_codes) for one in chemistry):
                place = next(p for p in layout.placements if step.location in (p.asset, layout.asset(p.id).variant_of))
                places[place.id] = footprint(layout, place.id)
    return places


def test_distances_from_water_on_published_floors_are_those_of_shapely() -> None:
    """The floors keep their distances: in each, the first fitting is moved next to the last reagent of the kind."""
    wet, seen = {"sink", "eyewash", "shower", "ice"}, 0
    for number in range(12):
        layout = load_published("floors-val", f"floors-val-{number:04}")
        reagents = [one for one in layout.placements if reacts_with_water(layout.asset(one.id))]
        if not reagents:
            continue
        first = next(one for one in layout.placements if layout.asset(one.id).subtype in wet)
        (x, y, _), z = reagents[-1].position, first.position[2]
        near = first.model_copy(update={"position": (x + 0.45, y, z)})
        layout = layout.replace(placements=tuple(near if one is first else one for one in layout.placements))
        fittings = {p.id: footprint(layout, p.id) for p in layout.placements if layout.asset(p.id).subtype in wet}
        points = [translate(box(0, 0, 0, 0), s.x, s.y) for s in layout.floor.services if s.kind == "water"]
        expected = []
        for placement in layout.placements:
            if reacts_with_water(layout.asset(placement.id)):
                own = footprint(layout, placement.id)
                expected += [own.distance(other) for other in (*fittings.values(), *points)]
        expected += [own.distance(other) for own in used_at(layout).values() for other in fittings.values()]
        near = sorted(gap for gap in expected if gap < 1.0)
        seen += len(near)
        assert sorted(issue.value or 0.0 for issue in issues(layout, "water_distance")) == pytest.approx(near, abs=1e-6)
    assert seen > 2


@pytest.mark.parametrize("name", ["Acetone", "HydrogenPeroxide", "PotassiumPermanganate"])
def test_flammables_and_oxidizers_keep_a_meter_from_doors(name: str) -> None:
    layout = orderly_laboratory(
        put("cabinet", "FlammableCabinet", 2.5, 0.24), put("reagent", name, 2.5, 0.24, 0.1, on="cabinet", slot=0)
    )
    own = [issue for issue in issues(layout, "flammable_door") if issue.ids == ("reagent",)]
    door = LineString([(0.7, 0.0), (1.7, 0.0)])
    assert [issue.value for issue in own] == pytest.approx([footprint(layout, "reagent").distance(door)], abs=1e-6)
    assert [issue.severity for issue in issues(layout, "flammable_exit") if issue.ids == ("reagent",)] == [
        "warning"
    ] * 2


def test_the_place_where_flammables_are_used_keeps_a_meter_from_doors() -> None:
    layout = orderly_laboratory(
        put("hood", "FumeHood", 2.6, 0.425), put("flask", "RoundBottomFlask", 2.2, 0.4, 0.9, on="hood", slot=0),
        put("plate", "MagneticHotplateStirrer", 2.6, 0.4, 0.9, on="hood", slot=0),
    )  # fmt: skip
    (issue,) = issues(layout, "flammable_door")
    door = LineString([(0.7, 0.0), (1.7, 0.0)])
    assert issue.ids == ("hood",)
    assert issue.value == pytest.approx(footprint(layout, "flask").distance(door), abs=1e-6)


def test_an_oxidizer_keeps_away_from_an_oven() -> None:
    oven = put("oven", "DryingOven", 7.6, 5.0, 0.9, yaw=HALF, on="table", slot=0)
    table = put("table", "LabBench1800", 7.6, 5.6, yaw=HALF)
    near = orderly_laboratory(table, oven, put("salt", "SodiumNitrite", 7.6, 5.45, 0.9, on="table", slot=0))
    (issue,) = issues(near, "oxidizer_heat")
    assert issue.value == pytest.approx(footprint(near, "salt").distance(footprint(near, "oven")), abs=1e-6)
    far = orderly_laboratory(table, oven, put("salt", "SodiumNitrite", 7.6, 6.3, 0.9, on="table", slot=0))
    assert issues(far, "oxidizer_heat") == []
    assert len(issues(far, "oxidizer_heat_preferred")) == 1


# Equipment of rooms.

CLASSES = {
    "Acetone": "B", "Hydrogen": "B", "Sodium": "BD", "SodiumHydride": "BD", "LithiumAluminumHydride": "BD",
    "NButyllithium": "BD", "RaneyNickel": "BD", "ZincPowder": "D", "SodiumTriacetoxyborohydride": "D",
    "SodiumChloride": "", "HydrochloricAcid": "",
}  # fmt: skip
"""Classes by the safety data sheets, section 5: solvents B, metals, hydrides and alkyls D."""


@pytest.mark.parametrize(("name", "classes"), CLASSES.items())
def test_the_class_of_an_extinguisher_follows_from_the_reagent(name: str, classes: str) -> None:
    assert fire_classes(CATALOG.get(name)) == frozenset(classes)


def test_hydrides_call_for_a_class_d_extinguisher_and_powder_does_not_do() -> None:
    hydride = (
        put("cabinet", "WaterReactiveCabinet", 0.3, 4.6, yaw=-HALF),
        put("hydride", "SodiumHydride", 0.3, 4.6, 0.1, on="cabinet", slot=0),
    )
    bare = assess(orderly_laboratory(*hydride))
    assert bare.unequipped == ("ClassDExtinguisher",)
    assert "room_extinguisher_d" in {issue.rule for issue in bare.issues}
    equipped = assess(orderly_laboratory(*hydride, put("sand", "ClassDExtinguisher", 7.8, 5.5, yaw=HALF)), True)
    assert (equipped.v, equipped.unequipped) == (0, ())
    only_d = assess(
        orderly_laboratory(put("sand", "ClassDExtinguisher", 7.8, 5.5, yaw=HALF), without=("extinguisher",))
    )
    assert only_d.unequipped == ("FireExtinguisher",)


@pytest.mark.parametrize(
    ("gone", "rule"),
    [
        ("shower", "room_shower"), ("eyewash", "room_eyewash"), ("hands", "room_hand_wash"),
        ("extinguisher", "room_extinguisher_b"), ("detector", "room_gas_detector"),
    ],
)  # fmt: skip
def test_a_room_with_hazardous_work_lacks_what_is_taken_away(gone: str, rule: str) -> None:
    (issue,) = issues(orderly_laboratory(without=(gone,)), rule)
    assert (issue.value, issue.limit, issue.severity) == (0.0, 1.0, "error")
    assert issue.ids


def test_a_wash_up_bench_is_no_sink_for_hands() -> None:
    bench = put("hands", "SinkBench", 7.6, 2.0, yaw=HALF)
    assert len(issues(orderly_laboratory(bench), "room_hand_wash")) == 1


def two_rooms(kind: str) -> Layout:
    """The orderly laboratory with its shower in a second room behind a door or a passage."""
    plain = orderly_laboratory(put("shower", "EmergencyShower", 10.0, 7.6, yaw=math.pi))
    floor = plain.floor.model_dump(mode="json")
    side = next(wall for wall in floor["walls"] if wall["start"][0] > 7.9 and wall["end"][0] > 7.9)
    low = min(side["start"][1], side["end"][1])
    side["openings"] = [{"kind": kind, "position": 5.6 - low, "width": 1.2, "height": 2.1}]
    x0, y0, y1 = 8.1, -0.1, 8.1
    corners = [(x0, y0), (12.1, y0), (12.1, y1), (x0, y1)]
    floor["walls"] += [{"start": a, "end": b, "thickness": 0.2, "height": 3.0} for a, b in pairwise(corners)]
    region = [{"x0": 0.0, "y0": 0.0, "x1": 3.8, "y1": 8.0}]
    floor["spaces"].append({"id": "annex", "x": 8.2, "y": 0.0, "region": region})
    return plain.replace(floor=Floor.model_validate(floor))


def test_a_shower_behind_a_door_does_not_count_and_behind_a_passage_it_does() -> None:
    behind_door = [issue.ids[0] for issue in issues(two_rooms("door"), "room_shower")]
    assert behind_door == ["hood"]
    assert issues(two_rooms("passage"), "room_shower") == []
    assert issues(two_rooms("passage"), "shower_walk", navigation=True) == []


def test_quick_walks_to_a_shower_are_never_shorter_than_the_exact_ones() -> None:
    layout = load_published("floors-test", "floors-test-0000")
    assessment = assess(layout, navigation=True)
    roadmap, site = assessment.site.roadmap, assessment.site
    for room, rows in site.work.items():
        goals = site.rows_in(room, ("EmergencyShower",))
        if goals:
            exact = np.array([roadmap.length(row, goals) for row in rows])
            for limit in (*np.arange(0.5, 17.0, 0.5), *exact - 1e-4):
                near = roadmap.within(rows, goals, room, float(limit))
                assert (exact[near] <= limit + 1e-6).all()
            assert roadmap.within(rows, goals, room, 16.8).any()


def test_nothing_stands_in_front_of_an_extinguisher() -> None:
    walled = orderly_laboratory(put("before", "GeneralCabinet", 0.5, 2.05, yaw=-HALF))
    assert [issue.ids for issue in issues(walled, "extinguisher_front")] == [("extinguisher", "before")]


def pocket(gap: float, *changed: Placement) -> Layout:
    """Return the orderly laboratory with an extinguisher in a pocket of benches that has two ways out, meters wide."""
    left = {"yaw": -HALF, "on": "wall"}
    return orderly_laboratory(
        put("extinguisher", "FireExtinguisher", 0.1, 4.5, 0.9, **left), *changed,
        put("low", "LabBench1200", 0.62, 3.3), put("high", "LabBench1200", 0.62, 5.7),
        put("before", "LabBench1800", 1.22 + gap + 0.375, 4.5, yaw=HALF),
        without=("flammables", "general", "ether", "salt"),
    )  # fmt: skip


@pytest.mark.cases(8)
@pytest.mark.parametrize("asset", ["FireExtinguisher", "CO2Extinguisher", "ClassDExtinguisher"])
@pytest.mark.parametrize("gap", [0.02, 0.3, 0.45, 0.6, 0.9])
def test_a_person_can_walk_to_every_extinguisher(asset: str, gap: float) -> None:
    on = {"on": "floor"} if asset == "ClassDExtinguisher" else {"on": "wall", "z": 0.6}
    layout = pocket(gap, put("extinguisher", asset, 0.14, 4.5, yaw=-HALF, **on))
    hall = box(0.0, 0.0, 8.0, 8.0).buffer(-0.25)
    loose = ("spill", "container", "fire")
    standing = [
        footprint(layout, p.id)
        for p in layout.placements
        if p.support == "floor" and layout.asset(p.id).subtype not in loose
    ]
    free = hall.difference(union_all(standing).buffer(0.25))
    groups = getattr(free, "geoms", [free])
    reachable = any(
        group.distance(Point(0.14, 4.5)) < 0.9 and group.distance(Point(6.0, 0.6)) < 0.1 for group in groups
    )
    assert reachable == (gap > 0.5)
    own = [issue.ids for issue in issues(layout, "equipment_reach", navigation=True)]
    assert own == ([] if reachable else [("extinguisher",)])
    seen = {fault.who for fault in faults(layout.to_json()) if fault.kind == "extinguisher reach"}
    assert seen == (set() if reachable else {("extinguisher",)})


@pytest.mark.parametrize("gap", [0.3, 0.9])
def test_a_person_can_walk_to_the_sink_for_hands(gap: float) -> None:
    layout = pocket(gap, put("hands", "HandWashSink", 0.24, 4.5, yaw=-HALF), put("extinguisher", "Carton", 5.0, 1.0))
    own = [issue.ids for issue in issues(layout, "equipment_reach", navigation=True)]
    assert own == ([("hands",)] if gap < 0.5 else [])
    assert [f.who for f in faults(layout.to_json()) if f.kind == "sink reach"] == own


@pytest.mark.cases(1)
@pytest.mark.parametrize("asset", ["FireExtinguisher", "ClassDExtinguisher"])
def test_repair_brings_an_extinguisher_out_of_a_pocket(asset: str) -> None:
    on = {"on": "floor"} if asset == "ClassDExtinguisher" else {"on": "wall", "z": 0.6}
    result = repair_layout(pocket(0.3, put("extinguisher", asset, 0.14, 4.5, yaw=-HALF, **on)), rules=V2)
    assert (result.after.v, result.problems) == (0, ())
    assert faults(result.layout.to_json()) == []


# Wall items and heights.


@pytest.mark.parametrize("asset", ["NoticeBoard", "Whiteboard", "SafetySign", "WallCabinet", "Clock", "CoatHooks"])
@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_a_wall_item_over_a_door_is_found_by_any_part_of_its_width(asset: str, share: float) -> None:
    size = CATALOG.get(asset).size
    x, z = 0.7 - size.width / 2.0 + share * min(size.width, 1.0), min(CATALOG.get(asset).mount_height, 1.9)
    layout = orderly_laboratory(put("item", asset, x, size.depth / 2.0 + 0.005, z, on="wall"))
    (issue,) = issues(layout, "wall_opening")
    assert issue.ids == ("item",)
    beside = orderly_laboratory(put("item", asset, 0.69 - size.width / 2.0, size.depth / 2.0 + 0.005, z, on="wall"))
    assert issues(beside, "wall_opening") == []


def test_a_sign_above_a_door_covers_nothing() -> None:
    assert issues(orderly_laboratory(put("exit", "ExitSign", 1.2, 0.02, 2.3, on="wall")), "wall_opening") == []


@pytest.mark.parametrize("bottom", [0.05, 1.05, 2.35])
def test_extinguishers_hang_between_4_inches_and_5_feet(bottom: float) -> None:
    layout = orderly_laboratory(put("extinguisher", "FireExtinguisher", 0.1, 2.0, bottom, yaw=-HALF, on="wall"))
    (issue,) = issues(layout, "wall_height")
    top = bottom + CATALOG.get("FireExtinguisher").size.height
    assert (issue.value, issue.limit) == pytest.approx((bottom, 0.10) if bottom < 0.10 else (top, 1.53))


@pytest.mark.parametrize("asset", sorted(MOUNTINGS))
def test_what_hangs_at_the_height_of_the_catalog_is_in_order(asset: str) -> None:
    entry = CATALOG.get(asset)
    item = put("item", asset, 7.98 - entry.size.depth / 2.0, 5.5, entry.mount_height, yaw=HALF, on="wall")
    assert issues(orderly_laboratory(item), "wall_height") == []


def test_reagents_do_not_stand_on_the_top_shelf_of_a_cabinet() -> None:
    shelves = CATALOG.get("GeneralCabinet").surfaces
    for slot, shelf in enumerate(shelves):
        layout = orderly_laboratory(put("salt", "SodiumChloride", 0.23, 5.5, shelf.z, on="general", slot=slot))
        assert [issue.ids for issue in issues(layout, "reagent_height")] == ([("salt",)] if shelf.z > 1.40 else [])
    assert shelves[-1].z > 1.40


@pytest.mark.parametrize(("bottom", "wrong"), [(0.4, True), (1.5, True), (2.0, False), (2.7, False)])
def test_a_detector_for_hydrogen_hangs_high(bottom: float, wrong: bool) -> None:
    layout = orderly_laboratory(
        put("detector", "GasDetector", 0.04, 7.0, bottom, yaw=-HALF, on="wall"),
        put("gas", "HydrogenCylinder", 7.85, 6.2, yaw=HALF),
    )
    assert [issue.ids[0] for issue in issues(layout, "detector_height")] == (["detector"] if wrong else [])


# What stands where, and how.

MISPLACED = (
    ("Laptop", "FumeHood"), ("Monitor", "GloveBox"), ("Laptop", "SinkBench"), ("ElectronicScale", "FumeHood"),
    ("Laptop", "FlammableCabinet"), ("SolventWasteContainer", "WritingDesk"), ("SolidWasteBin", "LabBench1800"),
    ("Acetone", "WritingDesk"), ("Beaker", "WritingDesk"), ("RoundBottomFlask", "WritingDesk"),
    ("Acetone", "EquipmentRack"), ("SodiumHydride", "WallShelf"), ("Ethanol", "SinkBench"),
    ("DryingOven", "FlammableCabinet"), ("OilBath", "FlammableSafeRefrigerator"), ("BunsenBurner", "EquipmentRack"),
    ("SpillKit", "WritingDesk"), ("Carton", "FumeHood"), ("Microscope", "GeneralCabinet"),
    ("Monitor", "LabRefrigerator"), ("HydrogenBalloon", "WritingDesk"), ("UltrasonicCleaner", "WritingDesk"),
    ("Spatula", "WritingDesk"), ("TLCPlate", "WritingDesk"), ("WaterPurifier", "WritingDesk"),
    ("WashBottle", "WaterReactiveCabinet"), ("IceBath", "WaterReactiveCabinet"), ("FilterPaper", "OxidizerCabinet"),
    ("Beaker", "FlammableCabinet"), ("MagneticStirrer", "AcidCabinet"), ("PHPaper", "ToxicCabinet"),
)  # fmt: skip
IN_PLACE = (
    ("Laptop", "WritingDesk"), ("Laptop", "LabBench1800"), ("ElectronicScale", "PreparationBench"),
    ("SolventWasteContainer", "WasteStation"), ("Acetone", "FlammableCabinet"), ("RoundBottomFlask", "FumeHood"),
    ("OilBath", "FumeHood"), ("DryingOven", "DryingStation"), ("SyringePump", "EquipmentRack"),
    ("UVCabinet", "FumeHood"), ("Beaker", "GlasswareCabinet"), ("VacuumPump", "RotaryEvaporatorStation"),
    ("WashBottle", "SinkBench"), ("GloveDispenser", "WritingDesk"), ("Keyboard", "WritingDesk"),
    ("SolventBottle", "FlammableCabinet"), ("BottleRack", "AcidCabinet"), ("SampleVial", "LabRefrigerator"),
    ("Beaker", "WallCabinet"), ("SeparatoryFunnel", "FumeHood"),
)  # fmt: skip


@pytest.mark.parametrize(("item", "carrier"), MISPLACED)
def test_some_things_do_not_belong_on_others(item: str, carrier: str) -> None:
    reason = forbidden(CATALOG.get(item), CATALOG.get(carrier))
    assert reason is not None
    assert reason.reason
    assert reason.source


@pytest.mark.parametrize(("item", "carrier"), IN_PLACE)
def test_the_usual_places_of_things_are_allowed(item: str, carrier: str) -> None:
    assert forbidden(CATALOG.get(item), CATALOG.get(carrier)) is None


def test_a_computer_in_the_hood_is_a_violation() -> None:
    (issue,) = issues(orderly_laboratory(put("laptop", "Laptop", 3.6, 7.6, 0.9, on="hood", slot=0)), "misplaced")
    assert issue.ids == ("laptop", "hood")


@pytest.mark.parametrize("degrees", [-44.0, -8.0, -2.5, 2.5, 5.0, 12.0, 27.0, 45.0])
def test_furniture_is_square_within_two_degrees(degrees: float) -> None:
    def turned(by: float) -> Placement:
        return put("island", "IslandBench1800", 4.0, 4.0, yaw=math.radians(by))

    (issue,) = issues(orderly_laboratory(turned(degrees)), "square")
    assert issue.value == pytest.approx(math.radians(abs(degrees)), abs=1e-6)
    assert issues(orderly_laboratory(turned(math.copysign(1.9, degrees))), "square") == []
    assert issues(orderly_laboratory(turned(90.0)), "square") == []


@pytest.mark.parametrize(("x", "yaw", "wrong"), [(0.04, -HALF, False), (0.07, 0.0, True), (0.04, HALF, True)])
def test_what_hangs_on_a_wall_has_its_back_to_it(x: float, yaw: float, wrong: bool) -> None:
    layout = orderly_laboratory(put("detector", "GasDetector", x, 7.0, 2.0, yaw=yaw, on="wall"))
    assert [issue.ids for issue in issues(layout, "square")] == ([("detector",)] if wrong else [])


FIXTURES = (
    ("hands", "HandWashSink"),
    ("hands", "SinkBench"),
    ("eyewash", "EyewashStation"),
    ("shower", "EmergencyShower"),
)


def fixture(name: str, asset: str, gap: float) -> Placement:
    """Return a fixture with its back to the right wall of the orderly laboratory, `gap` meters from it."""
    return put(name, asset, 8.0 - gap - CATALOG.find(asset).size.depth / 2.0, 2.0, yaw=HALF)


@pytest.mark.parametrize(("name", "asset"), FIXTURES)
@pytest.mark.parametrize("gap", [0.01, 0.06, 0.095, 0.105, 0.11, 0.14, 0.3, 1.5])
def test_what_is_plumbed_stands_at_a_wall(name: str, asset: str, gap: float) -> None:
    layout = orderly_laboratory(fixture(name, asset, gap), without=() if name == "hands" else ("hands",))
    measured = footprint(layout, name).distance(LineString([(8.0, 0.0), (8.0, 8.0)]))
    assert measured == pytest.approx(gap, abs=1e-6)
    own = issues(layout, "square")
    assert [(issue.ids, issue.value) for issue in own] == ([((name,), pytest.approx(gap))] if gap > 0.1 else [])
    assert {f.who for f in faults(layout.to_json()) if f.kind == "unfastened"} == {issue.ids for issue in own}


@pytest.mark.parametrize(("gap", "wrong"), [(0.02, False), (0.09, False), (0.12, True)])
def test_a_sink_bench_may_stand_back_to_back_with_a_bench(gap: float, wrong: bool) -> None:
    depth = CATALOG.find("LabBench").size.depth
    sink = put("hands", "SinkBench", 4.0, 3.5 + depth + gap)
    layout = orderly_laboratory(sink, put("other", "LabBench", 4.0, 3.5, yaw=math.pi))
    gap_between = footprint(layout, "hands").distance(footprint(layout, "other"))
    assert (gap_between > 0.1) == wrong
    assert [issue.ids for issue in issues(layout, "square")] == ([("hands",)] if wrong else [])


def test_repair_fastens_a_sink_that_stands_off_its_wall() -> None:
    result = repair_layout(orderly_laboratory(fixture("hands", "HandWashSink", 0.11)), rules=V2)
    assert (result.before.v, result.after.v, result.problems) == (1, 0, ())
    assert faults(result.layout.to_json()) == []


CYLINDER_RADIUS_M = CATALOG.find("NitrogenCylinder").size.width / 2.0


@pytest.mark.parametrize(("gap", "wrong"), [(0.02, False), (0.14, False), (0.16, True), (1.5, True)])
@pytest.mark.parametrize("beside", [False, True])
def test_a_gas_cylinder_stands_at_what_it_is_chained_to(gap: float, wrong: bool, beside: bool) -> None:
    bench = put("other", "LabBench", 3.0, 5.8)
    x = 3.0 + CATALOG.find("LabBench").size.width / 2.0 + gap if beside else 8.0 - gap - 2.0 * CYLINDER_RADIUS_M
    layout = orderly_laboratory(
        put("gas", "NitrogenCylinder", x + CYLINDER_RADIUS_M, 5.8), *([bench] if beside else [])
    )
    held = footprint(layout, "other") if beside else LineString([(8.0, 0.0), (8.0, 8.0)])
    assert footprint(layout, "gas").distance(held) == pytest.approx(gap, abs=1e-6)
    assert [issue.ids for issue in issues(layout, "square")] == ([("gas",)] if wrong else [])


def test_repair_stands_a_free_cylinder_at_a_wall() -> None:
    result = repair_layout(orderly_laboratory(put("gas", "NitrogenCylinder", 6.0, 2.5)), rules=V2)
    assert (result.before.v > 0, result.after.v, result.problems) == (True, 0, ())
    assert issues(result.layout, "square") == []


def test_the_adjuster_hangs_what_is_off_its_wall_with_its_back_to_one() -> None:
    """A quarter turn would bring the detector's side to the wall."""
    layout = orderly_laboratory(put("detector", "GasDetector", 0.08, 7.0, 2.0, yaw=-HALF, on="wall"))
    assert [fault.id for fault in assess(layout).bounds] == ["detector"]
    adjusted = RuleAdjuster().adjust(layout, layout.protocol, assess(layout), "room")
    assert assess(adjusted).bounds == ()
    assert issues(adjusted, "square") == []


def test_the_check_of_a_score_fails_on_a_safety_rule() -> None:
    assert score(orderly_laboratory(), BY_HAND, contacts=False, rules="touchstone").passed
    spoilt = orderly_laboratory(put("laptop", "Laptop", 3.6, 7.6, 0.9, on="hood", slot=0))
    assert not score(spoilt, BY_HAND, contacts=False, rules="touchstone").passed
    assert score(spoilt, BY_HAND, contacts=False, rules="paper").passed


def test_every_water_reactive_of_the_catalog_is_known_by_its_statements() -> None:
    dangerous = {"H250", "H260", "H261", "EUH014"}
    stated = {a.name for a in CATALOG.assets if a.chemistry and not dangerous.isdisjoint(a.chemistry.h_codes)}
    assert stated <= {asset.name for asset in CATALOG.assets if water_reactive(asset)}


def test_the_documentation_lists_every_rule_with_severity_limit_and_source() -> None:
    text = (Path(__file__).parents[3] / "docs" / "safety-rules.md").read_text()
    for rule in RULES:
        assert f"| `{rule.name}` | {rule.severity} | {rule.requires} | {rule.limit} | {rule.source} |" in text
