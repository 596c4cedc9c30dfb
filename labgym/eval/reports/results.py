"""The results in a folder: layouts, their scores, and evaluations of policies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from labgym.errors import DocumentError, LabgymError
from labgym.eval.drawing.plan_drawing import Trace
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import EpisodeRow, Key, read_rows
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
    routes: dict[Key, Route]

    @classmethod
    def read(cls, folder: Path) -> Evaluation:
        """Read the folder of an evaluation.

        Raises:
            DocumentError: the folder has no summary, or the summary cannot be read.
        """
        summary = NavigationSummary.load(folder / "summary.json")
        return cls(folder, summary, read_rows(folder / "episodes.jsonl"), read_routes(folder / "routes.jsonl"))

    def of(self, layout: str) -> tuple[EpisodeRow, ...]:
        """Return the episodes in a layout."""
        return tuple(row for row in self.rows if row.layout == layout)

    def traces(self, layout: str) -> tuple[Trace, ...]:
        """Return the paths driven in a layout, for drawing."""
        return tuple(
            Trace(row.policy, np.array(self.routes[row.key], dtype=np.float64)[:, :2], row.success)
            for row in self.of(layout)
            if self.routes.get(row.key)
        )


@dataclass(frozen=True)
class ResultsFolder:
    """The results in a folder.

    Attributes:
        folder: where the report is written.
        layouts: layouts in the order of their ids.
        scores: scores by layout id; a layout may have none.
        evaluations: evaluations in the order in which they are shown.
    """

    folder: Path
    layouts: tuple[Layout, ...]
    scores: dict[str, LayoutReport]
    evaluations: tuple[Evaluation, ...]

    @classmethod
    def read(cls, folder: str | Path, policies: Sequence[str] = (), others: Sequence[str | Path] = ()) -> ResultsFolder:
        """Read the folder of a run, or of one or more evaluations.

        Args:
            folder: folder written by `labgym run` or `labgym eval`.
            policies: policies to include, in this order; empty includes all, sorted by name.
            others: further folders whose evaluations are added.

        Raises:
            LabgymError: two evaluations are of the same policy.
            DocumentError: the folder has no results, or a file is broken.
        """
        folder = Path(folder)
        folders = [folder, *map(Path, others)]
        for place in folders:
            if not any(place.glob("**/summary.json")) and not any(place.glob("layouts/*.json")):
                raise DocumentError(place, "", "holds neither layouts/*.json nor an evaluation's summary.json")
        evaluations = sorted(
            (Evaluation.read(path.parent) for place in folders for path in place.glob("**/summary.json")), key=_policy
        )
        if policies:
            evaluations = [one for policy in policies for one in evaluations if _policy(one) == policy]
        paths = {path.name: path for place in folders for path in place.glob("layouts/*.json")}
        layouts = [Layout.load(path) for _, path in sorted(paths.items())]
        if not layouts and evaluations and evaluations[0].summary.suite.split is not None:
            layouts = list(evaluations[0].summary.suite.load_layouts())
        labels = [_policy(evaluation) for evaluation in evaluations]
        repeated = sorted({label for label in labels if labels.count(label) > 1})
        if repeated:
            raise LabgymError(
                f"{', '.join(map(str, folders))}: two evaluations of policy {repeated[0]!r}; name the folder of one"
            )
        scores = [LayoutReport.load(path) for path in sorted(folder.glob("scores/*.json"))]
        return cls(folder, tuple(layouts), {score.layout: score for score in scores}, tuple(evaluations))

    def traces(self, layout: str) -> tuple[Trace, ...]:
        """Return the paths of all policies in a layout."""
        return tuple(trace for evaluation in self.evaluations for trace in evaluation.traces(layout))


def _policy(evaluation: Evaluation) -> str:
    return evaluation.summary.policy
