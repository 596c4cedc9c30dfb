from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from labgym.errors import OptionError
from labgym.eval.driving.coverage import Scenario, coverage, scenarios
from labgym.eval.driving.intervals import bounded_mean, positive_mean, real_mean, score_interval

LAYOUTS = [f"c{k:02d}" for k in range(30) for _ in range(4)]


def clustered(seed: int, clusters: int = 60, size: int = 5) -> tuple[list[float], list[str]]:
    rng = np.random.default_rng(seed)
    values = rng.normal(0.6, 0.1, (clusters, 1)) + rng.normal(0.0, 0.05, (clusters, size))
    return values.ravel().tolist(), [f"c{k:03d}" for k in range(clusters) for _ in range(size)]


@pytest.mark.parametrize(("successes", "size"), [(0, 10), (7, 10), (129, 129), (64, 129)])
def test_the_score_interval_is_scipy_s_score_interval(successes, size):
    reference = stats.binomtest(successes, size).proportion_ci(method="wilson")
    ends = score_interval(successes / size, size, stats.norm.ppf(0.975))
    assert ends == pytest.approx((reference.low, reference.high), abs=1e-12)


def test_with_many_layouts_of_one_episode_the_interval_is_wilson_s():
    values = [1.0] * 2700 + [0.0] * 300
    estimate = bounded_mean(values, [str(k) for k in range(3000)])
    reference = stats.binomtest(2700, 3000).proportion_ci(method="wilson")
    assert (estimate.low, estimate.high) == pytest.approx((reference.low, reference.high), abs=2e-4)


@pytest.mark.parametrize("mean", [bounded_mean, positive_mean, real_mean])
def test_with_equal_layouts_the_interval_is_that_of_a_t_test_of_the_layout_means(mean):
    values, layouts = clustered(1)
    estimate = mean(values, layouts)
    means = np.reshape(values, (60, 5)).mean(axis=1)
    reference = stats.ttest_1samp(means, 0.0).confidence_interval()
    width = reference.high - reference.low
    assert estimate.value == pytest.approx(np.mean(values))
    # The score interval is pulled toward 0.5, and that of the logarithm is not symmetric.
    tolerance = {"real_mean": 1e-9, "positive_mean": 0.02 * width, "bounded_mean": 0.06 * width}[mean.__name__]
    assert (estimate.low, estimate.high) == pytest.approx((reference.low, reference.high), abs=tolerance)


def test_more_episodes_in_the_same_layouts_narrow_a_t_interval_no_further():
    values, layouts = clustered(2)
    once, tenfold = real_mean(values, layouts), real_mean(values * 10, layouts * 10)
    assert (tenfold.low, tenfold.high) == pytest.approx((once.low, once.high), abs=1e-8)


def test_if_all_episodes_succeed_the_interval_is_open_below():
    # The rule of three on 120 episodes gives 0.975, on 30 layouts 0.90.
    estimate = bounded_mean([1.0] * 120, LAYOUTS)
    assert estimate.high == 1.0
    assert 0.90 < estimate.low < 0.975
    failed = bounded_mean([0.0] * 120, LAYOUTS)
    assert (failed.low, failed.high) == pytest.approx((0.0, 1.0 - estimate.low))


def test_every_failure_lowers_both_ends():
    ends = []
    for failures in range(6):
        values = [1.0] * 120
        for k in range(failures):
            values[4 * k] = 0.0
        estimate = bounded_mean(values, LAYOUTS)
        ends.append((estimate.low, estimate.high))
    assert ends == sorted(ends, reverse=True)
    assert len({low for low, _ in ends}) == len({high for _, high in ends}) == 6


def test_three_repeats_without_failures_do_not_halve_the_interval():
    once = bounded_mean([1.0] * 120, LAYOUTS)
    thrice = bounded_mean([1.0] * 360, [layout for layout in LAYOUTS for _ in range(3)])
    # In layouts that are correlated, three times the drives are worth less than twice the drives.
    assert once.low < thrice.low < 1.0 - (1.0 - once.low) / 2.0


def test_two_policies_without_any_difference_have_an_interval_around_zero():
    estimate = bounded_mean([0.0] * 120, LAYOUTS, lowest=-1.0)
    assert estimate.value == 0.0
    assert -0.05 < estimate.low < 0.0 < estimate.high < 0.05


@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_the_interval_scales_with_the_bounds(scale):
    values, layouts = clustered(3)
    unit, scaled = bounded_mean(values, layouts), bounded_mean([v * scale for v in values], layouts, 0.0, scale)
    assert (scaled.low, scaled.high) == pytest.approx((unit.low * scale, unit.high * scale), abs=1e-7)


@pytest.mark.parametrize("mean", [bounded_mean, positive_mean, real_mean])
def test_rows_in_any_order_give_the_same_bytes(mean):
    values, layouts = clustered(4)
    order = np.random.default_rng(0).permutation(len(values))
    first = mean(values, layouts)
    second = mean([values[k] for k in order], [layouts[k] for k in order])
    assert json.dumps(second.model_dump()) == json.dumps(first.model_dump())


def test_what_does_not_apply_is_left_out_and_counted():
    estimate = bounded_mean([1.0, None, 0.0], ["a", "b", "c"])
    assert estimate.value == 0.5
    assert (estimate.count, estimate.nulls) == (2, 1)


