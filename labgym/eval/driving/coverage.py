"""Coverage of the intervals of navigation metrics: how often they contain the truth in simulated evaluations.

A simulated evaluation has layouts of 1 to 8 pairs, each driven `repeats` times. Two drives in one layout have the
correlation `layout_correlation`; repeats of one pair have, given the layout, the further correlation
`pair_correlation`. With a Gaussian copula these are correlations of the latent variables.

    success      Bernoulli, with a beta-distributed share per layout (and per pair)
    spl          a mass at 0 and at 1 and a continuous part between, correlated by a Gaussian copula
    time         log-normal, with a standard deviation of 0.6 of the logarithm, correlated by a Gaussian copula
    difference   difference in success of two policies whose results share 60% of the latent variance
    spl difference  the same for SPL
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from labgym.errors import OptionError
from labgym.eval.driving.intervals import Estimate, bounded_mean, positive_mean
from labgym.table import Table

Metric = Literal["success", "spl", "time", "difference", "spl difference"]
Array = NDArray[np.float64]

PAIRS = (1,) * 2 + (2,) * 3 + (3,) * 5 + (4,) * 6 + (5,) * 6 + (6,) * 5 + (7,) * 2 + (8,)
"""Pairs of the 30 layouts of a simulated benchmark: 129 in all, as in the suite `test`."""

CORRELATIONS = (0.0, 0.1, 0.3)
"""Intra-layout correlations of the table."""

SHARED = 0.6
"""Share of the latent variance that two policies have in common: some pairs are difficult for both."""

LOG_DEVIATION = 0.6
"""Standard deviation of the logarithm of a time."""

SPL_MASSES = {0.5: (0.45, 0.40), 0.9: (0.03, 0.45), 0.99: (0.004, 0.60)}
"""Probabilities of SPL = 0 and SPL = 1, by mean SPL; the rest is Beta(k, 1) with the k that gives the mean."""


@dataclass(frozen=True)
class Scenario:
    """A population of evaluations.

    Attributes:
        metric: what is estimated (see the module's docstring).
        mean: mean of the metric; of the first policy's, for differences.
        other: mean of the second policy, for differences.
        layouts: number of layouts. repeats: drives per pair.
        layout_correlation: correlation of two drives in one layout.
        pair_correlation: further correlation of two drives of one pair, given the layout.
    """

    metric: Metric
    mean: float
    layouts: int = len(PAIRS)
    repeats: int = 1
    layout_correlation: float = 0.0
    pair_correlation: float = 0.0
    other: float = 0.0

    @property
    def truth(self) -> float:
        """The mean that the interval should contain."""
        if self.metric == "time":
            return math.exp(LOG_DEVIATION**2 / 2.0)
        return self.mean - self.other


@dataclass(frozen=True)
class Coverage:
    """Result of a simulation.

    Attributes:
        inside: share of intervals that contain the truth. above, below: share of intervals above and below it.
        width: mean width of the intervals.
    """

    inside: float
    above: float
    below: float
    width: float


def coverage(scenario: Scenario, evaluations: int, seed: int = 0) -> Coverage:
    """Return how often the interval of a scenario contains the truth.

    Args:
        scenario: the population.
        evaluations: number of simulated evaluations.
        seed: random seed of the simulation.

    Raises:
        OptionError: fewer than 1 evaluation.
    """
    if evaluations < 1:
        raise OptionError(f"evaluations is {evaluations}, expected at least 1")
    rng = np.random.default_rng(seed)
    pairs = np.array([PAIRS[index % len(PAIRS)] for index in range(scenario.layouts)])
    if scenario.layouts < len(PAIRS):
        pairs = np.array(PAIRS[:: len(PAIRS) // scenario.layouts][: scenario.layouts])
    layout_of_pair = np.repeat(np.arange(scenario.layouts), pairs)
    names = [f"layout {index:03d}" for index in np.repeat(layout_of_pair, scenario.repeats)]
    above, below, width = 0, 0, 0.0
    for _ in range(evaluations):
        values = _values(rng, scenario, layout_of_pair)
        estimate = _interval(scenario.metric, values.tolist(), names)
        if estimate.low is None or estimate.high is None:
            continue
        # The ends are rounded, and 0.3 - 0.1 is not 0.2 in floating point.
        above += estimate.low > scenario.truth + 1e-9
        below += estimate.high < scenario.truth - 1e-9
        width += estimate.high - estimate.low
    return Coverage(1.0 - (above + below) / evaluations, above / evaluations, below / evaluations, width / evaluations)


def scenarios() -> Iterator[Scenario]:
    """Yield the scenarios of the table's rows; their layouts are uncorrelated."""
    designs = ((30, 1, 0.0), (30, 3, 0.0), (30, 3, 0.5), (5, 1, 0.0), (100, 1, 0.0))
    for layouts, repeats, pair_correlation in designs:
        for mean in (0.5, 0.9, 0.95, 0.97, 0.99):
            yield Scenario("success", mean, layouts, repeats, pair_correlation=pair_correlation)
    for layouts, repeats, pair_correlation in designs:
        for mean in SPL_MASSES:
            yield Scenario("spl", mean, layouts, repeats, pair_correlation=pair_correlation)
    for layouts, repeats, pair_correlation in designs:
        yield Scenario("time", 0.0, layouts, repeats, pair_correlation=pair_correlation)
    for mean, other in ((0.5, 0.5), (0.9, 0.9), (0.99, 0.9), (0.97, 0.95), (0.99, 0.99)):
        yield Scenario("difference", mean, other=other)
    for mean, other in ((0.5, 0.5), (0.9, 0.9), (0.99, 0.9), (0.99, 0.99)):
        yield Scenario("spl difference", mean, other=other)
    for layouts in (5, 100):
        yield Scenario("difference", 0.99, layouts, other=0.9)


def coverage_row(scenario: Scenario, evaluations: int, seed: int = 0) -> tuple[str, ...]:
    """Return a row of the table: the scenario, its coverage by correlation, and the mean width at the middle one."""
    results = [
        coverage(replace(scenario, layout_correlation=correlation), evaluations, seed) for correlation in CORRELATIONS
    ]
    means = f"{scenario.mean:g}, {scenario.other:g}" if "difference" in scenario.metric else f"{scenario.truth:.4g}"
    repeats = f"{scenario.repeats} ({scenario.pair_correlation:g})" if scenario.repeats > 1 else "1"
    shares = (f"{result.inside:.3f}" for result in results)
    return scenario.metric, means, str(scenario.layouts), repeats, *shares, f"{results[1].width:.3f}"


def coverage_table(rows: Iterable[tuple[str, ...]], evaluations: int, seed: int) -> Table:
    """Return the table of rows from `coverage_row`."""
    correlations = (f"ICC {correlation:g}" for correlation in CORRELATIONS)
    return Table(
        title=f"Coverage of 95% intervals, {evaluations} simulated evaluations per cell, seed {seed}",
        columns=("Metric", "Mean", "Layouts", "Repeats", *correlations, "Width"),
        rows=tuple(rows),
        notes=(
            "ICC: correlation of two drives in one layout. Repeats: drives per pair, in brackets their further "
            "correlation. Width: mean width of the interval at ICC 0.1.",
            f"Standard error of a coverage of 0.95: {math.sqrt(0.95 * 0.05 / evaluations):.4f}.",
        ),
    )


def _interval(metric: Metric, values: list[float], layouts: list[str]) -> Estimate:
    if metric == "time":
        return positive_mean(values, layouts)
    return bounded_mean(values, layouts, lowest=-1.0 if "difference" in metric else 0.0)


def _values(rng: np.random.Generator, scenario: Scenario, layout_of_pair: NDArray[np.int64]) -> Array:
    """Return one value per drive, shape (pairs * repeats,)."""
    if scenario.metric == "success":
        return _successes(rng, scenario, layout_of_pair)
    shared = _latent(rng, scenario, layout_of_pair)
    if scenario.metric == "time":
        return np.exp(LOG_DEVIATION * shared)
    quantile: Callable[[Array, float], Array] = _spl if "spl" in scenario.metric else _success
    if scenario.metric == "spl":
        return quantile(ndtr(shared), scenario.mean)
    mine, theirs = (
        quantile(
            ndtr(math.sqrt(SHARED) * shared + math.sqrt(1.0 - SHARED) * _latent(rng, scenario, layout_of_pair)), mean
        )
        for mean in (scenario.mean, scenario.other)
    )
    return mine - theirs


def _successes(rng: np.random.Generator, scenario: Scenario, layout_of_pair: NDArray[np.int64]) -> Array:
    share = _beta(rng, np.full(scenario.layouts, scenario.mean), scenario.layout_correlation)
    drives = np.repeat(_beta(rng, share[layout_of_pair], scenario.pair_correlation), scenario.repeats)
    return (rng.random(len(drives)) < drives).astype(np.float64)


def _beta(rng: np.random.Generator, mean: Array, correlation: float) -> Array:
    """Return beta variates of given means whose Bernoulli draws have the correlation."""
    if correlation <= 0.0:
        return mean
    size = 1.0 / correlation - 1.0
    return rng.beta(np.maximum(mean * size, 1e-12), np.maximum((1.0 - mean) * size, 1e-12))


def _latent(rng: np.random.Generator, scenario: Scenario, layout_of_pair: NDArray[np.int64]) -> Array:
    """Return standard normal variates with the scenario's correlations, shape (pairs * repeats,)."""
    layout = rng.standard_normal(scenario.layouts)[layout_of_pair]
    pair = rng.standard_normal(len(layout_of_pair))
    drive = rng.standard_normal(len(layout_of_pair) * scenario.repeats)
    of_layout, of_pair = scenario.layout_correlation, scenario.pair_correlation * (1.0 - scenario.layout_correlation)
    above = math.sqrt(of_layout) * layout + math.sqrt(of_pair) * pair
    return np.repeat(above, scenario.repeats) + math.sqrt(1.0 - of_layout - of_pair) * drive


def _success(level: Array, mean: float) -> Array:
    return (level < mean).astype(np.float64)


def _spl(level: Array, mean: float) -> Array:
    """Return the quantile of SPL at levels in (0, 1)."""
    zero, one = SPL_MASSES[mean]
    middle = (mean - one) / (1.0 - zero - one)
    rest = np.clip((level - zero) / (1.0 - zero - one), 0.0, 1.0) ** ((1.0 - middle) / middle)
    return np.where(level < zero, 0.0, np.where(level > 1.0 - one, 1.0, rest))
