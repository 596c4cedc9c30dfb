from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from labgym.cli import main
from labgym.errors import LabgymError, OptionError
from labgym.eval.drawing.film import film, save_film
from labgym.layouts import load_published
from labgym.navigation import goal_pairs
from labgym.scenes import MissingRendererError
from labgym.suites import suite_of


def ramps(count: int) -> list[np.ndarray]:
    """Grey pictures, each brighter than the one before."""
    return [np.full((96, 128, 3), 40 + 20 * index, np.uint8) for index in range(count)]


def test_a_gif_holds_every_picture_in_order(tmp_path):
    path = save_film(ramps(5), tmp_path / "new" / "drive.gif", rate=5.0)
    with Image.open(path) as image:
        assert image.n_frames == 5
        assert image.info["duration"] == 200
        greys = []
        for index in range(5):
            image.seek(index)
            greys.append(int(np.asarray(image.convert("RGB")).mean()))
    assert greys == sorted(greys)


def test_an_mp4_holds_every_picture_at_its_size(tmp_path):
    path = save_film(ramps(6), tmp_path / "drive.mp4")
    video = cv2.VideoCapture(str(path))
    frames = [video.read() for _ in range(7)]
    assert [done for done, _ in frames] == [True] * 6 + [False]
    assert frames[0][1].shape == (96, 128, 3)
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(10.0)


def test_a_film_that_fails_leaves_no_file(tmp_path):
    def broken():
        yield from ramps(2)
        raise LabgymError("no more")

    for name in ("a.gif", "a.mp4"):
        with pytest.raises(LabgymError, match="no more"):
            save_film(broken(), tmp_path / name)
    with pytest.raises(LabgymError, match="at least one picture"):
        save_film([], tmp_path / "b.gif")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_and_a_missing_pair_are_refused_before_the_drive(tmp_path, capsys):
    with pytest.raises(OptionError, match=r"\.mp4, \.gif or \.webp"):
        save_film(ramps(1), tmp_path / "drive.avi")
    assert main(["record", "test-sub_01", "--out", str(tmp_path / "drive.avi")]) == 2
    assert main(["record", "test-sub_01", "--pair", "99", "--out", str(tmp_path / "drive.gif")]) == 2
    assert "99" in capsys.readouterr().err


def test_the_view_of_the_robot_is_in_the_corner():
    layout = load_published("test", "test-sub_01")
    pair = goal_pairs(layout)[0]
    try:
        (picture,) = film(layout, (pair.start,), 320, 240)
    except MissingRendererError:
        pytest.skip("no OpenGL here")
    assert picture.shape == (240, 320, 3)
    # The frame around the inset: a white line across its top.
    white = (picture == 255).all(axis=2)
    assert white[:, 200:].sum(axis=1).max() >= int(320 * 0.28)


def test_an_episode_of_a_folder_is_filmed_by_its_route(tmp_path, capsys):
    from labgym.eval.evaluator import evaluate

    layout = load_published("test", "test-sub_01")
    suite = suite_of([layout]).model_copy(update={"max_steps": 3})
    evaluate("straight", suite, layouts=[layout], out=tmp_path / "run", progress=False)
    out, words = tmp_path / "drive.gif", ["--width", "128", "--height", "96"]
    assert main(["record", str(tmp_path / "run"), "--episode", "test-sub_01/99", "--out", str(out)]) == 2
    assert main(["record", str(tmp_path / "run"), "--episode", "test-sub_01", "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert "episode 'test-sub_01/99' not found" in error
    assert "must be LAYOUT/PAIR" in error
    code = main(["record", str(tmp_path / "run"), "--episode", "test-sub_01/0", "--out", str(out), *words])
    if "OpenGL" in capsys.readouterr().err:
        pytest.skip("no OpenGL here")
    assert code == 0
    lines = (tmp_path / "run" / "routes.jsonl").read_text().splitlines()
    with Image.open(out) as image:
        assert 1 < image.n_frames <= len(json.loads(lines[0])["poses"]) == 4
