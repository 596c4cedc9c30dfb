from __future__ import annotations

import hashlib
import io
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib.image import imread

from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.pictures import picture_bytes, save_picture, topdown
from labgym.eval.drawing.plan_drawing import DrivenPath
from labgym.eval.drawing.plan_labels import furniture_labels, readable_name
from labgym.layouts import Door, Layout, Placement, Room, load_published
from labgym.layouts.rules import evaluate_layout
from labgym.protocols import protocols

ROOM = Room(name="picture", width=6.0, depth=4.0, doors=(Door(wall="front", offset=1.0),))


def layout() -> Layout:
    return Layout(
        id="picture",
        floor=ROOM.floor,
        placements=(
            Placement(id="bench", asset="PreparationBench", position=(3.0, 2.0, 0.0), yaw=0.3),
            Placement(id="hood", asset="FumeHood", position=(4.5, 3.5, 0.0), yaw=math.pi),
        ),
    )


def pixel(png: bytes, x: float, y: float) -> np.ndarray:
    """The color at a point of the room, from the picture's own scale: walls reach to the plan's edges."""
    image = imread(io.BytesIO(png), format="png")[:, :, :3]
    wall = np.all(np.isclose(image, [int(palette.WALL[i : i + 2], 16) / 255 for i in (1, 3, 5)], atol=0.01), axis=2)
    rows, columns = np.flatnonzero(wall.any(axis=1)), np.flatnonzero(wall.any(axis=0))
    thickness = ROOM.wall_thickness
    scale = (columns[-1] - columns[0]) / (ROOM.width + 2 * thickness)
    return image[int(rows[-1] - (y + thickness) * scale), int(columns[0] + (x + thickness) * scale)]


def test_the_same_layout_gives_the_same_bytes_in_any_process():
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import test_pictures as t, hashlib\n"
        "for kind in ('png', 'svg', 'pdf'):\n"
        "    print(hashlib.sha256(t.picture_bytes(t.topdown(t.layout()), kind)).hexdigest())"
    )
    command = [sys.executable, "-c", code, str(Path(__file__).parent)]
    there = subprocess.run(command, env={"PYTHONHASHSEED": "1"}, capture_output=True, text=True, check=True).stdout
    pictures = [picture_bytes(topdown(layout()), kind) for kind in ("png", "svg", "pdf")]
    assert there.split() == [hashlib.sha256(picture).hexdigest() for picture in pictures]


def test_objects_stand_where_the_layout_says():
    png = picture_bytes(topdown(layout()))
    floor, bench = palette.FLOOR, palette.BENCH.fill
    for (x, y), color in {(0.55, 3.55): floor, (3.55, 1.9): bench, (3.4, 0.55): floor, (2.4, 1.9): bench}.items():
        expected = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        assert pixel(png, x, y) == pytest.approx(expected, abs=0.01)


def test_a_plan_names_all_protocols_of_its_laboratory():
    first, second = protocols()["sub_01"], protocols()["cyc_03"]
    both = layout().replace(protocols=(first, second))
    for shown, title in ((first, first.name), (None, "picture")):
        texts = " ".join(text.get_text() for axes in topdown(both, shown).axes for text in axes.texts)
        assert title in texts
        assert f"and {second.name}" in texts
        assert (f"and {first.name}" in texts) == (shown is None)


def test_locations_that_the_layout_lacks_are_left_out_of_the_route():
    picture = topdown(layout(), protocols()["sub_01"])
    texts = [text.get_text() for axes in picture.axes for text in axes.texts]
    assert "Preparation bench" in texts
    assert "Fume hood" in texts
    assert not any("Validation" in text for text in texts)


def test_a_route_is_drawn_in_the_color_of_its_policy():
    trace = DrivenPath("astar", np.array([[0.5, 0.55], [5.5, 0.55]]))
    color = palette.policy_colors(["astar"])["astar"]
    expected = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    assert pixel(picture_bytes(topdown(layout(), traces=[trace])), 4.3, 0.55) == pytest.approx(expected, abs=0.05)


