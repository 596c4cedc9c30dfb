"""`labgym play` writes what a person drove."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from labgym.cli import main
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.layouts import Layout
from labgym.suites import Suite
from labgym.viewer import Command, Show

STEPS = 8


@pytest.fixture
def played(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, layout: Layout, suite: Suite
) -> Callable[..., tuple[int, Path]]:
    """Drives the first episode of a layout backwards for some steps, then presses Ctrl-C."""

    def drive(show: Show, port: int, first: int, opened: object) -> None:
        def left(seconds: float | None = None) -> None:
            raise KeyboardInterrupt

        console = show.console
        console.enter()
        console.speed = 1000.0
        console.wait_for_scene = lambda number: None  # type: ignore[method-assign]
        console.wait_for_key = lambda: console.command(Command(forward=-1.0))  # type: ignore[method-assign]
        console.wait_for_episode = left  # type: ignore[method-assign]
        show.run(first)

    monkeypatch.setattr("labgym.viewer.run_viewer", drive)
    monkeypatch.chdir(tmp_path)
    layout.save(tmp_path / "lab.json")
    suite.model_copy(update={"max_steps": STEPS}).save(tmp_path / "rules.json")
    return lambda *arguments: (main(["play", "lab.json", "--suite", "rules.json", *arguments]), tmp_path)


def test_the_folder_is_read_as_an_evaluation_and_reported(
    played: Callable[..., tuple[int, Path]], capsys: pytest.CaptureFixture[str]
) -> None:
    code, folder = played("--out", "me", "--name", "ada")
    assert code == 0
    evaluation = TransitionEvaluation.read(folder / "me")
    assert [(row.policy, row.steps) for row in evaluation.rows] == [("ada", STEPS)]
    assert evaluation.summary.privileged
    assert len(next(iter(evaluation.routes.values()))) == STEPS + 1
    assert "time limit of 0.8 s reached" in capsys.readouterr().out


def test_the_film_shows_the_last_finished_episode(played: Callable[..., tuple[int, Path]]) -> None:
    pytest.importorskip("OpenGL")
    code, folder = played("--film", "drive.mp4")
    assert code == 0
    film = cv2.VideoCapture(str(folder / "drive.mp4"))
    pictures = []
    while (read := film.read())[0]:
        pictures.append(read[1])
    assert len(pictures) == STEPS + 1
    assert {picture.shape for picture in pictures} == {(480, 640, 3)}
    assert (pictures[0] != pictures[-1]).any()


def test_a_film_of_another_kind_is_refused_before_the_drive(
    played: Callable[..., tuple[int, Path]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert played("--film", "drive.avi")[0] == 2
    assert "must end in .mp4, .gif or .webp" in capsys.readouterr().err
