"""Drives episodes in the time of a person's clock, and publishes every control step."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from labgym.envs.robot import ROBOT
from labgym.envs.world import world_of
from labgym.eval.driving.drive import TransitionDrive, drive_episodes
from labgym.layouts import Layout
from labgym.policies.policy import Driver
from labgym.suites import Suite
from labgym.viewer.console import Console
from labgym.viewer.episodes import ViewerEpisode, description
from labgym.viewer.moment import Moment, PageSenses, outcome

PAUSE_S = 4.0
"""Seconds between the end of a policy's episode and the next one."""


class PacedShow(ABC):
    """Drives one episode after the other, as an evaluation does, but paced.

    A policy's episodes follow each other, from the first again after the last. A person's episode begins at the first
    key, and the next one when the page asks for it. An episode that is left before its end has no result.

    Args:
        console: the commands of the page. label: name of the driver.
        waits: whether the driver is a person, for whom the clock waits.
        control_dt: duration of a control step, seconds.
    """

    def __init__(self, console: Console, label: str, waits: bool = False, control_dt: float = ROBOT.control_dt) -> None:
        self.console, self.label, self.waits = console, label, waits
        self._control_dt = control_dt
        self._published = threading.Condition()
        self._moment: Moment | None = None
        self._number = 0
        self._attempt = 0
        self._due = 0.0
        self._first = True

    @property
    @abstractmethod
    def labels(self) -> list[str]:
        """A line for each episode, which the page lists."""

    @property
    @abstractmethod
    def suite_label(self) -> str:
        """Name and version of the suite."""

    @abstractmethod
    def layout(self, number: int) -> Layout:
        """Return what stands still in an episode."""

    @abstractmethod
    def description(self, number: int) -> dict[str, Any]:
        """Return what the page draws of an episode besides the layout."""

    def shape(self, number: int) -> bytes | None:  # noqa: ARG002
        """Return a shape that moves, as binary glTF; None if there is no such shape."""
        return None

    @abstractmethod
    def _drive(self, number: int) -> bool:
        """Drive an episode; return False if the page asked for another one before its end."""

    def run(self, number: int = 0) -> None:
        """Drive until the thread is interrupted, beginning with an episode; wait for a page first."""
        while True:
            self.console.wait_for_page()
            chosen = self.console.take_episode()
            number = (number if chosen is None else chosen) % len(self.labels)
            self._attempt, self._due, self._first = self._attempt + 1, time.monotonic(), True
            if self._drive(number):
                self.console.wait_for_episode(None if self.waits else PAUSE_S)
                number += 1

    def next_moment(self, after: int, seconds: float) -> tuple[int, Moment | None]:
        """Return the number and the content of the latest moment, or None if none follows `after` in time."""
        with self._published:
            self._published.wait_for(lambda: self._number > after, seconds)
            return self._number, self._moment if self._number > after else None

    def _show(self, moment: Callable[[str], Moment], number: int) -> None:
        """Publish the moment of a phase, and wait for the next control step.

        Raises:
            AnotherEpisodeError: the page asked for another episode.
        """
        self._publish(moment("ready" if self._first and self.waits else "driving"))
        if self._first:
            self.console.wait_for_scene(number)
            if self.waits:
                self.console.wait_for_key()
            self._due, self._first = time.monotonic(), False
        self._wait()

    def _finish(self, result: dict[str, Any]) -> None:
        """Publish the latest moment with the result of the episode."""
        if self._moment is not None:
            self._publish(replace(self._moment, phase="finished", result=result))

    def _publish(self, moment: Moment) -> None:
        with self._published:
            self._moment = replace(moment, paused=self.console.paused, speed=self.console.speed)
            self._number += 1
            self._published.notify_all()

    def _wait(self) -> None:
        """Wait for the next control step; a late step does not make later ones hurry."""
        self._due = max(self._due + self._control_dt / self.console.speed, time.monotonic() - 0.2)
        self.console.wait_until(self._due)
        if self.console.requested_episode is not None:
            raise AnotherEpisodeError


class Show(PacedShow):
    """Drives the episodes of a suite of layouts.

    Args:
        episodes: the episodes. suite: their rules.
        driver: a policy or a `KeyboardDriver`. label: its name in the rows.
        seed: random seed of the evaluation.
        console: the commands of the page.
        waits: whether the driver is a person, for whom the clock waits.
        finished: receives every finished drive.
    """

    def __init__(
        self,
        episodes: Sequence[ViewerEpisode],
        suite: Suite,
        driver: Driver,
        label: str,
        console: Console,
        *,
        seed: int = 0,
        waits: bool = False,
        finished: Callable[[TransitionDrive], None] = lambda _: None,
    ) -> None:
        super().__init__(console, label, waits, suite.control_dt)
        self.episodes, self.suite = episodes, suite
        self._driver, self._seed, self._finished = driver, seed, finished
        self._senses = PageSenses()

    @property
    def labels(self) -> list[str]:
        """The layout of each episode, and from where to where the robot drives."""
        return [episode.label for episode in self.episodes]

    @property
    def suite_label(self) -> str:
        """Name and version of the suite."""
        return self.suite.label

    def layout(self, number: int) -> Layout:
        """Return the layout of an episode."""
        return self.episodes[number].layout

    def description(self, number: int) -> dict[str, Any]:
        """Return ends, shortest path and plan of an episode."""
        return description(self.episodes[number], self.suite.success_distance)

    def _drive(self, number: int) -> bool:
        episode = self.episodes[number]
        world = world_of(episode.layout)

        def watch(info: dict[str, Any]) -> None:
            self._show(lambda phase: self._senses.moment(world, info, phase, number, self._attempt), number)

        try:
            (drive,) = drive_episodes(
                self._driver, episode.layout, (episode.assignment,), self.suite, self.label, self._seed, watch=watch
            )
        except AnotherEpisodeError:
            return False
        self._finish(outcome(drive.row))
        self._finished(drive)
        return True


class AnotherEpisodeError(Exception):
    """The page asked for another episode."""
