"""The NavDP benchmark's rules, and that what they yield never passes for the headline."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.navigation_metrics import METRICS, metrics_of
from labgym.eval.evaluator import evaluate
from labgym.eval.reports.tables import navigation_table
from labgym.layouts import load_published, published
from labgym.navigation import goal_pairs
from labgym.policies import Policy, velocities_to_action
from labgym.suites import Suite, load_suite

LAYOUT = load_published("test", published("test")[0])


@pytest.fixture(scope="module")
def suite() -> Suite:
    whole = load_suite("navdp_compat")
    return whole.model_copy(update={"layouts": (LAYOUT.id,), "drives": {LAYOUT.id: whole.drives[LAYOUT.id]}})


@pytest.fixture(scope="module")
def report(suite) -> TransitionEvaluation:
    return evaluate("straight", suite, progress=False)


class Spin(Policy):
    """Turns where it stands."""

    def reset(self, episode):
        self.control_dt = episode.robot.control_dt

    def act(self, observation):
        return velocities_to_action(0.0, 1.0)


def test_the_suite_has_the_benchmarks_rules(suite):
    assert suite.control_dt == 0.15
    assert suite.max_steps * suite.control_dt == pytest.approx(120.0)
    assert (suite.arrival.distance, suite.arrival.speed) == (1.0, 0.5)
    assert (suite.stuck.steps, suite.stuck.distance) == (30, 0.1)
    assert suite.success_distance == 1.5
    assert suite.metrics == "navdp"


class Still(Policy):
    """Never moves."""

    def reset(self, episode):
        pass

    def act(self, observation):
        return np.zeros(2)


def test_the_suite_drives_the_pairs_that_start_two_meters_or_more_from_their_goal():
    suite = load_suite("navdp_compat")
    pairs = [pair for layout in published("test") for pair in goal_pairs(load_published("test", layout))]
    far = [pair for pair in pairs if math.dist(pair.start[:2], pair.goal[:2]) >= 2.0]
    driven = [drive for layout in suite.layouts for drive in suite.drives[layout]]
    assert [(drive.start, drive.goal) for drive in driven] == [(pair.start, pair.goal) for pair in far]
    assert (suite.version, len(pairs), len(driven)) == (4, 129, 105)


def test_a_robot_that_stands_still_has_no_success(suite):
    rows = [drive.row for drive in drive_layout(Still(), LAYOUT, suite, "still", 0)]
    assert len(rows) == len(suite.drives[LAYOUT.id])
    assert not any(row.success for row in rows)
    assert {row.navdp_spl for row in rows} == {0.0}


def test_an_episode_ends_when_the_robot_is_near_and_slow_and_not_before(report, suite):
    arrived = [row for row in report.rows if row.final_distance < 1.0]
    assert arrived
    for row in arrived:
        route = np.array(report.routes[row.key])
        away = np.hypot(*(route[:, :2] - row.goal[:2]).T)
        speed = np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1) / suite.control_dt
        near = np.flatnonzero(away[:-1] < 1.0)
        # The speed is that at the end of a step, the route tells its mean: braking, they differ by up to 0.11 m/s.
        assert all(speed[k - 1] > 0.35 for k in near if k)
        assert row.steps < suite.max_steps


def test_a_robot_that_turns_where_it_stands_is_stuck_after_thirty_poses(suite):
    policy = Spin()
    rows = [drive.row for drive in drive_layout(policy, LAYOUT, suite, "spin", 0)]
    assert policy.control_dt == 0.15
    assert {row.steps for row in rows if row.final_distance >= 1.5} == {29}
    assert not any(row.success for row in rows if row.final_distance > 1.5)


def test_spl_is_that_of_the_straight_distance(report):
    for row in report.rows:
        straight = math.dist(row.start[:2], row.goal[:2])
        expected = min(1.0, straight / row.path_length) if row.success and row.path_length else float(row.success)
        assert row.navdp_spl == pytest.approx(expected, abs=1e-9)
        assert row.success is (row.final_distance <= 1.5)


def test_time_is_counted_in_steps_of_the_suites_length(report):
    assert all(row.time == pytest.approx(0.15 * row.steps) for row in report.rows)


def test_its_metrics_have_names_of_their_own(report):
    assert tuple(report.summary.metrics) == (
        "navdp_success", "navdp_spl", "navdp_time", "contacts_per_meter", "min_clearance", "final_distance"
    )  # fmt: skip
    assert not {"success", "spl", "soft_spl", "time_to_goal"} & set(report.summary.metrics)
    assert all(row.spl is None and row.soft_spl is None for row in report.rows)
    assert report["navdp_success"] == pytest.approx(np.mean([row.success for row in report.rows]))
    assert report["navdp_spl"] == pytest.approx(np.mean([row.navdp_spl for row in report.rows]))


def test_a_table_of_both_shows_what_they_share_alone(report):
    headline = evaluate("straight", [LAYOUT], progress=False)
    assert set(headline.summary.metrics) == set(metrics_of("touchstone"))
    assert all(row.navdp_spl is None for row in headline.rows)
    mixed = navigation_table({"a": report.summary.metrics, "b": headline.summary.metrics}, "both")
    shown = {row[0] for row in mixed.rows}
    assert shown == {"Contacts per meter ↓", "Minimum clearance, m ↑", "Distance left, m ↓"}
    alone = navigation_table({"a": report.summary.metrics}, "navdp")
    assert {row[0] for row in alone.rows} == {METRICS[name].heading for name in report.summary.metrics}


@pytest.mark.parametrize(
    "changes",
    [
        {"control_dt": 0.15},
        {"arrival": {"distance": 1.0, "speed": 0.5}},
        {"stuck": {"steps": 30, "distance": 0.1}},
        {"metrics": "navdp"},
    ],
)
def test_the_headlines_metrics_cannot_be_had_by_other_rules(changes):
    with pytest.raises(DocumentError, match=r"metrics (touchstone|navdp) "):
        Suite.parse({**Suite(name="mine", split="val").to_json(), **changes})


@pytest.mark.parametrize("control_dt", [0.05, 0.15])
def test_an_environments_control_step_can_be_chosen(control_dt):
    env = LabPointNavEnv(layout=LAYOUT, control_dt=control_dt)
    _, before = env.reset(seed=0)
    for _ in range(4):
        _, _, _, _, info = env.step(np.array([0.0, 0.4], np.float32))
    env.close()
    assert info["time"] == pytest.approx(4 * control_dt)
    # 0.6 rad/s from rest at 4 rad/s2: the turn lags behind by half of the 0.15 s that it takes to get there.
    lag = 0.6**2 / (2.0 * 4.0) / 0.6
    assert info["pose"][2] - before["pose"][2] == pytest.approx(0.6 * (4 * control_dt - lag), abs=0.02)


@pytest.mark.parametrize("control_dt", [0.0, -0.1, 0.03, 1.2, math.nan, math.inf])
def test_a_control_step_that_is_no_multiple_of_a_contact_check_is_refused(control_dt):
    with pytest.raises(OptionError, match="control_dt"):
        LabPointNavEnv(layout=LAYOUT, control_dt=control_dt)
