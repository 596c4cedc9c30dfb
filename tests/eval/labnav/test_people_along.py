"""People computed from a recorded route are where they were while the policy drove it."""

from __future__ import annotations

import numpy as np
import pytest
from labnav_suites import draw_suite

from labgym.envs.labnav.nuisances import prepared
from labgym.envs.robot import ROBOT
from labgym.eval.drawing.episode_plan import people_of
from labgym.eval.labnav.replay import drive_again
from labgym.eval.labnav.shown_drive import people_along, velocities_of


@pytest.fixture(scope="module")
def part():
    return draw_suite("people", 2, "floors-val", 1, 1, seed=6)


@pytest.fixture(scope="module")
def drive(part):
    """A drive of 6 s, in which the robot moves and people walk."""
    return drive_again("astar", part, part.episodes[0], seconds=6.0)


def test_people_are_where_they_were_during_the_drive(drive):
    route = [tuple(round(value, 3) for value in shot.pose) for shot in drive.shots]
    along = people_along(drive.task, route)
    true = np.array([[person.pose[:2] for person in people_of(drive.task, shot.bodies)] for shot in drive.shots])
    assert np.abs(true[-1] - true[0]).max() > 0.5
    assert np.linalg.norm(along.places - true, axis=2).max() < 0.05
    assert along.yields == tuple(person.yields for person in people_of(drive.task, drive.shots[0].bodies))
    assert along.least == pytest.approx(drive.row.outcomes["people"]["least_distance"], abs=0.05)


def test_people_depend_on_the_motion_of_the_robot(drive):
    start = drive.shots[0].pose
    moved = people_along(drive.task, [shot.pose for shot in drive.shots]).places
    rested = people_along(drive.task, [start] * len(drive.shots)).places
    assert np.array_equal(moved[0], rested[0])
    assert not np.array_equal(moved[-1], rested[-1])


def test_a_route_without_poses_or_people_has_none(part):
    episode = part.episodes[0]
    layout = part.layout(episode.floor)
    task = prepared("people", 2, episode, layout)
    assert people_along(task, ()).places.shape == (0, 0, 2)
    alone = episode.model_copy(update={"conditions": {}}).task(layout)
    found = people_along(alone, [episode.start] * 3)
    assert found.places.shape == (3, 0, 2)
    assert found.least is None


def test_the_velocity_is_along_the_heading():
    dt = ROBOT.control_dt
    poses = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.05, np.pi / 2.0), (0.1, 0.05, np.pi / 2.0)])
    expected = [(0.0, 0.0), (0.1 / dt, 0.0), (0.0, 0.05 / dt), (0.0, 0.0)]
    assert velocities_of(poses) == pytest.approx(np.array(expected), abs=1e-12)
