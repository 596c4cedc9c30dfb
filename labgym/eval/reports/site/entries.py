"""The entries of the site: evaluations from folders, and published results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import Literal

from labgym.artefacts import artefacts
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import TRACKS, Ending, LabNavRow
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.shown_drive import ShownDrive
from labgym.eval.labnav.suites import CHECK, MINI
from labgym.eval.labnav.summary import LabNavSummary
from labgym.eval.leaderboard.drives import published_drives
from labgym.eval.leaderboard.labnav import DIRTY, LabNavResult, Outcome, commits_of
from labgym.eval.leaderboard.receipts import ALARM, FreshReceipt, FreshRound, published_rounds, receipt_of
from labgym.policies.registry import BUILT_IN, FILES

Kind = Literal["learned", "classical", "reference", "other"]
KINDS: dict[Kind, str] = {
    "learned": "has trained weights",
    "classical": "planning and control without training",
    "reference": "shows a bound or the level of chance",
    "other": "a policy that is not built in",
}
"""Kinds of policies and what they mean."""
REFERENCES = frozenset({"blind", "clairvoyant", "random", "still", "straight"})
"""Built-in policies that are references."""
CARDS = {"ppo": "ppo-lidar"}
"""Folders of model cards that do not have the name of their policy."""
PUBLISHED = " (published)"
"""End of the name of a published result whose name a folder has, too."""


@dataclass(frozen=True)
class Entry:
    """The results of a policy on the site.

    Attributes:
        name: unique on the page. kind: of the policy. published: whether it is a published result.
        summary: of the tasks on the page.
        outcomes: of each episode, by its key.
        rows, routes: by the key; empty for a published result.
        drives: of a published result that are published, too, by the key.
        planning: median over episodes of the milliseconds per action; None if it was not measured.
        mark: of a policy that thinks longer than it declares, else "".
        commits: that drove each task, by its suite; "-dirty" follows a commit with changes.
        fresh: receipt of a published result on fresh floors; None without one.
        evaluation: the folder; None for a published result.
    """

    name: str
    kind: Kind
    published: bool
    summary: LabNavSummary
    outcomes: Mapping[str, Outcome]
    rows: Mapping[str, LabNavRow] = field(default_factory=dict)
    routes: Mapping[str, Route] = field(default_factory=dict)
    drives: Mapping[str, ShownDrive] = field(default_factory=dict)
    planning: float | None = None
    mark: str = ""
    commits: Mapping[str, Sequence[str]] = field(default_factory=dict)
    fresh: FreshReceipt | None = None
    evaluation: LabNavEvaluation | None = None

    @classmethod
    def driven(cls, one: LabNavEvaluation) -> Entry:
        """Return the entry of an evaluation's folder."""
        times = [time.planning_ms for time in one.times.values() if time.planning_ms is not None]
        commits = commits_of(one.provenance)
        return cls(
            name=one.name,
            kind=kind_of_policy(one.summary.policy),
            published=False,
            summary=one.summary,
            outcomes={row.key: Outcome.of(row) for row in one.rows},
            rows={row.key: row for row in one.rows},
            routes=one.routes,
            planning=median(times) if times else None,
            mark="" if one.thinking is None else one.thinking.mark,
            commits={task.suite: commits for task in one.summary.tasks},
            evaluation=one,
        )

    @classmethod
    def of_result(
        cls,
        result: LabNavResult,
        drives: Mapping[str, ShownDrive] | None = None,
        rounds: Sequence[FreshRound] = (),
    ) -> Entry:
        """Return the entry of a published result, of those of its drives that are published, and of its receipt."""
        return cls(
            name=result.summary.policy,
            kind=kind_of_policy(result.summary.policy),
            mark=result.mark,
            published=True,
            summary=result.summary,
            outcomes=result.by_key,
            drives={} if drives is None else drives,
            commits=result.commits,
            fresh=receipt_of(result.summary, rounds),
        )

    @cached_property
    def scores(self) -> dict[str, float]:
        """The scores of the episodes, by their keys."""
        return {key: one.score for key, one in self.outcomes.items()}

    @cached_property
    def endings(self) -> dict[str, Ending]:
        """How the episodes ended, by their keys."""
        return {key: one.ending for key, one in self.outcomes.items()}

    @property
    def moves(self) -> bool:
        """Whether the page has routes of it."""
        return bool(self.routes or self.drives)

    @property
    def most_episodes(self) -> int:
        """The greatest number of episodes of a task."""
        return max((task.episodes for task in self.summary.tasks), default=0)

    @property
    def commit_words(self) -> str:
        """The commits that drove the tasks, shortened, with the tasks of each where they differ; "" if unknown."""
        tasks: dict[str, list[str]] = {}
        for task in self.summary.tasks:
            for commit in dict.fromkeys(map(short_commit, self.commits.get(task.suite, ()))):
                tasks.setdefault(commit, []).append(task.task)
        whole = all(len(names) == len(self.summary.tasks) for names in tasks.values())
        return ", ".join(commit if whole else f"{commit} ({', '.join(names)})" for commit, names in tasks.items())


