from __future__ import annotations

import signal
from pathlib import Path

import pytest

from labgym.assets.forge import Options, OwnAssets
from labgym.assets.forge.annotating import _entries, annotate_file
from labgym.errors import OptionError
from labgym.runs import ExecutorOptions, Shard
from labgym.runs.folder import only_writer
from labgym.temporary import PREFIX
from runs import examples, killing

NAMES = ("beaker one", "beaker two", "beaker three", "beaker four", "beaker five")


def write_box(path: Path, height: float) -> Path:
    """Write a box of 6 x 6 cm as an OBJ file in meters, Y up."""
    corners = [(x, y, z) for x in (0, 0.06) for y in (0, height) for z in (0, 0.06)]
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {' '.join(map(str, face))}" for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five boxes, one of them twice, and a file that is no mesh."""
    folder = tmp_path_factory.mktemp("meshes")
    for number, name in enumerate(NAMES):
        write_box(folder / f"{number} {name}.obj", 0.08 + 0.01 * number)
    write_box(folder / "5 again.obj", 0.08)
    (folder / "2 broken.obj").write_text("v 0 0\nf 1 2 9\n")
    return folder


@pytest.fixture(scope="module")
def catalog(meshes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "catalog"
    outcomes = [each.outcome for each in OwnAssets(folder).add_files(sorted(meshes.glob("*")))]
    assert outcomes == ["added", "added", "added", None, "added", "added", "unchanged"]
    return folder


@pytest.mark.slow  # test_shards.py has workers
def test_workers_do_not_change_the_catalog(meshes: Path, catalog: Path, tmp_path: Path) -> None:
    own = OwnAssets(tmp_path / "catalog")
    additions = list(own.add_files(sorted(meshes.glob("*")), executor=ExecutorOptions(workers=2)))
    assert [each.path.name[0] for each in additions] == list("0122345")
    assert "2 broken.obj" in additions[3].problem
    assert killing.tree(own.folder) == killing.tree(catalog)


@pytest.mark.slow
def test_a_batch_that_is_terminated_goes_on_where_it_was(meshes: Path, catalog: Path, tmp_path: Path) -> None:
    by = signal.SIGTERM
    folder = tmp_path / "catalog"
    words = ("assets", "add", str(meshes), "--catalog", str(folder), "--workers", "2")

    def second_entry() -> bool:
        return len(list((folder / "assets").glob("*.json"))) >= 2

    seen = killing.kill(words, folder, by, second_entry)
    assert seen.returncode in (128 + by, -by)
    assert not seen.survivors
    done = {path: path.stat().st_mtime_ns for path in (folder / "assets").glob("*.json")}
    killing.run(words, returncode=1)  # One file is no mesh.
    assert {path: path.stat().st_mtime_ns for path in done} == done
    assert killing.tree(folder) == killing.tree(catalog)
    assert not killing.temporary_files(folder)


def test_a_batch_that_is_stopped_goes_on_where_it_was(meshes: Path, catalog: Path, tmp_path: Path) -> None:
    own, files = OwnAssets(tmp_path / "catalog"), sorted(meshes.glob("*"))
    additions = own.add_files(files)
    assert [next(additions).outcome for _ in range(2)] == ["added"] * 2
    additions.close()
    done = {path: path.stat().st_mtime_ns for path in (own.folder / "assets").glob("*.json")}
    assert len(done) >= 2
    assert len(list(own.add_files(files))) == len(files)
    assert {path: path.stat().st_mtime_ns for path in done} == done
    assert killing.tree(own.folder) == killing.tree(catalog)


def test_two_batches_do_not_write_into_one_catalog(meshes: Path, tmp_path: Path) -> None:
    own = OwnAssets(tmp_path)
    with only_writer(tmp_path), pytest.raises(OptionError, match="in use"):
        list(own.add_files(sorted(meshes.glob("*"))))
    with only_writer(tmp_path), pytest.raises(OptionError, match="in use"):
        own.add(meshes / "0 beaker one.obj")


def test_temporary_files_of_a_killed_batch_are_removed(tmp_path: Path) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / f"{PREFIX}abc").write_text("half an ent")
    assert not list(OwnAssets(tmp_path).add_files([]))
    assert not killing.temporary_files(tmp_path)


def test_a_file_that_kills_its_worker_does_not_stop_the_others(meshes: Path, tmp_path: Path) -> None:
    good = (meshes / "0 beaker one.obj", Options(), None, None)
    shards = [Shard("0", examples.die, (str(tmp_path / "log"), 99)), Shard("1", annotate_file, good)]
    entries = dict(_entries(shards, ExecutorOptions(workers=2)))
    assert "killed 3 processes" in entries[0].problem
    assert entries[1].name
    assert not entries[1].problem
