"""Honest results pass the check; results that somebody changed do not, even if everything is signed again."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from simulated_claims import problems_of_changes

from labgym.cli.app import main
from labgym.errors import DocumentError, OptionError
from labgym.eval.evaluator import evaluate
from labgym.eval.submission.check import Verdict, check_submission
from labgym.eval.submission.transition_claim import TransitionClaim
from labgym.layouts import load_published
from labgym.navigation import goal_pairs
from labgym.suites import Suite

Rows = list[dict[str, Any]]


def checked(submission: Any, suite_file: Path, **arguments: Any) -> Verdict:
    verdict = check_submission(
        submission.folder, suite=str(suite_file), **{"drive": False, "progress": False, **arguments}
    )
    assert all("\n" not in problem and len(problem) < 600 for problem in verdict.problems)
    return verdict


def failed(rows: Rows) -> int:
    return next(index for index, row in enumerate(rows) if not row["success"])


def succeeded(rows: Rows) -> int:
    return next(index for index, row in enumerate(rows) if row["success"] and row["path_length"] > 3.0)


def scored(row: dict[str, Any]) -> None:
    """Recompute the scores of a row from its other fields, by the definitions."""
    length, driven = row["shortest_path_length"], row["path_length"]
    initial = math.dist(row["start"][:2], row["goal"][:2])
    row["spl"] = row["success"] * length / max(length, driven)
    row["soft_spl"] = max(0.0, 1.0 - row["final_distance"] / initial) * length / max(length, driven)


@pytest.mark.slow
def test_an_honest_result_passes(submission, suite_file):
    verdict = checked(submission, suite_file, drive=True, seed=3)
    assert verdict.problems == ()
    assert verdict.passed
    assert verdict.facts[-1] == "all 22 episodes driven again with 'straight'"
    without = checked(submission, suite_file)
    assert without.passed
    assert "the policy itself is not verified" in without.facts[-1]


def test_an_honest_result_of_a_policy_of_ones_own_passes_with_that_policy(tmp_path, monkeypatch):
    suite_file = Suite(name="brief", split="test", layouts=("test-sub_01",), max_steps=15).save(tmp_path / "brief.json")
    (tmp_path / "own_policies.py").write_text(
        "import numpy as np\nfrom labgym.policies import Policy\n\n"
        "class Arc(Policy):\n"
        "    def __init__(self, turn: float = 0.1):\n        self.turn = turn\n"
        "    def reset(self, episode):\n        self.rng = episode.rng\n"
        "    def act(self, observation):\n        return np.array([self.rng.uniform(0.2, 1.0), self.turn])\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    folder = tmp_path / "arc"
    evaluate("own_policies:Arc", suite_file, out=folder, progress=False, options={"turn": 0.05}, seed=4)
    arguments = {"suite": str(suite_file), "progress": False, "seed": 0}
    with pytest.raises(OptionError, match=r"is not built in; pass the policy with --policy .* --no-drive"):
        check_submission(folder, **arguments)
    with pytest.raises(OptionError, match=r"turn=0\.05: pass them with --options"):
        check_submission(folder, policy="own_policies:Arc", **arguments)
    verdict = check_submission(folder, policy="own_policies:Arc", options={"turn": 0.05}, **arguments)
    assert verdict.problems == ()
    other = check_submission(folder, policy="own_policies:Arc", options={"turn": 0.06}, **arguments)
    assert any("driven again differs" in problem for problem in other.problems)
    assert any("parameters differ" in problem for problem in other.problems)


def change_success(rows: Rows, routes: Rows) -> None:
    row = rows[failed(rows)]
    row["success"] = True
    scored(row)


def change_success_and_distance(rows: Rows, routes: Rows) -> None:
    row = rows[failed(rows)]
    row["success"], row["final_distance"] = True, 0.45
    scored(row)


def teleport(rows: Rows, routes: Rows) -> None:
    """End a failed drive at the goal, with a row that agrees."""
    index = failed(rows)
    row, route = rows[index], routes[index]
    route["poses"] = [*route["poses"][:30], [round(value, 3) for value in row["goal"]]]
    points = np.array(route["poses"])[:, :2]
    row["final_distance"] = math.dist(points[-1], row["goal"][:2])
    row["success"], row["steps"], row["time"] = True, 30, 3.0
    row["contacts"] = min(row["contacts"], 3)
    row["path_length"] = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    scored(row)


def walk_through_walls(rows: Rows, routes: Rows) -> None:
    """Drive straight to the goal at a speed that the robot can reach, through whatever is in the way."""
    index = next(k for k, row in enumerate(rows) if not row["success"] and row["layout"] == "test-con_01")
    row, route = rows[index], routes[index]
    start, goal = np.array(row["start"]), np.array(row["goal"])
    length = float(np.linalg.norm(goal[:2] - start[:2])) - 0.45
    driven = [0.0]
    while driven[-1] < length:
        speed = min(1.0, 1.4 * 0.1 * len(driven))
        driven.append(min(length, driven[-1] + 0.1 * speed))
    along = (goal[:2] - start[:2]) / np.linalg.norm(goal[:2] - start[:2])
    points = start[:2] + np.outer(driven, along)
    route["poses"] = [[round(x, 3), round(y, 3), round(row["start"][2], 3)] for x, y in points]
    row["steps"] = len(points) - 1
    row["time"], row["success"], row["path_length"] = 0.1 * row["steps"], True, length
    row["final_distance"], row["contacts"] = float(np.linalg.norm(points[-1] - goal[:2])), 5
    row["min_clearance"] = 0.0
    scored(row)


def shorten_the_path(rows: Rows, routes: Rows) -> None:
    row = rows[succeeded(rows)]
    row["path_length"] *= 0.97
    scored(row)


def lengthen_the_shortest_path(rows: Rows, routes: Rows) -> None:
    row = rows[succeeded(rows)]
    row["shortest_path_length"] += 0.01
    scored(row)


def raise_spl(rows: Rows, routes: Rows) -> None:
    rows[succeeded(rows)]["spl"] = 0.999999


def drop_an_episode(rows: Rows, routes: Rows) -> None:
    index = failed(rows)
    del rows[index], routes[index]


def double_an_episode(rows: Rows, routes: Rows) -> None:
    index = succeeded(rows)
    rows.append(dict(rows[index]))
    routes.append(dict(routes[index]))


def replace_an_episode_by_a_double(rows: Rows, routes: Rows) -> None:
    good, bad = succeeded(rows), failed(rows)
    rows[bad], routes[bad] = dict(rows[good]), dict(routes[good])


def add_a_foreign_episode(rows: Rows, routes: Rows) -> None:
    rows.append({**rows[succeeded(rows)], "pair": 99})


def another_layout(rows: Rows, routes: Rows) -> None:
    for row in rows:
        if row["layout"] == "test-con_01":
            row["layout_hash"] = load_published("test", "test-alk_04").hash


def a_nearer_start(rows: Rows, routes: Rows) -> None:
    index = succeeded(rows)
    rows[index]["start"] = routes[index]["poses"][10]
    routes[index]["poses"] = routes[index]["poses"][10:]
    rows[index]["steps"] -= 10
    rows[index]["time"] = 0.1 * rows[index]["steps"]


def the_start_without_jitter(rows: Rows, routes: Rows) -> None:
    row = rows[succeeded(rows)]
    row["start"] = list(goal_pairs(load_published("test", row["layout"]))[row["pair"]].start)


def more_clearance(rows: Rows, routes: Rows) -> None:
    rows[succeeded(rows)]["min_clearance"] += 0.01


def fewer_seconds(rows: Rows, routes: Rows) -> None:
    rows[succeeded(rows)]["time"] -= 0.5


def an_early_end(rows: Rows, routes: Rows) -> None:
    """Stop a failed drive in the middle."""
    index = failed(rows)
    row, route = rows[index], routes[index]
    away = np.linalg.norm(np.array(route["poses"])[:, :2] - row["goal"][:2], axis=1)
    half = row["steps"] // 2
    route["poses"] = route["poses"][: half + 1]
    row["steps"], row["time"] = half, 0.1 * half
    row["final_distance"] = float(away[half])
    scored(row)


def too_many_contacts(rows: Rows, routes: Rows) -> None:
    row = next(row for row in rows if row["contacts"] == 0)
    row["contacts"] = 3


def other_seeds(rows: Rows, routes: Rows) -> None:
    rows[0]["seed"] = 5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (change_success, r"success True, now False"),
        (change_success_and_distance, r"differs: success True, now False, .*, and final_distance"),
        (teleport, r"differs: success True, now False, .*steps, time"),
        (walk_through_walls, r"simulated again differs: success True, now False"),
        (shorten_the_path, r"path_length .*, now"),
        (lengthen_the_shortest_path, r"shortest_path_length .*, now"),
        (raise_spl, r"spl 0.999999, now"),
        (drop_an_episode, r"has no row and no route"),
        (double_an_episode, r"episodes.jsonl line \d+ repeats the episode"),
        (replace_an_episode_by_a_double, r"has no row and no route"),
        (add_a_foreign_episode, r"/99/\d is not in suite"),
        (another_layout, r"test-con_01/0/0 simulated again differs: layout_hash"),
        (a_nearer_start, r"start .*, now"),
        (the_start_without_jitter, r"start .*, now"),
        (more_clearance, r"min_clearance .*, now"),
        (fewer_seconds, r"time .*, now"),
        (an_early_end, r"steps 100, now 200"),
        (too_many_contacts, r"contacts 3, now 0"),
        (other_seeds, r"seed 5, now 0"),
    ],
)
def test_a_changed_result_fails_although_it_is_signed_again(
    submission: Any, honest: Path, suite_file: Path, change: Callable[[Rows, Rows], None], message: str
) -> None:
    submission.change(change)
    found = problems_of_changes(*(TransitionClaim(folder, str(suite_file)) for folder in (submission.folder, honest)))
    assert any(re.search(message, problem) for problem in found), found


def test_a_file_that_was_changed_after_the_run_is_named(submission, suite_file):
    rows = submission.rows()
    rows[0]["contacts"] += 0
    submission.write("episodes.jsonl", [dict(sorted(row.items())) for row in rows])
    assert checked(submission, suite_file).problems == (
        "episodes.jsonl was changed after the run: its hash is not the one in manifest.json",
    )


def test_a_summary_that_does_not_match_the_rows_is_named(submission, suite_file):
    metrics = submission.document("summary.json")["metrics"]
    metrics["success"]["value"] = 1.0
    submission.change_document("summary.json", metrics=metrics)
    assert checked(submission, suite_file).problems == ("summary.json does not match the rows in success",)
    submission.change_document("summary.json", metrics=metrics, expected=17, episodes=17)
    problems = checked(submission, suite_file).problems
    assert any("expected is 17, but the suite has" in problem for problem in problems)


@pytest.mark.parametrize("name", ["episodes.jsonl", "routes.jsonl", "summary.json"])
def test_a_number_that_is_not_finite_is_a_problem(submission, suite_file, name):
    path = submission.folder / name
    text = path.read_text()
    for before in ('"path_length": ', '"poses": [[', '"value": '):
        if before in text:
            start = text.index(before) + len(before)
            end = min(text.index(mark, start) for mark in (",", "\n") if mark in text[start:])
            text = text[:start] + "NaN" + text[end:]
            break
    path.write_text(text)
    submission.sign()
    problems = checked(submission, suite_file).problems
    assert any(name in problem and "not finite" in problem for problem in problems), problems


@pytest.mark.slow
def test_a_swapped_policy_is_found_by_driving_again(submission, suite_file):
    """Results of straight under the name of another policy, everywhere."""
    run = submission.document("run.json")
    run["inputs"]["policy"]["label"] = "dwa"
    submission.write("run.json", run)
    submission.write("summary.json", {**submission.document("summary.json"), "policy": "dwa"})
    submission.change(lambda rows, routes: [row.update(policy="dwa") for row in rows] and None)
    assert checked(submission, suite_file).passed
    problems = checked(submission, suite_file, drive=True, seed=1).problems
    assert any("driven again differs" in problem for problem in problems)
    assert any("the policy's place" in problem for problem in problems)


def test_a_policy_renamed_in_one_place_is_found_without_driving(submission, suite_file):
    submission.change_document("summary.json", policy="astar")
    problems = checked(submission, suite_file).problems
    assert "run.json and summary.json differ in policy" in problems
    assert any("policy 'straight', now 'astar'" in problem for problem in problems)


def test_a_privileged_policy_cannot_pass_for_an_ordinary_one(submission, suite_file):
    submission.change_document("summary.json", privileged=True)
    problems = checked(submission, suite_file, drive=True, seed=0).problems
    assert "privileged of the policy is False, the submission says True" in problems


def test_results_of_other_code_fail_unless_they_are_accepted(submission, suite_file):
    submission.write("run.json", {**submission.document("run.json"), "code": "0" * 64})
    submission.sign()
    (problem,) = checked(submission, suite_file).problems
    assert "driven by other code (000000000000)" in problem
    assert checked(submission, suite_file, other_code=True).passed


def test_a_suite_that_is_not_published_or_differs_fails(submission, suite_file):
    problems = check_submission(submission.folder, drive=False).problems
    published = "floors-seen, floors-test, floors-val, navdp_compat, test, val"
    assert problems == (f"published suite 'mini' not found; available: {published}",)
    suite = {**submission.document("summary.json")["suite"], "max_steps": 400}
    submission.change_document("summary.json", suite=suite)
    problems = checked(submission, suite_file).problems
    assert any("differs from the published mini/1 in max_steps" in problem for problem in problems)


def test_missing_documents_and_provenance_are_problems(submission, suite_file):
    for name in ("run.json", "manifest.json", "provenance.jsonl"):
        (submission.folder / name).unlink()
    problems = checked(submission, suite_file).problems
    assert len(problems) == 3
    with pytest.raises(DocumentError, match=r"holds no summary\.json"):
        check_submission(submission.folder.parent)


def test_the_exit_code_tells_pass_fail_and_bad_input(submission, suite_file, capsys, tmp_path):
    folder, suite = str(submission.folder), ["--suite", str(suite_file)]
    assert main(["submit", "check", folder, *suite, "--seed", "7"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "passes"
    submission.change(change_success)
    assert main(["submit", "check", folder, *suite, "--no-drive"]) == 1
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-1].startswith("fails: ")
    assert "labgym: failed: episode " in captured.err
    assert main(["submit", "check", str(tmp_path / "nothing")]) == 2


def test_a_packed_submission_passes_the_check_and_has_its_text(submission, suite_file, capsys, tmp_path):
    (submission.folder / "report.html").write_text("a page")
    out = tmp_path / "submissions" / "mini"
    assert main(["submit", "pack", str(submission.folder), "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(out), f"{out}.md"]
    assert not (out / "report.html").exists()
    assert main(["submit", "check", str(out), "--suite", str(suite_file), "--seed", "7"]) == 0
    text = out.with_name("mini.md").read_text()
    assert f"labgym submit check {out.as_posix()}" in text
    assert "{" not in text
    assert main(["submit", "pack", str(submission.folder), "--out", str(out)]) == 2


CHECK_ALL = """
import resource, sys
from labgym.eval.submission.check import check_submission
resource.setrlimit(resource.RLIMIT_AS, (8 * 2**30, 8 * 2**30))
for folder in sys.argv[2:]:
    problems = check_submission(folder, suite=sys.argv[1], drive=False).problems
    assert 0 < len(problems) < 100, (folder, len(problems))
    assert all(len(line) < 600 and line.isprintable() for line in problems), (folder, problems)
