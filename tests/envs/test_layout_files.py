"""Training layouts as files: those of the source, whatever happens to a file, within the size of the folder."""

from __future__ import annotations

from pathlib import Path

import pytest
import training_sources

from labgym.envs import training
from labgym.envs.layout_files import LayoutFiles
from labgym.envs.training import TrainingRooms, training_floor
from labgym.errors import OptionError
from labgym.layouts import Layout


def files_in(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.fixture
def quick(monkeypatch) -> list[int]:
    """Rooms that are made at once; the numbers of those that were made."""
    made: list[int] = []

    def room(self: TrainingRooms, number: int) -> Layout:
        made.append(number)
        return training_sources.shifted(number)

    monkeypatch.setattr(TrainingRooms, "__call__", room)
    return made


@pytest.mark.parametrize("source", [TrainingRooms(), training_floor], ids=["rooms", "floors"])
def test_a_stored_layout_equals_the_generated_one(source, tmp_path):
    files = LayoutFiles(tmp_path)
    generated = files.layout(source, 3)
    stored = files.layout(source, 3)
    assert stored is not generated
    assert stored == generated
    assert stored.hash == generated.hash
    assert stored.to_json() == generated.to_json()
    assert len(files_in(tmp_path)) == 1


def test_each_layout_is_made_once_and_each_kind_has_a_file(quick, tmp_path):
    files = LayoutFiles(tmp_path)
    for source in (TrainingRooms(), TrainingRooms(profile="strict")):
        for number in (1, 2, 1):
            assert files.layout(source, number).id == f"shifted-{number}"
    assert quick == [1, 2, 1, 2]
    assert len(files_in(tmp_path)) == 4


@pytest.mark.parametrize(
    "change", [lambda raw: b"", lambda raw: raw[:-40], lambda raw: raw.replace(b"shifted", b"changed")]
)
def test_a_broken_file_is_made_again(quick, tmp_path, change):
    files = LayoutFiles(tmp_path)
    expected = files.layout(TrainingRooms(), 5)
    (path,) = files_in(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(change(whole))
    assert files.layout(TrainingRooms(), 5) == expected
    assert quick == [5, 5]
    assert path.read_bytes() == whole


def test_the_folder_stays_within_its_size_and_loses_what_was_used_longest_ago(quick, tmp_path):
    LayoutFiles(tmp_path).layout(TrainingRooms(), 0)
    size = files_in(tmp_path)[0].stat().st_size
    files = LayoutFiles(tmp_path, 5.5 * size / 1e6)
    for number in range(12):
        files.layout(TrainingRooms(), number)
        assert sum(path.stat().st_size for path in files_in(tmp_path)) <= 5.5 * size
    before = len(quick)
    files.layout(TrainingRooms(), 11)
    assert len(quick) == before
    files.layout(TrainingRooms(), 0)
    assert len(quick) == before + 1


def test_sources_of_others_are_not_stored(tmp_path):
    assert LayoutFiles(tmp_path).layout(training_sources.shifted, 4).id == "shifted-4"
    assert files_in(tmp_path) == []


def test_other_code_has_other_files(quick, tmp_path, monkeypatch):
    monkeypatch.setattr("labgym.runs.code_digest", lambda: "another")
    LayoutFiles(tmp_path).layout(TrainingRooms(), 1)
    monkeypatch.undo()
    monkeypatch.setattr(training.TrainingRooms, "__call__", lambda self, number: training_sources.shifted(number))
    LayoutFiles(tmp_path).layout(TrainingRooms(), 1)
    assert len(files_in(tmp_path)) == 2


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(quick, tmp_path):
    (tmp_path / "file").write_text("")
    assert LayoutFiles(tmp_path / "file").layout(TrainingRooms(), 1).id == "shifted-1"


@pytest.mark.parametrize("size", [0.0, -1, "256", True])
def test_a_size_that_is_not_above_zero_is_refused(size, tmp_path):
    with pytest.raises(OptionError, match="folder_mb"):
        LayoutFiles(tmp_path, size)