def test_pictures_are_written_by_suffix_and_other_suffixes_are_refused(tmp_path):
    figure = topdown(layout())
    assert save_picture(figure, tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in save_picture(figure, tmp_path / "a.svg").read_bytes()[:1000]
    with pytest.raises(OptionError, match=r"a\.gif"):
        save_picture(figure, tmp_path / "a.gif")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "a.svg"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("FumeHood1800", "Fume hood 1800"),
        ("PreparationBench", "Preparation bench"),
        ("GCMS", "GCMS"),
        ("NMRTube", "NMR tube"),
    ],
)
def test_camel_case_names_are_read_as_words(name, text):
    assert readable_name(name) == text


@pytest.mark.parametrize(("split", "name"), [("test", "test-sub_01"), ("test", "test-fgt_02"), ("val", "val-red_03")])
def test_names_cover_nothing_and_nearly_all_furniture_has_one(split, name):
    """Overlaps are computed by shapely from the layout's boxes."""
    laboratory = load_published(split, name)
    scale = 50.0
    labels = furniture_labels(laboratory, scale)
    outlines = {p.id: shapely.Polygon(laboratory.box(p.id).corners()) for p in laboratory.placements}
    furniture = {p.id for p in laboratory.placements if p.support == "floor"}
    hidden = {
        p.id
        for p in laboratory.placements
        if p.support in laboratory.by_id
        and laboratory.asset(p.support).storage_class
        and laboratory.asset(p.id).kind != "reagent"
    }
    spaces = {placement_id: shapely.box(*label.rectangle(scale)) for placement_id, label in labels.items()}
    assert len(labels) >= 0.9 * len(furniture)
    for placement_id, space in spaces.items():
        if outlines[placement_id].contains(space):
            on_it = {p.id for p in laboratory.placements if laboratory.root(p.id).id == placement_id}
            covered = on_it - hidden - {placement_id}
        else:
            covered = furniture
            others = [other for key, other in spaces.items() if key != placement_id]
            assert not any(space.intersection(other).area > 1e-6 for other in others)
        assert [other for other in covered if space.intersection(outlines[other]).area > 1e-6] == []


def test_a_placement_that_violates_a_rule_is_outlined_in_red_and_listed():
    bench, hood = layout().placements
    moved = hood.model_copy(update={"position": (3.2, 2.6, 0.0)})
    colliding = layout().replace(placements=(bench, moved))
    violations = evaluate_layout(colliding, rules="paper").violations.items
    assert [violation.kind for violation in violations] == ["collision"]
    red = [int(palette.ALARM[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    # The right edge of the hood, which is 1.5 m wide.
    edge = (3.2 + 0.75, 2.6)
    assert pixel(picture_bytes(topdown(colliding, violations=violations)), *edge) == pytest.approx(red, abs=0.05)
    assert pixel(picture_bytes(topdown(colliding)), *edge) != pytest.approx(red, abs=0.05)
    text = picture_text(topdown(colliding, violations=violations))
    assert "Violations: 1" in text
    assert violations[0].ids[0] in text


def picture_text(figure) -> str:
    return " ".join(text.get_text() for axes in figure.axes for text in axes.texts)


def test_a_long_list_of_violations_ends_with_their_number_and_the_panel_stays_in_the_picture():
    (bench, _) = layout().placements
    stack = tuple(bench.model_copy(update={"id": f"bench_{k}"}) for k in range(5))
    crowded = layout().replace(placements=stack)
    violations = evaluate_layout(crowded, rules="paper").violations.items
    assert len(violations) == 10
    figure = topdown(crowded, violations=violations)
    assert "and 4 more" in picture_text(figure)
    panel = figure.axes[1]
    assert all(panel.get_ylim()[1] <= text.get_position()[1] <= panel.get_ylim()[0] for text in panel.texts)
