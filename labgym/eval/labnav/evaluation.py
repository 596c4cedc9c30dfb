"""An evaluation of LabNav: driven, or read from its folder."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from labgym.documents import read_json
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.evaluation import KINDS, Evaluation
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav.summary import LabNavSummary, TaskSummary
from labgym.eval.labnav.thinking import Thinking
from labgym.runs.identity import IDENTITY_FILE


@dataclass(frozen=True)
class LabNavEvaluation(Evaluation[LabNavSummary, LabNavRow]):
    """The evaluation of a policy on a suite of LabNav."""

    KIND = KINDS[1]
    SUMMARY = LabNavSummary
    ROW = LabNavRow

    @cached_property
    def thinking(self) -> Thinking | None:
        """The measured time of the policy; None if it was not measured."""
        summary = self.summary
        declared = summary.latency if summary.declared is None else summary.declared
        return Thinking.of(self.times.values(), declared, summary.latency)

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """The figure `labnav` if the suite has it, and the mean score of each task and level, such as "aisle-2"."""
        figure = self.summary.labnav
        scores = {name: task.score for name, task in self.tasks.items()}
        return scores if figure is None else {"labnav": figure, **scores}

    @cached_property
    def tasks(self) -> dict[str, TaskSummary]:
        """The results by task and level, such as "aisle-2"."""
        return {f"{each.task}-{each.level}": each for each in self.summary.tasks}

    @cached_property
    def scores(self) -> dict[str, float]:
        """The scores by the rows' key."""
        return {row.key: row.score for row in self.rows}

    def row(self, key: str) -> LabNavRow:
        """Return the row of an episode by its key, such as people-2/floors-val-0003/1, or by a unique end of it.

        Raises:
            UnknownNameError: there is no such episode.
            OptionError: there are several.
        """
        fitting = [row for row in self.rows if row.key == key or row.key.endswith(f"/{key.lstrip('/')}")]
        exact = [row for row in fitting if row.key == key] or fitting
        if not exact:
            raise UnknownNameError(f"{self.folder}: episode", key, [row.key for row in self.rows])
        if len(exact) > 1:
            names = ", ".join(row.key for row in exact[:5])
            raise OptionError(f"{self.folder}: episode {key!r} is one of {names}: name its task too")
        return exact[0]


def is_labnav_run(folder: str | Path) -> bool:
    """Whether a folder holds an evaluation of LabNav, finished or not."""
    for name, field, value in (
        (IDENTITY_FILE, "kind", LabNavEvaluation.KIND),
        (SUMMARY, "schema", LabNavSummary.SCHEMA),
    ):
        path = Path(folder) / name
        if path.is_file():
            try:
                data = read_json(path)
            except DocumentError:
                continue
            if isinstance(data, dict) and data.get(field) == value:
                return True
    return False
