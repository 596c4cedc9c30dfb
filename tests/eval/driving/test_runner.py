from __future__ import annotations

import json
import math
import threading
from pathlib import Path

import numpy as np
import pytest
from episode_rows import read_routes
from laboratories import small_laboratory

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.eval.driving.drive import drive_layout, drive_pair
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import read_rows
from labgym.eval.evaluator import evaluate
from labgym.geometry import rotate
from labgym.layouts import Layout
from labgym.navigation import goal_pairs, shortest_path
from labgym.policies import EpisodeStart, Policy, make_policy
from labgym.protocols import get
from labgym.suites import Suite, suite_of

POLICIES = '''
import numpy as np
from labgym.policies import Policy

class Shy(Policy):
    """Fails in every second drive."""

    def reset(self, episode):
        self.fail = episode.rng.integers(2) == 0

    def act(self, observation):
        if self.fail:
            raise RuntimeError("no\\nthanks")
        return np.array([0.1, 0.2])

class Leaky(Policy):
    """Remembers what it should forget, and gives up early."""

    def __init__(self):
        self.count = 0

    def reset(self, episode):
        self.count += 1
        self.rng = episode.rng
        self.left = 40

    def act(self, observation):
        self.left -= 1
        return np.array([0.02 * self.count, self.rng.uniform(-1.0, 1.0)]) if self.left else None
'''


@pytest.fixture(scope="module")
def layouts() -> tuple[Layout, ...]:
    return small_laboratory("first"), small_laboratory("second", 0.2), small_laboratory("third", -0.15)


def brief(layouts) -> dict[str, object]:
    """Return the arguments of an evaluation of 6 s per drive, of policies that would drive on to the limit."""
    return {"suite": suite_of(layouts).model_copy(update={"max_steps": 60}), "layouts": layouts, "progress": False}


@pytest.fixture
def users_module(tmp_path, monkeypatch) -> str:
    (tmp_path / "users_policies.py").write_text(POLICIES)
    monkeypatch.syspath_prepend(tmp_path)
    return "users_policies"


class Listener(Policy):
    """Drives in an arc and keeps what it is printed."""

    def __init__(self) -> None:
        self.starts: list[EpisodeStart] = []
        self.heard: list[dict[str, np.ndarray]] = []

    def reset(self, episode: EpisodeStart) -> None:
        self.starts.append(episode)

    def act(self, observation):
        self.heard.append({name: np.array(value) for name, value in observation.items()})
        return np.array([0.4, 0.3])


def numbers(report: TransitionEvaluation) -> list[dict[str, object]]:
    return [row.model_dump() for row in report.rows]


@pytest.fixture(scope="module")
def astar_report(layouts, tmp_path_factory) -> tuple[TransitionEvaluation, Path]:
    folder = tmp_path_factory.mktemp("astar")
    return evaluate("astar", layouts, out=folder, progress=False), folder


def test_every_goal_pair_of_every_layout_is_driven_once(astar_report, layouts):
    report, _ = astar_report
    expected = [(layout.id, pair.index, pair.start, pair.goal) for layout in layouts for pair in goal_pairs(layout)]
    assert [(row.layout, row.pair, row.start, row.goal) for row in report.rows] == expected
    assert (report.summary.episodes, report.summary.expected, report.summary.complete) == (9, 9, True)


def test_astar_with_the_map_arrives_untouched_on_a_nearly_shortest_path(astar_report):
    report, _ = astar_report
    assert report["success"] == 1.0
    assert report["spl"] >= 0.97
    assert report["collision_free"] == 1.0
    assert report.summary.privileged


def test_a_row_agrees_with_the_route_and_the_layout(astar_report, layouts):
    report, _ = astar_report
    by_id = {layout.id: layout for layout in layouts}
    for row in report.rows:
        route = np.array(report.routes[row.key])
        assert len(route) == row.steps + 1
        assert row.time == pytest.approx(0.1 * row.steps)
        assert route[0] == pytest.approx(row.start, abs=1e-3)
        assert math.dist(route[-1][:2], row.goal[:2]) == pytest.approx(row.final_distance, abs=2e-3)
        assert row.final_distance <= 0.5
        chords = float(np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1).sum())
        assert row.path_length == pytest.approx(chords, rel=0.02, abs=0.01)
        exact = shortest_path(by_id[row.layout], row.start, row.goal).length
        assert row.shortest_path_length == pytest.approx(exact)
        assert row.spl == pytest.approx(exact / max(exact, row.path_length))
        initial = math.dist(row.start[:2], row.goal[:2])
        progress = 1.0 - row.final_distance / initial
        assert row.soft_spl == pytest.approx(progress * exact / max(exact, row.path_length))
        assert row.layout_hash == by_id[row.layout].hash


