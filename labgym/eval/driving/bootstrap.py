"""Bootstrap intervals for ratios of sums, clustered: whole layouts are drawn, not episodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from labgym.documents import Record

RESAMPLES = 10_000


class Estimate(Record):
    """A figure with its interval.

    Attributes:
        value: None where the metric applies to no episode.
        low, high: ends of the 95% interval; None where fewer than two clusters bear on it.
        count: episodes that bear on it. nulls: episodes that do not.
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

    Episodes in one layout are alike, so that layouts are resampled with all their episodes (the cluster bootstrap);
    the interval runs from the (1 - level) / 2 to the (1 + level) / 2 quantile. A mean has denominators of one. The
    result depends on the seed and on the clusters in sorted order, not on the order of the episodes.

    Args:
        numerators: (n,), NaN where the metric does not apply to an episode.
        denominators: (n,), not negative.
        clusters: n names of clusters.
        seed: of the resampling.
        resamples: how many resamples are drawn.
        level: share that the interval covers.
    """
    top, bottom = np.asarray(numerators, dtype=np.float64), np.asarray(denominators, dtype=np.float64)
    applies = np.isfinite(top) & np.isfinite(bottom)
    nulls = int((~applies).sum())
    names, place = np.unique(np.asarray(clusters, dtype=str)[applies], return_inverse=True)
    tops = np.bincount(place, top[applies], minlength=len(names))
    bottoms = np.bincount(place, bottom[applies], minlength=len(names))
    if bottoms.sum() <= 0.0:
        return Estimate(value=None, low=None, high=None, count=int(applies.sum()), nulls=nulls)
    value = float(tops.sum() / bottoms.sum())
    if len(names) < 2:
        return Estimate(value=value, low=None, high=None, count=int(applies.sum()), nulls=nulls)
    drawn = np.random.default_rng(seed).integers(len(names), size=(resamples, len(names)))
    totals = bottoms[drawn].sum(axis=1)
    ratios = tops[drawn].sum(axis=1)[totals > 0.0] / totals[totals > 0.0]
    low, high = np.quantile(ratios, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    return Estimate(value=value, low=float(low), high=float(high), count=int(applies.sum()), nulls=nulls)
