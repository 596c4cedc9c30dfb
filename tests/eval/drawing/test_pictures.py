from __future__ import annotations

import io
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.pictures import picture_bytes, save_picture, topdown
from labgym.eval.drawing.plan_drawing import Trace
from labgym.eval.drawing.plan_labels import readable_name
from labgym.layouts import Door, Layout, Placement, Room

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
    """The colour at a point of the room, from the picture's own scale: walls reach to the plan's edges."""
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
    seen = {
        subprocess.run(command, env={"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True).stdout
        for seed in ("1", "2")
    }
    assert len(seen) == 1


def test_objects_stand_where_the_layout_says():
    png = picture_bytes(topdown(layout()))
    floor, bench = palette.FLOOR, palette.BENCH.fill
    for (x, y), colour in {(0.55, 3.55): floor, (3.55, 1.9): bench, (3.4, 0.55): floor, (2.4, 1.9): bench}.items():
        expected = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        assert pixel(png, x, y) == pytest.approx(expected, abs=0.01)


def test_a_route_is_drawn_in_its_policy_s_colour():
    trace = Trace("astar", np.array([[0.5, 0.55], [5.5, 0.55]]))
    colour = palette.policy_colours(["astar"])["astar"]
    expected = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    assert pixel(picture_bytes(topdown(layout(), traces=[trace])), 4.3, 0.55) == pytest.approx(expected, abs=0.05)


def test_pictures_are_written_as_png_or_svg_and_nothing_else(tmp_path):
    figure = topdown(layout())
    assert save_picture(figure, tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in save_picture(figure, tmp_path / "a.svg").read_bytes()[:1000]
    with pytest.raises(OptionError, match=r"a\.gif"):
        save_picture(figure, tmp_path / "a.gif")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "a.svg"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("FumeHood1800", "Fume hood 1800"),
        ("PreparationBench", "Preparation bench"),
        ("GCMS", "GCMS"),
        ("NMRTube", "NMR tube"),
    ],
)
def test_camel_case_names_are_read_as_words(name, said):
    assert readable_name(name) == said
