"""A shown drive counts as an evaluated one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from episode_rows import read_routes

from labgym.errors import OptionError
from labgym.eval.driving.drive import TransitionDrive, drive_episodes
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import read_rows
from labgym.layouts import Layout
from labgym.policies import EpisodeStart, Policy
from labgym.suites import Suite
from labgym.viewer import Command, Console, KeyboardDriver, Show, ViewerEpisode
from labgym.viewer.console import KEY_LIFE_S
from labgym.viewer.records import DriveRecords


class Scripted(Policy):
    """Backs off, then turns."""

    def reset(self, episode: EpisodeStart) -> None:
        self.steps = 0

    def act(self, observation):
        self.steps += 1
        return np.array([-1.0, 0.0] if self.steps <= 10 else [0.2, 0.5], np.float32)


class ScriptedConsole(Console):
    """The console of a person who presses the keys of `Scripted`."""

    def __init__(self) -> None:
        super().__init__()
        self.steps, self.speed = 0, 1000.0
        self.enter()
        self.command(Command(loaded=0, forward=-1.0))

    @property
    def action(self) -> tuple[float, float]:
        self.steps += 1
        return (-1.0, 0.0) if self.steps <= 10 else (0.2, 0.5)


def evaluated(driver: Policy, episode: ViewerEpisode, suite: Suite, label: str) -> TransitionDrive:
    return drive_episodes(driver, episode.layout, (episode.assignment,), suite, label, 0)[0]


def test_a_shown_policy_has_the_row_and_the_route_of_an_evaluation(
    driven: Callable[..., TransitionDrive], suite: Suite, episodes: tuple[ViewerEpisode, ...]
) -> None:
    shown, expected = driven(Scripted(), 1), evaluated(Scripted(), episodes[1], suite, "driver")
    assert (shown.row, shown.route) == (expected.row, expected.route)
    assert shown.row.path_length > 0.2


def test_a_person_who_presses_a_policys_actions_has_its_row(
    suite: Suite, episodes: tuple[ViewerEpisode, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("labgym.viewer.console.KEY_LIFE_S", 1e6)  # A busy machine may take longer to a step.
    drives: list[TransitionDrive] = []

    class OverError(Exception):
        pass

    def finished(drive: TransitionDrive) -> None:
        drives.append(drive)
        raise OverError

    console = ScriptedConsole()
    with pytest.raises(OverError):
        Show(episodes, suite, KeyboardDriver(console), "me", console, waits=True, finished=finished).run()
    assert drives[0].row == evaluated(Scripted(), episodes[0], suite, "me").row


def test_an_episode_that_is_left_has_no_row_and_the_one_asked_for_begins(
    console: Console, suite: Suite, episodes: tuple[ViewerEpisode, ...]
) -> None:
    rows, pairs = [], []

    class Asks(Scripted):
        def act(self, observation):
            action = super().act(observation)
            if self.steps == 5 and not pairs:
                pairs.append(2)
                console.command(Command(episode=2))
            return action

    class OverError(Exception):
        pass

    def finished(drive: TransitionDrive) -> None:
        rows.append(drive.row)
        raise OverError

    with pytest.raises(OverError):
        Show(episodes, suite, Asks(), "driver", console, finished=finished).run()
    assert [row.pair for row in rows] == [episodes[2].assignment.pair.index]


def test_the_clock_of_a_person_waits_for_the_first_key(
    console: Console, suite: Suite, episodes: tuple[ViewerEpisode, ...]
) -> None:
    finished = threading.Event()
    show = Show(episodes, suite, KeyboardDriver(console), "me", console, waits=True, finished=lambda _: finished.set())
    thread = threading.Thread(target=show.run, daemon=True)
    thread.start()
    _, moment = show.next_moment(0, 300.0)
    assert moment is not None
    assert (moment.phase, moment.time) == ("ready", 0.0)
    assert not finished.wait(0.2)
    console.command(Command(forward=0.5))
    assert finished.wait(300.0)


def test_moments_hold_the_sensors_of_the_pose(driven: Callable[..., TransitionDrive], console, suite, episodes) -> None:
    from labgym.envs.world import world_of
    from labgym.viewer.moment import PageSenses

    world = world_of(episodes[0].layout)
    x, y, yaw = episodes[0].assignment.pair.start
    info = {"pose": (x, y, yaw), "distance": 1.0, "path_length": 0.0, "time": 0.0, "contacts": 0, "collision": False}
    moment = PageSenses().moment(world, {**info, "clearance": 0.3}, "driving", 0, 1)
    assert len(moment.lidar) == 180
    # The robot faces the device of its start, 0.60 m in front of its middle line.
    assert 0.2 < moment.lidar[90] < 0.7
    assert moment.record()["pose"] == pytest.approx((x, y, yaw), abs=1e-4)


def test_a_key_that_is_not_repeated_is_up_again(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [10.0]
    monkeypatch.setattr("labgym.viewer.console.time", SimpleNamespace(monotonic=lambda: now[0]))
    console = Console()
    console.command(Command(forward=1.0, turn=-0.5))
    now[0] += KEY_LIFE_S - 0.05
    assert console.action == (1.0, -0.5)
    now[0] += 0.1
    assert console.action == (0.0, 0.0)


def test_pausing_holds_the_drive(console: Console) -> None:
    console.command(Command(paused=True))
    thread = threading.Thread(target=console.wait_until, args=(time.monotonic(),), daemon=True)
    thread.start()
    thread.join(0.15)
    assert thread.is_alive()
    console.command(Command(paused=False))
    thread.join(60.0)
    assert not thread.is_alive()


def test_drives_are_written_as_an_evaluation_writes_them(
    driven: Callable[..., TransitionDrive], suite: Suite, episodes: tuple[ViewerEpisode, ...], tmp_path: Path
) -> None:
    drive, records = driven(Scripted(), label="me"), DriveRecords(tmp_path / "me", episodes, suite, "me")
    records.add(drive)
    records.add(drive)
    assert read_rows(tmp_path / "me" / "episodes.jsonl") == (drive.row,)
    assert read_routes(tmp_path / "me" / "routes.jsonl") == {drive.row.key: drive.route}
    evaluation = TransitionEvaluation.read(tmp_path / "me")
    assert (evaluation.name, evaluation.rows) == ("me", (drive.row,))
    assert evaluation.summary.metrics["success"].value == float(drive.row.success)
    assert f"1 of {len(episodes)} episodes" in " ".join(evaluation.problems)
    assert Layout.load(tmp_path / "me" / "layouts" / "by-hand.json") == episodes[0].layout
    with pytest.raises(OptionError, match="--out"):
        DriveRecords(tmp_path / "me", episodes, suite, "me")
