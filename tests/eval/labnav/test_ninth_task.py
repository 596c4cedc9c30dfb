"""A ninth task is one file: registered, it is drawn, announced, driven, scored and checked as the others."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from labnav_suites import draw_suite

from labgym.envs.labnav.task import TASKS, LabNavTask, Level, register, spl
from labgym.envs.labnav.tasks import FIGURE_TASKS, task_of
from labgym.errors import LabgymError, UnknownNameError
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.submission.check import check_submission


def half_of_spl(result, outcomes, conditions):
    return spl(result.success, result.shortest, result.path_length) / 2.0


@pytest.fixture(scope="module")
def ninth() -> Iterator[LabNavTask]:
    level = Level(lengths=(2.0, 6.0), odometry={"along": 0.001}, lidar=0.01)
    yield register(LabNavTask("ninth", "drive a few meters by a lidar that errs", {2: level}, half_of_spl, radius=0.5))
    del TASKS["ninth"]


def test_a_ninth_task_is_drawn_driven_scored_and_checked(ninth, tmp_path):
    part = draw_suite("ninth", 2, "floors-val", 1, 3, seed=1)
    assert part.name == "labnav-ninth-2"
    assert all(2.0 <= episode.length <= 6.0 for episode in part.episodes)
    suite = LabNavSuite(part.name, (part,), seconds=20.0)
    report = evaluate("astar", suite, out=tmp_path / "ninth", progress=False)
    assert {row.task for row in report.rows} == {"ninth"}
    assert any(row.success for row in report.rows)
    for row in report.rows:
        assert row.score == spl(row.success, row.shortest, row.path_length) / 2.0
    (summary,) = report.summary.tasks
    assert summary.score.value == pytest.approx(sum(row.score for row in report.rows) / 3.0)
    assert report.summary.labnav is None
    verdict = check_submission(tmp_path / "ninth", suite=suite, progress=False)
    assert verdict.problems == ()


def test_policies_are_told_the_properties_of_a_ninth_task(ninth):
    told = ninth.announced(2)
    assert (told.rests, told.drift, told.people, told.noise) == (True, True, False, False)
    assert "ninth" not in FIGURE_TASKS


def test_a_task_is_registered_once_under_a_plain_name(ninth):
    assert task_of("ninth") is ninth
    with pytest.raises(LabgymError, match="'ninth' is registered twice"):
        register(LabNavTask("ninth", "another", {}, half_of_spl))
    with pytest.raises(LabgymError, match="lower case letters"):
        register(LabNavTask("Ninth-2", "another", {}, half_of_spl))
    with pytest.raises(UnknownNameError, match="LabNav task 'tenth' not found"):
        task_of("tenth")
