"""Drives episodes in the time of a person's clock, and publishes every control step."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from labgym.envs.world import world_of
from labgym.eval.driving.drive import Drive, drive_episodes
from labgym.policies.policy import Driver
from labgym.suites import Suite
from labgym.viewer.console import Console
from labgym.viewer.episodes import Episode
from labgym.viewer.moment import Moment, Senses, outcome

PAUSE = 4.0
"""Seconds between the end of a policy's episode and the next one."""


class Show:
    """Drives one episode after the other, as an evaluation does, but paced.

    A policy's episodes follow each other, from the first again after the last. A person's episode begins at the first
    key, and the next one when the page asks for it. An episode that is left before its end has no result.

    Args:
        episodes: the episodes. suite: their rules.
        driver: a policy or a `Person`. label: its name in the rows.
        seed: random seed of the evaluation.
        console: the commands of the page.
        waits: whether the driver is a person, for whom the clock waits.
        finished: receives every finished drive.
    """

    def __init__(
        self,
        episodes: Sequence[Episode],
        suite: Suite,
        driver: Driver,
        label: str,
        console: Console,
        seed: int = 0,
        waits: bool = False,
        finished: Callable[[Drive], None] = lambda _: None,
    ) -> None:
        self.episodes, self.suite, self.label, self.console, self.waits = episodes, suite, label, console, waits
        self._driver, self._seed, self._finished = driver, seed, finished
        self._senses = Senses()
        self._published = threading.Condition()
        self._moment: Moment | None = None
        self._number = 0
        self._attempt = 0
        self._due = 0.0

    def run(self, number: int = 0) -> None:
        """Drive until the thread is interrupted, beginning with an episode; wait for a page first."""
        while True:
            self.console.wait_for_page()
            chosen = self.console.take_episode()
            number = (number if chosen is None else chosen) % len(self.episodes)
            drive = self._drive(number)
            if drive is not None:
                self._finished(drive)
                self.console.wait_for_episode(None if self.waits else PAUSE)
                number += 1

    def next_moment(self, after: int, seconds: float) -> tuple[int, Moment | None]:
        """Return the number and the content of the latest moment, or None if none follows `after` in time."""
        with self._published:
            self._published.wait_for(lambda: self._number > after, seconds)
            return self._number, self._moment if self._number > after else None

    def _drive(self, number: int) -> Drive | None:
        """Return the result of an episode; None if the page asked for another one before its end."""
        episode = self.episodes[number]
        world = world_of(episode.layout)
        self._attempt += 1
        self._due = time.monotonic()
        first = True

        def watch(info: dict[str, Any]) -> None:
            nonlocal first
            phase = "ready" if first and self.waits else "driving"
            self._publish(self._senses.moment(world, info, phase, number, self._attempt))
            if first:
                self.console.wait_for_scene(number)
                if self.waits:
                    self.console.wait_for_key()
                self._due, first = time.monotonic(), False
            self._wait()

        try:
            (drive,) = drive_episodes(
                self._driver, episode.layout, (episode.assignment,), self.suite, self.label, self._seed, watch
            )
        except _AnotherEpisodeError:
            return None
        if self._moment is not None:
            self._publish(replace(self._moment, phase="finished", result=outcome(drive.row)))
        return drive

    def _publish(self, moment: Moment) -> None:
        with self._published:
            self._moment = replace(moment, paused=self.console.paused, speed=self.console.speed)
            self._number += 1
            self._published.notify_all()

    def _wait(self) -> None:
        """Wait for the next control step; a late step does not make later ones hurry."""
        self._due = max(self._due + self.suite.control_dt / self.console.speed, time.monotonic() - 0.2)
        self.console.wait_until(self._due)
        if self.console.requested_episode is not None:
            raise _AnotherEpisodeError


class _AnotherEpisodeError(Exception):
    """The page asked for another episode."""
