"""`summary.json` of a LabNav evaluation: every figure is computed from the rows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from labgym.documents import Growing, Record
from labgym.envs.labnav.necks import RADII
from labgym.envs.labnav.task import PRECISE
from labgym.envs.labnav.tasks import TaskName, task_of
from labgym.eval.driving.episode_row import ENDINGS, LabNavRow, Track
from labgym.eval.driving.files import EPISODES, SUMMARY
from labgym.eval.driving.intervals import Estimate, bounded_mean, estimate_text
from labgym.eval.driving.record import EvaluationSummary
from labgym.eval.labnav.figure import arithmetic, figure, mean_score, nines
from labgym.eval.labnav.suites import LabNavSuite, is_whole
from labgym.policies.policy import Sensors
from labgym.policies.process.box import BUILT_IN_CODE, LONGEST_LEVEL, UNRANKED, is_rankable
from labgym.table import Table

COMPARED = ("episodes", "errors", "score", "success", "contacts", "endings", "contact", "parked")
"""Figures of a task that the rows must give."""
NEARLY = 1e-9
"""Difference of figures that versions of a mathematics library may cause."""
NOT_BEGUN = "not begun"
"""Ending of the drives of a shift that come after the one that ended it."""
SUCCESS = (
    "success: share of episodes that ended so: the robot came to rest in the goal's disc, without a spill and aligned "
    "with a dock, in shift at every goal."
)
LENGTHS = (10.0, 15.0)
"""Edges of the classes of L*, meters."""
DETOURS = (1.1, 1.3)
"""Edges of the classes of L* / straight distance."""
MET = (1, 3)
"""Edges of the classes of the number of people met."""


class TaskSummary(Record):
    """The results of one task.

    Attributes:
        task, level, suite: name, level, and suite with its version. draft: whether its episodes may still change.
        episodes: number of rows. expected: number of episodes of the suite. errors: of the policy.
        score: mean with its interval over floors. success: share of the episodes that ended by "success", likewise.
        contacts: share of episodes in which the robot touched something.
        endings: number of episodes by how they ended. contact: of those that ended by a contact, by the thing's kind.
        parked: episodes in which the evaluator stopped the robot.
        precise: in `dock`, share of episodes within 0.05 m and 0.05 rad; None elsewhere.
        legs: in `shift`, number of its drives by how they ended, "not begun" among them; empty elsewhere.
        nines: see `figure.nines`.
        by_length, by_detour, by_neck, by_met: mean score and number of episodes by the class of L*, of L* / straight
            distance, of the widest disc that reaches the goal, and of the number of people met.
    """

    task: TaskName
    level: int
    suite: str
    draft: bool
    episodes: int
    expected: int
    errors: int
    score: Estimate
    success: Estimate
    contacts: Estimate
    endings: dict[str, int]
    contact: dict[str, int]
    parked: int
    precise: Estimate | None
    legs: dict[str, int] = Field(default_factory=dict)
    nines: float | None
    by_length: dict[str, tuple[float, int]]
    by_detour: dict[str, tuple[float, int]]
    by_neck: dict[str, tuple[float, int]] = Field(default_factory=dict)
    by_met: dict[str, tuple[float, int]] = Field(default_factory=dict)


class LabNavSummary(EvaluationSummary, Growing):
    """The results of a policy on a suite.

    Attributes:
        suite: name. hash: of its episodes. policy: label. options: its arguments. track: what it knows.
        sensors: its observation. seed: of the evaluation. box: level of the box in which it drove.
        latency: by which its actions came late, seconds. declared: latency that it declares, if that is another.
        tasks: in the order of the suite.
        labnav: the figure, 0 to 100; None unless the suite has all eight tasks. arithmetic: 100 times the mean score.
    """

    SCHEMA: ClassVar[str] = "labgym.labnav-summary/1"
    ADDED: ClassVar[frozenset[str]] = frozenset({"declared", "box"})

    suite: str
    hash: str
    policy: str
    options: dict[str, Any]
    track: Track
    sensors: Sensors
    seed: int
    latency: float
    declared: float | None = None
    box: Annotated[str, Field(max_length=LONGEST_LEVEL)] = BUILT_IN_CODE
    tasks: tuple[TaskSummary, ...]
    labnav: Estimate | None
    arithmetic: float | None

    @property
    def stated_latency(self) -> float:
        """Latency that the policy declares, seconds."""
        return self.latency if self.declared is None else self.declared

    @property
    def by_task(self) -> dict[str, TaskSummary]:
        """The results by task and level, such as "aisle-2"."""
        return {f"{task.task}-{task.level}": task for task in self.tasks}

    @property
    def mean(self) -> float:
        """100 times the arithmetic mean of the task means; 0 without tasks."""
        return 100.0 * fmean([task.score.value or 0.0 for task in self.tasks]) if self.tasks else 0.0

    @property
    def headline(self) -> Estimate:
        """LabNav; where tasks are missing 100 times the mean score, which has an interval if it is that of one task."""
        if self.labnav is not None:
            return self.labnav
        low = high = None
        if len(self.tasks) == 1:
            low, high = (
                None if end is None else 100.0 * end for end in (self.tasks[0].score.low, self.tasks[0].score.high)
            )
        count = sum(task.episodes for task in self.tasks)
        return Estimate(value=self.mean, low=low, high=high, count=count, nulls=0)

    @property
    def endings(self) -> Counter[str]:
        """Number of episodes by how they ended, over all tasks."""
        return sum((Counter(task.endings) for task in self.tasks), Counter[str]())

    @property
    def touched(self) -> Counter[str]:
        """Number of episodes that ended by a contact, by the thing's kind, over all tasks."""
        return sum((Counter(task.contact) for task in self.tasks), Counter[str]())

    def share(self, quantity: Literal["success", "contacts"]) -> float | None:
        """Return the share of episodes that succeeded, or in which the robot touched something, over all tasks."""
        counted = [(getattr(task, quantity).value, task.episodes) for task in self.tasks]
        whole = sum(count for value, count in counted if value is not None)
        return sum(value * count for value, count in counted if value is not None) / whole if whole else None

    def classes(self, field: str) -> dict[str, tuple[float, int]]:
        """Return mean score and number of episodes of each class of difficulty over all tasks, easy ones first.

        Args:
            field: of `DIFFICULTIES`.
        """
        groups: dict[str, list[tuple[float, int]]] = {}
        for task in self.tasks:
            for name, group in getattr(task, field).items():
                groups.setdefault(name, []).append(group)
        counts = {name: sum(count for _, count in groups[name]) for name in sorted(groups, key=class_order)}
        return {name: (sum(m * n for m, n in groups[name]) / count, count) for name, count in counts.items()}

    @property
    def errors(self) -> int:
        """Number of episodes in which the policy failed."""
        return sum(task.errors for task in self.tasks)

    @property
    def draft(self) -> bool:
        """Whether some of the episodes may still change."""
        return any(task.draft for task in self.tasks)

    def recomputed(self, rows: Sequence[LabNavRow]) -> LabNavSummary:
        """Return the summary with every figure computed from rows."""
        parts = [_Part(each.suite, each.task, each.level, each.draft, each.expected) for each in self.tasks]
        fields = {
            name: getattr(self, name)
            for name in ("policy", "options", "track", "sensors", "seed", "latency", "declared", "box")
        }
        whole = is_whole(self.suite, [part.task for part in parts])
        return _summary(self.suite, self.hash, parts, rows, whole, fields)

    def differences(self, recomputed: LabNavSummary, exactly: bool) -> list[str]:  # noqa: ARG002 - of any version
        """Return the figures in which the summary differs from that of the rows, but for rounding."""
        names = [] if _alike(self.labnav, recomputed.labnav) else ["labnav"]
        for one, other in zip(self.tasks, recomputed.tasks, strict=True):
            unlike = [name for name in COMPARED if not _alike(getattr(one, name), getattr(other, name))]
            names += [f"{name} of {one.task}-{one.level}" for name in unlike]
        return names

    def incomplete(self, rows: Sequence[LabNavRow]) -> list[str]:
        """Return a sentence if rows are missing, and one if some are of other tasks."""
        problems = []
        counted, expected = sum(each.episodes for each in self.tasks), sum(each.expected for each in self.tasks)
        if counted != expected:
            problems.append(f"{EPISODES} holds {counted} of {expected} episodes; the others are left out")
        foreign = len(rows) - counted
        if foreign:
            problems.append(f"{EPISODES} has {foreign} rows of tasks that are not in {SUMMARY}")
        return problems


