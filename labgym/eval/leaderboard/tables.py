"""The published tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.stats import rankdata, t

from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.labnav.figure import differences, swaps
from labgym.eval.leaderboard.labnav import LabNavResult
from labgym.eval.leaderboard.receipts import ALARM, FreshReceipt, FreshRound, receipt_of
from labgym.policies.process.box import UNRANKED, is_rankable
from labgym.table import Table, number

KNOWLEDGE = {"privileged": "everything", "deployed": "old map", "mapless": "-"}
"""What the policies of a track know besides their sensors."""


def published_table(results: Sequence[LabNavResult], rounds: Sequence[FreshRound] = ()) -> Table:
    """Return the published results of LabNav, a row for each policy.

    Args:
        results: at least one, in the order of the rows.
        rounds: the published rounds; with a receipt of one of the results, the table has a column of fresh floors.
    """
    rows = []
    receipts = {one.summary.policy: receipt_of(one.summary, rounds) for one in results}
    fresh = any(receipts.values())
    for result in results:
        summary = result.summary
        scores = {task.task: task.score.value for task in summary.tasks}
        rows.append(
            (
                summary.policy,
                KNOWLEDGE[summary.track],
                estimate_text(summary.labnav, 1),
                *([fresh_text(receipts[summary.policy])] if fresh else []),
                number(summary.arithmetic, 1),
                *(number(scores.get(task), 2) for task in FIGURE_TASKS),
                number(summary.share("contacts"), 2),
            )
        )
    first = results[0].summary
    most = max(task.episodes for one in results for task in one.summary.tasks)
    return Table(
        title=f"LabNav, version {first.tasks[0].suite.rpartition('/')[2]}, {most} episodes per task",
        columns=(
            "Policy",
            "Knows",
            "LabNav ↑",
            *(["Fresh ↑"] if fresh else []),
            "Mean ↑",
            *(f"{task} ↑" for task in FIGURE_TASKS),
            "Touched ↓",
        ),
        rows=tuple(rows),
        notes=(
            "LabNav is 100 (exp(mean ln(s + 0.05)) - 0.05) over the eight mean scores s, with its 95% interval over "
            "floors; Mean is 100 times their arithmetic mean.",
            *(_fresh(results, rounds) if fresh else []),
            "Touched: share of episodes with a contact.",
            *_fewer(results, most),
            *(f"{one.summary.policy} {one.mark}." for one in results if one.mark),
            *(f"{one.summary.policy} is {UNRANKED}." for one in results if not is_rankable(one.summary.box)),
            *(["A dash stands for a task that is not driven yet."] if _unfinished(results) else []),
            *_pairs([result for result in results if result.summary.labnav is not None]),
        ),
    )


def fresh_text(receipt: FreshReceipt | None) -> str:
    """Return the figure on fresh floors with its interval, and whether it is an alarm; a dash without a receipt."""
    if receipt is None:
        return "-"
    return estimate_text(receipt.summary.labnav, 1) + (f", {ALARM}" if receipt.verdict == ALARM else "")


def _fresh(results: Sequence[LabNavResult], rounds: Sequence[FreshRound]) -> Iterator[str]:
    """Yield sentences on the floors of the fresh figures, and on the results that an alarm unranks."""
    names = ", ".join(one.name for one in rounds)
    yield (
        f"Fresh: LabNav on floors drawn from a verifier's secret after the result was handed in (rounds {names}); rows "
        "are ranked by LabNav, and an alarm unranks a row."
    )
    for result in results:
        receipt = receipt_of(result.summary, rounds)
        if receipt is not None and receipt.verdict == ALARM:
            yield f"{result.summary.policy} is not ranked: {receipt.sentence}."


def _fewer(results: Sequence[LabNavResult], most: int) -> tuple[str, ...]:
    """Return a sentence on the policies that drove fewer than `most` episodes per task."""
    counts = {one.summary.policy: max(task.episodes for task in one.summary.tasks) for one in results}
    names = [f"{policy} {count}" for policy, count in counts.items() if count < most]
    return (f"Fewer episodes per task: {', '.join(names)}; their intervals are wider.",) if names else ()


def _pairs(results: Sequence[LabNavResult]) -> tuple[str, ...]:
    """Return sentences on the pairs of policies that are apart, and on those whose order depends on the mean."""
    scores = {one.summary.policy: {key: each.score for key, each in one.by_key.items()} for one in results}
    pairs = differences(scores)
    if not pairs:
        return ()
    unclear = [f"{a} and {b}" for (a, b), one in pairs.items() if not one.significant]
    apart = f"{len(pairs) - len(unclear)} of {len(pairs)} pairs of policies are apart (the 95% interval of the paired "
    apart += "difference of their mean scores over the episodes that both drove, with floors as the unit, excludes 0)"
    text = apart + (f"; not {', '.join(unclear)}." if unclear else ".")
    order = swaps({one.summary.policy: [task.score.value or 0.0 for task in one.summary.tasks] for one in results})
    if not order:
        return text, "Both means order all policies in the same way."
    return text, f"The means order these pairs differently: {', '.join(f'{a} and {b}' for a, b in order)}."


def _unfinished(results: Sequence[LabNavResult]) -> bool:
    return any(len(result.summary.tasks) < len(FIGURE_TASKS) for result in results)


FEWEST = 4
"""Number of policies, or of floors, below which there is no correlation."""

Pairs = Mapping[tuple[str, str], tuple[float | None, int]]
"""Correlation, None without one, and the number of policies behind it, by two tasks in the order of `FIGURE_TASKS`."""


def spearman(a: Sequence[float], b: Sequence[float]) -> float | None:
    """Return the rank correlation of two sequences, equal values with their mean rank; None if one is constant.

    Args:
        a, b: of the same length.
    """
    if len(a) < FEWEST:
        return None
    x, y = (rankdata(each) - (len(each) + 1) / 2.0 for each in (a, b))
    scale = math.sqrt(float(x @ x) * float(y @ y))
    return float(x @ y) / scale if scale > 0.0 else None


def least_significant(count: int) -> float:
    """Return the least rank correlation of `count` pairs that differs from 0 at 5%, two-sided.

    By Student's t distribution with `count` - 2 degrees of freedom, as `scipy.stats.spearmanr`.

    Args:
        count: at least 3.
    """
    quantile = float(t.ppf(0.975, count - 2))
    return quantile / math.sqrt(count - 2 + quantile * quantile)


def over_policies(results: Sequence[LabNavResult]) -> Pairs:
    """Return the rank correlation of the tasks' mean scores over the policies that drove both."""
    means = {
        task: {
            one.summary.policy: each.score.value for one in results for each in one.summary.tasks if each.task == task
        }
        for task in FIGURE_TASKS
    }
    pairs: dict[tuple[str, str], tuple[float | None, int]] = {}
    for a, b in combinations(FIGURE_TASKS, 2):
        both = [(means[a][name], means[b][name]) for name in means[a] if name in means[b]]
        shared = [(x, y) for x, y in both if x is not None and y is not None]
        pairs[a, b] = spearman([x for x, _ in shared], [y for _, y in shared]), len(shared)
    return pairs


