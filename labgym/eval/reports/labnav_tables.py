"""Tables of LabNav evaluations: scores by task and track, endings, difficulty, and which policies differ."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.eval.driving.episode_row import ENDINGS, TRACKS, Track
from labgym.eval.driving.intervals import Estimate, bounded_mean, estimate_text
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.figure import differences, swaps
from labgym.eval.labnav.summary import DIFFICULTIES, LabNavSummary, class_order
from labgym.eval.reports.tables import unranked_notes
from labgym.policies.process.box import is_rankable
from labgym.table import Table, number


def labnav_tables(evaluations: Sequence[LabNavEvaluation]) -> tuple[Table, ...]:
    """Return all tables on evaluations of one suite: scores of each track, differences, endings, difficulty."""
    return (
        *score_tables(evaluations),
        *((pair_table(evaluations),) if len(evaluations) > 1 else ()),
        ending_table(evaluations),
        *difficulty_tables(evaluations),
    )


def ranked(evaluations: Sequence[LabNavEvaluation]) -> tuple[LabNavEvaluation, ...]:
    """Return evaluations by LabNav, or by the mean of the task means where there is no figure, the best first.

    Those that are not ranked come last.
    """

    def rank(one: LabNavEvaluation) -> tuple[bool, float, str]:
        return not is_rankable(one.summary.box), -(one.summary.headline.value or 0.0), one.name

    return tuple(sorted(evaluations, key=rank))


def touched(evaluation: LabNavEvaluation) -> Estimate:
    """Return the share of episodes in which the robot touched something."""
    rows = evaluation.rows
    return bounded_mean([float(row.contacts > 0) for row in rows], [row.floor for row in rows])


def tasks_of(summaries: Iterable[LabNavSummary]) -> tuple[str, ...]:
    """Return the tasks with their levels, such as "aisle-2", in the order of the benchmark."""
    names = {name for summary in summaries for name in summary.by_task}
    return tuple(sorted(names, key=lambda name: (FIGURE_TASKS.index(name.rpartition("-")[0]), name)))


def score_tables(evaluations: Sequence[LabNavEvaluation]) -> tuple[Table, ...]:
    """Return a table of scores for each track; the last one has the notes."""
    tracks = [track for track in TRACKS if any(one.summary.track == track for one in evaluations)]
    tables = [score_table(evaluations, track) for track in tracks]
    return (*tables[:-1], replace(tables[-1], notes=score_notes(evaluations)))


def score_table(evaluations: Sequence[LabNavEvaluation], track: Track) -> Table:
    """Return the scores of the policies of a track, a column for each task."""
    tasks = tasks_of(one.summary for one in evaluations)
    chosen = ranked([one for one in evaluations if one.summary.track == track])
    whole = any(one.summary.labnav is not None for one in chosen)
    rows = []
    for one in chosen:
        own, figure = one.summary.by_task, one.summary.labnav
        scores = [own[task].score if task in own else None for task in tasks]
        rows.append(
            (
                one.name,
                *((estimate_text(figure, 1),) if whole else ()),
                number(one.summary.mean, 1),
                *(estimate_text(score, 2) for score in scores),
                estimate_text(touched(one), 2),
            )
        )
    heads = ("policy", *(("LabNav",) if whole else ()), "mean", *(task.replace("-", " ") for task in tasks), "touched")
    return Table(f"{TRACKS[track]}, suite {chosen[0].summary.suite}", heads, tuple(rows))


def score_notes(evaluations: Sequence[LabNavEvaluation]) -> tuple[str, ...]:
    """Return how to read the scores, and the marks of policies."""
    notes = ["Mean scores with 95% intervals over floors. mean: 100 times the arithmetic mean of the task means."]
    if any(one.summary.labnav is not None for one in evaluations):
        notes.append("LabNav: 100 (exp(mean ln(s + 0.05)) - 0.05) over the eight task means s.")
    notes.append("touched: share of episodes in which the robot touched something.")
    notes += unranked_notes(one.summary for one in evaluations)
    parked = [one.name for one in evaluations if any(task.parked for task in one.summary.tasks)]
    if parked:
        notes.append(f"The evaluator stops the robot for {', '.join(parked)}, which cannot stop.")
    notes += [f"{one.name} {one.thinking.mark}." for one in evaluations if one.thinking and one.thinking.mark]
    if any(one.summary.draft for one in evaluations):
        notes.append("Draft episodes: they may change, and their figures are not those of LabNav.")
    return tuple(notes)


def pair_table(evaluations: Sequence[LabNavEvaluation]) -> Table:
    """Return the paired differences of all pairs of policies over the episodes that both drove."""
    found = differences({one.name: one.scores for one in ranked(evaluations)})
    rows = tuple(
        (
            f"{a} - {b}",
            estimate_text(one.difference, 3, "+"),
            str(one.difference.count),
            "yes" if one.significant else "no",
        )
        for (a, b), one in found.items()
    )
    apart = sum(one.significant for one in found.values())
    notes = [
        f"{apart} of {len(found)} pairs are apart: the 95% interval of the mean difference, with floors as the unit, "
        "does not contain 0. The intervals are not adjusted for the number of pairs."
    ]
    tasks = tasks_of(one.summary for one in evaluations)
    every = {one.name: one.summary.by_task for one in evaluations}
    whole = {
        name: [own[task].score.value or 0.0 for task in tasks] for name, own in every.items() if set(tasks) <= set(own)
    }
    other = ", ".join(f"{a} and {b}" for a, b in swaps(whole))
    notes.append(f"The geometric and the arithmetic mean order differently: {other or 'no pair'}.")
    return Table("Differences of mean scores", ("pair", "difference", "episodes", "apart"), rows, tuple(notes))


def ending_table(evaluations: Sequence[LabNavEvaluation]) -> Table:
    """Return how the episodes of each policy ended, over all tasks."""
    counts = {one.name: one.summary.endings for one in ranked(evaluations)}
    names = [name for name in ENDINGS if any(count[name] for count in counts.values())]
    rows = tuple((policy, *(str(count[name]) for name in names)) for policy, count in counts.items())
    return Table("How episodes ended, all tasks", ("policy", *names), rows)


def difficulty_tables(evaluations: Sequence[LabNavEvaluation]) -> tuple[Table, ...]:
    """Return a table for each class of difficulty: mean score and number of episodes, over all tasks."""
    tables = []
    for field, (title, _) in DIFFICULTIES.items():
        found = {one.name: one.summary.classes(field) for one in ranked(evaluations)}
        names = sorted({name for groups in found.values() for name in groups}, key=class_order)
        if len(names) > 1:
            rows = tuple(
                (policy, *(_class_cell(groups.get(name)) for name in names)) for policy, groups in found.items()
            )
            tables.append(Table(title, ("policy", *names), rows))
    notes = ("Mean score, and number of episodes in parentheses; the tasks differ between the classes.",)
    return tuple(tables[:-1] + [replace(table, notes=notes) for table in tables[-1:]])


def _class_cell(group: tuple[float, int] | None) -> str:
    return "-" if group is None else f"{group[0]:.2f} ({group[1]})"
