from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from labgym.eval.driving.bootstrap import ratio_estimate


def clustered(seed: int, clusters: int = 60, size: int = 5) -> tuple[np.ndarray, list[str]]:
    rng = np.random.default_rng(seed)
    values = rng.normal(0.6, 0.2, (clusters, 1)) + rng.normal(0.0, 0.05, (clusters, size))
    return values.ravel(), [f"c{k:03d}" for k in range(clusters) for _ in range(size)]


def test_the_value_is_the_ratio_of_the_sums():
    estimate = ratio_estimate([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], ["a", "a", "b"])
    assert estimate.value == pytest.approx(6.0 / 15.0)
    assert estimate.count == 3


def test_the_interval_agrees_with_scipys_bootstrap_of_the_cluster_means():
    values, clusters = clustered(1)
    estimate = ratio_estimate(values, np.ones(len(values)), clusters)
    means = values.reshape(60, 5).mean(axis=1)
    reference = stats.bootstrap((means,), np.mean, method="percentile", n_resamples=10_000, rng=0).confidence_interval
    assert estimate.low == pytest.approx(reference.low, abs=0.003)
    assert estimate.high == pytest.approx(reference.high, abs=0.003)
    half_width = 1.96 * means.std(ddof=0) / np.sqrt(60)
    assert (estimate.high - estimate.low) / 2.0 == pytest.approx(half_width, rel=0.05)


def test_more_episodes_in_the_same_layouts_do_not_make_the_figure_surer():
    values, clusters = clustered(2)
    once = ratio_estimate(values, np.ones(len(values)), clusters)
    tenfold = ratio_estimate(np.repeat(values, 10), np.ones(10 * len(values)), list(np.repeat(clusters, 10)))
    assert (tenfold.low, tenfold.high) == pytest.approx((once.low, once.high))


def test_the_interval_covers_the_truth_as_often_as_it_says():
    covered = 0
    for seed in range(200):
        values, clusters = clustered(seed, clusters=30, size=3)
        estimate = ratio_estimate(values, np.ones(len(values)), clusters, seed=seed, resamples=1000)
        covered += estimate.low <= 0.6 <= estimate.high
    assert 0.88 <= covered / 200 <= 0.99


def test_the_order_of_the_episodes_does_not_matter():
    values, clusters = clustered(3)
    order = np.random.default_rng(0).permutation(len(values))
    first = ratio_estimate(values, np.ones(len(values)), clusters)
    second = ratio_estimate(values[order], np.ones(len(values)), [clusters[k] for k in order])
    assert (second.value, second.low, second.high) == pytest.approx((first.value, first.low, first.high))


def test_what_does_not_apply_is_left_out_and_counted():
    estimate = ratio_estimate([1.0, np.nan, 0.0], [1.0, 1.0, 1.0], ["a", "b", "c"])
    assert estimate.value == 0.5
    assert (estimate.count, estimate.nulls) == (2, 1)


def test_nothing_that_applies_has_no_value():
    estimate = ratio_estimate([np.nan, np.nan], [1.0, 1.0], ["a", "b"])
    assert (estimate.value, estimate.low, estimate.high, estimate.count, estimate.nulls) == (None, None, None, 0, 2)
    assert ratio_estimate([], [], []).value is None


def test_one_layout_alone_has_no_interval():
    estimate = ratio_estimate([1.0, 0.0], [1.0, 1.0], ["a", "a"])
    assert (estimate.value, estimate.low, estimate.high) == (0.5, None, None)