def over_floors(results: Sequence[LabNavResult]) -> Pairs:
    """Return the rank correlation of a policy's mean scores on the floors of two tasks, as the mean over policies.

    Policies with equal scores on all floors of a task are left out.
    """
    floors = [floor_means(result) for result in results]
    pairs: dict[tuple[str, str], tuple[float | None, int]] = {}
    for a, b in combinations(FIGURE_TASKS, 2):
        values = []
        for own in floors:
            shared = [floor for floor in own.get(a, {}) if floor in own.get(b, {})]
            value = (
                spearman([own[a][floor] for floor in shared], [own[b][floor] for floor in shared]) if shared else None
            )
            values += [] if value is None else [value]
        pairs[a, b] = math.fsum(values) / len(values) if values else None, len(values)
    return pairs


def floor_means(result: LabNavResult) -> dict[str, dict[str, float]]:
    """Return the mean scores of a policy by task and floor."""
    scores: dict[str, dict[str, list[float]]] = {}
    for outcome in result.outcomes:
        level, floor, _ = outcome.key.split("/")
        scores.setdefault(level.rpartition("-")[0], {}).setdefault(floor, []).append(outcome.score)
    return {
        task: {floor: math.fsum(each) / len(each) for floor, each in floors.items()} for task, floors in scores.items()
    }


def correlation_tables(results: Sequence[LabNavResult]) -> tuple[Table, Table]:
    """Return the tables of the correlations over policies and over floors, of all pairs of tasks.

    Args:
        results: of at least one policy.
    """
    policies, floors = over_policies(results), over_floors(results)
    absent = {
        result.summary.policy: [
            task for task in FIGURE_TASKS if task not in {each.task for each in result.summary.tasks}
        ]
        for result in results
    }
    lacking = ", ".join(f"{policy} ({', '.join(tasks)})" for policy, tasks in absent.items() if tasks)
    left_out = (f"Policies without results in some tasks: {lacking}.",) if lacking else ()
    title = "Rank correlation between the tasks of LabNav"
    return (
        _table(
            f"{title}, over policies",
            policies,
            (
                "Spearman's correlation of the mean scores, over the policies that drove both tasks"
                f"{_counts(policies)}; a dash stands for fewer than {FEWEST}, or for equal scores.",
                *_range(policies),
                *_significance(policies),
                *left_out,
            ),
        ),
        _table(
            f"{title}, over floors",
            floors,
            (
                "Spearman's correlation of a policy's mean scores on the floors that both tasks have, as the mean over "
                f"policies{_counts(floors)}; policies with equal scores on all floors of a task are left out.",
                *_range(floors),
            ),
        ),
    )


def _table(title: str, pairs: Pairs, notes: tuple[str, ...]) -> Table:
    def cell(a: str, b: str) -> str:
        return "1" if a == b else number(pairs[(a, b) if (a, b) in pairs else (b, a)][0], 2)

    rows = tuple((a, *(cell(a, b) for b in FIGURE_TASKS)) for a in FIGURE_TASKS)
    return Table(title, ("Task", *FIGURE_TASKS), rows, notes)


def _counts(pairs: Pairs) -> str:
    """Return the number of policies behind the correlations in words."""
    counts = sorted({count for value, count in pairs.values() if value is not None})
    return "" if not counts else f" ({counts[0]})" if len(counts) == 1 else f" ({counts[0]} to {counts[-1]})"


def _significance(pairs: Pairs) -> tuple[str, ...]:
    """Return a sentence on the least correlation that chance does not explain; nothing without any."""
    counts = [count for value, count in pairs.values() if value is not None]
    if not counts:
        return ()
    return (
        f"Among {max(counts)} policies, a correlation below {least_significant(max(counts)):.2f} could be chance "
        "(two-sided, 5%, t distribution).",
    )


def _range(pairs: Pairs) -> tuple[str, ...]:
    """Return a sentence on the least and the greatest correlation; nothing without any."""
    values = {pair: value for pair, (value, _) in pairs.items() if value is not None}
    if not values:
        return ()
    least, greatest = min(values, key=lambda pair: values[pair]), max(values, key=lambda pair: values[pair])
    middle = float(np.median(list(values.values())))
    return (
        f"From {values[least]:.2f} ({' and '.join(least)}) to {values[greatest]:.2f} ({' and '.join(greatest)}), "
        f"median {middle:.2f}.",
    )