def test_nothing_that_applies_has_no_value():
    estimate = positive_mean([None, None], ["a", "b"])
    assert (estimate.value, estimate.low, estimate.high, estimate.count, estimate.nulls) == (None, None, None, 0, 2)
    assert bounded_mean([], []).value is None


@pytest.mark.parametrize("mean", [bounded_mean, positive_mean, real_mean])
def test_one_layout_alone_has_no_interval(mean):
    estimate = mean([1.0, 0.0], ["a", "a"])
    assert (estimate.value, estimate.low, estimate.high) == (0.5, None, None)


def test_two_layouts_have_a_finite_interval_and_a_dominant_one_has_none():
    estimate = positive_mean([0.0, 0.0, 0.0, 9.0], ["a", "a", "b", "b"])
    assert math.isfinite(estimate.high)
    assert real_mean([1.0] * 10 + [0.0], ["a"] * 10 + ["b"]).low is None


def test_times_that_are_all_zero_show_no_scale():
    assert positive_mean([0.0] * 120, LAYOUTS).high is None


# The full table: `labgym coverage` (docs/metrics.md). 1200 evaluations have a standard error of 0.006.
@pytest.mark.parametrize("correlation", [0.0, 0.3])
@pytest.mark.parametrize("mean", [0.5, 0.9, 0.99])
def test_the_interval_of_a_share_contains_the_truth_in_93_to_97_percent(mean, correlation):
    scenario = Scenario("success", mean, layout_correlation=correlation)
    assert 0.93 <= coverage(scenario, 1200, seed=8).inside <= 0.975


@pytest.mark.parametrize(
    "scenario",
    [
        Scenario("spl", 0.9, layout_correlation=0.1),
        Scenario("success", 0.9, repeats=3, layout_correlation=0.1, pair_correlation=0.5),
        Scenario("time", 0.0, layout_correlation=0.1),
        Scenario("difference", 0.99, other=0.9, layout_correlation=0.1),
    ],
    ids=lambda scenario: f"{scenario.metric}-{scenario.repeats}",
)
def test_the_other_intervals_contain_the_truth_as_often(scenario):
    assert 0.925 <= coverage(scenario, 800, seed=8).inside <= 0.975


def test_simulated_evaluations_have_the_mean_and_the_correlation_of_their_scenario():
    from labgym.eval.driving.coverage import PAIRS, _values

    scenario = Scenario("success", 0.9, layout_correlation=0.3)
    layout_of_pair = np.repeat(np.arange(30), PAIRS)
    rng = np.random.default_rng(0)
    for metric in ("success", "spl"):
        values = np.array([_values(rng, replace(scenario, metric=metric), layout_of_pair) for _ in range(4000)])
        assert values.mean() == pytest.approx(0.9, abs=0.004)
    values = np.array([_values(rng, scenario, layout_of_pair) for _ in range(4000)])
    assert np.corrcoef(values[:, -1], values[:, -2])[0, 1] == pytest.approx(0.3, abs=0.07)


def test_no_evaluations_are_refused():
    with pytest.raises(OptionError, match="evaluations is 0, expected at least 1"):
        coverage(Scenario("success", 0.9), 0)


@pytest.mark.parametrize(("sizes", "freedom"), [((1, 3), 1.0), ((1, 2), 1.0), ((2, 2, 2), 2.0), ((1, 2, 4), 4.0 / 3.0)])
def test_the_degrees_of_freedom_are_the_effective_layouts_less_one_but_at_least_one(sizes, freedom):
    values = np.arange(sum(sizes), dtype=float)
    layouts = [f"l{number}" for number, size in enumerate(sizes) for _ in range(size)]
    effective = sum(sizes) ** 2 / sum(size * size for size in sizes)
    sums = np.array([part.sum() for part in np.split(values, np.cumsum(sizes)[:-1])])
    variance = effective / (effective - 1.0) * ((sums - np.array(sizes) * values.mean()) ** 2).sum()
    half = stats.t.ppf(0.975, freedom) * math.sqrt(variance) / len(values)
    estimate = real_mean(values.tolist(), layouts)
    assert (estimate.low, estimate.high) == pytest.approx((values.mean() - half, values.mean() + half))


def test_there_is_an_interval_from_one_and_a_half_effective_layouts_on():
    for sizes, exists in (((1, 3), True), ((1, 4), False)):  # 1.60 and 1.47 effective layouts
        values = [float(number) for number in range(sum(sizes))]
        layouts = [f"l{number}" for number, size in enumerate(sizes) for _ in range(size)]
        assert (real_mean(values, layouts).low is not None) is exists


def test_the_table_simulates_the_suites_and_fewer_and_more_layouts():
    table = list(scenarios())
    designs = {(30, 1, 0.0), (30, 3, 0.0), (30, 3, 0.5), (5, 1, 0.0), (100, 1, 0.0)}
    for metric, means in (("success", {0.5, 0.9, 0.95, 0.97, 0.99}), ("spl", {0.5, 0.9, 0.99}), ("time", {0.0})):
        rows = [one for one in table if one.metric == metric]
        assert {(one.layouts, one.repeats, one.pair_correlation) for one in rows} == designs
        assert {one.mean for one in rows} == means
        assert len(rows) == len(designs) * len(means)
    assert {one.layout_correlation for one in table} == {0.0}
    differences = [one for one in table if "difference" in one.metric]
    assert [one.layouts for one in differences] == [30] * 9 + [5, 100]
