"""The results that a folder holds: layouts, their scores, and evaluations of policies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from labgym.errors import DocumentError, LabgymError
from labgym.eval.drawing.plan_drawing import Trace
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import EpisodeRow, read_rows
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.run_folder import read_routes
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.layouts import Layout


@dataclass(frozen=True)
class Evaluation:
    """One policy's evaluation: `summary.json`, `episodes.jsonl` and `routes.jsonl` of a folder."""

    folder: Path
    summary: NavigationSummary
    rows: tuple[EpisodeRow, ...]
    routes: dict[tuple[str, int], Route]

    @classmethod
    def read(cls, folder: Path) -> Evaluation:
        """Read an evaluation's folder.

        Raises:
            DocumentError: it has no summary, or one that cannot be read.
        """
        summary = NavigationSummary.load(folder / "summary.json")
        return cls(folder, summary, read_rows(folder / "episodes.jsonl"), read_routes(folder / "routes.jsonl"))

    def of(self, layout: str) -> tuple[EpisodeRow, ...]:
        """Return the episodes driven in a layout."""
        return tuple(row for row in self.rows if row.layout == layout)

    def traces(self, layout: str) -> tuple[Trace, ...]:
        """Return the paths driven in a layout, to be drawn."""
        return tuple(
            Trace(row.policy, np.array(self.routes[row.key], dtype=np.float64)[:, :2], row.success)
            for row in self.of(layout)
            if self.routes.get(row.key)
        )


@dataclass(frozen=True)
class ResultsFolder:
    """All that a folder holds.

    Attributes:
        layouts: in the order of their ids.
        scores: by layout id; a layout may have none.
        evaluations: in the order in which their policies are to be shown.
    """

    folder: Path
    layouts: tuple[Layout, ...]
    scores: dict[str, LayoutReport]
    evaluations: tuple[Evaluation, ...]

    @classmethod
    def read(cls, folder: str | Path, policies: Sequence[str] = ()) -> ResultsFolder:
        """Read the folder of a run, or of one or more evaluations.

        Args:
            folder: what `labgym run` or `labgym eval` wrote.
            policies: those to take, in this order; none takes all that there are, by name.

        Raises:
            LabgymError: there is nothing in it that could be shown.
            DocumentError: a file in it is broken.
        """
        folder = Path(folder)
        found = sorted((Evaluation.read(path.parent) for path in folder.glob("**/summary.json")), key=_policy)
        if policies:
            found = [one for policy in policies for one in found if _policy(one) == policy]
        layouts = [Layout.load(path) for path in sorted(folder.glob("layouts/*.json"))]
        if not layouts and found and found[0].summary.suite.split is not None:
            layouts = list(found[0].summary.suite.load_layouts())
        if not layouts and not found:
            raise DocumentError(folder, "", "holds neither layouts/*.json nor an evaluation's summary.json")
        scores = [LayoutReport.load(path) for path in sorted(folder.glob("scores/*.json"))]
        if len({one.summary.policy for one in found}) != len(found):
            raise LabgymError(f"{folder} holds two evaluations of one policy; name one of their folders")
        return cls(folder, tuple(layouts), {score.layout: score for score in scores}, tuple(found))

    def traces(self, layout: str) -> tuple[Trace, ...]:
        """Return the paths that all policies drove in a layout."""
        return tuple(trace for evaluation in self.evaluations for trace in evaluation.traces(layout))


def _policy(evaluation: Evaluation) -> str:
    return evaluation.summary.policy