def _alike(one: Any, other: Any) -> bool:
    """Whether two figures are equal but for rounding."""
    values = [getattr(each, "value", each) for each in (one, other)]
    if all(isinstance(value, float) for value in values):
        return math.isclose(values[0], values[1], rel_tol=NEARLY, abs_tol=NEARLY)
    return bool(values[0] == values[1])


def summarise(suite: LabNavSuite, rows: Sequence[LabNavRow], **fields: Any) -> LabNavSummary:
    """Return the summary of the rows of a suite.

    Args:
        suite: the suite. rows: of one policy.
        fields: the fields of `LabNavSummary` that do not follow from these.
    """
    parts = [_Part(part.label, part.task, part.level, part.draft, len(part.episodes)) for part in suite.parts]
    return _summary(suite.name, suite.hash, parts, rows, suite.figure, fields)


@dataclass(frozen=True)
class _Part:
    """The episodes of a task: suite with its version, name, level, whether they are drafts, and their number."""

    suite: str
    task: str
    level: int
    draft: bool
    expected: int


def _summary(
    suite: str, digest: str, parts: Sequence[_Part], rows: Sequence[LabNavRow], whole: bool, fields: Mapping[str, Any]
) -> LabNavSummary:
    """Return a summary; `whole` says whether the suite gives the figure LabNav."""
    tasks = [_task([row for row in rows if (row.task, row.level) == (part.task, part.level)], part) for part in parts]
    complete = whole and all(task.episodes for task in tasks)
    pairs = {part.task: [(row.floor, row.score) for row in rows if row.task == part.task] for part in parts}
    means = [task.score.value or 0.0 for task in tasks]
    return LabNavSummary(
        suite=suite,
        hash=digest,
        tasks=tuple(tasks),
        labnav=figure(pairs) if complete else None,
        arithmetic=arithmetic(means) if complete else None,
        **fields,
    )


