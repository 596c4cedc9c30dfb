"""Paired differences between two policies, over the episodes that both drove."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Literal

from labgym import protocols
from labgym.documents import Record
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.episode_row import Pose, TransitionRow
from labgym.eval.driving.intervals import Estimate, bounded_mean, real_mean
from labgym.eval.driving.navigation_metrics import metrics_of

Pair = tuple[TransitionRow, TransitionRow]
"""Rows of both policies for one episode."""

Value = Callable[[TransitionRow], float | None]

LENGTHS = (2.0, 4.0, 6.0)
"""Edges of the classes of L*, meters."""

DETOURS = (1.02, 1.1, 1.3)
"""Edges of the classes of detour, L* / straight distance."""


class MetricDifference(Record):
    """Difference between two policies in one metric, over the episodes to which it applies for both.

    Attributes:
        a, b: means of both policies; None without such episodes.
        difference: mean of the paired differences, a - b.
    """

    a: float | None
    b: float | None
    difference: Estimate

    @property
    def significant(self) -> bool:
        """Whether the 95% interval does not contain 0."""
        low, high = self.difference.low, self.difference.high
        return low is not None and high is not None and (low > 0.0 or high < 0.0)


def paired(a: Sequence[TransitionRow], b: Sequence[TransitionRow]) -> tuple[Pair, ...]:
    """Return the rows of both for each episode that both drove, in the order of the first.

    Episodes are the same if layout (by hash), pair, repeat, start and goal are.

    Raises:
        OptionError: the rows of a policy are of several suites or policies, or repeat an episode; the suites differ; or
            no episode is shared.
    """
    mine, theirs = _by_episode(a, "the first"), _by_episode(b, "the second")
    suites = a[0].suite, b[0].suite
    if suites[0] != suites[1]:
        raise OptionError(f"the evaluations are of different suites, {suites[0]} and {suites[1]}; compare within one")
    shared = [episode for episode in mine if episode in theirs]
    if not shared:
        raise OptionError(
            f"the evaluations share none of their {len(mine)} and {len(theirs)} episodes of suite {suites[0]}; compare "
            "evaluations of the same layouts and starts"
        )
    return tuple((mine[episode], theirs[episode]) for episode in shared)


def differences(pairs: Sequence[Pair], metrics: Literal["touchstone", "navdp"]) -> dict[str, MetricDifference]:
    """Return the paired difference in each compared metric, with its 95% interval over layouts and repeats.

    Args:
        pairs: rows of both policies.
        metrics: which metrics, as in the suite.
    """
    layouts = [a.layout_hash for a, _ in pairs]
    return {
        name: metric_difference(
            [(metric.value(a), metric.value(b)) for a, b in pairs], layouts, bounded=metric.mean is bounded_mean
        )
        for name, metric in metrics_of(metrics).items()
        if metric.compared
    }


def metric_difference(
    values: Sequence[tuple[float | None, float | None]], layouts: Sequence[str], bounded: bool = True
) -> MetricDifference:
    """Return the difference of two policies in a metric over the episodes to which it applies for both.

    Args:
        values: of both policies, for each episode. layouts: of the episodes, the units of chance.
        bounded: whether the metric is within [0, 1].
    """
    gaps = [None if a is None or b is None else a - b for a, b in values]
    estimate = bounded_mean(gaps, layouts, lowest=-1.0) if bounded else real_mean(gaps, layouts)
    both = [(a, b) for a, b in values if a is not None and b is not None]
    return MetricDifference(a=_mean([a for a, _ in both]), b=_mean([b for _, b in both]), difference=estimate)


def by_task(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    """Return the pairs by the reaction type of their protocol; "other" for protocols that are not in the library."""
    return _grouped(pairs, lambda row: _reaction_type(row.protocol))


def by_protocol(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    """Return the pairs by protocol; by layout where the protocol is not known."""
    return _grouped(pairs, lambda row: row.protocol or row.layout)


def by_length(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    """Return the pairs by class of the length of the shortest path, L*."""
    return _classed(pairs, lambda row: row.shortest_path_length, LENGTHS, "L*", " m")


def by_detour(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    """Return the pairs by class of detour: L* divided by the straight distance from start to goal."""
    return _classed(pairs, _detour, DETOURS, "detour", "")


def _by_episode(rows: Sequence[TransitionRow], which: str) -> dict[tuple[str, int, int, Pose, Pose], TransitionRow]:
    if not rows:
        raise OptionError(f"{which} evaluation has no episodes; evaluate the policy first")
    for kind, names in (("suites", {row.suite for row in rows}), ("policies", {row.policy for row in rows})):
        if len(names) > 1:
            raise OptionError(f"{which} evaluation mixes the {kind} {', '.join(sorted(names))}; expected one")
    episodes = {(row.layout_hash, row.pair, row.repeat, row.start, row.goal): row for row in rows}
    if len(episodes) < len(rows):
        raise OptionError(
            f"{which} evaluation holds {len(rows)} rows of {len(episodes)} episodes; expected each episode once"
        )
    return episodes


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None


def _detour(row: TransitionRow) -> float | None:
    straight = math.dist(row.start[:2], row.goal[:2])
    return None if row.shortest_path_length is None or straight <= 0.0 else row.shortest_path_length / straight


def _grouped(pairs: Iterable[Pair], group: Callable[[TransitionRow], str]) -> dict[str, list[Pair]]:
    groups: dict[str, list[Pair]] = {}
    for pair in pairs:
        groups.setdefault(group(pair[0]), []).append(pair)
    return dict(sorted(groups.items()))


def _classed(
    pairs: Iterable[Pair], measure: Value, edges: Sequence[float], symbol: str, unit: str
) -> dict[str, list[Pair]]:
    """Return the pairs by class of a measure, in ascending order; pairs without a path last."""
    names = [f"{symbol} < {edges[0]:g}{unit}"]
    names += [f"{symbol} {low:g} to {high:g}{unit}" for low, high in pairwise(edges)]
    names += [f"{symbol} >= {edges[-1]:g}{unit}", "no path"]

    def name(row: TransitionRow) -> str:
        size = measure(row)
        return names[-1] if size is None else names[sum(size >= edge for edge in edges)]

    groups = _grouped(pairs, name)
    return {each: groups[each] for each in names if each in groups}


@cache
def _reaction_type(protocol: str | None) -> str:
    try:
        return "other" if protocol is None else protocols.get(protocol).reaction_type or "other"
    except LabgymError:
        return "other"
