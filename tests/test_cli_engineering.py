"""The commands for engineers: compile, outline, move, view, and generate with an inventory or an outline."""

from __future__ import annotations

import csv
import json
import math

import ezdxf
import pytest
from laboratories import island_laboratory, put

from labgym.errors import DocumentError
from labgym.exchange.fixed import read_fixed
from labgym.exchange.inventory import read_inventory
from labgym.layouts import Layout, load_published, published

NAME = published("test")[0]


def test_several_formats_go_into_one_folder(call, tmp_path):
    formats = [word for name in ("dxf", "svg", "pdf", "bom", "ros") for word in ("--format", name)]
    code, out, _ = call("compile", NAME, "--out", "files", *formats)
    names = [f"files/{NAME}.{suffix}" for suffix in ("dxf", "svg", "pdf", "csv")]
    assert (code, out.split()) == (0, [*names, "files/ros/map.yaml"])
    assert (tmp_path / "files" / "ros" / "map.png").is_file()
    assert (tmp_path / f"files/{NAME}.pdf").read_bytes().startswith(b"%PDF")
    assert not ezdxf.readfile(tmp_path / f"files/{NAME}.dxf").audit().errors


def test_a_format_that_does_not_suit_is_one_line(call):
    for words in (("--out", "a.txt", "--format", "dxf"), ("--out", "a.png", "--format", "pdf")):
        code, _, err = call("compile", NAME, *words)
        assert (code, err.count("\n")) == (2, 1)
    assert call("compile", NAME, "--out", "a", "--format", "dxf", "--format", "dxf")[0] == 2


def test_a_move_prints_the_violations_before_and_after(call, tmp_path):
    island_laboratory().save(tmp_path / "lab.json")
    code, out, _ = call("move", "lab.json", "IslandBench1800_1", "--by", "-2.6,0,0.5", "--out", "new.json")
    assert code == 0
    rows = {line.split()[0]: line.split()[-2:] for line in out.splitlines() if line}
    assert rows["collision"] == ["0", "1"]
    assert "interpenetrate" in out
    moved, before = Layout.load(tmp_path / "new.json"), island_laboratory()
    place = moved.placement("IslandBench1800_1")
    assert place.position == pytest.approx((1.4, 2.5, 0.0))
    assert place.yaw == pytest.approx(0.5)
    assert [p for p in moved.placements if p.id != place.id] == [p for p in before.placements if p.id != place.id]