# Not ru_maxrss, which begins with the memory of the process that started this one.
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(int(status["VmHWM"].split()[0]) // 1024)
"""


HOSTILE = {
    "many lines": lambda folder: (folder / "episodes.jsonl").write_text("{}\n" * 3_000_000),
    "one long line": lambda folder: (folder / "routes.jsonl").write_text("[" * 50_000_000),
    "deep": lambda folder: (folder / "episodes.jsonl").write_text("[" * 100_000 + "\n"),
    "a long list": lambda folder: (folder / "routes.jsonl").write_text(
        '{"layout": "a", "pair": 0, "poses": [' + "[]," * 900_000 + "[]]}\n"
    ),
    "a pipe": lambda folder: ((folder / "episodes.jsonl").unlink(), os.mkfifo(folder / "episodes.jsonl")),
    "a device": lambda folder: (
        (folder / "routes.jsonl").unlink(),
        (folder / "routes.jsonl").symlink_to("/dev/zero"),
    ),
    "many actions": lambda folder: (folder / "actions.jsonl").write_text(
        '{"layout": "test-con_01", "pair": 0, "repeat": 0, "actions": {"stops": false, "drives": [[9e99, ""]], '
        '"data": "' + "AAAA" * 900_000 + '"}}\n'
    ),
    "a huge file": lambda folder: os.truncate(folder / "episodes.jsonl", 5 * 2**30),
    "bytes": lambda folder: (folder / "provenance.jsonl").write_bytes(os.urandom(3_000_000)),
    "text": lambda folder: (folder / "manifest.json").write_text('"manifest"'),
    "odd types": lambda folder: (folder / "routes.jsonl").write_text(
        '{"layout": {}, "pair": [], "poses": 3}\n{"layout": "a", "pair": 1e400, "poses": [[1, 2, "x"]]}\n'
    ),
}


def test_hostile_folders_are_refused_within_bounds(honest, suite_file, tmp_path):
    folders = []
    for index, change in enumerate(HOSTILE.values()):
        folders.append(tmp_path / str(index))
        shutil.copytree(honest, folders[-1])
        change(folders[-1])
    run = subprocess.run(
        [sys.executable, "-c", CHECK_ALL, str(suite_file), *map(str, folders)], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr[-2000:]
    assert int(run.stdout) < 1024


def test_no_class_that_the_folder_names_is_imported(submission, suite_file, tmp_path, monkeypatch):
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')\nclass Policy: pass\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    summary = submission.document("summary.json")
    for policy, options in (
        ("evil:Policy", {}),
        ("evil.onnx", {}),
        ("http://127.0.0.1:1/", {}),
        ("iplanner", {"weights": str(tmp_path)}),
        ("straight", {"options": {"lookahead": {"x": "y"}}}),
    ):
        submission.write("summary.json", {**summary, "policy": policy, "options": options})
        with pytest.raises(OptionError, match="--policy"):
            checked(submission, suite_file, drive=True)
    assert "evil" not in sys.modules