def short_commit(commit: str) -> str:
    """Return the first twelve digits of a commit, marked if its checkout had changes."""
    return commit.removesuffix(DIRTY)[:12] + (DIRTY if commit.endswith(DIRTY) else "")


def kind_of_policy(label: str) -> Kind:
    """Return the kind of a policy by the label in its rows."""
    if label in REFERENCES:
        return "reference"
    if label in BUILT_IN:
        return "learned" if BUILT_IN[label].extra == "train" or card_of(label) is not None else "classical"
    return "learned" if Path(label).suffix.lower() in FILES else "other"


def card_of(label: str) -> Path | None:
    """Return the model card of a built-in policy; None without one."""
    if label not in BUILT_IN:
        return None
    path = artefacts("policies") / CARDS.get(label, label) / "CARD.md"
    return path if path.is_file() else None


def ranked_entries(entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Return entries by their track, those with all tasks first, then the best figure first.

    Those with an alarm on fresh floors come last.
    """
    order = list(TRACKS)
    most = max((len(one.summary.tasks) for one in entries), default=0)

    def rank(one: Entry) -> tuple[bool, int, bool, float, str]:
        partial = len(one.summary.tasks) < most
        return (
            one.fresh is not None and one.fresh.verdict == ALARM,
            order.index(one.summary.track),
            partial,
            -(one.summary.headline.value or 0.0),
            one.name,
        )

    return tuple(sorted(entries, key=rank))


def with_published(evaluations: Sequence[LabNavEvaluation], published: Sequence[LabNavResult]) -> tuple[Entry, ...]:
    """Return the entries of evaluations of one suite, and of the published results on the same tasks.

    A published result is left out if it shares no task with the evaluations, or if a folder holds the same outcomes.
    The small suites have other limits of time, so that no published result belongs to them.
    """
    entries = [Entry.driven(one) for one in evaluations]
    first = evaluations[0].summary
    labels = {task.suite for task in first.tasks}
    driven, rounds = {one.name: one for one in entries}, published_rounds()
    for result in published if first.suite not in (MINI, CHECK) else ():
        entry = restricted(Entry.of_result(result, published_drives(result), rounds), labels)
        same = driven.get(entry.name)
        if not entry.summary.tasks or (same is not None and same.outcomes == entry.outcomes):
            continue
        entries.append(entry if same is None else replace(entry, name=entry.name + PUBLISHED))
    return ranked_entries(entries)


def restricted(entry: Entry, labels: Set[str]) -> Entry:
    """Return an entry with the tasks of some suites, named with their versions."""
    tasks = tuple(task for task in entry.summary.tasks if task.suite in labels)
    if len(tasks) == len(entry.summary.tasks):
        return entry
    prefixes = tuple(f"{task.task}-{task.level}/" for task in tasks)
    return replace(
        entry,
        summary=entry.summary.model_copy(update={"tasks": tasks, "labnav": None, "arithmetic": None}),
        outcomes={key: one for key, one in entry.outcomes.items() if key.startswith(prefixes)},
    )