def test_a_move_never_overwrites_unless_asked(call, tmp_path):
    island_laboratory().save(tmp_path / "lab.json")
    before = (tmp_path / "lab.json").read_bytes()
    words = ("move", "lab.json", "SinkBench_1", "--to", "5,5.6", "--out", "lab.json")
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert "--overwrite" in err
    assert (tmp_path / "lab.json").read_bytes() == before
    assert call(*words, "--overwrite")[0] == 0
    assert Layout.load(tmp_path / "lab.json").placement("SinkBench_1").position[0] == 5.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "--to"),
        (("--to", "1,2", "--by", "1,2"), "either"),
        (("--to", "1"), "2 or 3"),
        (("--to", "a,b"), "--to"),
        (("--by", "nan,0"), "out of range"),
        (("--by", "0,0", "--out", "lab.txt"), ".json"),
    ],
)
def test_a_move_without_a_place_is_one_line(call, words, message):
    code, out, err = call("move", NAME, "FumeHood_1", "--out", "new.json", *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_an_outline_is_a_layout_that_can_be_furnished(call, tmp_path):
    assert call("compile", NAME, "--out", "plan.dxf", "--format", "dxf")[0] == 0
    code, out, _ = call("outline", "plan.dxf", "--out", "floor.json")
    assert (code, out) == (0, "floor.json\n")
    assert Layout.load(tmp_path / "floor.json").placements == ()
    assert Layout.load(tmp_path / "floor.json").room == load_published("test", NAME).room.model_copy(
        update={"name": "plan"}
    )
    assert call("outline", "plan.dxf", "--out", "floor.json")[0] == 0, "the same content again loses nothing"
    island_laboratory().save(tmp_path / "floor.json")
    assert "--overwrite" in call("outline", "plan.dxf", "--out", "floor.json")[2]
    assert call("generate", "pro_01", "--room", "plan.dxf", "--out", "lab.json")[0] == 0
    assert Layout.load(tmp_path / "lab.json").room.name == "plan"


def test_what_an_inventory_lacks_is_listed_or_refused(call, tmp_path):
    assert call("compile", NAME, "--out", "have.csv", "--format", "bom")[0] == 0
    with (tmp_path / "have.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    protocol = load_published("test", NAME).protocol
    location = "FumeHood"
    assert location in protocol.locations
    (tmp_path / "less.csv").write_text(
        "asset,count\n" + "".join(f"{row['asset']},{row['count']}\n" for row in rows if row["asset"] != location)
    )
    room = ("--room", "12x9")
    code, out, err = call("generate", protocol.id, *room, "--have", "less.csv", "--only-have", "--out", "lab.json")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"missing: 1 {location}" in err
    assert not (tmp_path / "lab.json").exists()
    code, _, err = call("generate", protocol.id, *room, "--have", "less.csv", "--out", "lab.json")
    assert code == 0
    assert f"to buy: 1 {location}\n" in err


def test_a_misspelled_asset_of_a_table_is_noted(tmp_path):
    (tmp_path / "have.csv").write_text("asset,count\nFumeHod,1\nfume hood,1\nSinkBench,1\n")
    remarks: list[str] = []
    assert read_inventory(tmp_path / "have.csv", remark=remarks.append).counts == {"FumeHood": 2, "SinkBench": 1}
    assert [remark.removeprefix(f"{tmp_path}/") for remark in remarks] == [
        "have.csv: row 2: 'FumeHod' is taken for FumeHood"
    ]
    (tmp_path / "fixed.csv").write_text("asset,x,y\nSinkBnech,1,1\n")
    remarks.clear()
    assert [piece.asset for piece in read_fixed(tmp_path / "fixed.csv", remark=remarks.append)] == ["SinkBench"]
    assert len(remarks) == 1


def test_generate_prints_the_notes_on_misspelled_assets(call, tmp_path):
    (tmp_path / "have.csv").write_text("asset,count\nFumeHod,1\n")
    code, out, err = call("generate", "pro_01", "--room", "9x7", "--have", "have.csv", "--only-have")
    assert (code, out) == (2, "")
    assert "note: have.csv: row 2: 'FumeHod' is taken for FumeHood\n" in err


def test_hoods_stand_within_reach_of_the_wall_with_exhaust(call, tmp_path):
    room = ("--room", "9x7")
    assert call("generate", "pro_01", *room, "--service", "exhaust:left:required", "--out", "lab.json")[0] == 0
    layout = Layout.load(tmp_path / "lab.json")
    hoods = [layout.box(p.id) for p in layout.placements if layout.asset(p.id).fume_hood]
    assert hoods
    assert all(hood.bounds()[0] <= 3.0 for hood in hoods)
    code, _, err = call("generate", "pro_01", "--family", "ell", "--service", "exhaust:left", "--out", "no.json")
    assert (code, err.count("\n")) == (2, 1)
    assert "leave out --family" in err


def test_pieces_of_a_table_of_a_layout_and_of_a_drawing_stay_where_they_are(call, tmp_path):
    (tmp_path / "fixed.csv").write_text("id,asset,x,y,yaw_deg\nsink,SinkBench,0.4,4.0,-90\n,LabRefrigerator,7.6,5,90\n")
    assert call("generate", "sub_01", "--fixed", "fixed.csv", "--out", "lab.json")[0] == 0
    first = Layout.load(tmp_path / "lab.json")
    assert {p.id for p in first.placements if p.fixed} == {"sink", "LabRefrigerator_fixed_1"}
    assert call("compile", "lab.json", "--out", "lab.dxf", "--format", "dxf")[0] == 0
    sources = (("lab.json", 2), ("lab.dxf", sum(p.support in ("floor", "wall") for p in first.placements)))
    for name, count in sources:
        pieces = read_fixed(tmp_path / name)
        assert len(pieces) == count
        for piece in pieces:
            axes = 2 if name.endswith(".dxf") else 3  # a plan does not say how high a piece hangs
            assert piece.position[:axes] == pytest.approx(first.placement(piece.id).position[:axes], abs=1e-3)
            assert math.remainder(piece.yaw - first.placement(piece.id).yaw, 2.0 * math.pi) == pytest.approx(
                0.0, abs=1e-6
            )
    code, _, err = call("generate", "sub_01", "--room", "lab.json", "--fixed", "lab.json", "--out", "next.json")
    assert (code, err) == (0, "")
    again = Layout.load(tmp_path / "next.json")
    assert {p.id: p.position for p in again.placements if p.fixed} == {
        p.id: p.position for p in first.placements if p.fixed
    }


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("asset,x\nSinkBench,1\n", "no column 'y'"),
        ("asset,x,y\nSinkBench,one,1\n", "row 2: x 'one' is not a number"),
        ("asset,x,y\nSinkBench,,1\n", "row 2: x is empty"),
        ("asset,x,y\nBeaker,1,1\n", "row 2: Beaker stands on furniture"),
        ("asset,x,y\nSinkBank,1,1\n", "row 2.*nearest: SinkBench"),
        ("asset,x,y\nSinkBench,500,1\n", "row 2: x 500 must be -100 to 100 m"),
        ("asset,x,y,yaw,yaw_deg\nSinkBench,5,1,1,180\n", "row 2: yaw 1 rad and yaw_deg 180 differ"),
        ("id,asset,x,y\na b,SinkBench,5,1\n", "row 2: id 'a b'"),
        ("id,asset,x,y\na,SinkBench,5,1\na,SinkBench,1,1\n", "row 3.*twice"),
        ("asset,x,y\n", "no fixed piece"),
    ],
)
def test_a_bad_table_of_fixed_pieces_is_one_line_that_names_the_row(tmp_path, content, words):
    (tmp_path / "fixed.csv").write_text(content)
    with pytest.raises(DocumentError, match=words) as caught:
        read_fixed(tmp_path / "fixed.csv")
    assert "\n" not in str(caught.value)


