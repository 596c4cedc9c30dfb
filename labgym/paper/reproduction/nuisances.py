"""Cost of each nuisance of LabNav's tasks: drives of a policy on floors-val with one nuisance off at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from labgym.documents import Record
from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.envs.labnav.nuisances import NUISANCES, episode_without, nuisances_of, properties_without
from labgym.envs.labnav.tasks import FIGURE_TASKS, HEADLINE
from labgym.eval.driving.episode_row import Count, Ending, LabNavRow, Length, Share
from labgym.eval.driving.runner import policy_process
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.figure import paired_difference
from labgym.eval.labnav.foresight import in_place
from labgym.eval.labnav.leg import LabNavDriver
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import VAL, load_labnav
from labgym.eval.labnav.together import Entrant
from labgym.layouts import Layout
from labgym.paper.reproduction.figures import (
    FigureColumn,
    FigureLine,
    FigureTable,
    PublishedFigures,
    estimate_cell,
    plain_cells,
)
from labgym.paper.reproduction.study import Study, code_facts, rows_output
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import close_shared_process
from labgym.runs import Shard, ShardOutput

ON, NONE = "", "all"
"""Names of the variants with all nuisances, and without any."""
COLUMNS = (
    FigureColumn(key="with", heading="Score with it", digits=2),
    FigureColumn(key="without", heading="Score without it", digits=2),
    FigureColumn(key="difference", heading="Difference", digits=2),
)
NOTES = (
    "Each line: the same episodes with all nuisances and without one; Difference: paired, with its 95% interval and "
    "floors as the unit. All: without any nuisance of the task.",
    "Without parked things, changes, panes or the move of the station, L* is that of the floor without them; in carry "
    "without the beaker the score is that of aisle.",
    "Drives without a nuisance are no results of LabNav.",
)


class NuisanceRow(Record):
    """The results of an episode of which a nuisance may be off.

    Attributes:
        task, level, floor, number: the episode. policy: label.
        without: the nuisance that is off, "" for none, "all" for all.
        score, success, ending, contact, shortest, path_length, time, error: as in `LabNavRow`.
    """

    task: str
    level: int
    floor: str
    number: Count
    policy: str
    without: str
    score: Share
    success: bool
    ending: Ending
    contact: str
    shortest: Length
    path_length: Length
    time: Length
    error: str | None

    @classmethod
    def of(cls, row: LabNavRow, without: str) -> NuisanceRow:
        """Return the results in a row."""
        return cls(without=without, **{name: getattr(row, name) for name in cls.model_fields if name != "without"})

    @property
    def key(self) -> str:
        """Task, floor and number."""
        return f"{self.task}-{self.level}/{self.floor}/{self.number}"


@dataclass(frozen=True)
class NuisanceStudy(Study[NuisanceRow]):
    """A policy on the suites of some tasks with one nuisance off at a time.

    Attributes:
        entrant: the policy. parts: the episodes. seed: random seed of the policy.
    """

    entrant: Entrant
    parts: tuple[LabNavEpisodes, ...]
    seed: int = 0
    name: ClassVar[str] = "nuisances"
    unit: ClassVar[str] = "floor"
    row: ClassVar[type[Record]] = NuisanceRow

    def inputs(self) -> dict[str, Any]:
        """Return policy, episodes, seed and kernels."""
        return {
            "policy": self.entrant.fingerprint,
            "episodes": {part.name: part.hash for part in self.parts},
            "seed": self.seed,
            "kernels": kernel_mode(None).name,
        }

    def shards(self) -> Sequence[Shard]:
        """Return a shard for each floor of each task."""
        return tuple(
            Shard(name, drive_variants, (name, self.entrant, part.layout(floor), part, self.seed))
            for part in self.parts
            for floor in part.floors
            for name in (f"{part.task}-{part.level}/{floor}",)
        )

    def figures(self, rows: Sequence[NuisanceRow]) -> PublishedFigures:
        """Return the table of differences."""
        close_shared_process()  # If the floors were driven in this process.
        lines, found = [], []
        for part in self.parts:
            own = [row for row in rows if (row.task, row.level) == (part.task, part.level)]
            for variant in variants_of(part.task, part.level)[1:]:
                line, apart = _line(own, part, variant)
                lines.append(line)
                found += [f"{part.task} without {_words(variant)}, {line.cells['difference'].text(2)}"] if apart else []
        label = self.entrant.label
        table = FigureTable(
            key=label, title=f"What each nuisance costs {label}", first="Task", second="Nuisance", columns=COLUMNS,
            lines=tuple(lines), notes=NOTES,
        )  # fmt: skip
        words = "; ".join(found) or "none"
        return PublishedFigures(
            study=self.name,
            title=f"LabNav without its nuisances: {label}",
            source="",
            summary=(f"Scores that differ: {words}.",),
            facts={
                "policy": label,
                "suites": ", ".join(part.label for part in self.parts),
                "seed": str(self.seed),
                "kernels": kernel_mode(None).name,
                **code_facts(),
            },
            tables=(table,),
        )


def nuisance_study(policy: str, tasks: Sequence[str] = (), level: int = HEADLINE, seed: int = 0) -> NuisanceStudy:
    """Return the study of a policy on the suites of floors-val.

    Args:
        policy: a name for `make_policy`. seed: of the policy.
        tasks: names, also with their level, by default all. level: of the others.

    Raises:
        UnknownNameError: a task, the level or the policy does not exist.
        LabgymError: the policy cannot be loaded.
    """
    names = (task if task[-1:].isdigit() else f"{task}-{level}" for task in tasks or FIGURE_TASKS)
    parts = tuple(part for name in names for part in load_labnav(f"{VAL}-{name}").parts)
    return NuisanceStudy(Entrant.of(policy), parts, seed)


def variants_of(task: str, level: int) -> tuple[str, ...]:
    """Return the variants of a task: with all nuisances, without each one, and without any if there are several."""
    names = nuisances_of(task, level)
    return (ON, *names, *((NONE,) if len(names) > 1 else ()))


def drive_variants(shard: str, entrant: Entrant, layout: Layout, part: LabNavEpisodes, seed: int) -> ShardOutput:
    """Drive the episodes of a task on a floor in all variants and return a row for each."""
    process = policy_process(entrant.source, entrant.files, None, kernel_mode(None).kind)
    driver = in_place(process, entrant.source)
    episodes = part.floors[layout.id]
    rows: list[NuisanceRow] = []
    for variant in variants_of(part.task, part.level):
        rows += driven(driver, entrant.label, layout, episodes, part, variant, seed)
    return rows_output(shard, rows)


def driven(
    driver: LabNavDriver,
    label: str,
    layout: Layout,
    episodes: Sequence[LabNavEpisode],
    part: LabNavEpisodes,
    variant: str,
    seed: int = 0,
) -> list[NuisanceRow]:
    """Return the results of a policy in a variant of episodes on one floor.

    Args:
        driver: the policy. label: its name in the rows. layout: the floor. episodes: on it. part: their suite.
        variant: of `variants_of`. seed: of the policy.
    """
    task, level = part.task, part.level
    off = nuisances_of(task, level) if variant == NONE else (variant,) if variant else ()
    chosen = tuple(episode_without(each, layout, task, level, off) for each in episodes)
    properties = properties_without(task, level, off)
    suite = f"{part.label} without {_words(variant)}" if off else part.label
    drives = drive_floor(driver, layout, chosen, DriveTerms(task, level, label, suite, seed, properties=properties))
    return [NuisanceRow.of(drive.row, variant) for drive in drives]


def _line(rows: Sequence[NuisanceRow], part: LabNavEpisodes, variant: str) -> tuple[FigureLine, bool]:
    """Return the line of a variant of a task, and whether its scores are apart from those with all nuisances."""
    on, off = ({row.key: row.score for row in rows if row.without == name} for name in (ON, variant))
    gap = paired_difference(off, on)
    clusters = [key.split("/")[-2] for key in off]
    cells = {
        **plain_cells({"without": gap.a, "with": gap.b}),
        "difference": estimate_cell(gap.difference, clusters),
    }
    return FigureLine(name=part.task, detail=_words(variant), cells=cells), gap.significant


def _words(variant: str) -> str:
    return "all" if variant == NONE else NUISANCES[variant]
