"""The figure LabNav over its tasks, with an interval over floors, and how policies are compared.

    LabNav = 100 (exp(mean ln(s_k + 0.05)) - 0.05)

s_k is the mean score of task k. The figure is 0 if all are 0 and 100 if all are 1. Its interval is by the delta method:
with a_k = dLabNav / ds_k, floor j contributes sum_k a_k (T_jk - n_jk s_k) / N_k, where T_jk is the sum of its n_jk
scores in task k and N_k the number of episodes; floors are independent, and the interval is that of Student's t.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from labgym.errors import OptionError
from labgym.eval.driving.intervals import Estimate, bounded_mean, real_mean
from labgym.eval.driving.paired import MetricDifference, metric_difference

FLOOR = 0.05
"""Added to each score, so that a task of score 0 does not make the figure 0."""
SATURATED = 0.95
"""Score above which nines are reported."""

Scores = Mapping[str, Sequence[tuple[str, float]]]
"""Floor and score of each episode, by task."""


def geometric(scores: Sequence[float]) -> float:
    """Return the figure of task means in [0, 1]: 0 to 100.

    Raises:
        OptionError: the sequence is empty.
    """
    return 100.0 * (math.exp(_mean([math.log(score + FLOOR) for score in scores])) - FLOOR)


def arithmetic(scores: Sequence[float]) -> float:
    """Return 100 times the mean of task means.

    Raises:
        OptionError: the sequence is empty.
    """
    return 100.0 * _mean(scores)


def figure(scores: Scores) -> Estimate:
    """Return the figure with its 95% interval over floors, within 0 and 100."""
    means = {task: _mean([score for _, score in rows]) for task, rows in scores.items()}
    value = geometric(list(means.values()))
    floors = sorted({floor for rows in scores.values() for floor, _ in rows})
    contributions = dict.fromkeys(floors, 0.0)
    for task, rows in scores.items():
        slope = (value + 100.0 * FLOOR) / (len(means) * (means[task] + FLOOR))
        for floor, score in rows:
            contributions[floor] += slope * (score - means[task]) / len(rows)
    estimate = real_mean([value + len(floors) * contributions[floor] for floor in floors], floors)
    ends = [None if end is None else min(max(end, 0.0), 100.0) for end in (estimate.low, estimate.high)]
    count = sum(map(len, scores.values()))
    return Estimate(value=value, low=ends[0], high=ends[1], count=count, nulls=0)


def mean_score(rows: Sequence[tuple[str, float]]) -> Estimate:
    """Return the mean score of a task with its 95% interval over floors."""
    return bounded_mean([score for _, score in rows], [floor for floor, _ in rows])


def nines(score: Estimate) -> float | None:
    """Return -log10 of the upper bound of the failure rate, for a score above 0.95; None below or without bound."""
    if score.value is None or score.low is None or score.value <= SATURATED or score.low >= 1.0:
        return None
    return -math.log10(1.0 - score.low)


def swaps(tasks: Mapping[str, Sequence[float]]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of policies that the figure and the arithmetic mean order differently; ties do not count.

    Args:
        tasks: scores of the tasks by policy.
    """
    both = {policy: (geometric(scores), arithmetic(scores)) for policy, scores in tasks.items()}
    return tuple(
        (a, b) for a, b in combinations(sorted(both), 2) if (both[a][0] - both[b][0]) * (both[a][1] - both[b][1]) < 0.0
    )


def paired_difference(a: Mapping[str, float], b: Mapping[str, float]) -> MetricDifference:
    """Return the difference of two policies' scores over the episodes that both drove, with floors as the unit.

    Args:
        a, b: score by episode, whose keys are floor/number or task/floor/number.

    Raises:
        OptionError: no episode is shared.
    """
    shared = [key for key in a if key in b]
    if not shared:
        raise OptionError(f"the policies share none of their {len(a)} and {len(b)} episodes: drive the same suite")
    floors = [key.split("/")[-2] for key in shared]
    return metric_difference([(a[key], b[key]) for key in shared], floors)


def differences(scores: Mapping[str, Mapping[str, float]]) -> dict[tuple[str, str], MetricDifference]:
    """Return the difference of each pair of policies that share episodes, in the order of the policies.

    Args:
        scores: by episode, of each policy, as for `paired_difference`.
    """
    pairs = combinations(scores, 2)
    return {(a, b): paired_difference(scores[a], scores[b]) for a, b in pairs if scores[a].keys() & scores[b].keys()}


def _mean(values: Sequence[float]) -> float:
    if not values:
        raise OptionError("no scores: drive at least one episode")
    return math.fsum(values) / len(values)
