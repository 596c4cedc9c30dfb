from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from labgym.cli import main
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.files import read_rows
from labgym.eval.evaluator import evaluate
from labgym.eval.reports.comparison import Comparison, chosen_evaluations, compare, comparison_tables, evaluation_in
from labgym.suites import Suite

SUITE = Suite(name="few", split="test", layouts=("test-alk_03", "test-red_01"), max_steps=20)


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    for policy in ("astar", "straight"):
        evaluate(policy, SUITE, out=folder / "navigation" / policy)
    return folder


def test_two_policies_of_a_run_are_compared_over_the_same_episodes(run, tmp_path, capsys):
    out = tmp_path / "comparison.json"
    assert main(["compare", str(run), "--policies", "astar", "straight", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "astar - straight, suite few/1, 6 shared of 6 and 6 episodes in 2 layouts" in printed
    comparison = Comparison.load(out)
    rows = [read_rows(run / "navigation" / policy / "episodes.jsonl") for policy in ("astar", "straight")]
    soft_spl = comparison.groups[0].metrics["soft_spl"]
    expected = [a.soft_spl - b.soft_spl for a, b in zip(*rows, strict=True)]
    assert soft_spl.difference.value == pytest.approx(sum(expected) / 6)
    assert soft_spl.difference.low < soft_spl.difference.value < soft_spl.difference.high
    groups = {(group.grouping, group.name): group for group in comparison.groups}
    assert groups["protocol", "alk_03"].episodes == groups["task", "redox"].episodes == 3
    assert groups["protocol", "alk_03"].metrics["spl"].difference.low is None


def test_two_folders_are_compared_and_a_shorter_one_says_how_much_is_shared(run, tmp_path):
    folder = tmp_path / "half"
    shutil.copytree(run / "navigation" / "straight", folder)
    rows = (folder / "episodes.jsonl").read_text().splitlines(keepends=True)
    (folder / "episodes.jsonl").write_text("".join(rows[:4]))
    comparison = compare(*chosen_evaluations([run / "navigation" / "astar", folder]))
    assert (comparison.a.episodes, comparison.b.episodes, comparison.b.shared) == (6, 4, 4)
    assert "4 shared of 6 and 4 episodes" in comparison_tables(comparison)[0].title


def test_a_folder_whose_rows_were_changed_is_compared_with_a_complaint(run, tmp_path, capsys):
    folder = tmp_path / "changed"
    shutil.copytree(run / "navigation" / "straight", folder)
    text = (folder / "episodes.jsonl").read_text()
    (folder / "episodes.jsonl").write_text(text.replace('"success": false', '"success": true', 1))
    assert main(["compare", str(run / "navigation" / "astar"), str(folder)]) == 1
    assert "summary.json does not match the rows" in capsys.readouterr().err


def test_one_policy_in_two_folders_is_named_with_its_folders(run, tmp_path):
    shutil.copytree(run / "navigation" / "astar", tmp_path / "again")
    comparison = compare(*chosen_evaluations([run, tmp_path], ["astar"]))
    title = comparison_tables(comparison)[0].title
    assert title.startswith("astar (astar) - astar (again), ")
    difference = comparison.groups[0].metrics["success"].difference
    assert difference.value == 0.0
    assert difference.low < 0.0 < difference.high


def test_another_suite_is_refused(run, tmp_path, capsys):
    other = SUITE.model_copy(update={"max_steps": 10})
    evaluate("straight", other, out=tmp_path / "other")
    assert main(["compare", str(run / "navigation" / "astar"), str(tmp_path / "other")]) == 2
    assert "suites few/1 and few/1, which differ in max_steps" in capsys.readouterr().err


def test_arguments_that_do_not_name_two_evaluations_are_refused(run, tmp_path):
    with pytest.raises(OptionError, match="1 folders and 0 policies do not name two evaluations"):
        chosen_evaluations([run])
    with pytest.raises(OptionError, match="holds evaluations of astar, straight; name the policies"):
        evaluation_in(run)
    with pytest.raises(UnknownNameError, match="available: astar, straight"):
        evaluation_in(run, "ppo")
    with pytest.raises(DocumentError, match="holds no finished evaluation"):
        evaluation_in(tmp_path)


def test_the_document_is_plain_json(run, tmp_path):
    path = compare(*chosen_evaluations([run], ["astar", "straight"])).save(tmp_path / "c.json")
    data = json.loads(path.read_text())
    assert data["schema"] == "labgym.comparison/1"
    assert data["groups"][0]["grouping"] == "all"
