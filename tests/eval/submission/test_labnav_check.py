"""Honest LabNav results pass the check; results that somebody changed do not, even if they are signed again."""

from __future__ import annotations

import shutil

import pytest
from labnav_submissions import LabNavFolder
from labnav_suites import draw_suite

from labgym.cli import main
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.submission.check import check_submission


@pytest.fixture(scope="module")
def suite():
    """Two episodes of `people` and two of `moved`, cut after 3 s."""
    parts = tuple(draw_suite(task, 2, "floors-val", 1, 2, seed=3) for task in ("people", "moved"))
    return LabNavSuite("labnav-val", parts, seconds=3.0)


@pytest.fixture(scope="module")
def honest(suite, tmp_path_factory):
    folder = tmp_path_factory.mktemp("honest") / "straight"
    evaluate("straight", suite, out=folder, progress=False, kernels="pinned")
    return folder


@pytest.fixture
def submission(honest, tmp_path):
    shutil.copytree(honest, tmp_path / "submission")
    return LabNavFolder(tmp_path / "submission")


def problems(submission, suite, **arguments):
    verdict = check_submission(submission.folder, suite=suite, **{"drive": False, "progress": False, **arguments})
    assert all("\n" not in problem and len(problem) < 600 for problem in verdict.problems)
    return verdict.problems


def test_an_honest_result_passes_with_all_of_it_driven_again(submission, suite):
    verdict = check_submission(submission.folder, seed=3, suite=suite, progress=False)
    assert verdict.problems == ()
    assert verdict.facts == (
        "4 of 4 episodes of suite labnav-val checked",
        "all 4 episodes driven again with 'straight'",
    )
    without = check_submission(submission.folder, suite=suite, drive=False, progress=False)
    assert without.passed
    assert "the policy itself is not verified" in without.facts[-1]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"score": 0.9}, "score is 0.9, recomputed 0"),
        ({"success": True}, "success is True, but the drive ended by"),
        ({"shortest": 1.0}, "shortest is 1.0, expected"),
        ({"floor_hash": "0" * 64}, "floor_hash is"),
        ({"seed": 7}, "seed is 7, expected 0"),
        ({"track": "privileged"}, "track is 'privileged', expected 'mapless'"),
        ({"path_length": 0.0}, "path_length is 0.000 m, but its route is at least"),
        ({"final_distance": 0.01}, "final_distance is 0.010 m, but its route ends"),
        ({"steps": 3}, "poses, expected 4 for 3 steps"),
        ({"outcomes": {}}, "outcomes do not have what the score of"),
    ],
)
def test_a_changed_row_is_named_even_if_the_folder_is_signed_again(submission, suite, fields, message):
    submission.change(lambda rows, _: rows[0].update(fields))
    found = problems(submission, suite)
    assert any(message in problem for problem in found), found
    assert all("manifest" not in problem for problem in found)


def test_a_jump_in_a_route_is_found(submission, suite):
    def jump(rows, routes):
        quiet = next(number for number, row in enumerate(rows) if not row["contacts"])
        routes[quiet]["poses"][5][0] += 0.5

    submission.change(jump)
    assert any("which the robot cannot drive in 0.1 s" in problem for problem in problems(submission, suite))


def test_a_missing_a_foreign_and_a_repeated_episode_are_named(submission, suite):
    def change(rows, routes):
        rows[1]["number"] = 77
        rows.append(dict(rows[0]))
        routes.pop(2)

    submission.change(change)
    found = " ".join(problems(submission, suite))
    assert "/77 is not in suite labnav-val" in found
    assert "has no row" in found
    assert "has no route" in found
    assert "repeats the episode" in found


def test_a_drive_that_did_not_happen_differs_when_it_is_driven_again(submission, suite):
    def faster(rows, routes):
        for row in rows:
            row["contacts"] = row["contacts"] + 1 if row["contacts"] < row["steps"] else row["contacts"] - 1

    submission.change(faster)
    assert problems(submission, suite) == ()
    found = problems(submission, suite, drive=True, seed=1)
    assert found
    assert all("driven again differs: contacts" in problem for problem in found)


def test_a_summary_that_its_rows_do_not_give_is_named(submission, suite):
    summary = submission.document("summary.json")
    summary["tasks"][0]["score"]["value"] = 0.99
    submission.write("summary.json", summary)
    submission.sign()
    assert any("does not match the rows in score of people-2" in problem for problem in problems(submission, suite))


def test_unsigned_changes_and_other_episodes_are_named(submission, suite):
    with (submission.folder / "episodes.jsonl").open("a") as stream:
        stream.write("{}\n")
    found = " ".join(problems(submission, suite))
    assert "episodes.jsonl was changed after the run" in found
    assert "line 5 cannot be read" in found
    other = LabNavSuite("labnav-val", suite.parts[:1], seconds=3.0)
    assert any("its episodes have the hash" in problem for problem in problems(submission, other))


def test_the_command_checks_folders_of_labnav(submission, capsys):
    assert main(["submit", "check", str(submission.folder), "--no-drive"]) == 1
    printed = capsys.readouterr()
    assert "its episodes have the hash" in printed.out + printed.err
