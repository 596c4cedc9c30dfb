"""Honest LabNav results pass the check; results that somebody changed do not, even if they are signed again."""

from __future__ import annotations

import base64
import math
import shutil
from collections import Counter

import numpy as np
import pytest
from labnav_submissions import LabNavFolder
from simulated_claims import problems_of_changes

from labgym.cli import main
from labgym.eval.driving.actions import StoredActions
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.submission.check import (
    check_submission,
    drawn_again,
    driven_again,
    foreign_rows,
    simulated_problems,
    unseen,
)
from labgym.eval.submission.labnav_claim import LabNavClaim
from labgym.eval.submission.record_checks import box_problems
from labgym.policies import Policy
from labgym.policies.process.box import BUILT_IN_CODE
from labgym.runs.identity import RunIdentity

TASKS = ("people", "moved", "carry", "shift")


@pytest.fixture(scope="module")
def suite():
    """An episode of each of four tasks, cut after 2 s."""
    parts = tuple(load_labnav(f"labnav-val-{task}").parts[0].first(1, 1) for task in TASKS)
    return LabNavSuite("labnav-val", parts, seconds=2.0)


@pytest.fixture(scope="module")
def driven(suite, tmp_path_factory):
    """Return the folder of a built-in policy."""
    folders = {}

    def folder_of(policy):
        if policy not in folders:
            folders[policy] = tmp_path_factory.mktemp("honest") / policy
            evaluate(policy, suite, out=folders[policy], progress=False, kernels="pinned")
        return folders[policy]

    return folder_of


@pytest.fixture
def submission(driven, tmp_path):
    shutil.copytree(driven("straight"), tmp_path / "submission")
    return LabNavFolder(tmp_path / "submission")


def problems(submission, suite, **arguments):
    verdict = check_submission(submission.folder, suite=suite, **{"drive": False, "progress": False, **arguments})
    assert all("\n" not in problem and len(problem) < 600 for problem in verdict.problems)
    return verdict.problems


@pytest.fixture
def simulated(driven, submission, suite):
    """Return what files say of themselves, and what simulations say of the episodes that were changed."""

    def found():
        claims = [LabNavClaim(folder, suite) for folder in (submission.folder, driven("straight"))]
        return problems_of_changes(*claims)

    return found


@pytest.mark.parametrize("policy", ["straight", "astar"])
def test_an_honest_result_passes_with_all_of_it_driven_again(driven, suite, policy):
    verdict = check_submission(driven(policy), seed=3, suite=suite, progress=False)
    assert verdict.problems == ()
    assert verdict.facts[:2] == (
        "4 of 4 episodes of suite labnav-val checked",
        "4 episodes simulated again with their actions, without the policy",
    )
    assert verdict.facts[-1] == f"all 4 episodes driven again with {policy!r}"
    without = check_submission(driven(policy), suite=suite, drive=False, progress=False)
    assert without.passed
    assert "the policy itself is not verified" in without.facts[-1]


def test_rows_that_their_actions_do_not_give_are_no_result_to_publish(submission, suite, capsys, monkeypatch):
    assert simulated_problems(submission.folder, suite, progress=False) == []
    submission.change(lambda rows, _: rows[0].update(time=rows[0]["time"] + 0.1))
    (problem,) = simulated_problems(submission.folder, suite, progress=False)
    assert "simulated again differs: time" in problem
    monkeypatch.setattr("labgym.eval.leaderboard.labnav.LabNavResult.of", lambda folder: None)
    monkeypatch.setattr("labgym.eval.submission.labnav_claim.load_labnav", lambda name: suite)
    assert main(["leaderboard", "--add", str(submission.folder)]) == 2
    assert "simulated again differs: time" in capsys.readouterr().err


@pytest.mark.parametrize("place", [{"a": 1}, ["astar"], 3, None])
def test_a_policy_whose_place_is_no_text_is_not_built_in(place):
    identity = RunIdentity(kind="labnav", inputs={"policy": {"place": place}}, code="0" * 64)
    (problem,) = box_problems(identity, BUILT_IN_CODE)
    assert str(place) in problem


class Failing(Policy):
    """Fails in some episodes at once, in others after some steps, and in some never; it stops if it can."""

    def reset(self, episode):
        self._left = int(abs(episode.goal[0]) * 1000.0) % 3 * 7
        if not self._left:
            raise ValueError("no way")

    def act(self, observation):
        self._left -= 1
        if not self._left:
            raise ValueError("lost")
        return np.array([0.3, 0.1])


class Stopping(Failing):
    """Stops in its first drives."""

    def stop(self, observation):
        return self._left == 5


@pytest.mark.parametrize("policy", [Failing(), Stopping()])
def test_the_drives_of_a_policy_that_fails_are_simulated_as_they_were(suite, tmp_path, policy):
    report = evaluate(policy, suite, out=tmp_path / "failing", progress=False, kernels="pinned", latency=0.2)
    ends = Counter(row.ending for row in report.rows)
    assert ends["error"]
    assert problems(LabNavFolder(tmp_path / "failing"), suite) == ()


