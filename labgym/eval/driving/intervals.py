"""Means over episodes with 95% intervals; episodes of one layout are correlated, so layouts are the unit of chance.

Notation: layout j has n_j episodes (repeats included) that sum to T_j; N = sum n_j; J = N^2 / sum n_j^2 is Kish's
effective number of layouts; q is the 97.5% quantile of Student's t.

Bounded metrics (shares, SPL), scaled to [0, 1], have a score interval (Wilson, 1927) with an effective sample size, the
form that Franco et al. (2019, PMC6690503) recommend for clustered samples:

    p = (sum T_j + c) / (N + 2 c),                                            c = 1/2
    S = J / (J - 1) sum (T_j - n_j p)^2 + c d (p^2 + (1 - p)^2),              d = 1 + 0.2 (sum n_j^2 / N - 1)
    n = N (N + 2 c) p (1 - p) / S
    f = N min(mean, 1 - mean),    k = 1 + max(0, 2 - 2 n / N) f / (f + 1),    w = q^2 / n
    center m = (mean + w / 2) / (1 + w),    skewed center m' = (mean + k w / 2) / (1 + k w)
    interval: from min(m, m') - h to max(m, m') + h, where h is half the width of Wilson's interval

Half an episode at each bound (Jeffreys' prior) keeps the interval open if all episodes are equal. It counts with the
design effect d of an intra-layout correlation of 0.2, because a sample without failures says nothing about how failures
cluster; the correlations in published evaluations are 0 to 0.2. Failures that cluster make the mean skewer than a
binomial share of n episodes, so k moves the end on the side of 1/2, the more the more failures (f) show it; its form
was chosen by simulation. The added episodes count as one degree of freedom, so q has J. Without clusters (n = N, k = 1)
the interval is Wilson's.

Other metrics have a cluster-robust t interval with J - 1 degrees of freedom: on the scale of the logarithm if the
metric is positive (times), on its own scale otherwise. `labgym coverage` measures how often the intervals contain the
truth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scipy.special import stdtrit

from labgym.documents import Record

LEVEL = 0.95

PSEUDO_EPISODES = 0.5
"""Episodes added at each bound of a bounded metric."""

PRIOR_CORRELATION = 0.2
"""Intra-layout correlation of the added episodes."""

FEWEST_LAYOUTS = 1.5
"""Effective number of layouts below which there is no interval."""

DIGITS = 9
"""Digits to which the ends are rounded, so that they do not depend on the last bit of a mathematics library."""


class Estimate(Record):
    """An estimate with its interval.

    Attributes:
        value: the estimate; None if the metric applies to no episode.
        low, high: ends of the 95% interval; None with fewer than two layouts.
        count: episodes to which the metric applies. nulls: the other episodes.
    """

    value: float | None
    low: float | None
    high: float | None
    count: int
    nulls: int


def estimate_text(estimate: Estimate | None, digits: int, sign: str = "") -> str:
    """Return an estimate with its interval in brackets if it has one; a dash without a value.

    Args:
        digits: after the point. sign: "+" to print the sign of positive numbers, too.
    """
    if estimate is None or estimate.value is None:
        return "-"
    value = f"{estimate.value:{sign}z.{digits}f}"
    if estimate.low is None or estimate.high is None:
        return value
    return f"{value} [{estimate.low:{sign}.{digits}f}, {estimate.high:{sign}.{digits}f}]"


@dataclass(frozen=True)
class _Clusters:
    """Sums of a metric by layout.

    Attributes:
        sums, sizes: T_j and n_j, in the order of the layouts' names.
    """

    sums: tuple[float, ...]
    sizes: tuple[int, ...]

    @property
    def episodes(self) -> int:
        return sum(self.sizes)

    @property
    def squares(self) -> int:
        return sum(size * size for size in self.sizes)

    @property
    def effective(self) -> float:
        """Kish's effective number of layouts."""
        return self.episodes**2 / self.squares

    def quantile(self, added: float = 0.0) -> float:
        """Return the quantile of Student's t with J - 1 + `added` degrees of freedom, at least one."""
        return float(stdtrit(max(self.effective - 1.0 + added, 1.0), (1.0 + LEVEL) / 2.0))

    @property
    def mean(self) -> float:
        return math.fsum(self.sums) / self.episodes

    def squared_residuals(self, mean: float) -> float:
        """Return J / (J - 1) sum (T_j - n_j mean)^2."""
        residuals = ((total - size * mean) ** 2 for total, size in zip(self.sums, self.sizes, strict=True))
        return self.effective / (self.effective - 1.0) * math.fsum(residuals)


Interval = Callable[[_Clusters], tuple[float, float]]