def _task(rows: Sequence[LabNavRow], part: _Part) -> TaskSummary:
    task, floors = task_of(part.task), [row.floor for row in rows]
    score = mean_score([(row.floor, row.score) for row in rows])
    precise = [
        float(row.success and row.final_distance <= PRECISE[0] and abs(row.final_heading) <= PRECISE[1]) for row in rows
    ]
    return TaskSummary(
        task=part.task,
        level=part.level,
        suite=part.suite,
        draft=part.draft,
        episodes=len(rows),
        expected=part.expected,
        errors=sum(row.error is not None for row in rows),
        score=score,
        success=bounded_mean([float(row.ending == "success") for row in rows], floors),
        contacts=bounded_mean([float(row.contacts > 0) for row in rows], floors),
        endings=dict(sorted(Counter(row.ending for row in rows).items())),
        contact=dict(sorted(Counter(kind_of(row.contact) for row in rows if row.contact).items())),
        parked=sum(row.stopped == "evaluator" for row in rows),
        precise=bounded_mean(precise, floors) if task.docks and not task.chain else None,
        legs=_legs(rows),
        nines=nines(score),
        **{field: classes(rows, class_of) for field, (_, class_of) in DIFFICULTIES.items()},
    )


def _legs(rows: Sequence[LabNavRow]) -> dict[str, int]:
    """Return the number of drives of shifts by how they ended."""
    endings = Counter(leg.ending for row in rows for leg in row.legs)
    rest = sum(row.goals - len(row.legs) for row in rows if row.legs)
    return dict(sorted(endings.items())) | ({NOT_BEGUN: rest} if rest else {})


def kind_of(name: str) -> str:
    """Return the kind of a thing of that name: without its number."""
    return name.rstrip("0123456789").rstrip("_- ") or name


