"""Published results: made of evaluations, shown as tables, and compared with rows that a run drives."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Sequence
from typing import Any

import pytest
from labnav_folders import write_folder
from labnav_suites import draw_suite

from labgym.cli import main
from labgym.envs.labnav.episodes import LabNavEpisodes
from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import EPISODES, ROUTES, EpisodeRoute, parse_lines, read_records
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav import together
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import summarise
from labgym.eval.labnav.together import drive_together
from labgym.eval.leaderboard import lab30, labnav
from labgym.eval.leaderboard.labnav import LabNavResult, Outcome, agreement, published_results
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.tables import leaderboard
from labgym.runs import ExecutorOptions

SECONDS = 1.0


@pytest.fixture(scope="module")
def suite():
    return LabNavSuite("labnav-odometry-2", (draw_suite("odometry", 2, "floors-val", 1, 1, seed=3),), SECONDS)


@pytest.fixture(scope="module")
def folder(suite, tmp_path_factory):
    place = tmp_path_factory.mktemp("run") / "straight"
    evaluate("straight", suite, out=place, progress=False)
    return place


def test_policies_that_share_worlds_drive_as_each_alone(suite, folder):
    driven = drive_together(["still", "straight"], suite, None, ExecutorOptions(), progress=False)
    rows = tuple(parse_lines(EPISODES, driven["straight"][EPISODES], LabNavRow).values())
    assert rows == evaluate("straight", suite, out=folder, progress=False).rows
    assert set(driven) == {"still", "straight"}
    routes = parse_lines(ROUTES, driven["still"][ROUTES], EpisodeRoute)
    assert [route.poses[0] for route in routes.values()] == [route.poses[-1] for route in routes.values()]


class OpenedError(Exception):
    """Workers were asked for."""


@pytest.mark.parametrize(("policies", "apart"), [(["still"], False), (["still", "clairvoyant"], True)])
def test_policies_that_share_worlds_drive_with_one_thread_if_one_foresees(suite, monkeypatch, policies, apart):
    def run_shards(shards, folder, executor, *arguments, **options):
        assert executor == ExecutorOptions(apart=apart)
        raise OpenedError

    monkeypatch.setattr(together, "run_shards", run_shards)
    with pytest.raises(OpenedError):
        drive_together(policies, suite, None, ExecutorOptions(), progress=False)


def test_a_result_keeps_the_outcome_of_every_episode(tmp_path):
    folder = write_folder(tmp_path / "mine", load_labnav("labnav-odometry"), "mine", "mapless", lambda *_: 0.5)
    path = labnav.publish(folder, tmp_path)
    assert path.name == "mine.json"
    result = LabNavResult.load(path)
    rows = tuple(read_records(folder / "episodes.jsonl", LabNavRow).values())
    assert result.by_key == {row.key: Outcome.of(row) for row in rows}
    (line,) = published_table([result]).rows
    assert line[:2] == ("mine", "-")
    assert "A dash stands for a task that is not driven yet." in published_table([result]).notes


@pytest.mark.parametrize("name", ["labnav-mini", "labnav-val-odometry", "labnav-odometry-1"])
def test_only_whole_tasks_of_the_suite_labnav_are_published(name, tmp_path):
    suite = load_labnav(name)
    folder = write_folder(tmp_path / "mine", suite, "mine", "mapless", lambda *_: 0.5)
    with pytest.raises(OptionError, match=r"with \d+ episodes is no part of the suite labnav: results of"):
        labnav.publish(folder, tmp_path)
    assert not (tmp_path / "mine.json").exists()


@functools.cache
def whole_task(task: str) -> LabNavEpisodes:
    """Return all published episodes of a task on the headline's level."""
    return load_labnav(f"labnav-{task}").parts[0]


@pytest.fixture(scope="module")
def result_of(folder):
    """Return a function that returns a complete result of a published task with the same score in every episode."""
    (row,) = read_records(folder / EPISODES, LabNavRow).values()

    def result(task: str, score: float, per_floor: int = 2, **fields: Any) -> LabNavResult:
        part = whole_task(task).first(None, per_floor)
        suite = LabNavSuite(f"labnav-{task}", (part,))
        same = {"suite": part.label, "task": task, "level": 2, "score": score}
        rows = [row.model_copy(update={**same, "floor": one.floor, "number": one.number}) for one in part.episodes]
        known = {"options": {}, "track": "mapless", "sensors": "lidar", "seed": 0, "latency": 0.0, "policy": "mine"}
        summary = summarise(suite, rows, **(known | fields))
        outcomes = tuple(map(Outcome.of, rows))
        return LabNavResult(summary=summary, outcomes=outcomes, commits={part.label: ("a" * 40,)})

    return result


def test_tasks_driven_one_by_one_give_the_figure_when_the_last_one_is_there(result_of):
    scores = {"aisle": 0.8, "moved": 0.4, "people": 0.1, "odometry": 0.0, "dock": 0.5, "glass": 1.0, "carry": 0.2}
    joined = result_of("shift", 0.3)
    for task, score in scores.items():
        assert joined.summary.labnav is None
        joined = joined.joined(result_of(task, score))
    values = [*scores.values(), 0.3]
    assert joined.summary.labnav.value == pytest.approx(
        100.0 * (math.prod(value + 0.05 for value in values) ** (1 / 8) - 0.05)
    )
    assert joined.summary.arithmetic == pytest.approx(100.0 * sum(values) / 8)
    assert [part.task for part in joined.summary.tasks] == list(FIGURE_TASKS)
    assert joined.summary.suite == "labnav"
    assert joined.summary.hash == load_labnav("labnav").hash
    assert len(joined.outcomes) == 960
    assert len(joined.commits) == 8


