"""LabNav in the viewer: people, glass and what differs from the map, driven under the benchmark's rules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from labgym.envs.conditions.bodies import Body, BodyShape
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.nuisances import prepared
from labgym.envs.labnav.task import SECONDS
from labgym.envs.labnav.tasks import task_of
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.eval.drawing.episode_plan import people_of, route_of
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.leg import LabNavDriver
from labgym.eval.labnav.results import DriveTerms
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.viewer.console import Console
from labgym.viewer.episodes import plan_of
from labgym.viewer.glb import shape_glb
from labgym.viewer.moment import PageSenses
from labgym.viewer.show import AnotherEpisodeError, PacedShow

ADDED_COLOR, GLASS_COLOR = "#e0561b", "#00a6c8"
"""Colors on the plan of what is not on the map, and of glass."""


@dataclass(frozen=True, eq=False)
class LabNavWatch:
    """An episode to watch.

    Attributes:
        name, level: of the task. layout: as published. episode: on it. suite: its name and version in rows.
    """

    name: str
    level: int
    layout: Layout
    episode: LabNavEpisode
    suite: str = "labnav"

    @classmethod
    def of(cls, name: str, level: int, layout: Layout, episode: LabNavEpisode) -> LabNavWatch:
        """Return an episode whose world has been prepared.

        Raises:
            OptionError: the data of a condition is not of this layout.
        """
        watch = cls(name, level, layout, episode)
        _ = watch.task
        return watch

    @cached_property
    def task(self) -> Task:
        """The task after its conditions."""
        return prepared(self.name, self.level, self.episode, self.layout)

    @property
    def label(self) -> str:
        """Task, level, floor and number."""
        return f"{self.name}-{self.level}/{self.episode.key}"


class LabNavShow(PacedShow):
    """Drives episodes of LabNav.

    Args:
        episodes: the episodes. driver: the policy, or a `LabNavKeyboardDriver`. label: its name.
        console: the commands of the page. seed: random seed of the policy.
        finished: receives every finished drive.
        waits: whether the driver is a person, for whom the clock waits.
        seconds: time limit of a drive. suite: name of the suite on the page.
    """

    def __init__(
        self,
        episodes: Sequence[LabNavWatch],
        driver: LabNavDriver,
        label: str,
        console: Console,
        *,
        seed: int = 0,
        finished: Callable[[LabNavDrive], None] = lambda _: None,
        waits: bool = False,
        seconds: float = SECONDS,
        suite: str = "labnav",
    ) -> None:
        super().__init__(console, label, waits)
        self.episodes = episodes
        self._driver, self._seed, self._finished = driver, seed, finished
        self._seconds, self._suite = seconds, suite
        self._senses = PageSenses()
        self._shapes: list[BodyShape] = []

    @property
    def labels(self) -> list[str]:
        """Task, level, floor and number of each episode."""
        return [each.label for each in self.episodes]

    @property
    def suite_label(self) -> str:
        """Name of the suite."""
        return self._suite

    def layout(self, number: int) -> Layout:
        """Return the true floor of an episode without the things that the robot can push."""
        task = self.episodes[number].task
        return task.fixed

    def description(self, number: int) -> dict[str, Any]:
        """Return ends, shortest path, plan, and what differs from the map, of an episode."""
        watch = self.episodes[number]
        task, layout = watch.task, self.layout(number)
        route = route_of(task)
        return {
            "label": watch.label,
            "layout": layout.hash,
            "protocol": task_of(watch.name).summary,
            "start": list(task.pair.start),
            "goal": list((task.pair, *task.following)[-1].goal),
            "docks": task_of(watch.name).docks,
            "success_distance": task_of(watch.name).radius,
            "shortest": round(sum(watch.episode.lengths), 3),
            "path": np.round(route, 3).tolist(),
            "changes": [[color, np.round(corners, 3).tolist()] for color, corners in changes_of(task)],
            **plan_of(layout),
        }

    def shape(self, number: int) -> bytes | None:
        """Return a shape that moves, as binary glTF; None if there is no such shape."""
        return shape_glb(self._shapes[number].mesh) if number < len(self._shapes) else None

    def _drive(self, number: int) -> bool:
        episode = self.episodes[number]

        def watch(state: State) -> None:
            bodies = state.bodies
            placed = tuple((self._number_of(body), *_rounded(body.pose)) for body in bodies)
            people = tuple((*_rounded(each.pose), int(each.yields)) for each in people_of(state.task, bodies))
            self._show(lambda phase: self._senses.of_state(state, phase, number, self._attempt, placed, people), number)

        try:
            (drive,) = drive_floor(
                self._driver,
                episode.layout,
                (episode.episode,),
                DriveTerms(episode.name, episode.level, self.label, episode.suite, self._seed, self._seconds),
                watch,
            )
        except AnotherEpisodeError:
            return False
        self._finish(_outcome(drive))
        self._finished(drive)
        return True

    def _number_of(self, body: Body) -> int:
        """Return the number of a body's shape; shapes of all episodes stay."""
        for number, shape in enumerate(self._shapes):
            if shape is body.shape:
                return number
        self._shapes.append(body.shape)
        return len(self._shapes) - 1


def changes_of(task: Task) -> list[tuple[str, np.ndarray[Any, Any]]]:
    """Return color and corners of what stands on the true floor and not on the map, and of glass."""
    before, after = task.old_map or task.layout, task.layout
    changes = []
    for placement in after.placements:
        then, box = before.by_id.get(placement.id), after.box(placement.id)
        if placement.support != FLOOR or box.z0 >= OBSTACLE_HEIGHT or placement.id in task.pushable:
            continue
        if placement.asset in (FRAMED, FRAMELESS):
            changes.append((GLASS_COLOR, box.corners()))
        elif then is None or (then.position, then.yaw) != (placement.position, placement.yaw):
            changes.append((ADDED_COLOR, box.corners()))
    return changes


def _outcome(drive: LabNavDrive) -> dict[str, Any]:
    """Return what the page shows of a finished episode."""
    row = drive.row
    contact = f" ({row.contact})" if row.contact else ""
    words = f"{row.ending}{contact}, score {row.score:.3f}; {row.path_length:.2f} m in {row.time:.1f} s"
    return {
        "success": row.success,
        "words": f"{words}; {row.error}" if row.error else words,
        "final_distance": row.final_distance,
    }


def _rounded(pose: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, yaw = pose
    return round(x, 3), round(y, 3), round(yaw, 3)