def test_the_folder_holds_rows_routes_and_a_summary_that_say_the_same(astar_report):
    report, folder = astar_report
    assert read_rows(folder / "episodes.jsonl") == report.rows
    assert read_routes(folder / "routes.jsonl") == report.routes
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["schema"] == "labgym.navigation-summary/2"
    assert summary["metrics"]["success"]["value"] == 1.0
    provenance = json.loads((folder / "provenance.jsonl").read_text().splitlines()[-1])
    assert provenance["versions"]["labgym"]
    assert TransitionEvaluation.read(folder).times == report.times
    assert report.metrics["planning_ms"].count == 9


def test_the_numbers_do_not_depend_on_the_number_of_workers(astar_report, layouts, users_module):
    assert numbers(evaluate("astar", layouts, workers=2, progress=False)) == numbers(astar_report[0])
    alone = evaluate(f"{users_module}:Leaky", layouts[:2], workers=1, progress=False, seed=3)
    together = evaluate(f"{users_module}:Leaky", layouts[:2], workers=2, progress=False, seed=3)
    assert numbers(alone) == numbers(together)
    assert len({row.path_length for row in alone.rows}) == 6
    assert alone.summary.metrics["soft_spl"] == together.summary.metrics["soft_spl"]


def test_a_seed_decides_what_is_random(layouts):
    first, again, other = (evaluate("random", **brief(layouts[:1]), seed=seed) for seed in (1, 1, 2))
    assert numbers(first) == numbers(again)
    assert [row.path_length for row in first.rows] != [row.path_length for row in other.rows]


@pytest.mark.slow
def test_an_object_can_be_evaluated_here_and_in_workers(layouts):
    here = evaluate(make_policy("astar"), layouts[:2], progress=False)
    there = evaluate(make_policy("astar"), layouts[:2], workers=2, progress=False)
    assert here.summary.policy == "astar"
    assert numbers(here) == numbers(there)


def test_a_policy_that_is_not_privileged_knows_its_odometry_and_the_goal_alone(layouts):
    policy = Listener()
    report = evaluate(policy, **brief(layouts[:1]), isolated=False)
    assert all(start.truth is None for start in policy.starts)
    first = policy.heard[0]
    assert set(first) == {"goal", "velocity", "lidar", "odometry"}
    assert first["odometry"] == pytest.approx([0.0, 0.0, 0.0])
    row = report.rows[0]
    goal = policy.starts[0].goal
    assert rotate(*goal, row.start[2]) == pytest.approx((row.goal[0] - row.start[0], row.goal[1] - row.start[1]))
    for step in (1, 7, 20):
        x, y, yaw = report.routes[row.key][step]
        dx, dy, turn = policy.heard[step]["odometry"]
        moved = rotate(dx, dy, row.start[2])
        assert (row.start[0] + moved[0], row.start[1] + moved[1]) == pytest.approx((x, y), abs=2e-3)
        assert math.cos(row.start[2] + turn - yaw) == pytest.approx(1.0, abs=1e-5)
        distance, cosine, sine = policy.heard[step]["goal"]
        ahead = rotate(goal[0] - dx, goal[1] - dy, -turn)
        assert ahead == pytest.approx((distance * cosine, distance * sine), abs=1e-3)


def test_a_privileged_policy_is_given_the_layout_and_the_pair(layouts):
    class Knowing(Listener):
        privileged = True

    policy = Knowing()
    evaluate(policy, **brief(layouts[:1]), isolated=False)
    assert [start.truth.pair for start in policy.starts] == list(goal_pairs(layouts[0]))
    assert policy.starts[0].truth.layout == layouts[0]


def test_a_policy_that_raises_fails_its_episode_and_no_other(layouts, users_module):
    report = evaluate(f"{users_module}:Shy", **brief(layouts))
    failed = [row for row in report.rows if row.error]
    assert 0 < len(failed) < len(report.rows) == 9
    assert report.summary.errors == len(failed)
    assert {row.error for row in failed} == {"RuntimeError: no thanks"}
    assert not any(row.success for row in failed)
    assert {row.spl for row in failed} == {0.0}


