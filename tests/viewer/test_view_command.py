"""`labgym view --web` shows one layout after the other, or a suite."""

from __future__ import annotations

from pathlib import Path

import pytest
from laboratories import island_laboratory, small_laboratory

from labgym.cli import main
from labgym.layouts import published
from labgym.viewer import Show


@pytest.fixture
def shows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[tuple[list[str], int]]:
    """The labels of the episodes of each show, and the number of its first episode; nothing is served."""
    shows: list[tuple[list[str], int]] = []

    def note(show: Show, port: int, first: int, opened: object) -> None:
        shows.append(([episode.layout.id for episode in show.episodes], first))

    monkeypatch.setattr("labgym.viewer.run_viewer", note)
    monkeypatch.chdir(tmp_path)
    island_laboratory().save(tmp_path / "island.json")
    (tmp_path / "more").mkdir()
    for name in ("one", "two"):
        small_laboratory(name).save(tmp_path / "more" / f"{name}.json")
    return shows


def test_layouts_and_folders_follow_each_other_from_the_chosen_pair(shows) -> None:
    assert main(["view", "island.json", "more", "--web", "--policy", "straight", "--pair", "1"]) == 0
    ((labels, first),) = shows
    assert list(dict.fromkeys(labels)) == ["by-hand", "one", "two"]
    assert first == 1


def test_a_suite_is_shown_in_its_order(shows) -> None:
    assert main(["view", "--web", "--suite", "val", "--policy", "straight"]) == 0
    ((labels, first),) = shows
    assert list(dict.fromkeys(labels)) == list(published("val"))
    assert first == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--web"], "name a layout, or a suite with --suite"),
        (["island.json", "--web", "--pair", "99"], "99"),
        (["--web", "--suite", "nosuch"], "nosuch"),
        (["--web", "--suite", "val", "--protocol", "sub_01"], "--protocol"),
        ([], "0 layouts to draw"),
        (["island.json", "more/one.json"], "2 layouts to draw"),
        (["--suite", "val"], "--suite has no effect here: only --web"),
    ],
)
def test_what_cannot_be_shown_is_one_line(shows, capsys: pytest.CaptureFixture[str], arguments, message) -> None:
    assert main(["view", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert shows == []
