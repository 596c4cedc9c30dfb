"""Suites by name, the evaluation in a folder, its summary, and what `labgym eval` prints."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
from labnav_suites import draw_suite
from laboratories import island_laboratory

from labgym.cli.evaluation import eval_
from labgym.cli.evaluation import report as report_
from labgym.envs.labnav.episodes import suite_file
from labgym.envs.tasks import resolve_layouts
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.eval.driving import runner
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.suites import (
    CHECK,
    MINI,
    LabNavSuite,
    cost,
    is_labnav,
    load_labnav,
    read_labnav,
    resolve_labnav,
    suite_names,
)
from labgym.eval.labnav.summary import kind_of, summarise, summary_table
from labgym.policies import Policy
from labgym.runs import ExecutorOptions, open_executor

PUBLISHED = [name for name in suite_names() if suite_file(name).is_file()]


@pytest.fixture(scope="module")
def suite():
    part = draw_suite("odometry", 2, "floors-val", 2, 1, seed=3)
    return LabNavSuite("labnav-odometry-2", (part,), seconds=1.0)


@pytest.fixture(scope="module")
def report(suite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("labnav") / "run"
    return folder, evaluate("straight", suite, out=folder, progress=False)


def test_a_finished_folder_gives_the_same_report_without_driving(suite, report, monkeypatch):
    folder, first = report
    monkeypatch.setattr("labgym.eval.labnav.runner.drive_floor", None)
    again = evaluate("straight", suite, out=folder, progress=False)
    assert (again.summary, again.rows) == (first.summary, first.rows)
    rows = [LabNavRow.model_validate(json.loads(line)) for line in (folder / "episodes.jsonl").open()]
    assert tuple(rows) == first.rows
    assert {path.name for path in folder.iterdir()} >= {"run.json", "routes.jsonl", "times.jsonl", "summary.json"}


def test_rows_are_of_the_episodes_and_end_by_the_suites_limit(suite, report):
    rows = report[1].rows
    assert [row.floor for row in rows] == list(suite.parts[0].floors)
    assert {(row.time, row.ending, row.track, row.stopped) for row in rows} == {(1.0, "time", "mapless", "")}
    assert [row.shortest for row in rows] == [one.length for one in suite.parts[0].episodes]


def test_an_unfiltered_suite_is_driven(suite, tmp_path):
    part = suite.parts[0].first(1, 1).model_copy(update={"filtered": False})
    report = evaluate("straight", LabNavSuite(part.name, (part,), 1.0), out=tmp_path / "run", progress=False)
    assert [row.suite for row in report.rows] == ["labnav-odometry-2-unfiltered/0 on floors-val (draft)"]


def test_another_evaluation_is_refused_in_the_folder(suite, report):
    with pytest.raises(LabgymError, match="holds another run"):
        evaluate("straight", suite, out=report[0], seed=1, progress=False)


def test_the_summary_counts_endings_and_has_no_figure_of_one_task(suite, report):
    summary = report[1].summary
    (task,) = summary.tasks
    assert (task.episodes, task.expected, task.endings, task.draft) == (2, 2, {"time": 2}, True)
    assert (summary.labnav, summary.arithmetic) == (None, None)
    assert sum(count for _, count in task.by_length.values()) == 2
    text = summary_table(summary).text()
    assert "Draft episodes" in text
    assert "odometry-2" in text


def test_a_suite_of_all_tasks_has_the_figure(suite, report):
    from labgym.envs.labnav.tasks import FIGURE_TASKS

    part = suite.parts[0]
    parts = tuple(part.model_copy(update={"task": task}) for task in FIGURE_TASKS)
    row = report[1].rows[0]
    rows = [
        row.model_copy(update={"task": task, "floor": floor, "score": 0.3, "success": True})
        for task in FIGURE_TASKS
        for floor in "abc"
    ]
    fields = {name: getattr(report[1].summary, name) for name in ("policy", "options", "track", "sensors", "seed")}
    summary = summarise(LabNavSuite("labnav", parts), rows, latency=0.0, **fields)
    assert summary.labnav.value == pytest.approx(30.0)
    assert summary.arithmetic == pytest.approx(30.0)
    assert "LabNav 30.0" in summary_table(summary).text()
    assert summarise(LabNavSuite(MINI, parts), rows, latency=0.0, **fields).labnav is None


def test_the_printed_line_has_one_meaning_of_success(suite, report):
    """9 of 10 robots arrived, of which 6 spilt."""
    part = suite.parts[0].model_copy(update={"task": "carry"})
    endings = ["spilt"] * 6 + ["success"] * 3 + ["contact"]
    rows = [
        report[1]
        .rows[0]
        .model_copy(update={"task": "carry", "floor": f"f{k}", "success": ending != "contact", "ending": ending})
        for k, ending in enumerate(endings)
    ]
    fields = {name: getattr(report[1].summary, name) for name in ("policy", "options", "track", "sensors", "seed")}
    table = summary_table(summarise(LabNavSuite("labnav-carry", (part,)), rows, latency=0.0, **fields))
    assert table.columns[3] == "success"
    assert table.rows[0][3].startswith("0.300")
    assert table.rows[0][5] == "success 3, contact 1, spilt 6"
    assert sum(int(words.split()[-1]) for words in table.rows[0][5].split(", ")) == int(table.rows[0][1])


@pytest.mark.cases(20)
@pytest.mark.parametrize("name", PUBLISHED)
def test_published_episodes_have_floors_and_equal_numbers_on_each(name):
    suite = load_labnav(name)
    (part,) = suite.parts
    assert (suite.name, part.name.split("-")[1:]) == (name, name.replace("-val", "").split("-")[1:])
    assert part.split == ("floors-val" if part.draft or "-val-" in name else "floors-test")
    assert len({len(each) for each in part.floors.values()}) == 1
    assert len(part.episodes) >= 27
    for floor in list(part.floors)[:2]:
        part.layout(floor)


def test_a_task_without_a_level_has_the_headlines():
    assert load_labnav("labnav-odometry").name == "labnav-odometry-2"
    mini = load_labnav(MINI)
    assert mini.seconds == 60.0
    assert {part.split for part in mini.parts} == {"floors-val"}, "nobody tunes on test floors by the quick start"
    check = load_labnav(CHECK)
    assert {part.split for part in check.parts} == {"floors-test"}
    assert set(check.by_key) <= set(load_labnav("labnav").by_key)
    assert not check.figure
    assert {len(part.episodes) for part in mini.parts} == {3}
    assert {part.task: {len(one.lengths) for one in part.episodes} for part in mini.parts if part.task == "shift"} == {
        "shift": {3}
    }


@pytest.mark.parametrize("name", ["labnav-fly", "labnav-60", "labnav-aisle-4", "labnav-", "labnav-aisle-2-1"])
def test_a_suite_that_does_not_exist_is_refused_with_the_names(name):
    assert is_labnav(name)
    with pytest.raises(UnknownNameError, match=r"nearest: labnav.* 76 in all"):
        load_labnav(name)


def test_the_cost_is_told_before_the_start(suite):
    assert "2 episodes of at most 1 s simulated (odometry-2)" in cost(suite, "mine")
    assert "CPU time for astar" in cost(suite, "astar")
    all_tasks = load_labnav("labnav")
    assert all_tasks.figure
    assert "no figure LabNav" not in cost(all_tasks, "astar")
    assert "no figure LabNav" in cost(LabNavSuite("labnav", all_tasks.parts[1:]), "astar")


def test_a_published_suite_takes_no_layouts_and_no_repeats():
    with pytest.raises(OptionError, match="has its floors"):
        eval_(policy="straight", suite="labnav-mini", layouts=("test-sub_01",))
    with pytest.raises(OptionError, match="fixed episodes"):
        eval_(policy="straight", suite="labnav-mini", repeats=2)


def test_kinds_of_things_have_no_number():
    assert [kind_of(name) for name in ("SteelDrum_3", "parked-1", "person 12", "wall", "7")] == [
        "SteelDrum",
        "parked",
        "person",
        "wall",
        "7",
    ]


class Oracle(Policy):
    foresees = True

    def reset(self, episode):
        pass

    def act(self, observation):
        return np.zeros(2)


def test_only_built_in_policies_foresee_the_world_and_only_in_labnav(suite):
    with pytest.raises(OptionError, match="'Oracle' declares `foresees`"):
        evaluate(Oracle(), suite, progress=False)
    with pytest.raises(OptionError, match="only LabNav hands out"):
        evaluate(Oracle(), [island_laboratory()], progress=False)


def test_the_privileged_track_is_evaluated_in_one_worker_with_one_thread(suite, monkeypatch):
    opened, runner_shards = [], runner.run_shards

    def run_shards(shards, folder, executor, *arguments, **options):
        opened.append(executor)
        return runner_shards(shards, folder, executor, *arguments, **options)

    monkeypatch.setattr(runner, "run_shards", run_shards)
    report = evaluate("clairvoyant", suite, progress=False)
    assert opened == [ExecutorOptions(apart=True)]
    with open_executor(opened[0]) as workers:
        assert workers.executor.submit(os.getpid).result() != os.getpid()
        assert workers.executor.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == "1"
    assert report.summary.track == "privileged"
    assert "clairvoyant (privileged)" in summary_table(report.summary).text()
    assert {(row.track, row.error, row.time) for row in report.rows} == {("privileged", None, suite.seconds)}


@pytest.fixture
def in_files(suite, tmp_path):
    """A folder with the suite as sealed floors have it: in a file, beside layouts that no split publishes."""
    part = suite.parts[0].first(1, 1).model_copy(update={"split": "floors-sealed"})
    for floor in part.floors:
        suite.parts[0].layout(floor).save(tmp_path / "floors" / f"{floor}.json")
    part.save(tmp_path / "suites" / "odometry-2.json")
    return tmp_path


def test_a_suite_in_a_file_or_folder_is_driven_on_the_layouts_that_come_with_it(in_files, suite):
    layouts = resolve_layouts([in_files / "floors"])
    drawn = suite.parts[0].episodes[0]
    for path, name in (
        ("suites/odometry-2.json", "labnav-floors-sealed-odometry-2"),
        ("suites", "labnav-floors-sealed"),
    ):
        chosen = resolve_labnav(str(in_files / path), layouts)
        assert (chosen.name, chosen.parts[0].episodes) == (name, (drawn,))
    assert is_labnav(str(in_files / "suites"))
    assert not is_labnav(str(in_files / "floors"))
    code = eval_(
        policy="straight", suite=str(in_files / "suites"), layouts=(str(in_files / "floors"),), out=in_files / "run"
    )
    assert code == 0
    (row,) = (LabNavRow.model_validate_json(line) for line in (in_files / "run" / "episodes.jsonl").open())
    assert (row.floor, row.shortest) == (drawn.floor, drawn.length)
    assert report_([in_files / "run"]) == 0
    assert "labnav-floors-sealed is not published" in (in_files / "run" / "report.html").read_text()


def test_layouts_of_a_suite_in_files_are_those_of_its_episodes(in_files, suite):
    path = str(in_files / "suites" / "odometry-2.json")
    with pytest.raises(OptionError, match="pass their folder"):
        evaluate("straight", resolve_labnav(path), progress=False)
    other = suite.parts[0].layout(suite.parts[0].episodes[1].floor)
    with pytest.raises(UnknownNameError, match="layout of"):
        evaluate("straight", resolve_labnav(path, [other]), progress=False)
    changed = other.model_copy(update={"id": suite.parts[0].episodes[0].floor})
    with pytest.raises(LabgymError, match="hash"):
        evaluate("straight", resolve_labnav(path, [changed]), progress=False)
    with pytest.raises(OptionError, match="has its floors"):
        resolve_labnav("labnav-aisle", [other])
    with pytest.raises(LabgymError, match="holds no episodes"):
        read_labnav(in_files / "floors")
