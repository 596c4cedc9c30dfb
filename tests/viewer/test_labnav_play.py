"""A person in LabNav: the rows of an evaluation, STOP by a key, and a folder that is read as one of labgym eval."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from headless_browser import browser, chromium

from labgym.cli import main
from labgym.envs.labnav.episodes import published_episodes
from labgym.eval.driving.files import SUMMARY
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.results import DriveTerms
from labgym.policies import EpisodeStart, Policy
from labgym.viewer import Command, Console, LabNavKeyboardDriver, LabNavShow, LabNavWatch
from runs.killing import hear_interrupts

STEPS = 6
BACK = (-1.0, 0.0)


class Scripted(Policy):
    """Backs off for some steps and gives STOP, as `ScriptedConsole` does; receives what a person sees."""

    privileged = foresees = True

    def reset(self, episode: EpisodeStart) -> None:
        self.steps = 0

    def act(self, observation):
        self.steps += 1
        return np.array(BACK, np.float32)

    def stop(self, observation):
        return self.steps >= STEPS


class ScriptedConsole(Console):
    """The console of a person who backs off for some steps and presses Enter."""

    def __init__(self) -> None:
        super().__init__()
        self.speed, self.steps = 1000.0, 0
        self.enter()
        self.command(Command(loaded=0, forward=-1.0))

    @property
    def action(self) -> tuple[float, float]:
        self.steps += 1
        if self.steps % STEPS == 0:
            self.command(Command(stop=True))
        return BACK


class OverError(Exception):
    """Ends a show."""


def watch_of(task: str) -> LabNavWatch:
    part = published_episodes(task, 2, development=True)
    return LabNavWatch(task, 2, part.layout(part.episodes[0].floor), part.episodes[0], part.label)


@pytest.mark.cases(1)
@pytest.mark.parametrize("task", ["dock", "shift"])
def test_a_person_has_the_row_of_a_policy_that_acts_alike(task):
    episode, drives = watch_of(task), []

    def finished(drive):
        drives.append(drive)
        raise OverError

    console = ScriptedConsole()
    console.wait_for_key = lambda: None
    show = LabNavShow((episode,), LabNavKeyboardDriver(console), "ada", console, finished=finished, waits=True)
    with pytest.raises(OverError):
        show.run()
    own = (episode.episode,)
    (drive,) = drive_floor(Scripted(), episode.layout, own, DriveTerms(task, 2, "ada", episode.suite, 0))
    assert drives[0].row == drive.row
    assert drives[0].route == drive.route
    assert (drive.row.track, drive.row.stopped) == ("privileged", "policy")
    assert len(drive.row.legs) == (len(episode.episode.lengths) if task == "shift" else 0)


def test_stop_counts_once_and_not_for_the_next_drive():
    console = Console()
    person = LabNavKeyboardDriver(console)
    console.command(Command(stop=True))
    assert [person.stop({}), person.stop({})] == [True, False]
    console.command(Command(stop=True))
    person.reset(None)
    assert person.stop({}) is False


@pytest.fixture
def played(monkeypatch, tmp_path):
    """Drives the first episodes of a suite as a script, then presses Ctrl-C."""

    def drive(show, port, first, opened, episodes=(0, 1)):
        left = list(episodes)

        def onward(seconds=None):
            if not left:
                raise KeyboardInterrupt

        console = show.console
        console.enter()
        console.speed = 1000.0
        console.wait_for_scene = lambda number: left.remove(number)
        console.wait_for_key = lambda: console.command(Command(forward=-1.0))
        console.take_stop = lambda: show._moment.time >= 0.3
        console.wait_for_episode = onward
        show.run(first)

    monkeypatch.setattr("labgym.viewer.run_viewer", drive)
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: (main(["play", *arguments]), tmp_path)


def test_the_folder_is_read_as_an_evaluation_and_not_published_before_it_is_complete(played, capsys):
    code, folder = played("--suite", "labnav-val-people", "--out", "me", "--name", "ada")
    assert code == 0
    assert "people-2/floors-val-0000/1: wrong place after" in capsys.readouterr().out
    evaluation = LabNavEvaluation.read(folder / "me")
    assert [(row.key, row.policy, row.track) for row in evaluation.rows] == [
        (f"people-2/floors-val-0000/{number}", "ada", "privileged") for number in (0, 1)
    ]
    assert (evaluation.summary.suite, evaluation.summary.by_task["people-2"].expected) == ("labnav-val-people-2", 30)
    assert json.loads((folder / "me" / SUMMARY).read_text())["policy"] == "ada"
    assert main(["leaderboard", "--add", str(folder / "me")]) == 2
    assert "holds 2 of 30 episodes of people" in capsys.readouterr().err
    assert played("--suite", "labnav-val-people", "--out", "me")[0] == 2
    assert "has episodes: name another folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words, why",
    [
        (["test-sub_01"], "has its floors"),
        (["--film", "a.mp4"], "fixed episodes and no film"),
        (["--protocol", "sub_01"], "fixed episodes and no film"),
    ],
)
def test_options_of_layouts_are_refused_in_labnav(words, why, played, capsys):
    assert played("--suite", "labnav-val-people", *words)[0] == 2
    assert why in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="needs Chromium (Debian: apt install chromium)")
def test_enter_gives_stop_on_the_page_which_shows_the_goal_of_the_drive(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "labgym.cli", "play", "--suite", "labnav-val-shift", "--port", "0"]
    command += ["--out", str(tmp_path / "me")]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, preexec_fn=hear_interrupts)
    try:
        url = process.stdout.readline().split()[1]
        with browser(tmp_path / "profile") as tab:
            tab.open(url, 480, 320)
            tab.wait("document.body.dataset.scene === 'ready' && document.body.dataset.phase === 'ready'", seconds=90)
            assert "Enter" in tab.value("document.getElementById('words').textContent")
            tab.key("ArrowDown", down=True)
            tab.wait("document.body.dataset.phase === 'driving'", seconds=90)
            tab.key("ArrowDown", down=False)
            first, second = (pair.goal for pair in watch_of("shift").episode.pairs[:2])
            assert json.loads(tab.value("document.body.dataset.goal")) == pytest.approx(first, abs=1e-3)
            tab.key("Enter", down=True)
            tab.wait(f"Math.abs(JSON.parse(document.body.dataset.goal)[1] - {second[1]}) < 1e-3", seconds=90)
            assert tab.errors == []
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=300)
    assert process.returncode == 0
    assert not (tmp_path / "me").exists()