def test_the_actions_of_an_episode_are_exact_and_compact():
    taken = [[np.array([math.pi * k, -1.0 / (k + 1)], np.float32) for k in range(count)] for count in (5, 0, 3)]

    class Tape:
        drives, ends = taken, ["stop", "", "error"]

    actions = StoredActions.of(Tape(), stops=True)
    again = StoredActions.model_validate_json(actions.model_dump_json())
    assert again.drives == ((5, "stop"), (0, ""), (3, "error"))
    for one, drive in zip(again.arrays(), taken, strict=True):
        assert one.dtype == np.float32
        assert one.tobytes() == np.array(drive, np.float32).tobytes()


def outcome(name, **fields):
    """Return a change of the outcomes of the first row that has these."""

    def change(rows, _):
        row = next(row for row in rows if name in row["outcomes"])
        row["outcomes"][name].update(fields)

    return change


def field(**fields):
    return lambda rows, _: rows[0].update(fields)


def a_jump(rows, routes):
    routes[0]["poses"][5][0] += 0.5


def by_a_millimeter(rows, routes):
    routes[-1]["poses"][7][1] += 0.001


def through_the_wall(rows, routes):
    """Make the route a straight line of as many steps, to an end near the goal."""
    poses, steps = routes[0]["poses"], rows[0]["steps"]
    (x, y, yaw), (dx, dy) = poses[0], (0.05, 0.02)
    routes[0]["poses"] = [[round(x + dx * k, 3), round(y + dy * k, 3), yaw] for k in range(steps + 1)]


def pushed(rows, _):
    row = next(row for row in rows if (row["outcomes"].get("changes") or {}).get("pushed"))
    thing = next(iter(row["outcomes"]["changes"]["pushed"].values()))
    thing.update(way=thing["way"] + 0.01, touched=True)


def a_shorter_drive(rows, _):
    row = next(row for row in rows if row["legs"])
    row["legs"][0]["path_length"] *= 0.9


def of_another_episode(rows, routes):
    routes[0]["poses"] = routes[2]["poses"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (field(score=0.9), "score 0.9, now 0"),
        (field(success=True, ending="success"), "success True, now False"),
        (field(shortest=1.0), "shortest 1, now"),
        (field(floor_hash="0" * 64), "floor_hash '0000"),
        (field(seed=7), "seed 7, now 0"),
        (field(track="privileged"), "track 'privileged', now 'mapless'"),
        (field(path_length=0.0), "path_length 0, now"),
        (field(final_distance=0.01), "final_distance 0.01, now"),
        (field(time=1.0, steps=10), "steps 10, now"),
        (field(delay=2), "delay 2, now 0"),
        (field(waited=0.5), "waited 0.5, now"),
        (field(outcomes={}), "outcomes {}, now"),
        (outcome("people", close_seconds=0.005), "outcomes"),
        (outcome("people", least_distance=1.234), "outcomes"),
        (outcome("payload", highest=0.001), "outcomes"),
        (pushed, "outcomes"),
        (a_shorter_drive, "legs"),
        (a_jump, "has another route from step 5"),
        (by_a_millimeter, "has another route from step 7"),
        (through_the_wall, "has another route from step 1"),
        (of_another_episode, "has another route from step 0"),
    ],
)
def test_a_forged_row_or_route_is_named_by_a_simulation(submission, simulated, change, message):
    submission.change(change)
    found = simulated()
    assert found
    assert all("simulated again" in problem and message in problem for problem in found), found


def encoded(actions):
    return base64.b64encode(np.asarray(actions, "<f4").tobytes()).decode()


def first(line):
    return StoredActions.model_validate(line["actions"])


def other_actions(lines):
    (moved, *_) = arrays = first(lines[0]).arrays()
    moved[len(moved) // 2] += 0.01
    lines[0]["actions"]["data"] = encoded(np.concatenate(arrays))


def fewer_actions(lines):
    (moved,) = first(lines[0]).arrays()
    lines[0]["actions"].update(drives=[[len(moved) - 4, ""]], data=encoded(moved[:-4]))


def more_actions(lines):
    (moved,) = first(lines[0]).arrays()
    lines[0]["actions"].update(drives=[[len(moved) + 1, ""]], data=encoded([*moved, (0, 0)]))


def another_drive(lines):
    lines[0]["actions"]["drives"].append([0, ""])


def of_another(lines):
    lines[0]["actions"] = lines[2]["actions"]


def data(text):
    return lambda lines: lines[0]["actions"].update(data=text)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (other_actions, "simulated again"),
        (fewer_actions, "drive 0 goes on after its"),
        (more_actions, "drive 0 ends after"),
        (another_drive, "drive 1, which has actions, does not begin"),
        (of_another, "simulated again"),
        (data(""), "data are not those of"),
        (data("*"), "data are not in base64"),
        (data("\u00e9"), "data are not in base64"),
        (data(encoded([(0, 0)])), "data are not those of"),
        (lambda lines: lines[0]["actions"].update(drives=[[10**12, ""]] * 3), "data are not those of"),
        (data("A" * 2**23), "actions.jsonl line 1 cannot be read"),
        (lambda lines: lines[0]["actions"].update(drives=[[-1, ""]]), "actions.jsonl line 1 cannot be read"),
        (lambda lines: lines[0]["actions"].update(drives=[[1, ""]], data=encoded([(math.nan, 0)])), "not finite"),
        (lambda lines: lines.pop(0), "has no actions"),
        (lambda lines: lines[0].update(key="aisle-2/nowhere/0"), "is not in suite"),
    ],
)
def test_actions_that_are_broken_or_not_those_of_the_row_are_named(submission, simulated, change, message):
    submission.change_actions(change)
    found = simulated()
    assert len(found) <= 4
    assert any(message in problem for problem in found), found


