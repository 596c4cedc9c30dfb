"""Drives without a nuisance: separate rows and paired differences, which are no results of LabNav."""

from __future__ import annotations

import json

import numpy as np
import pytest
from labnav_suites import draw_suite
from laboratories import island_laboratory

from labgym.cli import main
from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.envs.labnav.task import timed
from labgym.errors import UnknownNameError
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.together import Entrant
from labgym.paper.reproduction.nuisances import NuisanceRow, NuisanceStudy, driven, nuisance_study, variants_of
from labgym.paper.reproduction.study import reproduce
from labgym.policies import Policy

LAYOUT = island_laboratory()
START, GOAL = (1.5, 4.2, 0.0), (6.5, 4.2, 0.0)
BEAKER = {"radius": 0.052, "depth": 0.115, "freeboard": 0.001, "damping": 0.005}
"""A beaker that is full to the brim."""


class Pursuing(Policy):
    """Full speed ahead, turning towards the goal; knows whether it carries a beaker."""

    def reset(self, episode):
        self.beaker = episode.beaker

    def act(self, observation):
        return np.array([1.0, float(observation["goal"][2])])


def suite(task, **conditions):
    episode = LabNavEpisode(
        floor=LAYOUT.id, floor_hash=LAYOUT.hash, number=0, start=START, goal=GOAL, conditions=conditions, seed=3,
        length=4.64,
    )  # fmt: skip
    return LabNavEpisodes(task=task, level=2, split="floors-val", seed=0, episodes=(episode,))


def test_without_the_beaker_a_drive_of_carry_has_the_score_of_its_time():
    part, policy = suite("carry", payload=BEAKER, people={}), Pursuing()
    (full,) = driven(policy, "mine", LAYOUT, part.episodes, part, "")
    assert (full.score, full.success, policy.beaker is None) == (0.0, True, False)
    (empty,) = driven(policy, "mine", LAYOUT, part.episodes, part, "payload")
    assert (empty.success, empty.ending, policy.beaker) == (True, "success", None)
    assert empty.score == pytest.approx(timed(True, 4.64, empty.time))
    assert (empty.time, empty.path_length) == (full.time, full.path_length)


def test_with_all_nuisances_a_drive_is_that_of_labnav():
    part = suite("odometry")
    (row,) = driven(Pursuing(), "mine", LAYOUT, part.episodes, part, "")
    (drive,) = drive_floor(Pursuing(), LAYOUT, part.episodes, DriveTerms.of(part, "mine", 0))
    assert row == NuisanceRow.of(drive.row, "")
    (none,) = driven(Pursuing(), "mine", LAYOUT, part.episodes, part, "all")
    # Without errors the robot drives the straight line until the evaluator brakes it, at 1.5 m/s2.
    assert none.path_length == pytest.approx(5.0 - 0.252 + 0.5 / 1.5, abs=0.05)
    assert none.path_length != row.path_length


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("study") / "nuisances"
    part = draw_suite("odometry", 2, "floors-val", 1, 1, seed=3)
    return place, reproduce(NuisanceStudy(Entrant.of("still"), (part,)), place, progress=False)


def test_the_study_has_a_line_for_each_nuisance_and_one_for_all(folder):
    (table,) = folder[1].tables
    assert [line.detail for line in table.lines] == [
        "errors of the wheels", "drift of the odometry", "noise of the sensors", "all",
    ]  # fmt: skip
    rows = [NuisanceRow.model_validate_json(line) for line in (folder[0] / "rows.jsonl").open()]
    assert (
        [row.without for row in rows] == ["", "wheels", "odometry", "noise", "all"] == list(variants_of("odometry", 2))
    )
    assert {line.cells["difference"].value for line in table.lines} == {0.0}
    assert folder[1].summary == ("Scores that differ: none.",)


def test_differences_are_those_of_the_same_episodes(folder):
    from labgym.envs.labnav.episodes import published_episodes

    part = published_episodes("odometry", 2, development=True)
    study = NuisanceStudy(Entrant.of("still"), (part,))
    gains = {"": 0.2, "wheels": 0.2, "odometry": 0.5, "noise": 0.1, "all": 0.8}
    template = NuisanceRow.model_validate_json((folder[0] / "rows.jsonl").read_text().splitlines()[0])
    rows = [
        template.model_copy(update={"floor": one.floor, "number": one.number, "without": name, "score": score})
        for one in part.episodes
        for name, score in gains.items()
    ]
    figures = study.figures(rows)
    values = [[line.cells[key].value for key in ("with", "without", "difference")] for line in figures.tables[0].lines]
    assert values == [
        pytest.approx(each) for each in ([0.2, 0.2, 0.0], [0.2, 0.5, 0.3], [0.2, 0.1, -0.1], [0.2, 0.8, 0.6])
    ]
    assert "odometry without drift of the odometry, 0.30 [" in figures.summary[0]
    assert "wheels" not in figures.summary[0]


@pytest.mark.parametrize("command", [["leaderboard", "--add"], ["submit", "check"]])
def test_the_folder_is_refused_as_a_result_of_labnav(folder, command, capsys):
    assert main([*command, str(folder[0])]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "summary.json" in message


def test_rows_without_a_nuisance_are_no_rows_of_labnav(folder, tmp_path, capsys):
    summary = {"schema": "labgym.labnav-summary/1"}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "episodes.jsonl").write_bytes((folder[0] / "rows.jsonl").read_bytes())
    assert main(["leaderboard", "--add", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_task_or_a_level_that_does_not_exist_is_refused():
    with pytest.raises(UnknownNameError, match="labnav-val-fly-2"):
        nuisance_study("still", ("fly",))
    with pytest.raises(UnknownNameError, match="labnav-val-aisle-4"):
        nuisance_study("still", ("aisle",), level=4)
