"""An episode of LabNav in the viewer counts as an evaluated one, and the page receives what moves."""

from __future__ import annotations

import json
import urllib.error
import urllib.request

import numpy as np
import pytest

from labgym.cli import main
from labgym.envs.labnav.nuisances import drawn_episode
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.policies import EpisodeStart, Policy
from labgym.viewer import LabNavShow, LabNavWatch


class Stops(Policy):
    """Drives ahead for half a second, and then declares that it has arrived."""

    def reset(self, episode: EpisodeStart) -> None:
        self.steps = 0

    def act(self, observation):
        self.steps += 1
        return np.array([0.5, 0.1], np.float32)

    def stop(self, observation):
        return self.steps >= 5


class OverError(Exception):
    """Ends a show."""


@pytest.fixture(scope="module")
def watch() -> LabNavWatch:
    return LabNavWatch.of("shift", 2, *drawn_episode("shift", 2, 4))


@pytest.fixture
def moments(watch, console):
    """A finished show and what it published."""
    published, rows = [], []

    def finished(drive):
        rows.append(drive.row)
        raise OverError

    show = LabNavShow((watch,), Stops(), "stops", console, finished=finished)
    publish = show._publish
    show._publish = lambda moment: (published.append(moment), publish(moment))
    with pytest.raises(OverError):
        show.run()
    return show, published, rows


def test_a_shown_episode_has_the_row_of_an_evaluation(watch, moments):
    _, published, (row,) = moments
    (drive,) = drive_floor(Stops(), watch.layout, (watch.episode,), DriveTerms("shift", 2, "stops", "labnav", 0))
    assert row == drive.row
    assert len(published) == len(drive.route) + 1  # the result, in addition
    assert published[-1].phase == "finished"
    assert published[-1].result["words"].startswith(row.ending)
    people = watch.task.conditions["people"]["people"]
    assert {len(moment.people) for moment in published} == {len(people)}
    assert [bool(person[3]) for person in published[0].people] == [role["yields"] for role in people]
    json.dumps([moment.record() for moment in published[:3]])


def test_the_page_receives_the_shapes_that_moments_name(moments, serve):
    show, published, _ = moments
    server = serve(show)
    shapes = {body[0] for moment in published for body in moment.bodies}
    assert shapes == set(range(len(shapes)))
    for number in shapes:
        with urllib.request.urlopen(f"{server.url}shape/{number}.glb") as answer:
            assert answer.read(4) == b"glTF"
    for path in (f"shape/{len(shapes)}.glb", "shape/x.glb", "shape/0.json", "episode/1.json"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(server.url + path)
    with urllib.request.urlopen(f"{server.url}episode/0.json") as answer:
        content = json.load(answer)
    assert content["goal"] == list(show.episodes[0].episode.pairs[-1].goal)
    assert content["layout"] == show.layout(0).hash
    standing = {one.id for one in show.layout(0).placements}
    assert not standing & set(show.episodes[0].task.pushable)


def test_options_of_layouts_are_refused_with_an_episode(capsys):
    for words in (["--suite", "test"], ["--camera", "door"], ["--pair", "2"], ["--protocol", "sub_01"]):
        assert main(["view", "--task", "people", "--web", *words]) == 2
        assert "has no effect with --task" in capsys.readouterr().err
    assert main(["view", "--task", "people", "--web", "--policy", "nobody"]) == 2
    assert "'nobody' not found" in capsys.readouterr().err
