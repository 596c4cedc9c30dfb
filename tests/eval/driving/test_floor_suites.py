"""Suites that embed their drives: validation, evaluation, and the folder that `labgym floors` writes."""

from __future__ import annotations

import math

import pytest
from laboratories import small_laboratory
from pydantic import ValidationError

from labgym.cli import main
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.driving import floor_suites
from labgym.eval.driving.floor_suites import floor_suite
from labgym.eval.evaluator import evaluate
from labgym.layouts import Layout
from labgym.layouts.floors import SPLITS
from labgym.navigation import ShortestPaths
from labgym.suites import Suite, SuiteDrive

START, GOAL = (1.0, 1.0, 0.0), (5.5, 1.5, 1.0)


def suite(**drives: tuple[SuiteDrive, ...]) -> Suite:
    return Suite(name="own", layouts=tuple(drives), drives=drives, max_steps=40)


def test_the_drives_of_a_suite_take_the_place_of_goal_pairs(tmp_path):
    laboratory = small_laboratory("one")
    one = SuiteDrive(start=START, goal=GOAL)
    report = evaluate(
        "straight", suite(one=(one, one)), layouts=[laboratory], out=tmp_path, progress=False, isolated=False
    )
    assert [(row.pair, row.start, row.goal) for row in report.rows] == [(0, START, GOAL), (1, START, GOAL)]
    length = ShortestPaths(laboratory).path(START, GOAL)
    assert length is not None
    assert report.rows[0].shortest_path_length == pytest.approx(length.length, abs=1e-6)
    assert math.dist(report.routes["one/1/0"][0], START) == pytest.approx(0.0, abs=1e-3)
    assert Suite.model_validate(report.summary.suite.model_dump(mode="json")) == suite(one=(one, one))


def test_a_suite_is_driven_in_its_own_layouts_alone():
    one = SuiteDrive(start=START, goal=GOAL)
    for layouts in ([small_laboratory("other")], [small_laboratory("one"), small_laboratory("other")]):
        with pytest.raises(OptionError, match="not those of suite 'own'"):
            evaluate("straight", suite(one=(one,)), layouts=layouts, progress=False)
    with pytest.raises(OptionError, match="leave out layouts"):
        evaluate("straight", "test", layouts=[small_laboratory("one")], progress=False)
    with pytest.raises(OptionError, match="pass its layouts"):
        evaluate("straight", suite(one=(one,)), progress=False)


def test_drives_name_the_suite_s_layouts_and_are_finite():
    one = SuiteDrive(start=START, goal=GOAL)
    with pytest.raises(ValidationError, match="exactly the suite's layouts"):
        Suite(name="own", layouts=("a", "b"), drives={"a": (one,)})
    with pytest.raises(ValidationError, match="exactly the suite's layouts"):
        Suite(name="own", drives={"a": (one,)})
    with pytest.raises(ValidationError):
        SuiteDrive(start=(math.nan, 0.0, 0.0), goal=GOAL)


def test_floors_are_written_with_drives_that_can_be_driven(tmp_path, monkeypatch, capsys):
    """Two bays, the second after an interruption, and by the command line: 2 s."""
    monkeypatch.setitem(SPLITS, "floors-train", SPLITS["floors-train"][:1])
    make_floor = floor_suites.make_floor

    def stopping(split: str, index: int, *rest):
        if index == 4:
            raise KeyboardInterrupt
        return make_floor(split, index, *rest)

    monkeypatch.setattr(floor_suites, "make_floor", stopping)
    with pytest.raises(KeyboardInterrupt):
        floor_suite("floors-train", 2, tmp_path, 3, 5, 0, progress=False)
    monkeypatch.setattr(floor_suites, "make_floor", make_floor)
    assert not (tmp_path / "suite.json").exists()
    command = [
        "floors",
        "--split",
        "floors-train",
        "--count",
        "2",
        "--first",
        "3",
        "--episodes",
        "5",
        "--development",
        "0",
    ]
    assert main([*command, "--out", str(tmp_path)]) == 0
    written = Suite.load(tmp_path / "suite.json")
    assert f"2 floors, {sum(map(len, written.drives.values()))} drives" in capsys.readouterr().out
    for name in written.layouts:
        layout = Layout.load(tmp_path / "layouts" / f"{name}.json")
        paths = ShortestPaths(layout)
        assert 1 <= len(written.pairs(layout)) <= 5
        for pair in written.pairs(layout):
            path = paths.path(pair.start, pair.goal)
            assert path is not None
            assert path.length >= 2.0


def test_bad_arguments_are_named(tmp_path):
    with pytest.raises(UnknownNameError, match="'tset'"):
        floor_suite("tset", 1, tmp_path)
    with pytest.raises(OptionError, match="count is 0"):
        floor_suite("floors-test", 0, tmp_path)
    with pytest.raises(OptionError, match="seed is 1000000000"):
        floor_suite("floors-test", 1, tmp_path, seed=10**9)
