"""Correlation between tasks against closed forms and SciPy, with tasks that lack policies."""

from __future__ import annotations

import numpy as np
import pytest
from labnav_folders import made_up_row
from scipy import stats

from labgym.cli import main
from labgym.envs.labnav.episodes import published_episodes
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import summarise
from labgym.eval.leaderboard.labnav import LabNavResult, Outcome
from labgym.eval.leaderboard.tables import (
    correlation_tables,
    least_significant,
    over_floors,
    over_policies,
    spearman,
)

AISLE, DOCK = published_episodes("aisle", 2), published_episodes("dock", 2)
FLOORS = [floor for floor in AISLE.floors if floor in DOCK.floors]


def result(policy, scores):
    """Return the result of a policy whose score on each floor of a task is that of a function of the floor's number."""
    parts = tuple(part.first(None, 1) for part in (AISLE, DOCK) if part.task in scores)
    rows = [
        made_up_row(part, one, policy, "mapless", scores[part.task](FLOORS.index(one.floor)))
        for part in parts
        for one in part.episodes
        if one.floor in FLOORS
    ]
    known = {"options": {}, "track": "mapless", "sensors": "lidar", "seed": 0, "latency": 0.0, "policy": policy}
    summary = summarise(LabNavSuite("labnav", parts), rows, **known)
    return LabNavResult(summary=summary, outcomes=tuple(map(Outcome.of, rows)))


def constant(**scores):
    return {task: lambda _, score=score: score for task, score in scores.items()}


def test_without_ties_it_is_the_closed_form():
    a, b = [0.1, 0.4, 0.2, 0.9, 0.7], [3.0, 1.0, 2.0, 5.0, 4.0]
    squares = sum((x - y) ** 2 for x, y in zip([0, 2, 1, 4, 3], [2, 0, 1, 4, 3], strict=True))
    assert spearman(a, b) == pytest.approx(1.0 - 6.0 * squares / (5 * 24))
    assert spearman(a, a) == pytest.approx(1.0)
    assert spearman(a, [-x for x in a]) == pytest.approx(-1.0)


def test_with_ties_it_is_that_of_scipy():
    rng = np.random.default_rng(0)
    for size in (4, 7, 60):
        a, b = rng.integers(0, 4, size).astype(float), rng.integers(0, 5, size).astype(float)
        if len(set(a)) > 1 and len(set(b)) > 1:
            assert spearman(a.tolist(), b.tolist()) == pytest.approx(stats.spearmanr(a, b).statistic)


def test_a_constant_or_too_few_values_have_no_correlation():
    assert spearman([0.0] * 5, [0.1, 0.2, 0.3, 0.4, 0.5]) is None
    assert spearman([0.1, 0.2, 0.3], [0.1, 0.2, 0.3]) is None


def test_chance_exceeds_the_least_significant_correlation_once_in_twenty():
    rng = np.random.default_rng(0)
    ordered = np.arange(14.0)
    by_chance = [abs(spearman(ordered, rng.permutation(ordered))) for _ in range(4_000)]
    assert np.mean(np.array(by_chance) >= least_significant(14)) == pytest.approx(0.05, abs=0.012)


def test_over_policies_only_those_that_drove_both_tasks_count():
    scores = {"a": (0.1, 0.2), "b": (0.2, 0.1), "c": (0.5, 0.6), "d": (0.9, 0.7)}
    results = [result(name, constant(aisle=x, dock=y)) for name, (x, y) in scores.items()]
    pairs = over_policies([*results, result("half", constant(aisle=0.0))])
    assert pairs["aisle", "dock"] == (pytest.approx(1.0 - 6.0 * 2 / (4 * 15)), 4)
    assert pairs["aisle", "shift"] == (None, 0)
    table = correlation_tables([*results, result("half", constant(aisle=0.0))])[0]
    assert table.rows[0][table.columns.index("dock")] == table.rows[4][table.columns.index("aisle")] == "0.80"
    assert "over the policies that drove both tasks (4)" in table.notes[0]
    assert "Among 4 policies, a correlation below 0.95 could be chance" in table.notes[2]
    assert "half (moved, people, odometry, dock, glass, carry, shift)" in table.notes[-1]


def test_over_floors_it_is_the_mean_of_the_policies_that_have_one():
    last = len(FLOORS) - 1
    alike = result("alike", {"aisle": lambda k: k / last, "dock": lambda k: (k / last) ** 2})
    opposed = result("opposed", {"aisle": lambda k: k / last, "dock": lambda k: 1.0 - k / last})
    assert over_floors([alike])["aisle", "dock"] == (pytest.approx(1.0), 1)
    both = over_floors([alike, opposed, result("still", constant(aisle=0.0, dock=0.0))])
    assert both["aisle", "dock"] == (pytest.approx(0.0, abs=1e-12), 2)
    assert both["aisle", "moved"] == (None, 0)


def test_the_tables_of_one_policy_have_dashes():
    policies, floors = correlation_tables([result("one", constant(aisle=0.5))])
    assert {cell for row in (*policies.rows, *floors.rows) for cell in row[1:]} == {"-", "1"}


def test_the_command_shows_them_on_request(capsys):
    assert main(["leaderboard"]) == 0
    assert "Rank correlation" not in capsys.readouterr().out
    assert main(["leaderboard", "--correlation"]) == 0
    assert capsys.readouterr().out.count("Rank correlation between the tasks of LabNav") == 2
