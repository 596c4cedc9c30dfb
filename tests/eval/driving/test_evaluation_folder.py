"""What a folder of an evaluation promises: it resumes only its own run, and what is read from it agrees."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from episode_rows import read_routes
from laboratories import small_laboratory
from notebook_policies import notebook_policy

from labgym.assets import Catalog
from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import default_folder, read_rows, short_name
from labgym.eval.evaluator import evaluate
from labgym.eval.reports.results import ResultsFolder
from labgym.layouts import Layout
from labgym.policies import EpisodeStart, Policy
from labgym.runs.manifest import RunManifest
from labgym.suites import Suite, suite_of

OUTPUT = ("episodes.jsonl", "routes.jsonl", "actions.jsonl", "summary.json", "manifest.json")


class Arc(Policy):
    """Drives in an arc; its weights may be in a file."""

    def __init__(self, turn: float = 0.1, weights: Path | None = None) -> None:
        self.turn, self.weights = turn, weights

    def reset(self, episode: EpisodeStart) -> None:
        self.left = 5

    def act(self, observation):
        self.left -= 1
        if self.left < 0:
            raise RuntimeError("enough")
        return np.array([0.5, self.turn])

    def files(self):
        return () if self.weights is None else (self.weights,)


@pytest.fixture(scope="module")
def layouts() -> tuple[Layout, ...]:
    return small_laboratory("first"), small_laboratory("second", 0.2)


@pytest.fixture(scope="module")
def finished(layouts, tmp_path_factory) -> Path:
    """A folder with an evaluation of `Arc()` that was not interrupted."""
    folder = tmp_path_factory.mktemp("runs") / "arc"
    evaluate(Arc(), layouts, out=folder, progress=False)
    return folder


@pytest.fixture
def folder(finished, tmp_path) -> Path:
    """A copy of the finished folder that a test may change."""
    return Path(shutil.copytree(finished, tmp_path / "arc"))


def content(folder: Path, names: tuple[str, ...] = OUTPUT) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in names}


def edit(path: Path, change) -> None:
    path.write_text(change(path.read_text()))


def test_a_folder_holds_what_decides_the_run_and_what_came_out(finished, layouts):
    assert {path.name for path in finished.iterdir()} == {
        ".lock",
        "actions.jsonl",
        "episodes.jsonl",
        "layouts",
        "manifest.json",
        "provenance.jsonl",
        "routes.jsonl",
        "run.json",
        "summary.json",
        "times.jsonl",
    }
    identity = json.loads((finished / "run.json").read_text())
    assert (identity["schema"], identity["kind"]) == ("labgym.run/2", "eval")
    assert identity["inputs"]["layouts"] == {layout.id: layout.hash for layout in layouts}
    assert {"suite", "policy", "seed", "catalog"} <= identity["inputs"].keys()
    assert identity["inputs"]["policy"]["label"] == "Arc"
    assert "times.jsonl" not in RunManifest.read(finished).files
    times = [json.loads(line) for line in (finished / "times.jsonl").read_text().splitlines()]
    assert [(time["layout"], time["pair"]) for time in times] == [
        (row.layout, row.pair) for row in read_rows(finished / OUTPUT[0])
    ]
    assert all(time["planning_ms"] > 0.0 for time in times)
    assert not any(b"planning" in text for text in content(finished).values())
    assert Layout.load(finished / "layouts" / "first.json").hash == layouts[0].hash


@pytest.mark.slow
def test_rows_routes_summary_and_manifest_are_equal_with_two_workers(finished, layouts, tmp_path):
    evaluate(Arc(), layouts, out=tmp_path / "two", workers=2, progress=False)
    assert content(tmp_path / "two") == content(finished)


def test_a_finished_run_is_read_and_not_driven_again(folder, layouts):
    times = (folder / "times.jsonl").read_bytes()
    before = content(folder)
    report = evaluate(Arc(), layouts, out=folder, progress=False)
    assert (content(folder), (folder / "times.jsonl").read_bytes()) == (before, times)
    assert report.rows == read_rows(folder / "episodes.jsonl")
    assert report.routes == read_routes(folder / "routes.jsonl")
    assert report.metrics == TransitionEvaluation.read(folder).metrics


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("policy", {"policy": Arc(0.2)}),
        ("seed", {"seed": 5}),
        ("layouts", {"suite": (small_laboratory("first"), small_laboratory("second", 0.25))}),
        ("suite, layouts", {"suite": (small_laboratory("first"),)}),
        ("suite", {"repeats": 2}),
    ],
)
def test_a_folder_with_another_run_is_left_alone_and_the_difference_is_named(folder, layouts, name, arguments):
    before = content(folder)
    with pytest.raises(OptionError, match=rf"differs in {name}\b.*--fresh"):
        evaluate(**({"policy": Arc(), "suite": layouts, "out": folder, "progress": False} | arguments))
    assert content(folder) == before


def test_a_second_policy_object_never_gets_the_rows_of_the_first(layouts, tmp_path):
    # Both have the label Arc and no options: the identity of version 0.1 was the same for both.
    first = evaluate(Arc(0.1), layouts[:1], out=tmp_path / "f", progress=False)
    with pytest.raises(OptionError, match="differs in policy"):
        evaluate(Arc(0.9), layouts[:1], out=tmp_path / "f", progress=False)
    second = evaluate(Arc(0.9), layouts[:1], out=tmp_path / "g", progress=False)
    assert first.routes != second.routes


CELL = """
import numpy as np
from labgym.policies import Policy

