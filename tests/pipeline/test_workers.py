from __future__ import annotations

import json
import os
import time
from pathlib import Path

import pytest

from labgym.errors import LabgymError, OptionError
from labgym.pipeline.ledger import Ledger
from labgym.pipeline.workers import Work, work_through


def note(folder: Path, name: str, text: str) -> None:
    (folder / f"{name}.txt").write_text(text)
    with (folder / "calls.log").open("a") as log:
        log.write(name + "\n")


def refuse(message: str) -> None:
    raise OptionError(message)


def units(folder: Path, texts: dict[str, str]) -> list[Work]:
    return [Work(name, text, note, (folder, name, text), (folder / f"{name}.txt",)) for name, text in texts.items()]


def calls(folder: Path) -> list[str]:
    log = folder / "calls.log"
    lines = sorted(log.read_text().split()) if log.exists() else []
    log.unlink(missing_ok=True)
    return lines


@pytest.mark.parametrize("processes", [1, 2])
def test_a_second_time_nothing_is_done(tmp_path, processes):
    todo = units(tmp_path, {"a": "1", "b": "2"})
    assert work_through("test", todo, Ledger(tmp_path), processes) == 2
    assert calls(tmp_path) == ["a", "b"]
    assert work_through("test", todo, Ledger(tmp_path), processes) == 0
    assert calls(tmp_path) == []


def test_only_what_changed_is_done_again(tmp_path):
    work_through("test", units(tmp_path, {"a": "1", "b": "2", "c": "3"}), Ledger(tmp_path), 1)
    calls(tmp_path)
    (tmp_path / "c.txt").write_text("touched")
    work_through("test", units(tmp_path, {"a": "1", "b": "other", "c": "3"}), Ledger(tmp_path), 1)
    assert calls(tmp_path) == ["b", "c"]
    assert (tmp_path / "b.txt").read_text() == "other"
    assert (tmp_path / "c.txt").read_text() == "3"


@pytest.mark.parametrize("broken", ["", "{", "[]", '{"schema": "labgym.ledger/1", "units": {"a": 1}}'])
def test_a_broken_ledger_counts_as_empty(tmp_path, broken):
    (tmp_path / "ledger.json").write_text(broken)
    assert work_through("test", units(tmp_path, {"a": "1"}), Ledger(tmp_path), 1) == 1
    assert json.loads((tmp_path / "ledger.json").read_text())["units"].keys() == {"a"}


@pytest.mark.parametrize("processes", [1, 2])
def test_an_error_in_a_unit_reaches_the_caller_and_what_was_done_stays_done(tmp_path, processes):
    good = units(tmp_path, {"a": "1"})
    bad = Work("bad", "", refuse, ("no such room",), ())
    work_through("test", good, Ledger(tmp_path), processes)
    with pytest.raises(OptionError, match="no such room"):
        work_through("test", [*good, bad, Work("late", "", time.sleep, (0.0,), ())], Ledger(tmp_path), processes)
    assert Ledger(tmp_path).done("bad", "") is False
    calls(tmp_path)
    assert work_through("test", good, Ledger(tmp_path), processes) == 0


def test_a_worker_that_dies_is_one_error_and_finished_work_is_kept(tmp_path):
    good = units(tmp_path, {"a": "1"})
    work_through("test", good, Ledger(tmp_path), 1)
    dying = [Work(name, "", os._exit, (3,), ()) for name in ("x", "y")]
    with pytest.raises(LabgymError, match=r"worker process died at the stage 'test'.*run again to resume"):
        work_through("test", [*good, *dying], Ledger(tmp_path), 2)
    assert work_through("test", good, Ledger(tmp_path), 1) == 0
