"""Clustered bootstrap intervals for ratios of sums: whole layouts are resampled, not episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labgym.documents import Record

RESAMPLES = 10_000


class Estimate(Record):
    """An estimate with its interval.

    Attributes:
        value: the estimate; None if the metric applies to no episode.
        low, high: ends of the 95% interval; None with fewer than two clusters.
        count: episodes to which the metric applies. nulls: the other episodes.
    """

    value: float | None
    low: float | None
    high: float | None
    count: int
    nulls: int


def ratio_estimate(
    numerators: ArrayLike,
    denominators: ArrayLike,
    clusters: Sequence[str],
    seed: int = 0,
    resamples: int = RESAMPLES,
    level: float = 0.95,
) -> Estimate:
    """Return sum(numerators) / sum(denominators) with a percentile bootstrap interval.

    Episodes in one layout are correlated, so layouts are resampled with all their episodes (cluster bootstrap). The
    interval runs from the (1 - level) / 2 to the (1 + level) / 2 quantile. For a mean, pass denominators of one. The
    result depends on the seed but not on the order of the episodes. If all ratios are equal, the interval has no width.

    Args:
        numerators: (n,), NaN if the metric does not apply to an episode.
        denominators: (n,), not negative.
        clusters: n names of clusters.
        seed: random seed of the resampling.
        resamples: number of resamples.
        level: coverage of the interval.
    """
    top, bottom = np.asarray(numerators, dtype=np.float64), np.asarray(denominators, dtype=np.float64)
    applies = np.isfinite(top) & np.isfinite(bottom)
    nulls = int((~applies).sum())
    names, index = np.unique(np.asarray(clusters, dtype=str)[applies], return_inverse=True)
    tops = np.bincount(index, top[applies], minlength=len(names))
    bottoms = np.bincount(index, bottom[applies], minlength=len(names))
    if bottoms.sum() <= 0.0:
        return Estimate(value=None, low=None, high=None, count=int(applies.sum()), nulls=nulls)
    value = float(tops.sum() / bottoms.sum())
    if len(names) < 2:
        return Estimate(value=value, low=None, high=None, count=int(applies.sum()), nulls=nulls)
    sample = np.random.default_rng(seed).integers(len(names), size=(resamples, len(names)))
    totals = bottoms[sample].sum(axis=1)
    ratios = tops[sample].sum(axis=1)[totals > 0.0] / totals[totals > 0.0]
    low, high = np.quantile(ratios, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    return Estimate(value=value, low=float(low), high=float(high), count=int(applies.sum()), nulls=nulls)
