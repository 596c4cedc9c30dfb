"""The gain of a policy on published floors over fresh ones: the test that exposes a policy which has seen them.

    s_k = sum_j T_jk / sum_j n_jk,    m = mean_k s_k,    d = m(published) - m(fresh),    z = d / e

T_jk is the sum of the n_jk scores of floor j in task k. The floors of both sets are independent, so that the squared
standard error e^2 is the sum of two variances of m. Each is that of resampled floors (a bootstrap over floors, which
keeps the tasks of a floor together) times J / (J - 1) for J floors.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from labgym.documents import Record
from labgym.errors import OptionError

LEAST_Z = 3.0
"""An alarm needs a larger z: by chance, 0.13% of honest policies exceed it."""
LEAST_GAIN = 0.03
"""An alarm needs a larger difference of the mean scores."""
LEAST_ERROR = 1e-3
"""Least standard error: equal scores on a few floors do not show how scores vary."""
FEWEST_FLOORS = 2
RESAMPLES = 2000
SEED = 33
"""Random seed of the resampling: equal scores give equal figures."""


class Gain(Record):
    """The difference of a policy's mean scores on published and on fresh floors.

    Attributes:
        published, fresh: mean over the tasks of the mean scores.
        difference: published - fresh. error: its standard error. z: their quotient.
    """

    published: float
    fresh: float
    difference: float
    error: float
    z: float

    def is_near(self, other: Gain) -> bool:
        """Whether all figures are equal but for rounding."""
        pairs = zip(self.model_dump().values(), other.model_dump().values(), strict=True)
        return all(math.isclose(one, another, rel_tol=1e-5, abs_tol=1e-6) for one, another in pairs)

    @property
    def alarm(self) -> bool:
        """Whether the gain is larger than chance and than any honest difference."""
        return self.z > LEAST_Z and self.difference > LEAST_GAIN


def gain(published: Mapping[str, float], fresh: Mapping[str, float]) -> Gain:
    """Return what a policy gains on published floors, over the tasks that both have.

    Args:
        published, fresh: scores by the episodes' keys, such as "aisle-2/floors-test-0000/1".

    Raises:
        OptionError: no task is shared, or one of both has fewer than two floors.
    """
    tasks = sorted(_tasks(published) & _tasks(fresh))
    if not tasks:
        raise OptionError("the published and the fresh episodes share no task: draw fresh floors for the same tasks")
    (mean, variance), (other, noise) = (_mean_and_variance(scores, tasks) for scores in (published, fresh))
    difference, error = mean - other, max(math.sqrt(variance + noise), LEAST_ERROR)
    values = (mean, other, difference, error, difference / error)
    return Gain(**dict(zip(Gain.model_fields, (round(value, 9) for value in values), strict=True)))


def _tasks(keys: Iterable[str]) -> set[str]:
    return {key.split("/")[0] for key in keys}


def _mean_and_variance(scores: Mapping[str, float], tasks: list[str]) -> tuple[float, float]:
    """Return the mean over tasks of the mean scores, and its variance by resampled floors."""
    sums, counts = by_floor(scores, tasks)
    floors = len(sums)
    if floors < FEWEST_FLOORS:
        raise OptionError(f"episodes of {floors} floor: the test needs at least {FEWEST_FLOORS} floors")
    draws = np.random.default_rng(SEED).multinomial(floors, np.full(floors, 1.0 / floors), size=RESAMPLES)
    means = _means(draws @ sums, draws @ counts)
    return float(_means(sums.sum(axis=0), counts.sum(axis=0))), float(means.var()) * floors / (floors - 1)


def by_floor(scores: Mapping[str, float], tasks: list[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return sum and number of the scores of each floor in each task, both (floors, tasks).

    Args:
        scores: by the episodes' keys. tasks: with their levels, such as "aisle-2"; others are left out.
    """
    place = {task: column for column, task in enumerate(tasks)}
    parts = {key: key.split("/") for key in sorted(scores)}
    rows = {floor: row for row, floor in enumerate(sorted({part[-2] for part in parts.values() if part[0] in place}))}
    sums, counts = (np.zeros((len(rows), len(tasks))) for _ in range(2))
    for key, (task, *_, floor, _) in parts.items():
        if task in place:
            sums[rows[floor], place[task]] += scores[key]
            counts[rows[floor], place[task]] += 1.0
    return sums, counts


def _means(sums: NDArray[np.float64], counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the last axis, the tasks, of the mean scores; tasks without episodes do not count."""
    present = counts > 0.0
    means = np.divide(sums, counts, out=np.zeros_like(sums), where=present)
    return np.asarray(means.sum(axis=-1) / present.sum(axis=-1))
