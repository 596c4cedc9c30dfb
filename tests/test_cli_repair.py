"""The command `labgym repair`: what it prints, writes and returns."""

import pytest
from laboratories import island_laboratory, put

from labgym.layouts import Layout, load_published
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules.objective import evaluate_layout


def test_a_laboratory_without_reagents_gets_them_and_its_file_stays(call, tmp_path):
    path = tmp_path / "lab.json"
    island_laboratory().save(path)
    written = path.read_bytes()
    code, _, err = call("repair", path, "--rules", "paper", "--out", tmp_path / "first.json")
    assert (code, err.count("\n"), "add a shower" in err) == (1, 1, True)
    code, out, err = call("repair", path)
    assert (code, err) == (0, "")
    assert path.read_bytes() == written
    after = Layout.load(tmp_path / "lab-repaired.json")
    assessment = evaluate_layout(after, after.protocol, navigation=True, rules="paper")
    assert (assessment.cost, assessment.missing) == (0, ())
    added = [placement.id for placement in after.placements if placement.id not in island_laboratory().by_id]
    assert added
    assert all(f"{item}: added " in out for item in added)
    assert f"{len(added)} added" in out


def test_a_building_without_an_exit_fails_under_both_versions(call, tmp_path):
    path = tmp_path / "lab.json"
    layout = island_laboratory()
    wall = next(k for k, wall in enumerate(layout.to_json()["floor"]["walls"]) if wall["openings"])
    data = layout.to_json()
    data["floor"]["walls"][wall]["openings"] = []
    Layout.parse(data, "test").save(path)
    for rules in ("paper", "touchstone"):
        code, _, err = call("repair", path, "--rules", rules, "--out", tmp_path / f"{rules}.json")
        assert code == 1
        assert "no exit for" in err


def test_what_is_fixed_stays_is_reported_and_fails(call, tmp_path):
    layout = island_laboratory()
    blocks = [
        put(name, "EquipmentRack", x, 1.0).model_copy(update={"fixed": True})
        for name, x in (("rack_1", 4.0), ("rack_2", 4.2))
    ]
    path = tmp_path / "lab.json"
    layout.replace(placements=(*layout.placements, *blocks)).save(path)
    before = path.read_bytes()
    code, _, err = call("repair", path, "--out", path)
    assert (code, err.count("\n"), path.read_bytes()) == (2, 1, before)
    assert "--overwrite" in err
    code, _, err = call("repair", path, "--out", path, "--overwrite")
    assert code == 1
    assert "not repaired: rack_1 and rack_2 interpenetrate" in err
    assert "fixed objects stay" in err
    after = Layout.load(path)
    assert [after.placement(block.id) for block in blocks] == blocks


def test_a_name_without_json_is_one_line(call, tmp_path):
    island_laboratory().save(tmp_path / "lab.json")
    code, _, err = call("repair", "lab.json", "--out", "folder")
    assert code == 2
    assert "must end in .json" in err


@pytest.mark.parametrize("lost", ["DryingOven_1", "DryingStation_1"])
def test_a_missing_oven_is_added_where_the_protocol_uses_it_and_not_in_the_hood(lost):
    layout = load_published("test", "test-alk_01")
    assert [step.location for step in layout.protocol.steps if "DryingOven" in step.uses] == ["DryingStation"]
    gone = {lost} | {placement.id for placement in layout.placements if placement.support == lost}
    damaged = layout.replace(placements=tuple(p for p in layout.placements if p.id not in gone))
    after = repair_layout(damaged, rules="paper").layout
    supports = {p.asset: after.placement(p.support).asset for p in after.placements if p.asset == "DryingOven"}
    assert supports == {"DryingOven": "DryingStation"}