class Cell(Policy):
    def reset(self, episode):
        pass

    def act(self, observation):
        return np.array([0.0, {turn}])
"""


def cell(monkeypatch, turn: float, shown: bool = True) -> Policy:
    return notebook_policy(monkeypatch, CELL.format(turn=turn), shown)


def test_an_edited_class_of_a_notebook_is_another_policy(layouts, tmp_path, monkeypatch):
    short = suite_of(layouts[:1]).model_copy(update={"max_steps": 20})
    suite = {"suite": short, "layouts": layouts[:1], "progress": False}
    first = evaluate(cell(monkeypatch, 0.1), out=tmp_path / "f", **suite)
    assert evaluate(cell(monkeypatch, 0.1), out=tmp_path / "f", **suite).rows == first.rows
    with pytest.raises(OptionError, match="differs in policy"):
        evaluate(cell(monkeypatch, 0.2), out=tmp_path / "f", **suite)
    with pytest.raises(OptionError, match=r"source of class 'Cell' is not known.*evaluate without a folder"):
        evaluate(cell(monkeypatch, 0.3, shown=False), out=tmp_path / "g", **suite)
    assert evaluate(cell(monkeypatch, 0.3, shown=False), **suite).summary.complete


def test_other_weights_are_another_policy_and_fresh_moves_the_old_results_aside(layouts, tmp_path):
    weights, out = tmp_path / "weights", tmp_path / "out"
    weights.write_text("old")
    policy = Arc(weights=weights)
    evaluate(policy, layouts[:1], out=out, progress=False)
    before = content(out)
    weights.write_text("new")
    with pytest.raises(OptionError, match="differs in policy"):
        evaluate(policy, layouts[:1], out=out, progress=False)
    assert content(out) == before
    report = evaluate(policy, layouts[:1], out=out, progress=False, fresh=True)
    assert read_rows(out / "episodes.jsonl") == report.rows
    assert content(tmp_path / "out.old-1") == before


def test_results_under_another_catalog_are_not_resumed(layouts, tmp_path):
    evaluate("straight", layouts[:1], out=tmp_path, progress=False)
    bench = layouts[0].catalog.get("PreparationBench")
    wider = bench.model_copy(update={"size": bench.size.model_copy(update={"width": bench.size.width + 0.1})})
    others = [asset for asset in layouts[0].catalog if asset.name != bench.name]
    rebound = layouts[0].replace(catalog=Catalog([*others, wider]))
    with pytest.raises(OptionError, match=r"differs in .*catalog"):
        evaluate("straight", [rebound], out=tmp_path, progress=False)


def test_a_merged_file_that_was_changed_is_not_resumed(folder, layouts):
    edit(folder / "episodes.jsonl", lambda text: text.replace('"success": false', '"success": true'))
    with pytest.raises(DocumentError, match=r"episodes\.jsonl.*was changed"):
        evaluate(Arc(), layouts, out=folder, progress=False)


def test_an_untouched_folder_has_no_problems(finished):
    evaluation = TransitionEvaluation.read(finished)
    assert evaluation.problems == ()
    assert evaluation.summary.to_json() == json.loads((finished / "summary.json").read_text())
    assert evaluation.metrics["planning_ms"].count == len(evaluation.rows)


def test_figures_come_from_the_rows_and_a_summary_that_differs_is_named(folder):
    edit(folder / "summary.json", lambda text: text.replace('"value": 0.0', '"value": 1.0', 1))
    evaluation = TransitionEvaluation.read(folder)
    assert evaluation.metrics["success"].value == 0.0
    assert any("summary.json does not match the rows in success" in problem for problem in evaluation.problems)
    assert any("summary.json: not as the run wrote it" in problem for problem in evaluation.problems)


@pytest.mark.parametrize(
    ("file", "change", "expected"),
    [
        ("episodes.jsonl", lambda text: text[:-40], r"episodes\.jsonl line 6 cannot be read \(not valid JSON"),
        ("episodes.jsonl", lambda text: "".join(text.splitlines(True)[1:]), r"holds 5 of 6 episodes"),
        ("episodes.jsonl", lambda text: text + text.splitlines(True)[0], r"line 7 repeats the episode 'first/0/0'"),
        ("episodes.jsonl", lambda text: text.replace('"steps": 5', '"steps": -5', 1), r"line 1 .*steps"),
        ("episodes.jsonl", lambda text: text.replace('"Arc"', '"Other"', 1), r"rows of other policies: Other"),
        ("episodes.jsonl", lambda text: text.replace('_hash": "', '_hash": "0', 1), r"rows of layouts .*: first"),
        ("routes.jsonl", lambda text: text.replace("[", "(", 1), r"routes\.jsonl line 1 cannot be read"),
        ("routes.jsonl", lambda text: "".join(text.splitlines(True)[1:]), r"routes without a row: 1"),
        ("times.jsonl", lambda text: text[:-10], r"times\.jsonl line 6 cannot be read"),
    ],
)
def test_damaged_and_missing_lines_are_reported(folder, file, change, expected):
    edit(folder / file, change)
    problems = " | ".join(TransitionEvaluation.read(folder).problems)
    assert re.search(expected, problems), problems
    assert "\n" not in problems


def test_the_report_says_on_standard_error_and_in_the_page_what_does_not_agree(folder, capsys):
    assert main(["report", str(folder)]) == 0
    edit(folder / "episodes.jsonl", lambda text: text.replace('"success": false', '"success": true'))
    assert main(["report", str(folder)]) == 1
    errors = [line for line in capsys.readouterr().err.splitlines() if line.startswith("labgym: failed")]
    assert any("summary.json does not match the rows in success, collision_free" in line for line in errors)
    page = (folder / "report.html").read_text()
    assert "does not match the rows in success" in page
    assert "1.000 [" in page


def test_an_unfinished_evaluation_says_how_to_finish_it(folder):
    (folder / "summary.json").unlink()
    (folder / "manifest.json").unlink()
    with pytest.raises(DocumentError, match="not finished; run the same labgym eval command again"):
        ResultsFolder.read(folder)


def test_any_runs_share_a_table_under_names_that_tell_them_apart(finished, layouts, tmp_path):
    evaluate(Arc(0.5), layouts, out=tmp_path / "wide", progress=False)
    other = Suite(name="short", split="val", layouts=("val-alk_01",), max_steps=2)
    evaluate("straight", other, out=tmp_path / "straight", progress=False)
    results = ResultsFolder.read(finished, others=[tmp_path / "wide", tmp_path / "straight", finished])
    assert [one.name for one in results.evaluations] == ["Arc (arc)", "Arc (wide)", "straight"]


def test_names_of_policies_are_short():
    assert short_name("mine:GoToGoal") == "GoToGoal"
    assert short_name("runs/a b/ppo-lab.zip") == "ppo-lab"
    assert short_name("http://127.0.0.1:8888") == "http://127.0.0.1:8888"
    assert default_folder("/data/nets/ppo-lab.onnx", "test") == Path("runs/ppo-lab-test")
    assert default_folder("mine:GoToGoal", "val") == Path("runs/mine_GoToGoal-val")
