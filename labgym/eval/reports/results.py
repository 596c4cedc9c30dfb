"""The results in folders: layouts, their scores, and evaluations of policies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.drawing.plan_drawing import DrivenPath
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import UNFINISHED, Evaluation, TransitionEvaluation, is_unfinished
from labgym.eval.labnav.evaluation import is_labnav_run
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.layouts import Layout


@dataclass(frozen=True)
class ResultsFolder:
    """The results in a folder.

    Attributes:
        folder: where the report is written.
        layouts: layouts in the order of their ids.
        scores: scores by layout id; a layout may have none.
        evaluations: evaluations in the order in which they are shown, with unique names.
        problems: contradictions between the files of the folders, one sentence each.
    """

    folder: Path
    layouts: tuple[Layout, ...]
    scores: dict[str, LayoutReport]
    evaluations: tuple[TransitionEvaluation, ...]
    problems: tuple[str, ...] = ()

    @classmethod
    def read(cls, folder: str | Path, policies: Sequence[str] = (), others: Sequence[str | Path] = ()) -> ResultsFolder:
        """Read the folder of a run, or of one or more evaluations.

        Args:
            folder: folder written by `labgym run` or `labgym eval`.
            policies: policies to include, in this order; empty includes all, sorted by name.
            others: further folders whose evaluations are added.

        Raises:
            DocumentError: the folder has no results, or a file is broken.
        """
        folder = Path(folder)
        folders = [folder, *map(Path, others)]
        for place in folders:
            _check_has_results(place)
        found = [path.parent for each in folders for path in sorted(each.glob("**/summary.json"))]
        paths = [path for path in found if not is_labnav_run(path)]
        places = {path.resolve(): path for path in paths}
        evaluations = sorted(map(TransitionEvaluation.read, places.values()), key=lambda one: one.name)
        if policies:
            evaluations = [one for policy in policies for one in evaluations if one.summary.policy == policy]
        evaluations = distinguished(evaluations)
        layouts, problems = _layouts(folders, evaluations)
        scores = [LayoutReport.load(path) for path in sorted(folder.glob("scores/*.json"))]
        runs = [path.parent for each in folders for path in sorted(each.glob("**/run.json"))]
        unfinished = [f"{path}: {UNFINISHED}" for path in runs if is_unfinished(path)]
        return cls(
            folder,
            tuple(layouts),
            {score.layout: score for score in scores},
            tuple(evaluations),
            (*unfinished, *problems, *(problem for one in evaluations for problem in one.problems)),
        )

    def traces(self, layout: Layout) -> tuple[DrivenPath, ...]:
        """Return the paths of all policies in a layout, for drawing."""
        return tuple(
            DrivenPath(one.name, np.array(one.routes[row.key], dtype=np.float64)[:, :2], row.success)
            for one in self.evaluations
            for row in one.in_layout(layout)
            if one.routes.get(row.key)
        )


E = TypeVar("E", bound=Evaluation[Any, Any])


def distinguished(evaluations: Sequence[E]) -> list[E]:
    """Return evaluations with unique names: equal names get the part of the folder that differs as a suffix."""
    names = [one.name for one in evaluations]
    groups = {name: [one for one in evaluations if one.name == name] for name in names}
    suffixes = {
        one.folder: suffix
        for group in groups.values()
        if len(group) > 1
        for one, suffix in zip(group, _suffixes([one.folder.resolve() for one in group]), strict=True)
    }
    return [
        one.named(f"{one.name} ({suffixes[one.folder]})" if one.folder in suffixes else one.name) for one in evaluations
    ]


def _suffixes(folders: Sequence[Path]) -> list[str]:
    """Return the last component of each path in which all differ; the whole path if none does."""
    for depth in range(1, min(len(folder.parts) for folder in folders) + 1):
        parts = [folder.parts[-depth] for folder in folders]
        if len(set(parts)) == len(parts):
            return parts
    return [str(folder) for folder in folders]


def _layouts(folders: Iterable[Path], evaluations: Sequence[TransitionEvaluation]) -> tuple[list[Layout], list[str]]:
    """Return the layouts of the folders or else of the suite, by id, and a sentence for those that differ."""
    layouts: dict[str, Layout] = {}
    for path in sorted((path for each in folders for path in each.glob("layouts/*.json")), key=lambda path: path.name):
        layout = Layout.load(path)
        layouts.setdefault(layout.id, layout)
    splits = [one.summary.suite for one in evaluations if one.summary.suite.split is not None]
    if not layouts and splits:
        layouts = {layout.id: layout for layout in splits[0].load_layouts()}
    differing = {
        name: one.folder
        for one in evaluations
        for name, digest in one.summary.layouts.items()
        if name in layouts and layouts[name].hash != digest
    }
    problems = [
        f"{place}: drove in another version of layout {name!r} than the one shown; its routes are not drawn"
        for name, place in sorted(differing.items())[:3]
    ]
    return [layouts[name] for name in sorted(layouts)], problems


def _check_has_results(folder: Path) -> None:
    if is_unfinished(folder):
        raise DocumentError(folder, "", UNFINISHED)
    if not any(folder.glob("**/summary.json")) and not any(folder.glob("layouts/*.json")):
        raise DocumentError(folder, "", "holds neither layouts/*.json nor an evaluation's summary.json")


def recorded_drive(folder: str | Path, episode: str, policy: str | None = None) -> tuple[Layout, TransitionRow, Route]:
    """Return the layout, the row and the route of an episode in a folder of results.

    Args:
        folder: written by `labgym eval`, `labgym run` or `labgym play`.
        episode: LAYOUT/PAIR or LAYOUT/PAIR/REPEAT. policy: name of the policy, where the folder holds several.

    Raises:
        DocumentError: the folder holds no such results, or the episode has no route.
        OptionError: it holds evaluations of several policies, or the episode is not named as above.
        UnknownNameError: there is no such episode.
    """
    results = ResultsFolder.read(folder)
    fitting = [one for one in results.evaluations if policy in (None, one.name, one.summary.policy)]
    if len(fitting) != 1:
        names = ", ".join(one.name for one in results.evaluations) or "none"
        raise OptionError(f"{folder} holds evaluations of {names}: name one of them with --policy")
    evaluation = fitting[0]
    name, *parts = episode.split("/")
    if not 1 <= len(parts) <= 2 or not all(part.isdecimal() and len(part) < 7 for part in parts):
        raise OptionError(f"episode {episode[:80]!r} must be LAYOUT/PAIR or LAYOUT/PAIR/REPEAT, such as test-sub_01/3")
    key = f"{name}/{int(parts[0])}/{int(parts[1]) if len(parts) == 2 else 0}"
    rows = {row.key: row for row in evaluation.rows}
    if key not in rows:
        raise UnknownNameError(f"{folder}: episode", episode, rows)
    layout = next((each for each in results.layouts if each.id == name), None)
    route = evaluation.routes.get(key)
    if layout is None or layout.hash != rows[key].layout_hash or not route:
        raise DocumentError(folder, f"episode {episode}", "has no route, or its layout is another version")
    return layout, rows[key], route
