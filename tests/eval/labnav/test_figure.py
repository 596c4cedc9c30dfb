"""The figure against closed forms, and its interval against the simulated spread."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.errors import OptionError
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav import figure


def test_all_perfect_is_100_and_all_failed_is_0():
    assert figure.geometric([1.0] * 8) == pytest.approx(100.0)
    assert figure.geometric([0.0] * 8) == pytest.approx(0.0, abs=1e-12)
    assert figure.geometric([0.3] * 8) == pytest.approx(30.0)
    assert figure.geometric([0.2, 0.8]) == pytest.approx(100.0 * (math.sqrt(0.25 * 0.85) - 0.05))


def test_one_failed_task_costs_more_than_in_the_arithmetic_mean():
    scores = [0.8] * 7 + [0.0]
    assert figure.arithmetic(scores) == pytest.approx(70.0)
    assert figure.geometric(scores) == pytest.approx(100.0 * (0.85 ** (7 / 8) * 0.05 ** (1 / 8) - 0.05))


def test_no_scores_are_refused():
    with pytest.raises(OptionError, match="no scores"):
        figure.geometric([])


def test_the_interval_has_the_width_of_the_simulated_spread():
    rng = np.random.default_rng(0)
    tasks, floors, each = 8, 60, 5
    means = np.linspace(0.2, 0.8, tasks)
    values, widths = [], []
    for _ in range(60):
        rows = {}
        for task, mean in enumerate(means):
            shares = np.clip(mean + 0.15 * rng.standard_normal(floors), 0.02, 0.98)
            rows[str(task)] = [(str(j), float(rng.random() < shares[j])) for j in range(floors) for _ in range(each)]
        estimate = figure.figure(rows)
        values.append(estimate.value)
        widths.append((estimate.high - estimate.low) / 2.0 / 2.0)
    assert np.mean(widths) == pytest.approx(np.std(values), rel=0.25)


def test_the_value_of_the_interval_is_that_of_the_task_means():
    rows = {"aisle": [("a", 1.0), ("a", 0.0), ("b", 0.5)], "carry": [("a", 0.2), ("b", 0.2)]}
    assert figure.figure(rows).value == pytest.approx(figure.geometric([0.5, 0.2]))


def test_nines_follow_from_the_upper_bound_of_the_failure_rate():
    assert figure.nines(Estimate(value=0.999, low=0.99, high=1.0, count=300, nulls=0)) == pytest.approx(2.0)
    assert figure.nines(Estimate(value=0.94, low=0.9, high=0.97, count=300, nulls=0)) is None
    assert figure.nines(Estimate(value=1.0, low=None, high=None, count=3, nulls=0)) is None


def test_a_specialist_and_a_generalist_swap_between_the_means():
    tasks = {"generalist": [0.5] * 4, "specialist": [1.0, 1.0, 0.1, 0.0], "weak": [0.1] * 4}
    assert figure.swaps(tasks) == (("generalist", "specialist"),)
    assert figure.swaps({"a": [0.5, 0.5], "b": [0.4, 0.4], "same": [0.5, 0.5]}) == ()


def test_paired_differences_have_floors_as_their_unit():
    a = {f"aisle-2/{floor}/{number}": 0.8 for floor in "abcdefgh" for number in range(5)}
    b = {key: score - (0.3 if key.split("/")[1] in "abcd" else 0.1) for key, score in a.items()}
    one = figure.paired_difference(a, b)
    assert (one.a, one.b) == pytest.approx((0.8, 0.6))
    assert one.difference.value == pytest.approx(0.2)
    assert one.significant
    assert not figure.paired_difference(a, a).significant
    with pytest.raises(OptionError, match="share none"):
        figure.paired_difference(a, {"x/y/0": 1.0})
