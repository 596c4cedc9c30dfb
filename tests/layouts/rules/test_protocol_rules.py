"""`touchstone` by hand: supports, glass on the floor, storage classes, near, ventilation, handling, reach, walks."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import pytest
from laboratories import BY_HAND as PROTOCOL
from laboratories import orderly_laboratory as laboratory
from laboratories import put

from labgym.layouts import Door, Placement, Room
from labgym.layouts.rules import Assessment, evaluate_layout, rule_set
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.reach import ARM_REACH, SHOULDER_HEIGHT, item_reaches
from labgym.layouts.rules.workflow import walking_distance
from labgym.protocols import Step

HALF = math.pi / 2.0


def assess(*changed: Placement, without: tuple[str, ...] = (), navigation: bool = False) -> Assessment:
    layout = laboratory(*changed, without=without)
    assessment = evaluate_layout(layout, PROTOCOL, navigation=navigation, rules="touchstone")
    assert isinstance(assessment, Assessment)
    return assessment


def kinds(assessment: Assessment) -> dict[str, int]:
    """Number of violations by kind."""
    items = assessment.violations.items
    assert len(items) == assessment.v
    return {kind: len(assessment.violations.of(kind)) for kind in dict.fromkeys(item.kind for item in items)}


def test_a_laboratory_in_order_has_no_violation_and_full_fitness() -> None:
    clean = assess(navigation=True)
    assert (kinds(clean), clean.fitness, clean.perfect) == ({}, 1.0, True)
    assert len(clean.drives_of("entries")) == 2
    # The doors of a room open inward, which is advice.
    assert {name for name, value in clean.facility.items() if value < 1.0} == {"exit_swing"}


WRONG_SUPPORTS = {
    "an instrument on the floor": put("scale", "ElectronicScale", 6.0, 4.0),
    "a reagent on the floor": put("salt", "SodiumChloride", 2.0, 4.0),
    "an extinguisher off its wall": put("extinguisher", "FireExtinguisher", 2.0, 5.0),
    "a stool on a bench": put("stool", "LabStool", 7.6, 4.5, 0.9, on="bench", slot=0),
}


@pytest.mark.parametrize("placement", WRONG_SUPPORTS.values(), ids=WRONG_SUPPORTS)
def test_the_wrong_kind_of_support_is_out_of_bounds_under_touchstone_only(placement: Placement) -> None:
    assessment = assess(placement)
    assert assessment.out_of_bounds == {placement.id}
    assert "belongs" in assessment.violations.of("bounds")[0].message
    assert not evaluate_layout(laboratory(placement), PROTOCOL, "paper").out_of_bounds


def test_portable_equipment_may_stand_on_furniture_and_a_cylinder_on_the_floor() -> None:
    kit = put("spills", "SpillKit", 7.6, 4.6, 0.9, on="bench", slot=0)
    assert not assess(kit, put("argon", "ArgonGas", 6.0, 6.0)).out_of_bounds


def test_glass_on_the_floor_scores_0_and_so_does_glass_on_what_fell() -> None:
    on_floor = assess(put("flask", "RoundBottomFlask", 4.0, 4.0))
    assert [(one.ids, one.satisfaction) for one in on_floor.of("glass")] == [(("flask",), 0.0)]
    assert evaluate_layout(laboratory(put("flask", "RoundBottomFlask", 4.0, 4.0)), PROTOCOL, "paper").of("glass") == ()
    stand = put("stand", "AdditionStand", 4.0, 4.0)
    height = laboratory(stand).surface("stand", 0).z0
    on_stand = assess(stand, put("flask", "RoundBottomFlask", 4.0, 4.0, height, on="stand", slot=0))
    assert on_stand.out_of_bounds >= {"stand"}
    assert [one.satisfaction for one in on_stand.of("glass")] == [0.0]


def test_a_reagent_in_a_cabinet_of_another_class_is_not_stored() -> None:
    swapped = assess(put("salt", "SodiumChloride", 0.23, 3.7, 0.1, on="flammables", slot=0))
    assert kinds(swapped)["storage"] == 1
    assert "storage class General, in a cabinet of class Flammable" in swapped.violations.of("storage")[0].message


def test_the_pieces_of_an_apparatus_are_near_up_to_an_arms_reach() -> None:
    near = assess().of("near")
    assert [(one.satisfaction, one.hard) for one in near] == [(1.0, False)]
    far = assess(put("plate", "MagneticHotplateStirrer", 7.6, 3.4, 0.9, on="bench", slot=0)).of("near")[0]
    flask, plate = laboratory().box("flask"), laboratory().asset("plate").size
    dx, dy = (
        7.6 - plate.width / 2.0 - flask.x - flask.width / 2.0,
        flask.y - flask.depth / 2.0 - 3.4 - plate.depth / 2.0,
    )
    assert far.distance == pytest.approx(math.hypot(dx, dy), abs=0.02)
    assert far.satisfaction == pytest.approx(0.85 / far.distance)
    assert far.hard


def test_harmful_vapors_stay_in_the_hood() -> None:
    assert [one.satisfaction for one in assess().of("ventilation")] == [1.0]
    out = assess(put("flask", "RoundBottomFlask", 7.6, 4.4, 0.9, on="bench", slot=0))
    assert [(one.satisfaction, one.hard) for one in out.of("ventilation")] == [(0.5, True)]
    assert "RoundBottomFlask outside of FumeHood" in out.violations.of("ventilation")[0].message
    turned = assess(put("hood", "FumeHood", 4.0, 7.575))
    assert [one.satisfaction for one in turned.of("ventilation")] == [0.0]


def test_flammables_count_where_they_are_used_but_not_for_the_protocols_own_heat() -> None:
    assert [one for one in assess().of("flammable") if "is used" in one.note] == []
    burner = put("burner", "BunsenBurner", 4.0, 7.3, 0.9, on="hood", slot=0)
    near = next(one for one in assess(burner).of("flammable") if "is used" in one.note)
    layout = laboratory(burner)
    flask, flame = layout.box("flask"), layout.box("burner")
    gap = flask.y - flask.depth / 2.0 - flame.y - flame.depth / 2.0
    assert near.distance == pytest.approx(max(gap, 0.0))
    assert near.hard


def test_heat_that_another_protocol_of_the_layout_uses_there_does_not_count() -> None:
    burner = put("burner", "BunsenBurner", 4.0, 7.3, 0.9, on="hood", slot=0)
    step = Step(index=1, location="FumeHood", action="Heat", text="Heat.", uses=("BunsenBurner",))
    other = PROTOCOL.model_copy(update={"id": "other", "instruments": ("BunsenBurner",), "steps": (step,)})
    shared = laboratory(burner).replace(protocols=(PROTOCOL, other))
    assessment = evaluate_layout(shared, PROTOCOL, rules="touchstone")
    assert [one for one in assessment.of("flammable") if "is used" in one.note] == []


def test_an_open_incompatible_reagent_counts_where_another_is_used() -> None:
    acid = put("acid", "NitricAcid", 3.85, 7.55, 0.9, on="hood", slot=0)
    used = [one for one in assess(acid).of("incompatible") if "where it is used" in one.note]
    assert [(one.ids, one.hard) for one in used] == [(("hood", "acid"), True)]


def test_a_cabinet_that_faces_the_wall_and_a_blocked_hood_are_hard() -> None:
    turned = assess(put("general", "GeneralCabinet", 0.23, 5.5, yaw=HALF), without=("salt",))
    front = {one.ids[0]: one for one in turned.of("front")}["general"]
    assert front.hard
    assert front.satisfaction < 0.05
    blocked = assess(put("island", "LabBench1800", 4.0, 6.2, yaw=math.pi))
    layout = laboratory(put("island", "LabBench1800", 4.0, 6.2, yaw=math.pi))
    gap = (
        layout.box("hood").y
        - layout.box("hood").depth / 2.0
        - layout.box("island").y
        - layout.box("island").depth / 2.0
    )
    assert {one.ids[0]: one.distance for one in blocked.of("front")}["hood"] == pytest.approx(gap)


def test_missing_safety_equipment_and_missing_assets_count_in_v() -> None:
    bare = assess(without=("extinguisher", "spills", "waste", "scale"))
    assert bare.unequipped == ("FireExtinguisher", "SpillKit", "SolventWasteContainer")
    assert bare.missing == ("ElectronicScale",)
    assert kinds(bare) == {"missing": 4, "facility": 1}
    assert "room_extinguisher_b" in {issue.rule for issue in bare.issues}


def test_hazardous_reagents_call_for_a_shower_an_eyewash_a_hand_wash_sink_and_a_gas_detector() -> None:
    bare = assess(without=("shower", "eyewash", "hands", "detector"))
    assert bare.unequipped == ("EmergencyShower", "EyewashStation", "HandWashSink", "GasDetector")


def test_stools_before_the_doors_stop_the_robot_but_are_no_egress_issue() -> None:
    stools = [put(f"stool{k}", "LabStool", x, 0.45) for k, x in enumerate((1.2, 6.0))]
    assessment = assess(*stools, navigation=True)
    assert [drive.feasible for drive in assessment.drives_of("entries")] == [False, False]
    assert [drive.feasible for drive in assessment.transitions or ()] == [True]
    assert kinds(assessment) == {"navigation": 2, "facility": 2}
    assert {issue.rule for issue in assessment.issues} == {"door_area", "exit_swing"}


def test_a_missing_second_exit_is_a_warning_and_hard_under_the_profile_code() -> None:
    floor = Room(width=8.0, depth=8.0, doors=(Door(wall="front", offset=1.2),)).floor
    layout = laboratory().replace(floor=floor)
    default, code = (evaluate_layout(layout, PROTOCOL, rule_set(profile=name)) for name in ("default", "code"))
    assert (default.v, code.v) == (0, 1)
    assert "only one exit" in code.violations.of("facility")[0].message


def test_reach_is_the_distance_from_the_shoulder_at_the_goal_pose() -> None:
    arrangement = Arrangement.of(laboratory())
    reaches = {one.item: one for one in item_reaches(arrangement, PROTOCOL)}
    box = laboratory().box("flask")
    hood = laboratory().box("hood")
    shoulder = (4.0, hood.y - hood.depth / 2.0 - 0.6, SHOULDER_HEIGHT)
    assert reaches["flask"].distance == pytest.approx(math.dist(shoulder, (box.x, box.y, (box.z0 + box.z1) / 2.0)))
    assert set(reaches) == {"salt", "scale", "ether", "flask", "plate"}
    far = Arrangement.of(laboratory(put("scale", "ElectronicScale", 4.6, 7.55, 0.9, on="hood", slot=0)))
    lost = {one.item: one for one in item_reaches(far, PROTOCOL)}["scale"]
    assert not lost.reached
    assert lost.distance > ARM_REACH


def test_the_walk_of_the_workflow_by_hand() -> None:
    layout = laboratory()
    bench, hood = (6.65, 4.0), (4.0, 7.575 - layout.asset("hood").size.depth / 2.0 - 0.6)
    bench = (layout.box("bench").x - layout.box("bench").depth / 2.0 - 0.6, 4.0)
    store = {
        name: (layout.box(name).x + layout.box(name).depth / 2.0 + 0.6, layout.box(name).y)
        for name in ("general", "flammables")
    }
    walk = walking_distance(Arrangement.of(layout), PROTOCOL)
    assert walk.between == pytest.approx(math.dist(bench, hood))
    assert walk.fetching == pytest.approx(
        2.0 * (math.dist(bench, store["general"]) + math.dist(hood, store["flammables"]))
    )
    assert (walk.trips, walk.blocked) == (2, 0)
    away = walking_distance(
        Arrangement.of(laboratory(put("flask", "RoundBottomFlask", 7.6, 4.4, 0.9, on="bench", slot=0))), PROTOCOL
    )
    assert away.fetching == pytest.approx(walk.fetching + 2.0 * math.dist(bench, hood))
    assert away.length == pytest.approx(away.between + away.fetching)


def test_tie_breakers_prefer_the_shorter_walk_only_when_asked() -> None:
    moved = (
        put("general", "GeneralCabinet", 0.23, 6.5, yaw=-HALF),
        put("salt", "SodiumChloride", 0.23, 6.5, 0.1, on="general", slot=0),
    )
    near, far = assess(), assess(*moved)
    assert not near.better_than(far)
    rules = replace(near.rules, tie_breakers=True)
    near, far = replace(near, rules=rules), replace(far, rules=rules)
    assert (near.cost, near.fitness, near.reach) == (far.cost, far.fitness, far.reach)
    assert near.better_than(far)
    assert not far.better_than(near)


def test_fewer_violations_are_better_whatever_the_fitness() -> None:
    clean, worse = assess(), assess(put("scale", "ElectronicScale", 6.0, 4.0))
    assert clean.cost < worse.cost
    assert clean.better_than(worse)
    assert not worse.better_than(clean)
    assert not clean.better_than(clean)


VIOLATIONS = {
    "near": (
        put("plate", "MagneticHotplateStirrer", 7.6, 3.4, 0.9, on="bench", slot=0),
        lambda short: f"plate is {0.85 + short:.2f} m from flask: ",
        lambda _: "place them on one surface, at most 0.85 m apart",
    ),
    "storage": (
        put("salt", "SodiumChloride", 0.23, 3.7, 0.1, on="flammables", slot=0),
        lambda _: "salt is of storage class General, ",
        lambda _: "put salt on a shelf of a reagent cabinet",
    ),
    "ventilation": (
        put("flask", "RoundBottomFlask", 7.6, 4.4, 0.9, on="bench", slot=0),
        lambda _: "RoundBottomFlask outside of FumeHood",
        lambda _: "place flask in hood",
    ),
    "flammable": (
        put("burner", "BunsenBurner", 4.0, 7.3, 0.9, on="hood", slot=0),
        lambda short: f"hood is {0.6 - short:.2f} m from burner, under 0.6 m: ",
        lambda short: f"move hood and burner {short:.2f} m further apart",
    ),
}


@pytest.mark.parametrize("kind", VIOLATIONS)
def test_a_violation_says_what_is_wrong_by_how_much_and_what_to_do(kind: str) -> None:
    placement, message, suggestion = VIOLATIONS[kind]
    (found,) = assess(placement).violations.of(kind)
    assert found.amount == 1.0 or kind in ("near", "flammable")
    assert message(found.amount) in found.message
    assert found.suggestion == suggestion(found.amount)


def test_what_an_assessment_keeps_for_later_is_no_part_of_its_text_or_of_comparisons() -> None:
    kept = [field for field in fields(Assessment) if field.name.startswith("_")]
    assert kept
    assert not any(field.repr or field.compare for field in kept)
    assert Assessment.__dataclass_fields__["navigation"].default is False