@pytest.mark.cases(3)
@pytest.mark.parametrize("action", [[0.0], [math.nan, 0.0], "left", None, [[0.0, 0.0]]])
def test_what_is_no_action_fails_the_episode_with_a_reason(layouts, action):
    class Odd(Listener):
        def act(self, observation):
            return action

    report = evaluate(Odd(), [layouts[0]], progress=False)
    assert all("expected two" in row.error for row in report.rows)


def test_a_policy_that_exits_fails_its_episode_and_not_the_evaluation(layouts):
    class Exiting(Still):
        def act(self, observation):
            raise SystemExit(7)

    report = evaluate(Exiting(), [layouts[0]], progress=False)
    assert {row.error for row in report.rows} == {"SystemExit: 7"}


def test_time_runs_out_where_the_suite_says(layouts):
    drives = drive_layout(make_policy("random"), layouts[0], Suite(name="brief", max_steps=5), "random", seed=0)
    assert {(drive.row.steps, drive.row.success, drive.row.suite) for drive in drives} == {(5, False, "brief/1")}


def test_arrival_is_where_the_suite_says(layouts):
    near, far = (
        drive_layout(make_policy("astar"), layouts[0], Suite(name="mine", success_distance=radius), "astar", seed=0)
        for radius in (0.2, 1.5)
    )
    for close, wide in zip(near, far, strict=True):
        assert close.row.success
        assert wide.row.success
        assert close.row.final_distance <= 0.2
        assert 1.3 < wide.row.final_distance <= 1.5


class Still(Policy):
    """Stands still; its weights are in a file."""

    weights: Path | None = None

    def reset(self, episode: EpisodeStart) -> None:
        pass

    def act(self, observation):
        return np.zeros(2)

    def files(self):
        return () if self.weights is None else (self.weights,)


def test_layouts_passed_by_hand_are_kept_with_their_results(layouts, tmp_path):
    evaluate(Still(), **brief(layouts[:1]), out=tmp_path)
    assert Layout.load(tmp_path / "layouts" / "first.json").hash == layouts[0].hash


def test_a_goal_pair_that_does_not_exist_names_those_that_do(layouts):
    with pytest.raises(UnknownNameError, match=r"goal pair of layout 'first' '7' not found.* available: 0, 1, 2"):
        drive_pair("astar", layouts[0], 7)
    protocol = get("alk_03").model_copy(update={"steps": get("alk_03").steps[:1]})
    with pytest.raises(OptionError, match="layout 'first' has no goal pairs"):
        drive_pair("astar", layouts[0].for_protocol(protocol), 0)


def test_bad_requests_say_what_is_wrong(layouts):
    with pytest.raises(UnknownNameError, match="astr"):
        evaluate("astr", layouts, progress=False)
    with pytest.raises(UnknownNameError, match="suite"):
        evaluate("astar", "tset", progress=False)
    with pytest.raises(OptionError, match="workers"):
        evaluate("astar", layouts, workers=0, progress=False)
    with pytest.raises(LabgymError, match="'first'"):
        evaluate("astar", (layouts[0], layouts[0]), progress=False)
    with pytest.raises(LabgymError, match="no layouts to drive in"):
        evaluate("astar", (), progress=False)
    with pytest.raises(UnknownNameError, match="colour"):
        evaluate("astar", layouts, options={"colour": "red"}, progress=False)
    for policy in (Still, lambda observation: [0.0, 0.0]):  # a class in place of an object; a function
        with pytest.raises(OptionError, match=r"expected a name or a labgym\.policies\.Policy"):
            evaluate(policy, layouts, progress=False)


def test_an_object_that_cannot_be_sent_to_its_process_says_so(layouts):
    policy = Still()
    policy.lock = threading.Lock()
    with pytest.raises(OptionError, match=r"'Still' cannot be sent to its process .*lock.* pass it by name"):
        evaluate(policy, layouts, progress=False)


def test_an_object_of_a_local_class_drives_in_workers(layouts):
    class Local(Still):
        pass

    assert [row.error for row in evaluate(Local(), **brief(layouts[:2]), workers=2).rows] == [None] * 6
