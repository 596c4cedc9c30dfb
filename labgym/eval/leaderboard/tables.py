"""The published tables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.labnav.figure import paired_difference, swaps
from labgym.eval.labnav.suites import FIRST
from labgym.eval.leaderboard.labnav import LabNavResult
from labgym.table import Table, number

KNOWLEDGE = {"privileged": "everything", "deployed": "old map", "mapless": "-"}
"""What the policies of a track know besides their sensors."""


def published_table(results: Sequence[LabNavResult]) -> Table:
    """Return the published results of LabNav, a row for each policy.

    Args:
        results: at least one, in the order of the rows.
    """
    rows = []
    for result in results:
        summary = result.summary
        scores = {task.task: task.score.value for task in summary.tasks}
        rows.append(
            (
                summary.policy,
                KNOWLEDGE[summary.track],
                estimate_text(summary.labnav, 1),
                number(summary.arithmetic, 1),
                *(number(scores.get(task), 2) for task in FIGURE_TASKS),
                number(_touched(result), 2),
            )
        )
    first = results[0].summary
    most = max(task.episodes for one in results for task in one.summary.tasks)
    return Table(
        title=f"LabNav, version {first.tasks[0].suite.rpartition('/')[2]}, {most} episodes per task",
        columns=("Policy", "Knows", "LabNav ↑", "Mean ↑", *(f"{task} ↑" for task in FIGURE_TASKS), "Touched ↓"),
        rows=tuple(rows),
        notes=(
            "LabNav is 100 (exp(mean ln(s + 0.05)) - 0.05) over the eight mean scores s, with its 95% interval over "
            "floors; Mean is 100 times their arithmetic mean.",
            "Touched: share of episodes with a contact.",
            *_costly(results),
            *(f"{one.summary.policy} {one.mark}." for one in results if one.mark),
            *(["A dash stands for a task that is not driven yet."] if _unfinished(results) else []),
            *_pairs([result for result in results if result.summary.labnav is not None]),
        ),
    )


def _costly(results: Sequence[LabNavResult]) -> tuple[str, ...]:
    """Return a sentence on the policies that drove the first episode of each floor only."""
    names = [one.summary.policy for one in results if one.summary.suite == FIRST]
    return (f"{', '.join(names)} drove the first episode of each floor only (suite {FIRST}).",) if names else ()


def _pairs(results: Sequence[LabNavResult]) -> tuple[str, ...]:
    """Return sentences on the pairs of policies that are apart, and on those whose order depends on the mean."""
    pairs = list(combinations(results, 2))
    if not pairs:
        return ()
    scores = {one.summary.policy: {key: each.score for key, each in one.by_key.items()} for one in results}
    unclear = [
        f"{a.summary.policy} and {b.summary.policy}"
        for a, b in pairs
        if not paired_difference(scores[a.summary.policy], scores[b.summary.policy]).significant
    ]
    apart = f"{len(pairs) - len(unclear)} of {len(pairs)} pairs of policies are apart (the 95% interval of the paired "
    apart += "difference of their mean scores over the episodes that both drove, with floors as the unit, excludes 0)"
    text = apart + (f"; not {', '.join(unclear)}." if unclear else ".")
    order = swaps({one.summary.policy: [task.score.value or 0.0 for task in one.summary.tasks] for one in results})
    if not order:
        return text, "Both means order all policies in the same way."
    return text, f"The means order these pairs differently: {', '.join(f'{a} and {b}' for a, b in order)}."


def _unfinished(results: Sequence[LabNavResult]) -> bool:
    return any(len(result.summary.tasks) < len(FIGURE_TASKS) for result in results)


def _touched(result: LabNavResult) -> float | None:
    """Return the share of episodes with a contact, over all tasks."""
    tasks = [task for task in result.summary.tasks if task.contacts.value is not None]
    count = sum(task.episodes for task in tasks)
    return sum((task.contacts.value or 0.0) * task.episodes for task in tasks) / count if count else None