def test_a_result_without_its_actions_is_refused(submission, suite):
    whole = (submission.folder / "actions.jsonl").read_bytes()
    (submission.folder / "actions.jsonl").write_bytes(whole[:-200])
    found = problems(submission, suite)
    assert any("actions.jsonl was changed after the run" in problem for problem in found)
    assert any("actions.jsonl line 4 cannot be read" in problem for problem in found)
    (submission.folder / "actions.jsonl").unlink()
    assert "actions.jsonl is missing" in problems(submission, suite)


def test_actions_of_another_policy_simulate_and_are_found_by_driving_again(driven, submission, suite):
    """Everything is that of `astar`; the names are those of `straight`."""
    other = LabNavFolder(driven("astar"))
    for name in ("routes.jsonl", "actions.jsonl"):
        shutil.copy(other.folder / name, submission.folder / name)
    names = {"policy": "straight", "track": "mapless"}
    submission.change(
        lambda rows, _: rows.__setitem__(slice(None), [row | names for row in other.lines("episodes.jsonl")])
    )
    assert problems(submission, suite) == ()
    found = problems(submission, suite, drive=True, seed=1)
    assert found
    assert all("driven again" in problem for problem in found)


def test_changed_rows_and_actions_fail_the_check_although_the_folder_is_signed_again(submission, suite):
    submission.change(field(score=0.9))
    submission.change_actions(lambda lines: fewer_actions(lines[1:]))
    found = problems(submission, suite)
    assert len(found) == 2
    assert all("simulated again differs" in problem for problem in found)


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


@pytest.mark.parametrize(("name", "value"), [("latency", 1e9), ("latency", -1.0), ("seed", -1), ("seed", 2**70)])
def test_terms_out_of_range_are_refused_before_anything_is_simulated(submission, suite, name, value):
    submission.write("summary.json", {**submission.document("summary.json"), name: value})
    submission.sign()
    (problem,) = problems(submission, suite)
    assert f"summary.json: field {name}" in problem


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
    other = LabNavSuite("labnav-val", suite.parts[:1], seconds=2.0)
    assert any("its episodes have the hash" in problem for problem in problems(submission, other))


def test_the_command_checks_folders_of_labnav(submission, capsys):
    assert main(["submit", "check", str(submission.folder), "--no-drive"]) == 1
    printed = capsys.readouterr()
    assert "its episodes have the hash" in printed.out + printed.err


def test_all_of_at_most_60_rows_are_driven_again_and_of_more_as_many_as_find_two_percent():
    for count, again in ((3, 3), (60, 60), (61, 61), (129, 116), (960, 205), (2400, 218)):
        keys = [str(number) for number in range(count)]
        assert len(drawn_again(keys, 0)) == again
        assert drawn_again(keys, 0) == tuple(sorted(drawn_again(keys, 0), key=int))
    assert drawn_again(keys, 0) != drawn_again(keys, 1)


def test_the_sample_is_the_smallest_that_finds_foreign_rows_in_99_of_100_results():
    for count in (61, 100, 120, 129, 500, 960, 2400):
        again = len(drawn_again([str(number) for number in range(count)], 0))
        assert unseen(count, again) <= 0.01 < unseen(count, again - 1)
    # Two foreign rows of 129, 116 driven again: 13/129 * 12/128.
    assert foreign_rows(129) == 2
    assert unseen(129, 116) == pytest.approx(13 / 129 * 12 / 128)
    drawn = np.random.default_rng(0)
    foreign = range(foreign_rows(960))
    missed = sum(min(drawn.choice(960, 205, replace=False)) not in foreign for _ in range(4000))
    assert 15 <= missed <= 65
    assert "are not the policy's, one is found with a probability of 99" in driven_again(205, 960, "straight", 4)
    assert driven_again(24, 24, "straight", 4) == "all 24 episodes driven again with 'straight'"
