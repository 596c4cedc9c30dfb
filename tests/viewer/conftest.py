from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from laboratories import island_laboratory

from labgym.eval.driving.drive import TransitionDrive
from labgym.layouts import Layout
from labgym.policies.policy import Driver
from labgym.suites import Suite, suite_of
from labgym.viewer import Command, Console, Show, ViewerEpisode, ViewerServer, episodes_of


class OverError(Exception):
    """Ends a show."""


@pytest.fixture(scope="session")
def layout() -> Layout:
    return island_laboratory()


@pytest.fixture(scope="session")
def suite(layout: Layout) -> Suite:
    return suite_of([layout]).model_copy(update={"max_steps": 45})


@pytest.fixture(scope="session")
def episodes(layout: Layout, suite: Suite) -> tuple[ViewerEpisode, ...]:
    return episodes_of([layout], suite)


@pytest.fixture
def console(monkeypatch: pytest.MonkeyPatch) -> Console:
    """The console of a page that shows every scene at once, and whose keys stay down on a busy machine, too."""
    monkeypatch.setattr("labgym.viewer.console.KEY_LIFE_S", 1e6)
    console = Console()
    console.enter()
    console.wait_for_scene = lambda number: None  # type: ignore[method-assign]
    console.speed = 1000.0
    return console


@pytest.fixture
def driven(suite: Suite, episodes: tuple[ViewerEpisode, ...], console: Console) -> Callable[..., TransitionDrive]:
    """Returns the first finished drive of a show."""

    def first(driver: Driver, first: int = 0, waits: bool = False, label: str = "driver") -> TransitionDrive:
        drives: list[TransitionDrive] = []

        def finished(drive: TransitionDrive) -> None:
            drives.append(drive)
            raise OverError

        with pytest.raises(OverError):
            Show(episodes, suite, driver, label, console, waits=waits, finished=finished).run(first)
        return drives[0]

    return first


@pytest.fixture
def serve() -> Iterator[Callable[[Show], ViewerServer]]:
    """Serves a show on a free port, without driving it."""
    with _served() as start:
        yield start


@contextmanager
def _served() -> Iterator[Callable[[Show], ViewerServer]]:
    servers: list[tuple[ViewerServer, threading.Thread]] = []

    def start(show: Show) -> ViewerServer:
        server = ViewerServer(show, 0)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        thread.start()
        servers.append((server, thread))
        return server

    yield start
    for server, thread in servers:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture
def hold(console: Console) -> Callable[[float, float], None]:
    """Holds keys down."""
    return lambda forward, turn: console.command(Command(forward=forward, turn=turn))