def bounded_mean(
    values: Sequence[float | None], layouts: Sequence[str], lowest: float = 0.0, highest: float = 1.0
) -> Estimate:
    """Return the mean of a metric between two bounds, with the score interval.

    Args:
        values: (n,), within the bounds; None if the metric does not apply to an episode.
        layouts: n names of layouts. The result does not depend on the order of the episodes.
        lowest, highest: bounds of the metric.
    """
    width = highest - lowest

    def score(clusters: _Clusters) -> tuple[float, float]:
        shares = tuple(
            (total - size * lowest) / width for total, size in zip(clusters.sums, clusters.sizes, strict=True)
        )
        low, high = _bounded_interval(_Clusters(shares, clusters.sizes))
        return lowest + width * low, lowest + width * high

    return _estimate(values, layouts, score)


def positive_mean(values: Sequence[float | None], layouts: Sequence[str]) -> Estimate:
    """Return the mean of a metric that is never negative and has no upper bound, with a t interval of its logarithm.

    There is no interval if all values are zero: they do not show the metric's scale.

    Args:
        values: (n,), not negative; None if the metric does not apply to an episode.
        layouts: n names of layouts. The result does not depend on the order of the episodes.
    """

    def logarithmic(clusters: _Clusters) -> tuple[float, float]:
        mean = clusters.mean
        if mean <= 0.0:
            return math.nan, math.nan
        factor = math.exp(min(_half_width(clusters) / mean, 100.0))
        return mean / factor, mean * factor

    return _estimate(values, layouts, logarithmic)


def real_mean(values: Sequence[float | None], layouts: Sequence[str]) -> Estimate:
    """Return the mean of a metric without bounds, with a t interval.

    Args:
        values: (n,); None if the metric does not apply to an episode.
        layouts: n names of layouts. The result does not depend on the order of the episodes.
    """

    def symmetric(clusters: _Clusters) -> tuple[float, float]:
        mean, half = clusters.mean, _half_width(clusters)
        return mean - half, mean + half

    return _estimate(values, layouts, symmetric)


def _estimate(values: Sequence[float | None], layouts: Sequence[str], interval: Interval) -> Estimate:
    episodes: dict[str, list[float]] = {}
    for value, layout in zip(values, layouts, strict=True):
        if value is not None:
            episodes.setdefault(layout, []).append(value)
    names = sorted(episodes)
    clusters = _Clusters(
        tuple(math.fsum(episodes[name]) for name in names), tuple(len(episodes[name]) for name in names)
    )
    count = clusters.episodes
    nulls = len(values) - count
    if not count:
        return Estimate(value=None, low=None, high=None, count=0, nulls=nulls)
    value = math.fsum(number for name in names for number in episodes[name]) / count
    if clusters.effective < FEWEST_LAYOUTS:
        return Estimate(value=value, low=None, high=None, count=count, nulls=nulls)
    low, high = interval(clusters)
    if math.isnan(low):
        return Estimate(value=value, low=None, high=None, count=count, nulls=nulls)
    return Estimate(value=value, low=round(low, DIGITS), high=round(high, DIGITS), count=count, nulls=nulls)


def _half_width(clusters: _Clusters) -> float:
    """Return half the width of the cluster-robust t interval of a mean."""
    return clusters.quantile() * math.sqrt(clusters.squared_residuals(clusters.mean)) / clusters.episodes


def _bounded_interval(clusters: _Clusters) -> tuple[float, float]:
    """Return the score interval of a mean in [0, 1]; see the module's docstring for the symbols."""
    N, c = clusters.episodes, PSEUDO_EPISODES
    p = (math.fsum(clusters.sums) + c) / (N + 2.0 * c)
    d = 1.0 + PRIOR_CORRELATION * (clusters.squares / N - 1.0)
    S = clusters.squared_residuals(p) + c * d * (p**2 + (1.0 - p) ** 2)
    n = N * (N + 2.0 * c) * p * (1.0 - p) / S
    mean = min(max(clusters.mean, 0.0), 1.0)
    f = N * min(mean, 1.0 - mean)
    k = 1.0 + max(0.0, 2.0 - 2.0 * n / N) * f / (f + 1.0)
    return score_interval(mean, n, clusters.quantile(added=1.0), k)


def score_interval(share: float, size: float, quantile: float, skewness: float = 1.0) -> tuple[float, float]:
    """Return Wilson's score interval of a share; with a skewness above 1, its end on the side of 1/2 is farther out.

    Args:
        share: observed share, in [0, 1].
        size: sample size; not necessarily whole.
        quantile: quantile of the score's distribution, for example 1.96.
        skewness: k in the module's docstring, at least 1.
    """
    weight = quantile**2 / size
    centers = [(share + k * weight / 2.0) / (1.0 + k * weight) for k in (1.0, skewness)]
    half = quantile * math.sqrt(share * (1.0 - share) / size + weight / (4.0 * size)) / (1.0 + weight)
    return max(min(centers) - half, 0.0), min(max(centers) + half, 1.0)
