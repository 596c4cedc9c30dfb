"""The head of model cards: the published LabNav row of a policy, and how it fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from labgym.eval.driving.episode_row import TRACKS, Ending
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.table import Table

BEGIN, END = "<!-- LabNav: begin -->", "<!-- LabNav: end -->"
"""Marks around the head, which `docs/generate.py` keeps up to date."""
FAILURES: dict[str, tuple[Ending, ...]] = {
    "touches something": ("contact",),
    "runs out of time": ("time",),
    "gets stuck": ("stuck",),
    "waits for people until the end": ("frozen",),
    "stops away from the goal": ("lost", "wrong place"),
    "stops out of its dock": ("undocked",),
    "spills": ("spilt",),
    "has an error": ("error",),
}
"""Failures in words, and the endings of rows that they stand for."""
UNDRIVEN = "Not driven in this version of LabNav yet."
MOST_KINDS = 5
"""Greatest number of kinds of things that a card names."""


def headed(card: str, results: Sequence[LabNavResult] | None = None) -> str:
    """Return a card with the policy's LabNav row after its title, in place of an earlier one.

    Args:
        card: Markdown that begins with `# name: ...`. results: published ones; by default those of this installation.
    """
    title, _, rest = card.partition("\n")
    name = title.removeprefix("# ").partition(":")[0]
    if BEGIN in rest:
        rest = rest.partition(END)[2]
    results = published_results() if results is None else results
    result = next((each for each in results if each.summary.policy == name), None)
    text = UNDRIVEN if result is None else head(result)
    return f"{title}\n\n{BEGIN}\n\n{text}\n\n{END}\n\n{rest.lstrip()}"


def head(result: LabNavResult) -> str:
    """Return the LabNav row of a policy in Markdown: figure, how it fails, and a table of its tasks."""
    summary = result.summary
    rows = tuple(
        (
            f"{task.task}-{task.level}",
            estimate_text(task.score, 2),
            estimate_text(task.success, 2),
            estimate_text(task.contacts, 2),
            failures(task.endings) or "never",
        )
        for task in summary.tasks
    )
    endings = summary.endings
    count = sum(endings.values())
    lines = [
        f"**LabNav {figure(result)}** of 100, version {summary.tasks[0].suite.rpartition('/')[2]}, level "
        f"{summary.tasks[0].level}. {TRACKS[summary.track]}; {count} episodes.",
        f"**How it fails**: of all episodes it {failures(endings)}." if failures(endings) else "It never fails.",
    ]
    touched = summary.touched
    if touched:
        kinds = [f"{kind} {number}" for kind, number in touched.most_common(MOST_KINDS)]
        rest = touched.total() - sum(number for _, number in touched.most_common(MOST_KINDS))
        words = ", ".join([*kinds, *([f"others {rest}"] if rest else [])])
        lines.append(f"Episodes that ended by touching: {words}.")
    if result.mark:
        lines.append(f"It {result.mark}.")
    note = "Brackets: 95% intervals over floors. Shares of the episodes of a task by how they ended."
    table = Table("", ("task", "score ↑", "SR ↑", "touched ↓", "how it fails"), rows, (note,)).markdown()
    return "\n".join(lines) + f"\n\n{table}"


def board(results: Sequence[LabNavResult], policies: Sequence[str]) -> str:
    """Return the LabNav rows of some policies in one Markdown table, the best first.

    Args:
        results: the best first. policies: names; those without a result are left out.
    """
    chosen = [result for result in results if result.summary.policy in policies]
    names = [task.task for task in chosen[0].summary.tasks]
    rows = tuple(
        (
            f"`{result.summary.policy}`",
            figure(result),
            *(f"{task.score.value or 0.0:.2f} / {task.success.value or 0.0:.2f}" for task in result.summary.tasks),
            failures(result.summary.endings) or "never",
        )
        for result in chosen
    )
    note = "A task has its mean score / success rate. Shares of all episodes by how they ended; level 2, floors-test."
    return Table("", ("policy", "LabNav ↑", *names, "how it fails"), rows, (note,)).markdown()


def figure(result: LabNavResult) -> str:
    """Return the figure of a result with its interval, a dash if tasks are missing."""
    return "-" if result.summary.labnav is None else estimate_text(result.summary.labnav, 1)


def failures(endings: Mapping[str, int]) -> str:
    """Return the shares of failed episodes in words, the most frequent first; "" without any.

    Args:
        endings: number of episodes by how they ended.
    """
    count = sum(endings.values())
    shares = {words: sum(endings.get(name, 0) for name in names) / count for words, names in FAILURES.items()}
    chosen = sorted((item for item in shares.items() if item[1]), key=lambda item: -item[1])
    return ", ".join(f"{words} {'under 1' if share < 0.005 else f'{100.0 * share:.0f}'}%" for words, share in chosen)
