"""A policy that thinks longer than it declares pays for it, and all that shows its result says so."""

from __future__ import annotations

import json
import shutil
import time
from types import SimpleNamespace

import numpy as np
import pytest
from labnav_suites import draw_suite
from signed_folders import SignedFolder

from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.files import EpisodeTime
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav import evaluation, runner
from labgym.eval.labnav.evaluation import LabNavEvaluation, Thinking, percentile
from labgym.eval.labnav.rules import delay_of
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.comparison import chosen_evaluations, compare, comparison_tables
from labgym.eval.reports.labnav_tables import score_notes
from labgym.eval.submission.check import check_submission
from labgym.policies import Policy


class Thoughtful(Policy):
    """Drives ahead after a pause of 0.23 s that it does not declare."""

    name = "thoughtful"
    seconds = 0.23

    def reset(self, episode):
        pass

    def act(self, observation):
        time.sleep(self.seconds)
        return np.array([0.3, 0.0])


class Quick(Thoughtful):
    name = "quick"
    seconds = 0.0


@pytest.fixture(scope="module")
def suite():
    """One episode, cut after 1 s."""
    part = draw_suite("odometry", 2, "floors-val", 1, 1, seed=3)
    return LabNavSuite("labnav-odometry-2", (part,), seconds=1.0)


@pytest.fixture(scope="module")
def thoughtful(suite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("thinking") / "thoughtful"
    return folder, evaluate(Thoughtful(), suite, out=folder, progress=False)


def test_a_policy_is_charged_for_the_time_that_it_does_not_declare(thoughtful):
    folder, report = thoughtful
    summary = report.summary
    assert summary.declared == 0.0
    assert summary.latency >= 0.3
    assert abs(10.0 * summary.latency - round(10.0 * summary.latency)) < 1e-9
    assert {row.delay for row in report.rows} == {delay_of(summary.latency)}
    assert json.loads((folder / "run.json").read_text())["inputs"]["latency"] == summary.latency
    route = json.loads((folder / "routes.jsonl").read_text())["poses"]
    still = delay_of(summary.latency)
    assert all(pose == route[0] for pose in route[: still + 1]), "the first action comes late"
    assert route[-1] != route[0]


def test_the_latency_is_measured_once_and_kept_in_the_folder(suite, thoughtful, monkeypatch):
    folder, first = thoughtful
    monkeypatch.setattr(runner, "charged_latency", None)
    again = evaluate(Thoughtful(), suite, out=folder, progress=False)
    assert again.summary == first.summary


@pytest.mark.parametrize(("milliseconds", "delay"), [(None, 0), (99.0, 0), (101.0, 2), (230.0, 3)])
def test_the_latency_follows_from_the_time_of_the_probe(suite, monkeypatch, milliseconds, delay):
    probe = SimpleNamespace(high_ms=milliseconds)
    monkeypatch.setattr(evaluation, "drive_floor", lambda *_: (probe,))
    assert {row.delay for row in evaluate(Quick(), suite, progress=False).rows} == {delay}


def test_a_built_in_policy_has_the_latency_that_it_declares(suite, monkeypatch):
    monkeypatch.setattr(runner, "charged_latency", None)
    report = evaluate("stack", suite, progress=False)
    assert (report.summary.latency, report.summary.declared) == (0.1, None)
    assert {row.delay for row in report.rows} == {1}


def test_a_latency_that_the_user_passes_is_not_measured_and_never_below_the_declared_one(suite, monkeypatch):
    monkeypatch.setattr(runner, "charged_latency", None)
    report = evaluate(Quick(), suite, progress=False, latency=0.45)
    assert ({row.delay for row in report.rows}, report.summary.declared) == ({5}, 0.0)
    for latency in (0.05, -1.0, float("nan"), True, 1e6):
        with pytest.raises(OptionError, match="latency is"):
            evaluate("stack", suite, progress=False, latency=latency)


def test_the_mark_is_in_the_published_file_the_tables_and_the_comparison(suite, thoughtful, tmp_path):
    folder, report = thoughtful
    mark = report.thinking.mark
    assert mark.startswith(f"thinks {report.thinking.seconds:.2f} s, declares 0 s")
    assert f"its actions come {report.summary.latency:g} s late" in mark
    saved = LabNavResult.load(LabNavResult.of(folder).save(tmp_path / "thoughtful.json"))
    assert saved.mark == mark
    assert f"thoughtful {mark}." in score_notes([LabNavEvaluation.read(folder)])
    evaluate(Quick(), suite, out=tmp_path / "quick", progress=False)
    comparison = compare(*chosen_evaluations([folder, tmp_path / "quick"]))
    assert f"thoughtful {mark}." in comparison_tables(comparison)[0].notes
    result = published_results()[0]
    marked = result.model_copy(update={"thinking": {result.summary.tasks[0].suite: report.thinking}})
    assert f"{result.summary.policy} {mark}." in published_table([marked]).notes


@pytest.mark.parametrize("change", ["file", "line", "measure", "mark"])
def test_a_publication_that_drops_the_mark_is_refused(suite, thoughtful, tmp_path, change):
    copy = SignedFolder(shutil.copytree(thoughtful[0], tmp_path / "copy"))
    assert check_submission(copy.folder, suite=suite, drive=False).passed
    lines = copy.lines("times.jsonl")
    if change == "file":
        (copy.folder / "times.jsonl").unlink()
    elif change == "line":
        copy.write("times.jsonl", [])
    else:
        lines[0]["high_ms" if change == "measure" else "slow"] = None if change == "measure" else True
        copy.write("times.jsonl", lines)
    copy.sign()
    found = " ".join(check_submission(copy.folder, suite=suite, drive=False).problems)
    assert "no measured time" in found or "slow is True" in found
    with pytest.raises(DocumentError, match=r"times\.jsonl|not published"):
        LabNavResult.of(copy.folder)


def test_a_delay_that_was_dropped_is_named(suite, thoughtful, tmp_path):
    copy = SignedFolder(shutil.copytree(thoughtful[0], tmp_path / "copy"))
    copy.write("summary.json", {**copy.document("summary.json"), "latency": 0.0})
    copy.sign()
    found = check_submission(copy.folder, suite=suite, drive=False).problems
    assert any("differ in latency" in problem for problem in found)
    assert any(problem.endswith("expected 0") and "delay is" in problem for problem in found)


def test_a_policy_that_becomes_slow_after_the_probe_is_marked():
    times = [EpisodeTime(key=str(k), planning_ms=5.0, high_ms=20.0 if k < 8 else 340.0, slow=k >= 8) for k in range(10)]
    thinking = Thinking.of(times, declared=0.1, charged=0.1)
    assert thinking.mark == "thinks 0.34 s, declares 0.1 s, longer in 2 of 10 episodes"
    assert Thinking.of(times[:8], 0.1, 0.1).mark == ""
    assert Thinking.of([], 0.1, 0.1) is None


def test_the_percentile_is_the_least_value_that_nine_tenths_do_not_exceed():
    assert percentile(range(1, 11)) == 9.0
    assert percentile([3.0]) == 3.0
    assert percentile([1.0] * 9 + [7.0]) == 1.0


def test_the_command_refuses_a_latency_where_actions_are_not_delayed(capsys):
    assert main(["eval", "--policy", "still", "--suite", "test", "--latency", "0.2"]) == 2
    assert "does not delay actions" in capsys.readouterr().err
