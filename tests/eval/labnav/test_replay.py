"""Evaluations of LabNav read back from their folders, and their episodes driven again."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from labnav_suites import draw_suite

from labgym.cli import main
from labgym.envs.labnav.necks import RADII
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.evaluation import LabNavEvaluation, is_labnav_run
from labgym.eval.labnav.replay import driver_name, replay
from labgym.eval.labnav.suites import LabNavSuite, load_labnav, published_episode


@pytest.fixture(scope="module")
def suite():
    """An episode of `people` and one of `carry`, cut after 2 s."""
    parts = tuple(draw_suite(task, 2, "floors-val", 1, 1, seed=3) for task in ("people", "carry"))
    return LabNavSuite("labnav-mini", parts, seconds=2.0)


@pytest.fixture(scope="module")
def folder(suite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("labnav") / "run"
    evaluate("straight", suite, out=folder, progress=False)
    return folder


def test_a_folder_is_read_with_every_figure_computed_from_its_rows(folder):
    evaluation = LabNavEvaluation.read(folder)
    assert evaluation.problems == ()
    assert evaluation.name == "straight"
    assert list(evaluation.summary.by_task) == ["people-2", "carry-2"]
    assert set(evaluation.scores) == {row.key for row in evaluation.rows} == set(evaluation.routes)
    assert driver_name(evaluation) == "straight"
    assert is_labnav_run(folder)
    for task in evaluation.summary.by_task.values():
        assert sum(count for _, count in task.by_met.values()) == task.episodes
        assert set(task.by_neck) <= {f"{radius:.2f} m" for radius in RADII[:-1]} | {"0.45 m and more"}


def test_a_summary_that_contradicts_its_rows_is_reported(folder, tmp_path):
    copy = tmp_path / "run"
    shutil.copytree(folder, copy)
    lines = [json.loads(line) for line in (copy / "episodes.jsonl").open()]
    lines[0]["score"], lines[0]["ending"] = 1.0, "success"
    (copy / "episodes.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    problems = " ".join(LabNavEvaluation.read(copy).problems)
    assert "does not match the rows in score of people-2, success of people-2" in problems
    assert "by its hash in manifest.json" in problems
    (copy / "summary.json").unlink()
    with pytest.raises(DocumentError, match="not finished"):
        LabNavEvaluation.read(copy)


def test_a_replay_has_the_route_of_the_folder_and_the_people_around_it(folder, suite):
    evaluation = LabNavEvaluation.read(folder)
    row = evaluation.rows[0]
    shown = replay(evaluation, f"{row.floor}/{row.number}" if len(evaluation.rows) == 1 else row.key, suite=suite)
    poses = np.round([shot.pose for shot in shown.shots], 3)
    assert np.array_equal(poses, np.array(evaluation.routes[row.key]))
    assert shown.row == row
    people = [{body.name for body in shot.bodies if body.name.startswith("person ")} for shot in shown.shots]
    assert {len(each) for each in people} == {row.outcomes["people"]["people"]}
    walked = np.array([[body.pose[:2] for body in shot.bodies] for shot in shown.shots])
    assert np.abs(walked[-1] - walked[0]).max() > 0.1


def test_a_drive_by_another_policy_is_not_taken_for_the_recorded_one(folder, suite):
    evaluation = LabNavEvaluation.read(folder)
    with pytest.raises(LabgymError, match=r"leaves its route after .*`labgym record labnav-mini --episode carry-2/"):
        replay(evaluation, evaluation.rows[1].key, "still", suite)


def test_the_beaker_rides_on_the_robot(folder, suite):
    evaluation = LabNavEvaluation.read(folder)
    shown = replay(evaluation, evaluation.rows[1].key, suite=suite)
    for shot in shown.shots:
        (beaker,) = (body for body in shot.bodies if body.name == "beaker")
        assert beaker.pose == pytest.approx(shot.pose)
        low, high = beaker.shape.heights
        assert low == pytest.approx(0.40)
        assert high - low == pytest.approx(0.125)  # 115 mm of liquid and 10 mm of freeboard
    rises = [shot.rise for shot in shown.shots]
    assert rises == sorted(rises)
    assert rises[-1] > 0.0


def test_episodes_are_named_by_a_unique_end_of_their_key(folder):
    evaluation = LabNavEvaluation.read(folder)
    row = evaluation.rows[0]
    assert evaluation.row(row.key) is row
    with pytest.raises(UnknownNameError, match=row.key):
        evaluation.row("elsewhere/3")
    twins = replace(evaluation, rows=(row, row.model_copy(update={"task": "carry"})))
    with pytest.raises(OptionError, match="name its task too"):
        twins.row(f"{row.floor}/{row.number}")
    first = load_labnav("labnav-people").parts[0].episodes[0]
    part, episode, seconds = published_episode("labnav-people", first.key)
    assert (part.name, episode, seconds) == ("labnav-people-2", first, 120.0)
    with pytest.raises(OptionError, match="name its task too"):
        published_episode("labnav-mini", load_labnav("labnav-mini").parts[0].episodes[0].key)
    with pytest.raises(UnknownNameError, match="people-2/"):
        published_episode("labnav-people", "people-2/nowhere/1")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("FOLDER",), "name an episode"),
        (("FOLDER", "--episode", "nowhere/1"), "'nowhere/1' not found"),
        (("FOLDER", "--episode", "x/0", "--seed", "3"), "--seed has no effect on a folder"),
        (("FOLDER", "--episode", "x/0", "--width", "20"), "minimum is 480x270"),
        (("labnav-people", "--episode", "x/0", "--start", "1,2,0"), "--start has no effect on an episode"),
        (("test-sub_01", "--episode", "1"), "--episode has no effect on a layout"),
    ],
)
def test_bad_input_is_one_line(folder, tmp_path, capsys, words, message):
    words = [str(folder) if word == "FOLDER" else word for word in words]
    assert main(["record", *words, "--out", str(tmp_path / "film.gif")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
