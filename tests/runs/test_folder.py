from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest

from labgym.errors import DocumentError, OptionError
from labgym.runs import RunFolder, RunIdentity
from runs import examples


def test_a_folder_of_another_run_is_refused_by_what_differs_and_nothing_in_it_changes(tmp_path):
    examples.run(tmp_path / "run", 3, 1)
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    other = RunIdentity(kind="eval", inputs={"seed": 1, "layouts": "x" * 64}, code="")
    with pytest.raises(OptionError) as error, RunFolder.open(tmp_path / "run", other):
        pass
    message = str(error.value)
    assert 'differs in kind ("test" there, "eval" requested), code (another version' in message
    assert "seed (0 there, 1 requested), layouts;" in message
    assert message.endswith("move the old one aside and start anew with --fresh")
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_fresh_moves_each_old_folder_aside(tmp_path):
    for seed in range(3):
        with RunFolder.open(tmp_path / "run", examples.identity(seed=seed), fresh=True) as folder:
            folder.put("a", None, {"a.txt": str(seed).encode()})
    texts = {path.parent.name: path.read_text() for path in tmp_path.rglob("a.txt")}
    assert texts == {"run.old-1": "0", "run.old-2": "1", "run": "2"}


def test_fresh_does_not_move_the_working_folder(tmp_path, monkeypatch):
    (tmp_path / "mine.txt").write_text("mine")
    monkeypatch.chdir(tmp_path)
    with (
        pytest.raises(OptionError, match="contains the working folder"),
        RunFolder.open(tmp_path, examples.identity(), fresh=True),
    ):
        pass


def test_a_second_writer_is_refused_by_the_name_of_the_first(tmp_path):
    with RunFolder.open(tmp_path / "run", examples.identity()):
        for fresh in (False, True):
            with (
                pytest.raises(OptionError, match=r"in use: process \d+ on .* writes into it"),
                RunFolder.open(tmp_path / "run", examples.identity(), fresh),
            ):
                pass
    with RunFolder.open(tmp_path / "run", examples.identity()):
        pass


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("mine")
    with (
        pytest.raises(OptionError, match=r"holds thesis.tex, which is not a run"),
        RunFolder.open(tmp_path, examples.identity()),
    ):
        pass
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OptionError, match="is not a folder"), RunFolder.open(tmp_path / "file", examples.identity()):
        pass


def test_a_broken_identity_is_one_error(tmp_path):
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(DocumentError, match=r"run\.json"), RunFolder.open(tmp_path, examples.identity()):
        pass


def test_an_identity_compares_equal_to_the_one_read_from_its_file(tmp_path):
    identity = examples.identity(layouts=("a", "b"), room={"size": (3.0, 4)})
    path = identity.save(tmp_path / "run.json")
    assert RunIdentity.load(path) == identity
    assert RunIdentity.load(path).differences(identity) == ()
    assert identity.differences(examples.identity(layouts=("a",), new=None)) == ("layouts", "room", "new")


def test_an_input_that_is_not_json_is_refused():
    with pytest.raises(DocumentError, match=re.escape("not JSON data")):
        examples.identity(policy=object())


def test_a_path_in_the_manifest_that_leaves_the_folder_is_refused(tmp_path):
    examples.run(tmp_path / "run", 3, 1)
    manifest = tmp_path / "run" / "manifest.json"
    data = json.loads(manifest.read_text())
    data["files"]["../../secret"] = "0" * 64
    manifest.write_text(json.dumps(data))
    with pytest.raises(DocumentError, match="secret"):
        examples.run(tmp_path / "run", 3, 1)


@pytest.mark.parametrize("name", ["", "..", "/dev/zero", "a\0b", "x" * 300, "ledger.jsonl"])
def test_a_file_name_of_a_damaged_ledger_is_not_read_and_its_shard_runs_again(tmp_path, name):
    with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
        folder.put("a", None, {"shards/a": b"1"})
    ledger = tmp_path / "run" / "ledger.jsonl"
    entry = json.loads(ledger.read_text())
    ledger.write_text(json.dumps(entry | {"files": {name: entry["files"]["shards/a"]}}) + "\n")
    with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
        assert folder.output("a") is None


@pytest.mark.parametrize("in_pairs", [False, True])
def test_merged_files_are_on_the_disk_before_the_files_of_shards_are_removed(tmp_path, monkeypatch, in_pairs):
    flushed: dict[str, bool] = {}
    fsync = os.fsync

    def note(handle: int) -> None:
        name = Path(f"/proc/self/fd/{handle}").readlink().name
        flushed[name] = (tmp_path / "run" / "shards" / "a").exists()
        fsync(handle)

    with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
        folder.put("a", None, {"shards/a": b"1"})
        monkeypatch.setattr(os, "fsync", note)
        folder.finish(iter([("rows.txt", b"1")]) if in_pairs else {"rows.txt": b"1"})
    assert (flushed["rows.txt"], flushed["manifest.json"], flushed["run"]) == (True, True, True)
    assert not (tmp_path / "run" / "shards").exists()