def test_the_plan_marks_a_cabinet_in_the_doorway(call, tmp_path):
    layout = island_laboratory()
    cabinet = put("GeneralCabinet_1", "GeneralCabinet", 1.2, 0.6)
    layout.replace(placements=(*layout.placements, cabinet)).save(tmp_path / "bad.json")
    layout.save(tmp_path / "good.json")
    for name in ("bad", "good"):
        assert call("view", f"{name}.json", "--out", f"{name}.svg")[0] == 0
    alarm = "#e0002d"
    assert (tmp_path / "bad.svg").read_text().count(alarm) > (tmp_path / "good.svg").read_text().count(alarm)
    scores = [call("score", f"{name}.json", "--json", "--rules", "paper") for name in ("bad", "good")]
    assert [code for code, _, _ in scores] == [0, 0]
    assert json.loads(scores[0][1])["v"] == json.loads(scores[1][1])["v"]


def test_compile_interactive_writes_joints_and_refuses_formats_without_them(call, tmp_path):
    code, _, _ = call("compile", NAME, "--out", "scene", "--interactive")
    text = (tmp_path / "scene" / "scene.xml").read_text()
    assert code == 0
    assert "frictionloss" in text
    assert "gravcomp" in text
    code, _, error = call("compile", NAME, "--out", "x.glb", "--format", "glb", "--interactive")
    assert (code, error.count("\n")) == (2, 1)
    assert "format glb has no moving parts" in error
    code, _, error = call("compile", NAME, "--out", "z", "--format", "usd", "--interactive", "--loose")
    assert code == 2
    assert "--loose is for mjcf" in error
    code, _, error = call("compile", NAME, "--out", "y", "--loose")
    assert code == 2
    assert "add --interactive" in error