def test_the_table_names_pairs_that_are_not_apart_and_those_whose_order_depends_on_the_mean(result_of):
    def whole(policy: str, scores: Sequence[float]) -> LabNavResult:
        parts = [result_of(task, score, policy=policy) for task, score in zip(FIGURE_TASKS, scores, strict=True)]
        return functools.reduce(LabNavResult.joined, parts)

    even, uneven = whole("even", [0.4] * 8), whole("uneven", [1.0] * 4 + [0.0] * 4)
    text = " ".join(published_table([even, uneven, whole("twin", [0.4] * 8)]).notes)
    assert "2 of 3 pairs of policies are apart" in text
    assert "not even and twin." in text
    assert "The means order these pairs differently: even and uneven, twin and uneven." in text


def test_a_task_driven_again_replaces_its_result(result_of):
    joined = result_of("aisle", 0.8).joined(result_of("dock", 0.5)).joined(result_of("aisle", 0.6))
    assert [part.score.value for part in joined.summary.tasks] == pytest.approx([0.6, 0.5])
    assert len(joined.outcomes) == 240


def test_results_of_other_options_are_not_joined(result_of):
    with pytest.raises(OptionError, match="mine is published with options"):
        result_of("aisle", 0.8).joined(result_of("dock", 0.5, options={"speed": 0.5}))


def test_a_policy_with_fewer_episodes_is_named(result_of):
    few, many = (result_of("aisle", 0.5, count, policy=name) for name, count in (("few", 1), ("many", 2)))
    table = published_table([few, many])
    assert table.title == "LabNav, version 2, 120 episodes per task"
    assert "Fewer episodes per task: few 60; their intervals are wider." in table.notes
    assert not any(note.startswith("Fewer") for note in published_table([many]).notes)


def test_a_task_without_all_of_its_episodes_is_neither_joined_nor_published(result_of, tmp_path, monkeypatch):
    part = result_of("dock", 0.5, per_floor=1)
    with pytest.raises(OptionError, match="dock-2/2 with 60 episodes is no part of the suite labnav"):
        result_of("aisle", 0.8).joined(part)
    monkeypatch.setattr(LabNavResult, "of", lambda _: part)
    with pytest.raises(OptionError, match="dock-2/2 with 60 episodes"):
        labnav.publish("run", tmp_path)


def test_an_incomplete_evaluation_is_not_published(folder, tmp_path):
    summary = json.loads((folder / "summary.json").read_text())
    summary["tasks"][0]["expected"] = 7
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(DocumentError, match="holds 1 of 7 episodes of odometry"):
        labnav.publish(tmp_path, tmp_path / "place")
    assert not (tmp_path / "place").exists()


def test_rows_agree_with_published_drives_that_the_shorter_limit_cuts_off(folder):
    (row,) = read_records(folder / "episodes.jsonl", LabNavRow).values()
    longer = Outcome(key=row.key, score=0.8, ending="success", time=40.0)
    assert agreement([row], {row.key: longer}, SECONDS).equal == 1
    assert agreement([row], {row.key: Outcome.of(row)}, SECONDS).equal == 1
    assert agreement([row], {}, SECONDS).compared == 0


@pytest.mark.parametrize("change", [{"score": 0.5}, {"time": 0.9}, {"ending": "contact"}])
def test_a_row_that_differs_is_named(folder, change):
    (row,) = read_records(folder / "episodes.jsonl", LabNavRow).values()
    expected = Outcome.of(row).model_copy(update=change)
    result = agreement([row], {row.key: expected}, 2.0 * SECONDS)
    assert (result.equal, result.compared) == (0, 1)
    assert row.key in result.differing[0]


def test_results_of_lab30_give_the_table_of_their_evaluation(tmp_path):
    from labgym.layouts import load_published
    from labgym.suites import load_suite

    test = load_suite("lab30")
    first = test.first([load_published("test", "test-sub_02")])
    evaluate("straight", first, out=tmp_path / "run", progress=False)
    result = lab30.Lab30Result.load(lab30.publish_lab30(tmp_path / "run", tmp_path))
    assert leaderboard([result]).rows[0][:2] == ("straight", "lidar")
    assert result.planning is not None


def test_results_of_lab30_come_with_the_fewest_contacts_first():
    results = lab30.published_lab30()
    free = [result.metrics["collision_free"].value for result in results]
    assert free == sorted(free, reverse=True)
    names = [result.name for result in results]
    assert {"astar", "local-ppo", "navdp", "random"} <= set(names)
    assert [one.name for one in lab30.published_lab30(["random", "nobody", "astar"])] == ["random", "astar"]


def test_the_first_drives_of_a_suite_are_driven_as_in_the_suite(tmp_path):
    from labgym.layouts import load_published
    from labgym.suites import load_suite

    layout = load_published("test", "test-sub_02")
    test = load_suite("lab30")
    whole = evaluate("astar", test.model_copy(update={"layouts": (layout.id,)}), progress=False).rows
    (first,) = evaluate("astar", test.first([layout]), progress=False).rows
    assert first.model_copy(update={"suite": whole[0].suite}) == whole[0]


def test_the_command_shows_what_is_published(capsys):
    assert main(["leaderboard"]) == 0
    printed = capsys.readouterr().out
    assert all(result.summary.policy in printed for result in published_results())


def test_the_command_names_a_folder_without_results(tmp_path, capsys):
    assert main(["leaderboard", "--add", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "summary.json" in message
