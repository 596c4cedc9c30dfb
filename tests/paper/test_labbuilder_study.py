"""The study of LabBuilder's scenes: read, scored, repaired, driven in, written again; a broken file is one row."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import pytest

from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.layouts import Layout
from labgym.paper.labbuilder.reading import read_labbuilder
from labgym.paper.labbuilder.routes import GoalPose, read_goals, route_protocol, usual_places, visited
from labgym.paper.labbuilder.study import LabBuilderStudy
from labgym.paper.reproduction.figures import PublishedFigures

SIZES = {
    "ExperimentalPlatform": {"short": 1.5, "long": 2.7, "height": 0.8},
    "ReagentCabinet": {"short": 0.44, "long": 1.8, "height": 2.36},
    "FumeHood": {"short": 0.9, "long": 3.0, "height": 2.37},
}
FRONTS = {"FumeHood": (5.5, 6.75 - 2.1), "ReagentCabinet": (1.5, 6.98 - 1.5), "ExperimentalPlatform": (4.0, 4.0 - 1.95)}
"""Goal poses as the authors take them: half the long side and 0.6 m along the front; all fronts look along -y here."""


def thing(name, x, y, z=0.0, turn=0.0, on="floor"):
    return {
        "id": name,
        "position": {"x": x, "y": y, "z": z},
        "rotation": {"x": 0, "y": 0, "z": turn},
        "initial_location": on,
    }


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    objects = [
        thing("FumeHood", 5.5, 6.75, turn=180),
        thing("ReagentCabinet", 1.5, 6.98, turn=180),
        thing("ExperimentalPlatform", 4.0, 4.0, turn=180),
        thing("Chair", 5.5, 5.7),
        thing("Ethanol", 1.2, 6.98, 0.8, on="reagent_cabinet"),
        thing("Beaker", 4.5, 4.1, 0.8, on="experimental_platform"),
        thing("Pipette", 4.5, 4.12, 0.8, on="experimental_platform"),
    ]
    scene = {"query": "An ester", "room_size": {"w": 8.4, "d": 7.4, "h": 3.2}, "objects": objects}
    (folder / "ester.json").write_text(json.dumps(scene))
    (folder / "broken.json").write_text(json.dumps({**scene, "objects": [thing("FumeHood", 5.5, 6.75, turn="x")]}))
    (folder / "torn.json").write_text("{")
    (folder / "asset_bboxes.json").write_text(json.dumps(SIZES))
    stops = [[*FRONTS[name], 0.0] for name in ("ReagentCabinet", "FumeHood", "ExperimentalPlatform")]
    pairs = [{"start": a, "end": b} for a, b in pairwise(stops)]
    (folder / "goal_pairs.json").write_text(json.dumps({"ester": {"pairs": pairs}}))
    return folder


@pytest.fixture(scope="module")
def results(scenes, tmp_path_factory):
    """One scene through all stages, with drives by astar: 2 s."""
    out = tmp_path_factory.mktemp("reproduce") / "labbuilder"
    assert main(["reproduce", "labbuilder", "--scenes", str(scenes), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def row(results):
    rows = {row["scene"]: row for row in map(json.loads, (results / "rows.jsonl").read_text().splitlines())}
    assert "rotation" in rows["broken"]["error"]
    assert "JSON" in rows["torn"]["error"]
    return rows["ester"]


def test_the_route_is_that_of_the_goal_pairs(row):
    assert row["route"] == ["TallReagentCabinet", "FumeHood", "MainWorkbench"]
    assert row["transitions"] == 2


def test_a_scene_is_scored_as_it_is_and_repaired(row, results):
    assert (row["before"]["ob"], row["before"]["cn"]) == (0, 1)
    assert row["feasible_before"] == 0
    assert (row["after"]["v"], row["feasible_after"]) == (0, 2)
    assert (row["driven"], row["reached"], row["touching"]) == (2, 2, 0)
    layout = Layout.load(results / "layouts/ester-before.json")
    assert len(layout.placements) == row["objects"] == 7


def test_the_repaired_scene_is_written_in_labbuilder_s_form(results, row):
    again = read_labbuilder(results / "labbuilder/ester/scene.json").layout
    repaired = Layout.load(results / "layouts/ester-after.json")
    for one, other in zip(again.placements, repaired.placements, strict=True):
        assert one.id == other.id
        assert math.dist(one.position, other.position) < 1e-8
    pairs = json.loads((results / "labbuilder/ester/goal_pairs.json").read_text())["ester"]["pairs"]
    assert [(pair["from"], pair["to"]) for pair in pairs] == list(pairwise(row["route"]))


def test_the_page_names_the_file_that_failed(results):
    figures = PublishedFigures.load(results / "figures.json")
    assert any("broken failed" in line for line in figures.summary)
    assert "ester, after the repair" in (results / "index.html").read_text()


def test_without_goal_pairs_the_places_of_work_are_visited(scenes):
    layout = read_labbuilder(scenes / "ester.json").layout
    assert read_goals(scenes / "goal_pairs.json", "other") == ()
    assert read_goals(scenes / "absent.json", "ester") == ()
    assert usual_places(layout) == ("TallReagentCabinet", "FumeHood", "MainWorkbench")
    assert visited(layout, [GoalPose(x=0.1, y=0.1)]) == ()
    bare = layout.replace(placements=tuple(p for p in layout.placements if p.asset != "Ethanol"))
    assert route_protocol(bare, ("FumeHood",)) is None


def test_bad_goal_pairs_and_folders_without_scenes_are_refused(scenes, tmp_path):
    (tmp_path / "goal_pairs.json").write_text(
        json.dumps({"ester": {"pairs": [{"start": ["x", 0, 0], "end": [0, 0, 0]}]}})
    )
    with pytest.raises(DocumentError, match=r"goal_pairs\.json"):
        read_goals(tmp_path / "goal_pairs.json", "ester")
    with pytest.raises(OptionError, match="no scene of LabBuilder"):
        LabBuilderStudy(tmp_path).scenes()