def classes(rows: Iterable[LabNavRow], class_of: Callable[[LabNavRow], str | None]) -> dict[str, tuple[float, int]]:
    """Return the mean score and the number of episodes of each class, easy ones first.

    Args:
        class_of: returns the class of a row, None for none.
    """
    groups: dict[str, list[float]] = {}
    for row in rows:
        name = class_of(row)
        if name is not None:
            groups.setdefault(name, []).append(row.score)
    order = sorted(groups, key=class_order)
    return {name: (sum(groups[name]) / len(groups[name]), len(groups[name])) for name in order}


def class_order(name: str) -> tuple[float, str]:
    """Return the order of a class: by the first number in its name, "<" before it and ">=" after it."""
    first = next((float(word) for word in name.split() if word.replace(".", "", 1).isdigit()), 0.0)
    return first - 1e-3 * name.startswith("<") + 1e-3 * name.startswith(">="), name


def _length(row: LabNavRow) -> str:
    return _class(row.shortest, LENGTHS, " m")


def _detour(row: LabNavRow) -> str | None:
    return _class(row.shortest / row.straight, DETOURS, "") if row.straight else None


def _disc(row: LabNavRow) -> str | None:
    if row.neck is None:
        return None
    return f"{row.neck:.2f} m" + (" and more" if row.neck == RADII[-1] else "")


def _met(row: LabNavRow) -> str | None:
    """Return the class of the number of people that the robot met."""
    people = row.outcomes.get("people")
    if not isinstance(people, Mapping):
        return None
    count, (few, many) = int(people.get("met", 0)), MET
    return "0" if count < few else f"{few} or {many - 1}" if count < many else f"{many} and more"


def _class(value: float, edges: tuple[float, float], unit: str) -> str:
    low, high = edges
    if low <= value < high:
        return f"{low:g} to {high:g}{unit}"
    return f"< {low:g}{unit}" if value < low else f">= {high:g}{unit}"


DIFFICULTIES: dict[str, tuple[str, Callable[[LabNavRow], str | None]]] = {
    "by_length": ("Shortest length L*", _length),
    "by_detour": ("Detour: L* / straight distance", _detour),
    "by_neck": ("Neck: radius of the widest disc that reaches the goal", _disc),
    "by_met": ("People met", _met),
}
"""Heading and class of an episode of each kind of difficulty, by the field of `TaskSummary`."""


def _counted(endings: Mapping[str, int]) -> str:
    """Return numbers of episodes or drives by how they ended, in the order of the tables."""
    order = [name for name in (*ENDINGS, NOT_BEGUN) if name in endings]
    return ", ".join(f"{name} {endings[name]}" for name in order)


def summary_table(summary: LabNavSummary) -> Table:
    """Return the table of a summary: a row for each task."""
    rows = [
        (
            f"{task.task}-{task.level}",
            str(task.episodes),
            estimate_text(task.score, 3),
            estimate_text(task.success, 3),
            estimate_text(task.contacts, 3),
            _counted(task.endings),
        )
        for task in summary.tasks
    ]
    notes = [SUCCESS]
    if any(task.draft for task in summary.tasks):
        notes.append("Draft episodes: they may change, and their figures are not those of LabNav.")
    notes += [
        f"{task.task}-{task.level}: {sum(task.legs.values())} drives: {_counted(task.legs)}."
        for task in summary.tasks
        if task.legs
    ]
    if not is_rankable(summary.box):
        notes.append(f"{summary.policy} is {UNRANKED}.")
    parked = sum(task.parked for task in summary.tasks)
    if parked:
        notes.append(f"The evaluator stopped the robot in {parked} episodes: the policy cannot stop.")
    if summary.labnav is not None:
        notes.append(f"LabNav {estimate_text(summary.labnav, 1)}, arithmetic mean {summary.arithmetic:.1f}")
    head = ("task", "episodes", "score", "success", "touched", "how episodes ended")
    return Table(f"{summary.policy} ({summary.track}), suite {summary.suite}", head, tuple(rows), tuple(notes))
