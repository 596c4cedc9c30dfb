"""The layout report: every planted fault shows in its own metric and in no other; totals, gates and nulls add up."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from laboratories import put

from labgym.assets import Catalog
from labgym.errors import DocumentError, LabgymError, UnknownNameError
from labgym.eval import LayoutReport, LayoutSummary, aggregate, score
from labgym.layouts import Door, Layout, Placement, Room
from labgym.protocols import Protocol, ReagentUse, Step, get, protocols

PROTOCOL = Protocol(
    id="test",
    name="Test",
    reaction_type="substitution",
    reagents=tuple(
        ReagentUse(name=name, role="reagent") for name in ("Acetone", "HydrochloricAcid", "SodiumHydroxide")
    ),
    instruments=("RoundBottomFlask", "MagneticHotplateStirrer", "ElectronicScale"),
    steps=tuple(
        Step(index=k, location=location, action="Stir", text="Stir.")
        for k, location in enumerate(("PreparationBench", "FumeHood", "PreparationBench"), 1)
    ),
)
METRICS = ("ob", "cn", "cn_sw", "asset", "step_nav", "prot_nav", "flam", "store", "incomp", "glass")


def shelf(cabinet: str) -> float:
    return Catalog.load().get(cabinet).surfaces[0].z


CLEAN = (
    put("hood", "FumeHood", 4.0, 7.575, yaw=math.pi),
    put("bench", "PreparationBench", 7.625, 3.0, yaw=math.pi / 2),
    put("flammables", "FlammableCabinet", 0.23, 3.5, yaw=-math.pi / 2),
    put("acids", "AcidCabinet", 0.3, 5.0, yaw=-math.pi / 2),
    put("bases", "BaseCabinet", 0.3, 6.5, yaw=-math.pi / 2),
    put("stool", "LabStool", 6.0, 6.0),
    put("acetone", "Acetone", 0.23, 3.5, shelf("FlammableCabinet"), on="flammables", slot=0),
    put("acid", "HydrochloricAcid", 0.3, 5.0, shelf("AcidCabinet"), on="acids", slot=0),
    put("base", "SodiumHydroxide", 0.3, 6.5, shelf("BaseCabinet"), on="bases", slot=0),
    put("flask", "RoundBottomFlask", 4.0, 7.55, 0.9, on="hood", slot=0),
    put("plate", "MagneticHotplateStirrer", 4.4, 7.55, 0.9, on="hood", slot=0),
    put("scale", "ElectronicScale", 7.6, 3.0, 0.9, on="bench", slot=0),
    put("jack", "LabJack", 7.6, 3.4, 0.9, on="bench", slot=0),
)


def lab(*changed: Placement, without: tuple[str, ...] = (), room: Room | None = None) -> Layout:
    """The clean laboratory with placements replaced or added by id, and some left out."""
    by_id = {placement.id: placement for placement in (*CLEAN, *changed) if placement.id not in without}
    room = room or Room(width=8.0, depth=8.0, doors=(Door(wall="front", offset=1.2), Door(wall="front", offset=6.0)))
    return Layout(id="lab", floor=room.floor, placements=tuple(by_id.values()))


def report(layout: Layout, profile: str = "default") -> LayoutReport:
    return score(layout, PROTOCOL, "paper", profile, contacts=False)


def test_the_clean_laboratory_is_perfect() -> None:
    found = report(lab())
    assert [getattr(found, name) for name in METRICS] == [0, 0, 0, 1, 1.0, 1, 1.0, 1.0, 1.0, 1.0]
    assert (found.obj, found.v, found.fitness) == (13, 0, 1.0)
    assert (found.s_phys, found.s_chem) == (35.0, 35.0)
    assert found.violations == ()


FAULTS = {
    "an item over the edge of its bench": (
        put("jack", "LabJack", 7.6, 3.67, 0.9, on="bench", slot=0),
        {"ob"},
        "bounds",
    ),
    "an item that floats": (put("jack", "LabJack", 7.6, 3.4, 0.92, on="bench", slot=0), {"ob"}, "bounds"),
    "a stool through the wall": (put("stool", "LabStool", 7.9, 6.0), {"ob"}, "bounds"),
    "two items in one place": (
        put("jack", "LabJack", 7.6, 3.16, 0.9, on="bench", slot=0),
        {"cn", "cn_sw"},
        "collision",
    ),
    "two items that just interpenetrate": (
        put("jack", "LabJack", 7.6, 3.258, 0.9, on="bench", slot=0),
        {"cn"},
        "collision",
    ),
    "a reagent left on the bench": (
        put("acetone", "Acetone", 7.6, 2.6, 0.9, on="bench", slot=0),
        {"store"},
        "storage",
    ),
    "a heater beside the flammables": (put("bath", "OilBath", 0.6, 3.5), {"flam"}, "flammable"),
    "acid and base on one shelf": (
        put("base", "SodiumHydroxide", 0.3, 5.15, shelf("AcidCabinet"), on="acids", slot=0),
        {"incomp"},
        "incompatible",
    ),
    "a flask at the sash": (put("flask", "RoundBottomFlask", 4.0, 7.30, 0.9, on="hood", slot=0), {"glass"}, None),
    "a rack where the robot stands": (
        put("rack", "EquipmentRack", 6.6, 3.0),
        {"step_nav", "prot_nav"},
        "navigation",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_shows_in_its_own_metric_only(fault: str) -> None:
    changed, metrics, kind = FAULTS[fault]
    clean, found = report(lab()), report(lab(changed))
    moved = {name for name in METRICS if getattr(found, name) != getattr(clean, name)}
    assert moved == metrics
    assert {violation.kind for violation in found.violations} == ({kind} if kind else set())
    assert found.v == len(found.violations)
    if kind is not None:
        involved = {name for violation in found.violations for name in violation.ids}
        assert changed.id in involved or kind == "navigation"
        assert all(violation.message and violation.suggestion for violation in found.violations)


@pytest.mark.parametrize("fault", [None, *FAULTS])
def test_mujoco_counts_the_same_collisions(fault: str | None) -> None:
    found = score(lab(*([FAULTS[fault][0]] if fault else [])), PROTOCOL, rules="paper")
    assert found.cn_mj == found.cn


def test_mujocos_count_leaves_doors_windows_and_the_robot_out_as_well() -> None:
    inside = put("robot", "MobileManipulator", 7.0, 3.0)
    window = put("window", "LabWindow", 4.0, 7.95, 0.9, math.pi, on="wall")
    assert score(lab(inside, window), PROTOCOL, rules="paper").cn_mj == 0


def test_a_missing_asset_shows_in_the_asset_bit_and_gates_the_chemistry() -> None:
    found = report(lab(without=("scale",)))
    assert (found.asset, found.missing) == (0, ("ElectronicScale",))
    assert (found.flam, found.store, found.incomp, found.glass) == (1.0, 1.0, 1.0, 1.0)
    assert set(found.gated.model_dump().values()) == {0.0}
    assert found.s_chem == 35.0


def test_a_location_that_is_missing_makes_its_transitions_infeasible() -> None:
    found = report(lab(without=("hood", "flask", "plate")))
    assert (found.transitions, found.step_nav, found.prot_nav) == (2, 0.0, 0)
    assert "FumeHood" in found.missing


def test_the_geometry_penalty_reaches_every_instance_of_a_faulty_object() -> None:
    found = report(lab(put("plate", "MagneticHotplateStirrer", 4.05, 7.55, 0.9, on="hood", slot=0)))
    assert found.cn == 1  # with the flask
    assert found.flam == 0.0
    assert found.glass == 0.0
    assert (found.store, found.incomp) == (1.0, 1.0)
    assert found.v == 1  # the pair is far enough apart: the penalty is no second violation


def test_the_profile_is_named_and_changes_the_thresholds() -> None:
    layout = lab(put("flask", "RoundBottomFlask", 4.0, 7.40, 0.9, on="hood", slot=0))
    found = {profile: report(layout, profile) for profile in ("default", "strict", "paper")}
    inside = 0.35 - 0.15 - 0.085 / 2  # 0.7 m deep, its middle at y = 7.55 when turned by pi
    for profile, limit in (("default", 0.15), ("strict", 0.20), ("paper", 0.30)):
        assert found[profile].profile == profile
        assert found[profile].glass == pytest.approx(min(1.0, inside / limit))


def test_nulls_where_a_metric_does_not_apply() -> None:
    empty = score(
        Layout(id="empty", floor=Room(width=5.0, depth=5.0).floor, placements=()),
        contacts=False,
        rules="paper",
    )
    unknown = (
        "asset", "step_nav", "prot_nav", "flam", "store", "incomp", "glass", "s_chem", "total", "cn_mj",
        "total_with_proxy", "real", "lay", "comp", "s_consist", "store_class", "incomp_contained",
    )  # fmt: skip
    assert [name for name in unknown if getattr(empty, name) is not None] == []
    assert (empty.obj, empty.ob, empty.cn, empty.s_phys) == (0, 0, 0, 35.0)


def test_chemistry_points_are_equal_shares_of_what_applies() -> None:
    no_heat = report(lab(put("flask", "RoundBottomFlask", 4.0, 7.30, 0.9, on="hood", slot=0), without=("plate",)))
    assert no_heat.flam is None
    assert no_heat.glass is not None
    assert no_heat.s_chem == pytest.approx(35.0 * (no_heat.glass + 2.0) / 3.0)


def test_physical_points_are_shares_of_the_objects_concerned() -> None:
    found = report(
        lab(
            put("jack", "LabJack", 7.6, 3.67, 0.92, on="bench", slot=0),  # over the edge and floating
            put("stool", "LabStool", 7.9, 6.0),
        )
    )
    assert found.ob == 2
    assert found.physical.tabletop_bounds == pytest.approx(10.0 * 6 / 7)
    assert found.physical.desktop_collisions == 10.0
    assert found.physical.heights == pytest.approx(5.0 * 12 / 13)
    assert found.physical.room == pytest.approx(10.0 * 5 / 6)
    assert found.s_phys == pytest.approx(found.physical.total)
    assert found.total is None
    assert found.total_with_proxy == pytest.approx(found.s_phys + found.s_chem + found.consistency_proxy.total)


def test_the_protocol_may_be_given_by_id_or_named_by_the_layout() -> None:
    name = next(iter(protocols()))
    layout = Layout(id="empty", protocols=(get(name),), floor=Room(width=5.0, depth=5.0).floor, placements=())
    named, given = (
        score(layout, contacts=False, rules="paper"),
        score(layout.replace(protocols=()), name, contacts=False, rules="paper"),
    )
    assert named.protocol == given.protocol == name
    assert named.asset == given.asset == 0
    assert len(named.missing) == len(protocols()[name].required_assets())


def test_bad_arguments_name_what_exists() -> None:
    with pytest.raises(UnknownNameError, match="profile 'loose' not found"):
        score(lab(), PROTOCOL, profile="loose", rules="paper")
    with pytest.raises(UnknownNameError, match=r"protocol \(an id or a \.json file\) 'nonsense' not found"):
        score(lab(), "nonsense", rules="paper")
    with pytest.raises(DocumentError, match=r"field placements.\d+.asset: asset 'NoSuchThing' not found"):
        score(lab(put("x", "NoSuchThing", 1.0, 1.0)), PROTOCOL, rules="paper")
    with pytest.raises(LabgymError, match="slot 3 of 'bench'"):
        score(lab(put("jack", "LabJack", 7.6, 3.4, 0.9, on="bench", slot=3)), PROTOCOL, rules="paper")


def test_a_report_and_a_summary_survive_the_disk(tmp_path: Path) -> None:
    found = report(lab(*(changed for changed, _, _ in FAULTS.values())))
    assert LayoutReport.load(found.save(tmp_path / "report.json")) == found
    summary = aggregate([found])
    assert LayoutSummary.load(summary.save(tmp_path / "summary.json")) == summary
    (tmp_path / "report.json").write_text('{"schema": "labgym.layout-report/1", "obj": -1}')
    with pytest.raises(DocumentError, match=r"report\.json: field "):
        LayoutReport.load(tmp_path / "report.json")


def test_a_summary_averages_what_applies_and_counts_the_rest() -> None:
    half = report(lab(put("acetone", "Acetone", 7.6, 2.6, 0.9, on="bench", slot=0)))
    bare = report(lab(without=("plate", "scale")))  # no heat source, an asset missing
    summary = aggregate([report(lab()), half, bare])
    assert summary.layouts == 3
    assert summary.mean("obj") == pytest.approx((13 + 13 + 11) / 3)
    assert summary.mean("store") == pytest.approx((1.0 + 2 / 3 + 1.0) / 3)
    assert (summary.metrics["flam"].count, summary.metrics["flam"].nulls) == (2, 1)
    assert summary.mean("asset") == pytest.approx(2 / 3)
    assert summary.mean("gated_store") == pytest.approx((1.0 + 2 / 3 + 0.0) / 3)
    assert (summary.mean("real"), summary.metrics["real"].nulls) == (None, 3)
    assert summary.profiles == ("default",)
    assert aggregate([]).mean("obj") is None


def test_the_score_does_not_depend_on_the_order_of_placements() -> None:
    layout = lab(*(changed for changed, _, _ in FAULTS.values()))
    one, other = report(layout), report(layout.replace(placements=layout.placements[::-1]))
    for name in (*METRICS, "obj", "v", "fitness", "s_phys", "s_chem", "incomp_contained", "store_class"):
        assert getattr(one, name) == pytest.approx(getattr(other, name)), name
