"""The console of a viewer: commands of the page, read by the thread that drives, and a person who drives by them."""

from __future__ import annotations

import threading
import time
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labgym.documents import Record
from labgym.policies import EpisodeStart
from labgym.policies.policy import Observation, Policy

KEY_LIFE_S = 0.6
"""Seconds after which a driving command without a successor ends; the page repeats commands while a key is down."""

Component = Annotated[float, Field(ge=-1.0, le=1.0)]


class Command(Record):
    """A message of the page; absent fields change nothing.

    Attributes:
        forward, turn: action of a person, in [-1, 1]; see `LabPointNavEnv`.
        stop: whether the person has arrived: STOP in LabNav.
        paused: whether time stands still.
        speed: simulated seconds per second.
        episode: number of the episode to start now.
        loaded: number of the episode whose scene the page shows.
    """

    forward: Component | None = None
    turn: Component | None = None
    stop: bool | None = None
    paused: bool | None = None
    speed: Annotated[float, Field(ge=0.1, le=16.0)] | None = None
    episode: Annotated[int, Field(ge=0, lt=1_000_000)] | None = None
    loaded: Annotated[int, Field(ge=0, lt=1_000_000)] | None = None


class Console:
    """The latest commands; one thread writes, another one reads and waits.

    Attributes:
        paused, speed: see `Command`.
    """

    def __init__(self) -> None:
        self.paused, self.speed = False, 1.0
        self._changed = threading.Condition()
        self._action, self._until = (0.0, 0.0), 0.0
        self._stop = False
        self._episode: int | None = None
        self._loaded: int | None = None
        self._pages = 0

    def command(self, command: Command) -> None:
        """Take a message of the page."""
        with self._changed:
            if command.forward is not None or command.turn is not None:
                self._action = (command.forward or 0.0, command.turn or 0.0)
                self._until = time.monotonic() + KEY_LIFE_S
            if command.stop is not None:
                self._stop = command.stop
            if command.paused is not None:
                self.paused = command.paused
            if command.speed is not None:
                self.speed = command.speed
            if command.episode is not None:
                self._episode = command.episode
            if command.loaded is not None:
                self._loaded = command.loaded
            self._changed.notify_all()

    @property
    def action(self) -> tuple[float, float]:
        """Forward and turn of a person; zero once the last command is older than `KEY_LIFE_S`."""
        with self._changed:
            return self._action if time.monotonic() < self._until else (0.0, 0.0)

    def take_stop(self) -> bool:
        """Return whether the person gave STOP, once."""
        with self._changed:
            stop, self._stop = self._stop, False
            return stop

    def enter(self) -> None:
        """Note a page that watches."""
        with self._changed:
            self._pages += 1
            self._changed.notify_all()

    def leave(self) -> None:
        """Note that a page has gone."""
        with self._changed:
            self._pages -= 1

    @property
    def requested_episode(self) -> int | None:
        """The episode that the page asked for and that has not begun."""
        with self._changed:
            return self._episode

    def take_episode(self) -> int | None:
        """Return the episode that the page asked for, once."""
        with self._changed:
            episode, self._episode = self._episode, None
            return episode

    def wait_for_page(self) -> None:
        """Wait until a page watches."""
        with self._changed:
            while not self._pages:
                self._changed.wait(0.5)

    def wait_for_scene(self, number: int) -> None:
        """Wait until a page shows the scene of an episode, or asks for another one."""
        with self._changed:
            while self._episode is None and self._loaded != number:
                self._changed.wait(0.5)

    def wait_for_key(self) -> None:
        """Wait until a person drives, or asks for an episode."""
        with self._changed:
            while self._episode is None and (time.monotonic() >= self._until or self._action == (0.0, 0.0)):
                self._changed.wait(0.5)

    def wait_for_episode(self, seconds: float | None = None) -> None:
        """Wait until the page asks for an episode; at most for some seconds, if they are not None."""
        end = None if seconds is None else time.monotonic() + seconds
        with self._changed:
            while self._episode is None and (end is None or time.monotonic() < end or self.paused):
                self._changed.wait(0.1)

    def wait_until(self, moment: float) -> None:
        """Wait until a value of `time.monotonic` and while time stands still, unless the page asks for an episode."""
        with self._changed:
            while self._episode is None:
                left = moment - time.monotonic()
                if left <= 0.0 and not self.paused:
                    return
                self._changed.wait(0.5 if self.paused else min(left, 0.5))


class KeyboardDriver(Policy):
    """Drives by the keys that a page reports.

    The page shows the whole laboratory, the shortest path and the sensors: a person has the map.

    Args:
        console: receives the keys.
    """

    name = "person"
    privileged = True

    def __init__(self, console: Console) -> None:
        self._console = console

    def reset(self, episode: EpisodeStart) -> None:
        """Do nothing: a person sees the new episode on the page."""

    def act(self, observation: Observation) -> NDArray[np.float32]:  # noqa: ARG002
        """Return the action of the keys that are down."""
        return np.array(self._console.action, dtype=np.float32)


class LabNavKeyboardDriver(KeyboardDriver):
    """Drives an episode of LabNav, and gives STOP.

    The page shows the floor as it is, people, glass and the true pose, so that rows are of the privileged track.

    Args:
        console: receives the keys.
    """

    foresees = True

    def reset(self, episode: EpisodeStart) -> None:  # noqa: ARG002
        """Forget a STOP of the drive before."""
        self._console.take_stop()

    def stop(self, observation: Observation) -> bool:  # noqa: ARG002
        """Return whether STOP was given since the last step."""
        return self._console.take_stop()
