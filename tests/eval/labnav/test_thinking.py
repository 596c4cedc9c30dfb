"""A policy that thinks longer than it declares pays for it, and all that shows its result says so."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
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
from labgym.eval.labnav import runner
from labgym.eval.labnav.evaluation import LabNavEvaluation, Thinking
from labgym.eval.labnav.latency import (
    REFERENCE_S,
    LatencyMeter,
    Probe,
    charged_latency,
    computes_elsewhere,
    is_accepted,
    percentile,
    probe,
)
from labgym.eval.labnav.rules import delay_of
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.comparison import chosen_evaluations, compare, comparison_tables
from labgym.eval.reports.labnav_tables import score_notes
from labgym.eval.submission import labnav_claim
from labgym.eval.submission.check import check_submission
from labgym.eval.submission.labnav_claim import LabNavClaim
from labgym.policies import EpisodeStart, Policy
from labgym.policies.process import PolicyProcess, PolicySource


class Thoughtful(Policy):
    """Drives ahead after a pause of 0.23 s that it does not declare."""

    name = "thoughtful"
    seconds = 0.23

    def reset(self, episode):
        pass

    def act(self, observation):
        time.sleep(self.seconds)
        return np.array([0.3, 0.0])


class Spinning(Policy):
    """Uses 0.2 s of CPU time itself and as much in a child for its one action."""

    name = "spinning"

    def reset(self, episode):
        pass

    def act(self, observation):
        spin = "import time\nwhile time.process_time() < 0.2: pass"
        subprocess.run([sys.executable, "-S", "-c", spin], check=True)
        end = time.process_time() + 0.2
        while time.process_time() < end:
            pass
        return np.zeros(2)


class Resting(Policy):
    name = "resting"

    def reset(self, episode):
        pass

    def act(self, observation):
        return np.zeros(2)


class Quick(Thoughtful):
    name = "quick"
    seconds = 0.0


@pytest.fixture(scope="module")
def suite():
    """One episode, cut after 1 s."""
    part = draw_suite("odometry", 2, "floors-val", 1, 1, seed=3)
    return LabNavSuite("labnav-odometry-2", (part,), seconds=1.0)


MEASURED = Probe(seconds=0.23, basis="CPU time", steps=50)


@pytest.fixture(scope="module")
def thoughtful(suite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("thinking") / "thoughtful"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "probe", lambda *_: MEASURED)
        return folder, evaluate(Thoughtful(), suite, out=folder, progress=False)


def test_a_policy_is_charged_for_the_time_that_it_does_not_declare(thoughtful):
    folder, report = thoughtful
    assert (report.summary.declared, report.summary.latency) == (0.0, 0.3)
    assert {row.delay for row in report.rows} == {3}
    inputs = json.loads((folder / "run.json").read_text())["inputs"]
    assert (inputs["latency"], inputs["probe"]) == (0.3, MEASURED.model_dump())
    route = json.loads((folder / "routes.jsonl").read_text())["poses"]
    assert all(pose == route[0] for pose in route[:4]), "the first action comes late"
    assert route[-1] != route[0]


def test_the_latency_is_measured_once_and_kept_in_the_folder(suite, thoughtful, monkeypatch):
    folder, first = thoughtful
    before = (folder / "run.json").read_bytes()
    monkeypatch.setattr(runner, "probe", None)
    again = evaluate(Thoughtful(), suite, out=folder, progress=False)
    assert again.summary == first.summary
    assert evaluate(Thoughtful(), suite, out=folder, progress=False, latency=0.2).summary == first.summary
    assert (folder / "run.json").read_bytes() == before
    with pytest.raises(OptionError, match="latency"):
        evaluate(Thoughtful(), suite, out=folder, progress=False, latency=0.5)


def test_a_built_in_policy_has_the_latency_that_it_declares_and_is_not_measured(suite, monkeypatch):
    monkeypatch.setattr(runner, "probe", None)
    report = evaluate("stack", suite, progress=False)
    assert (report.summary.latency, report.summary.declared) == (0.1, None)
    assert {row.delay for row in report.rows} == {1}


def test_a_latency_that_the_user_passes_adds_to_what_is_charged_and_takes_nothing_from_it(suite, monkeypatch):
    for seconds, latency in ((0.001, 0.45), (0.51, 0.6), (2.0, 2.0)):
        monkeypatch.setattr(
            runner, "probe", lambda *_, seconds=seconds: MEASURED.model_copy(update={"seconds": seconds})
        )
        report = evaluate(Quick(), suite, progress=False, latency=0.45)
        assert (report.summary.latency, report.summary.declared) == (latency, 0.0)
        assert {row.delay for row in report.rows} == {delay_of(latency)}
    for latency in (0.05, -1.0, float("nan"), True, 1e6):
        with pytest.raises(OptionError, match="latency is"):
            evaluate("stack", suite, progress=False, latency=latency)


@pytest.mark.parametrize(
    ("seconds", "declared", "latency"),
    [(0.0099, 0.0, 0.0), (0.01, 0.0, 0.1), (0.1, 0.0, 0.1), (0.1001, 0.0, 0.2), (0.3, 0.0, 0.3), (0.011, 0.1, 0.1),
     (0.15, 0.1, 0.2), (0.0, 0.25, 0.25), (0.21, 0.25, 0.25), (0.31, 0.25, 0.4), (60.0, 0.0, 10.0)],
)  # fmt: skip
def test_thinking_is_free_below_10_ms_and_charged_in_whole_steps_from_then_on(seconds, declared, latency):
    assert charged_latency(seconds, declared) == latency


def test_a_verifier_accepts_a_latency_that_is_one_step_below_its_own_or_above():
    assert is_accepted(0.1, 0.0)
    assert is_accepted(0.0, 0.5)
    assert is_accepted(0.35, 0.3)
    assert not is_accepted(0.2, 0.0)
    assert not is_accepted(0.5, 0.3)


def test_the_time_of_an_action_is_relative_to_the_calibration_right_before_and_after_it():
    # A machine that becomes twice as slow for the policy and for the loop alike.
    clock, loop = iter((0.0, 9.0, 9.02, 9.06)), iter((REFERENCE_S, REFERENCE_S, REFERENCE_S, 3.0 * REFERENCE_S))
    meter = LatencyMeter(lambda: next(clock), lambda: next(loop))
    for steps in range(4):
        meter(SimpleNamespace(steps=steps))
    assert meter.times == pytest.approx([9.0, 0.02, 0.02])


def test_a_probe_charges_the_ninetieth_percentile_of_50_actions_after_5(suite, monkeypatch):
    spent = [5.0] * 6 + [0.02] * 45 + [0.4] * 5
    ticks = iter(np.cumsum(spent).tolist() + [1e3] * 100)
    monkeypatch.setattr(
        "labgym.eval.labnav.latency.LatencyMeter", lambda clock: LatencyMeter(clock, lambda: REFERENCE_S)
    )
    source = PolicySource.copied(Resting())
    driver = PolicyProcess(source)
    try:
        monkeypatch.setattr(driver, "cpu_seconds", lambda: next(ticks))
        measured = probe(driver, source, suite, 0)
    finally:
        driver.close()
    assert (measured.seconds, measured.steps, measured.basis) == (0.02, 50, "CPU time")


def test_cpu_time_counts_a_policy_s_children_and_not_the_evaluator():
    driver = PolicyProcess(PolicySource.copied(Spinning()))
    try:
        before = driver.cpu_seconds()
        begin = time.process_time()
        while time.process_time() - begin < 0.2:
            pass
        assert driver.cpu_seconds() - before < 0.1
        driver.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
        driver.act({})
        assert driver.cpu_seconds() - before >= 0.38
    finally:
        driver.close()


@pytest.mark.parametrize(("seconds", "accepted"), [(0.001, True), (0.23, True), (0.39, True), (0.41, False)])
def test_a_verifier_measures_again_and_says_so(suite, thoughtful, monkeypatch, seconds, accepted):
    again = MEASURED.model_copy(update={"seconds": seconds})
    monkeypatch.setattr(labnav_claim, "probe", lambda *_: again)
    claim = LabNavClaim(thoughtful[0], suite)
    driver = SimpleNamespace(latency=0.0)
    fine, sentence = claim.measured_again(driver, PolicySource.copied(Thoughtful()), 0)
    assert fine is accepted
    assert sentence.startswith(f"measured again, the policy takes {1e3 * seconds:.3g} ms of CPU time per action in 50")
    assert sentence.endswith("the 0.3 s with which it drove")
    assert claim.measured_again(driver, PolicySource.named("stack"), 0) is None


def test_a_policy_on_a_server_or_a_gpu_is_measured_in_wall_time():
    driver = SimpleNamespace(kernels={"torch": "2"})
    assert not computes_elsewhere(driver, PolicySource("mine:Policy"))
    assert computes_elsewhere(driver, PolicySource("http://127.0.0.1:8888"))
    assert computes_elsewhere(SimpleNamespace(kernels={"cuda": "NVIDIA H100"}), PolicySource("mine:Policy"))


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
    assert any("simulated again differs" in problem for problem in found)


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
