from __future__ import annotations

import json

import numpy as np
import pytest
from episode_rows import row
from scipy import stats

from labgym.errors import OptionError
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.paired import by_detour, by_length, by_protocol, by_task, differences, paired


def evaluation(policy: str, seed: int, layouts: int = 20, pairs: int = 4) -> list[TransitionRow]:
    rng = np.random.default_rng(seed)
    return [
        row(f"l{k:02d}", pair, policy=policy, spl=float(rng.uniform(0.5, 1.0)), time=float(rng.uniform(4.0, 9.0)))
        for k in range(layouts)
        for pair in range(pairs)
    ]


def test_the_difference_in_time_is_scipy_s_paired_t_test_of_the_layout_means():
    a, b = evaluation("a", 1), evaluation("b", 2)
    metric = differences(paired(a, b), "touchstone")["time_to_goal"]
    means = [np.reshape([one.time for one in rows], (20, 4)).mean(axis=1) for rows in (a, b)]
    reference = stats.ttest_rel(*means).confidence_interval()
    assert metric.difference.value == pytest.approx(np.mean(means[0] - means[1]))
    assert (metric.difference.low, metric.difference.high) == pytest.approx((reference.low, reference.high), abs=1e-8)
    assert metric.a - metric.b == pytest.approx(metric.difference.value)


def test_the_difference_in_spl_is_close_to_a_cluster_bootstrap_of_scipy():
    a, b = evaluation("a", 3, layouts=200), evaluation("b", 4, layouts=200)
    difference = differences(paired(a, b), "touchstone")["spl"].difference
    gaps = np.reshape([x.spl - y.spl for x, y in zip(a, b, strict=True)], (200, 4)).mean(axis=1)
    reference = stats.bootstrap((gaps,), np.mean, method="BCa", rng=0).confidence_interval
    assert (difference.low, difference.high) == pytest.approx((reference.low, reference.high), abs=0.003)


def test_swapping_the_policies_changes_the_signs():
    a, b = evaluation("a", 5), evaluation("b", 6)
    for name, one in differences(paired(a, b), "touchstone").items():
        other = differences(paired(b, a), "touchstone")[name]
        assert (-other.difference.high, -other.difference.low) == pytest.approx(
            (one.difference.low, one.difference.high), abs=1e-8
        )


def test_rows_in_any_order_give_the_same_bytes():
    a, b = evaluation("a", 7), evaluation("b", 8)
    first = differences(paired(a, b), "touchstone")
    second = differences(paired(a[::-1], b[1:] + b[:1]), "touchstone")
    dumped = [json.dumps({name: metric.model_dump() for name, metric in each.items()}) for each in (first, second)]
    assert dumped[0] == dumped[1]


def test_only_the_same_episodes_are_paired():
    a = [row("one", 0), row("one", 1), row("one", 2), row("two", 0), row("one", 0, repeat=1)]
    b = [
        row("one", 0, policy="b"),
        row("one", 1, policy="b", start=(0.01, 0.0, 0.0)),
        row("one", 2, policy="b", goal=(3.0, 4.0, 0.1)),
        row("two", 0, policy="b", layout_hash="another"),
        row("one", 0, policy="b", repeat=1),
        row("one", 0, policy="b", repeat=2),
    ]
    pairs = paired(a, b)
    assert [(one.pair, one.repeat, other.policy) for one, other in pairs] == [(0, 0, "b"), (0, 1, "b")]


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        ([], [row()], "the first evaluation has no episodes"),
        ([row()], [row(suite="val/1")], "different suites, test/1 and val/1"),
        ([row()], [row(layout_hash="x")], "share none of their 1 and 1 episodes"),
        ([row()], [row(), row(pair=1, policy="b")], "the second evaluation mixes the policies a, b"),
        ([row(), row()], [row()], "the first evaluation holds 2 rows of 1 episodes"),
    ],
)
def test_rows_that_are_not_comparable_are_refused_in_one_line(a, b, message):
    with pytest.raises(OptionError, match=message) as error:
        paired(a, b)
    assert "\n" not in str(error.value)


def test_time_is_compared_where_both_succeeded_and_spl_where_both_have_one():
    a = [row("one", 0, time=4.0), row("one", 1, time=60.0, success=False), row("two", 0, spl=None)]
    b = [row("one", 0, time=6.0), row("one", 1, time=5.0), row("two", 0, spl=None, time=6.0)]
    metrics = differences(paired(a, b), "touchstone")
    assert metrics["time_to_goal"].difference.value == pytest.approx(-1.0)
    assert metrics["time_to_goal"].difference.count == 2
    assert metrics["spl"].difference.count == 2
    assert metrics["success"].difference.value == pytest.approx(-1 / 3)


def test_suites_with_the_navdp_rules_have_metrics_of_their_own():
    rows = [row(spl=None, soft_spl=None, navdp_spl=0.5)]
    metrics = differences(paired(rows, rows), "navdp")
    assert list(metrics) == ["navdp_success", "navdp_spl", "navdp_time"]


def test_groups_are_tasks_protocols_and_classes_of_difficulty():
    rows = [
        row("one", 0, shortest_path_length=5.0),
        row("one", 1, shortest_path_length=5.2),
        row("two", 0, protocol="red_01", shortest_path_length=7.0),
        row("three", 0, protocol="unknown", shortest_path_length=None, spl=None),
        row("four", 0, protocol=None, goal=(1.0, 0.0, 0.0), shortest_path_length=1.0),
    ]
    pairs = paired(rows, rows)
    sizes = [{name: len(group) for name, group in by(pairs).items()} for by in (by_task, by_protocol)]
    assert sizes[0] == {"other": 2, "redox": 1, "substitution": 2}
    assert sizes[1] == {"four": 1, "red_01": 1, "sub_01": 2, "unknown": 1}
    assert {name: len(group) for name, group in by_length(pairs).items()} == {
        "L* < 2 m": 1,
        "L* 4 to 6 m": 2,
        "L* >= 6 m": 1,
        "no path": 1,
    }
    assert list(by_detour(pairs)) == ["detour < 1.02", "detour 1.02 to 1.1", "detour >= 1.3", "no path"]
    for by in (by_task, by_protocol, by_length, by_detour):
        assert sum(map(len, by(pairs).values())) == len(rows)
