"""Routes of policies on LabNav episodes: of each task those on which the policies differ most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.envs.labnav.worlds import prepared
from labgym.errors import LabgymError
from labgym.eval.drawing.episode_plan import draw_map, draw_route, route_of
from labgym.eval.drawing.palette import MUTED
from labgym.eval.drawing.pictures import picture_bytes
from labgym.eval.drawing.plan_drawing import DrivenPath, draw_traces, plan_size
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.suites import load_labnav
from labgym.eval.reports.report import Picture

EACH = 2
"""Number of episodes of a task whose routes are drawn."""
INCHES = 4.6
"""Longer side of a picture, inches."""


@dataclass(frozen=True)
class RouteJob:
    """A picture to draw.

    Attributes:
        part: the episodes of the task. episode: one of them.
        traces: the routes. colors: of the policies.
    """

    part: LabNavEpisodes
    episode: LabNavEpisode
    traces: tuple[DrivenPath, ...]
    colors: Mapping[str, str]

    @property
    def key(self) -> str:
        """Key of the rows."""
        return f"{self.part.task}-{self.part.level}/{self.episode.key}"


def route_jobs(
    evaluations: Sequence[LabNavEvaluation], colors: Mapping[str, str]
) -> tuple[tuple[RouteJob, ...], tuple[str, ...]]:
    """Return the pictures to draw, and a sentence for each task that has none.

    Args:
        evaluations: of one suite. colors: of the policies by their names.
    """
    name = evaluations[0].summary.suite
    try:
        parts = load_labnav(name).parts
    except LabgymError as error:
        return (), (f"no routes are drawn: {error}",)
    jobs, problems = [], []
    for part in parts:
        if any(row.suite != part.label for one in evaluations for row in one.rows if row.task == part.task):
            problems.append(f"routes of {part.name} are not drawn: its episodes are now those of {part.label}")
            continue
        episodes = {f"{part.task}-{part.level}/{each.key}": each for each in part.episodes}
        for key in _telling(evaluations, list(episodes)):
            jobs.append(RouteJob(part, episodes[key], _traces(evaluations, key), colors))  # noqa: PERF401
    return tuple(jobs), tuple(problems)


def draw_routes(job: RouteJob) -> Picture:
    """Return the picture of an episode: its world, the shortest path, and the routes driven."""
    from matplotlib.figure import Figure

    layout = job.part.layout(job.episode.floor)
    task = prepared(job.part.task, job.part.level, job.episode, layout)
    width, depth = plan_size(layout.floor)
    scale = INCHES / max(width, depth)
    figure = Figure(figsize=(width * scale, depth * scale), facecolor="#ffffff")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
    axes.set_axis_off()
    draw_map(axes, task)
    draw_route(axes, task, route_of(task), MUTED)
    draw_traces(axes, job.traces, dict(job.colors))
    reached = [trace.policy for trace in job.traces if trace.success]
    return Picture(f"{job.key}: reached by {', '.join(reached) or 'nobody'}", picture_bytes(figure))


def _telling(evaluations: Sequence[LabNavEvaluation], keys: Sequence[str]) -> list[str]:
    """Return the episodes with the greatest spread of scores, on different floors where possible."""
    scores = {key: [one.scores[key] for one in evaluations if key in one.scores] for key in keys}
    spread = {key: float(np.std(values)) for key, values in scores.items() if values}
    chosen: list[str] = []
    for key in sorted(spread, key=lambda key: (-spread[key], keys.index(key))):
        if key.split("/")[-2] not in {each.split("/")[-2] for each in chosen}:
            chosen.append(key)
    return chosen[:EACH]


def _traces(evaluations: Sequence[LabNavEvaluation], key: str) -> tuple[DrivenPath, ...]:
    success = {(one.name, row.key): row.success for one in evaluations for row in one.rows}
    return tuple(
        DrivenPath(one.name, np.array(one.routes[key], dtype=np.float64)[:, :2], success[one.name, key])
        for one in evaluations
        if one.routes.get(key) and (one.name, key) in success
    )
