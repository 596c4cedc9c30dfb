"""An evaluation of LabNav: driven, or read from its folder."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from labgym.documents import Record, read_json
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.episode_row import Count, LabNavRow, Length
from labgym.eval.driving.evaluation import KINDS, Evaluation
from labgym.eval.driving.files import SUMMARY, TIMES, EpisodeTime
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav.latency import percentile
from labgym.eval.labnav.rules import is_slow
from labgym.eval.labnav.summary import LabNavSummary
from labgym.runs.identity import IDENTITY_FILE


class Thinking(Record):
    """The measured time of a policy in an evaluation.

    Attributes:
        seconds: 90th percentile over the episodes of the 90th percentile of an episode's actions.
        declared: latency that the policy declares, seconds. charged: by which its actions came late.
        slow: episodes in which its actions took longer than was charged. episodes: that were measured.
    """

    seconds: Length
    declared: Length
    charged: Length
    slow: Count
    episodes: Count

    @classmethod
    def of(cls, times: Iterable[EpisodeTime], declared: float, charged: float) -> Thinking | None:
        """Return the time of a policy in some episodes; None if none was measured."""
        measured = [time.high_ms for time in times if time.high_ms is not None]
        if not measured:
            return None
        return cls(
            seconds=round(percentile(measured) / 1e3, 4),
            declared=declared,
            charged=charged,
            slow=sum(is_slow(each / 1e3, charged) for each in measured),
            episodes=len(measured),
        )

    @property
    def mark(self) -> str:
        """Words on a policy that thinks longer than it declares: "thinks 0.23 s, declares 0.1 s"; else ""."""
        late = is_slow(self.seconds, self.charged)
        if not late and self.charged <= self.declared:
            return ""
        words = f"thinks {self.seconds:.2f} s, declares {self.declared:g} s"
        paid = f", its actions come {self.charged:g} s late" if self.charged > self.declared else ""
        return words + paid + (f", longer in {self.slow} of {self.episodes} episodes" if late else "")


def time_problems(rows: Iterable[LabNavRow], times: Mapping[str, EpisodeTime], latency: float) -> Iterator[str]:
    """Yield a sentence for each episode whose measured time is missing or does not have its mark.

    Args:
        rows: of an evaluation. times: by the rows' key. latency: by which actions came late, seconds.
    """
    for row in rows:
        time = times.get(row.key)
        if time is None or (time.high_ms is None and row.error is None):
            yield f"episode {row.key} has no measured time of the policy in {TIMES}"
        elif time.slow != (time.high_ms is not None and is_slow(time.high_ms / 1e3, latency)):
            took = f"the policy took {time.high_ms} ms at a latency of {latency:g} s"
            yield f"episode {row.key}: slow is {time.slow} in {TIMES}, but {took}"


@dataclass(frozen=True)
class LabNavEvaluation(Evaluation[LabNavSummary, LabNavRow]):
    """The evaluation of a policy on a suite of LabNav."""

    KIND = KINDS[1]
    SUMMARY = LabNavSummary
    ROW = LabNavRow

    @cached_property
    def thinking(self) -> Thinking | None:
        """The measured time of the policy; None if it was not measured."""
        return Thinking.of(self.times.values(), self.summary.stated_latency, self.summary.latency)

    @cached_property
    def metrics(self) -> dict[str, Estimate]:
        """The figure `labnav` if the suite has it, and the mean score of each task and level, such as "aisle-2"."""
        figure = self.summary.labnav
        scores = {name: task.score for name, task in self.summary.by_task.items()}
        return scores if figure is None else {"labnav": figure, **scores}

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
