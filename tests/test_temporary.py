from __future__ import annotations

import multiprocessing
import os
import signal
from pathlib import Path

import pytest

from labgym import temporary
from labgym.documents import write_bytes
from labgym.scenes.folders import whole_folder
from labgym.temporary import PREFIX, sweep, temporary_file, temporary_folder


def hold(folder: Path, ready, form: str) -> None:
    """Write a temporary file or folder and never finish it."""
    if form == "file":
        with temporary_file(folder) as (handle, _):
            os.write(handle, b"half")
            ready.set()
            signal.pause()
    with temporary_folder(folder) as path:
        (path / "half").write_bytes(b"half")
        ready.set()
        signal.pause()


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("form", ["file", "folder"])
def test_a_sweep_removes_what_a_killed_process_left_and_nothing_that_is_being_written(tmp_path, form):
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    writer = context.Process(target=hold, args=(tmp_path, ready, form))
    writer.start()
    assert ready.wait(60)
    (tmp_path / ".mine").write_text("mine")
    assert sweep(tmp_path) == 0
    assert [name[: len(PREFIX)] for name in names(tmp_path)] == [PREFIX, ".mine"]
    writer.kill()
    writer.join()
    assert sweep(tmp_path) == 1
    assert names(tmp_path) == [".mine"]


def test_the_first_write_into_a_folder_sweeps_it(tmp_path):
    (tmp_path / f"{PREFIX}abandoned").write_bytes(b"half")
    (tmp_path / f"{PREFIX}folder").mkdir()
    write_bytes(tmp_path / "a.txt", b"a")
    assert names(tmp_path) == ["a.txt"]
    (tmp_path / f"{PREFIX}folder").mkdir()
    with whole_folder(tmp_path / "scene", (), "scene") as scene:
        (scene / "scene.xml").write_text("x")
    assert sweep(tmp_path) == 1
    assert names(tmp_path) == ["a.txt", "scene"]


def test_a_file_that_another_process_sweeps_between_creation_and_lock_is_made_again(tmp_path, monkeypatch):
    flock, swept = temporary.fcntl.flock, []

    def late(handle, operation):
        if not swept:
            swept.extend(tmp_path.glob(f"{PREFIX}*"))
            swept[0].unlink()
        return flock(handle, operation)

    monkeypatch.setattr(temporary.fcntl, "flock", late)
    assert write_bytes(tmp_path / "a.txt", b"a").read_bytes() == b"a"
    assert len(swept) == 1


def test_a_written_file_is_readable_by_everybody_and_nothing_else_is_left(tmp_path):
    path = write_bytes(tmp_path / "new" / "a.bin", iter([b"ab", b"", b"c" * 1_000_000]))
    assert path.read_bytes() == b"ab" + b"c" * 1_000_000
    assert path.stat().st_mode & 0o777 == 0o644
    assert names(path.parent) == ["a.bin"]


def test_an_error_leaves_the_old_content(tmp_path):
    write_bytes(tmp_path / "a.txt", b"old")

    def pieces():
        yield b"new"
        raise RuntimeError

    with pytest.raises(RuntimeError):
        write_bytes(tmp_path / "a.txt", pieces())
    assert (tmp_path / "a.txt").read_bytes() == b"old"
    assert names(tmp_path) == ["a.txt"]
