"""Nuisances that are off leave nothing of themselves, and all others as they were."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.envs.labnav.episodes import EpisodeTasks, published_episodes
from labgym.envs.labnav.levels import locobot, robothor
from labgym.envs.labnav.nuisances import (
    CONDITIONS,
    NUISANCES,
    episode_without,
    nuisances_of,
    prepared,
    properties_without,
)
from labgym.envs.labnav.tasks import TASKS, config_of
from labgym.envs.parts.actuation import LOCOBOT
from labgym.envs.parts.odometry import OdometrySensor
from labgym.envs.point_nav import LabPointNavEnv
from labgym.errors import UnknownNameError
from labgym.navigation import PLANNING_RADIUS, ShortestPaths
from labgym.navigation.lengths import length_to_disc

EACH = [(task, name) for task in TASKS for name in nuisances_of(task, 2)]


ROOM = 1.1
"""Radius of a disc that is free where the drives of these tests begin, meters."""


def first(task):
    """Return the first episode of a task that begins with room around the robot, if there is one, and its floor."""
    part = published_episodes(task, 2, development=True)
    roomy = (one for one in part.episodes if ShortestPaths(part.layout(one.floor), ROOM).free(*one.start[:2]))
    episode = next(roomy, part.episodes[0])
    return part.layout(episode.floor), episode


def drive(task, off=(), seconds=3.0):
    """Return the observations and the true poses of an episode's first seconds, backwards in a bow."""
    layout, episode = first(task)
    chosen = episode_without(episode, layout, task, 2, off)
    properties = properties_without(task, 2, off)
    env = LabPointNavEnv(
        config=config_of(task, 2, stop=None, properties=properties, tasks=EpisodeTasks(layout, (chosen,)))
    )
    observations, poses = [env.reset(seed=episode.seed)[0]], [env.state.pose]
    for _ in range(round(seconds / 0.1)):
        observations.append(env.step(np.array([-1.0, 0.3]))[0])
        poses.append(env.state.pose)
    state = env.state
    env.close()
    return observations, poses, state


def test_every_nuisance_is_one_of_a_task_and_every_condition_of_a_task_is_a_nuisance():
    assert {name for _, name in EACH} == set(NUISANCES)
    for task in TASKS:
        conditions = {each.name for each in config_of(task, 2).conditions} - {"contacts"}
        assert conditions == set(nuisances_of(task, 2)) & set(CONDITIONS)
        assert "wheels" in nuisances_of(task, 2)


@pytest.mark.parametrize(("task", "name"), [each for each in EACH if each[1] in CONDITIONS])
def test_without_a_condition_the_floor_is_that_of_the_map_and_the_shortest_path_too(task, name):
    layout, episode = first(task)
    calm = episode_without(episode, layout, task, 2, (name,))
    assert calm.model_copy(update={"conditions": {}, "length": 0.0, "following": ()}) == episode.model_copy(
        update={"conditions": {}, "length": 0.0, "following": ()}
    )
    others = {key: data for key, data in episode.conditions.items() if key != name}
    assert {key: data for key, data in calm.conditions.items() if key != name} == others
    if name in ("people", "payload"):
        assert calm.lengths == episode.lengths
        return
    true = prepared(task, 2, calm, layout)
    assert [(one.position, one.yaw) for one in true.layout.placements] == [
        (one.position, one.yaw) for one in layout.placements
    ]
    assert not true.pushable
    assert true.pair.goal == pytest.approx(episode.goal, abs=1e-12)
    paths, radius = ShortestPaths(layout, PLANNING_RADIUS), TASKS[task].radius
    assert calm.lengths == pytest.approx(
        [length_to_disc(paths, pair.start, pair.goal, radius) for pair in calm.pairs], abs=1e-6
    )


def test_without_errors_the_robot_goes_where_it_is_sent_and_knows_where_it_is():
    observations, poses, state = drive("odometry", ("wheels", "odometry", "noise"))
    start = poses[0]
    for observation, (x, y, _) in zip(observations, poses, strict=True):
        along, aside = x - start[0], y - start[1]
        cosine, sine = np.cos(start[2]), np.sin(start[2])
        local = (cosine * along + sine * aside, -sine * along + cosine * aside)
        assert observation["odometry"][:2] == pytest.approx(local, abs=1e-5)
    assert state.contacts == 0


def test_each_error_is_off_alone_and_the_others_have_the_same_values():
    observations, poses, _ = drive("odometry")
    silent, same, _ = drive("odometry", ("noise",))
    assert poses == same
    assert all(np.array_equal(a["odometry"], b["odometry"]) for a, b in zip(observations, silent, strict=True))
    assert not np.array_equal(observations[0]["lidar"], silent[0]["lidar"])
    sure, driven, _ = drive("odometry", ("odometry",))
    assert driven == poses
    assert all(np.array_equal(a["lidar"], b["lidar"]) for a, b in zip(observations, sure, strict=True))
    assert not np.array_equal(observations[-1]["odometry"], sure[-1]["odometry"])
    straight = drive("odometry", ("wheels",))[1]
    assert straight[0] == poses[0]
    assert straight[-1] != poses[-1]


def test_without_errors_of_their_places_the_sensors_are_where_the_robot_has_them():
    properties = properties_without("dock", 2, ("mounting",))
    assert config_of("dock", 2, properties=properties).randomizations == ()
    assert len(config_of("dock", 2).randomizations) == 1


def test_people_and_the_beaker_are_gone():
    nobody = drive("carry", ("people",), 0.5)[2]
    assert (nobody.presences["people"].outcome["people"], "payload" in nobody.presences) == (0, True)
    empty = drive("carry", ("payload",), 0.5)[2]
    assert "payload" not in empty.presences
    assert empty.presences["people"].outcome["people"] > 0


def test_odometry_without_drift_is_the_sensor_without_errors():
    properties = properties_without("shift", 2, ("odometry",))
    sensors = config_of("shift", 2, properties=properties).sensors
    assert OdometrySensor() in sensors


def test_a_nuisance_that_a_task_does_not_have_is_refused():
    with pytest.raises(UnknownNameError, match="nuisance of aisle-2"):
        properties_without("aisle", 2, ("glass",))


def test_the_errors_of_odometry_are_the_published_ones_of_an_action():
    # RoboTHOR: 5 mm and 0.5 degrees of a step of 0.25 m, 0.5 degrees of a turn by 30 degrees.
    for factor in (0.5, 1.0, 2.0):
        errors = robothor(factor)
        assert errors["along"] * math.sqrt(0.25) == pytest.approx(0.005 * factor)
        assert errors["heading"] * math.sqrt(0.25) == pytest.approx(0.5 * factor)
        assert errors["turning"] * math.sqrt(30.0 / 360.0) == pytest.approx(0.5 * factor)
        for controller, table in LOCOBOT.items():
            errors = {name: value / factor for name, value in locobot(controller, factor).items()}
            assert errors["stretch"] * 0.25 == pytest.approx(table.ahead[0])
            assert errors["along"] ** 2 * 0.25 == pytest.approx(table.ahead[1])
            assert math.radians(errors["veer"]) * 0.25 == pytest.approx(table.turned[0])
            assert math.radians(errors["heading"]) ** 2 * 0.25 == pytest.approx(table.turned[1])
            assert errors["overturn"] * math.radians(30.0) == pytest.approx(table.turned_turning[0])
            assert math.radians(errors["turning"]) ** 2 / 12.0 == pytest.approx(table.turned_turning[1])


def test_the_levels_of_odometry_err_as_the_suites_state():
    levels = TASKS["odometry"].levels
    expected = {
        1: (robothor(1.0), 1.0, 0.03, 8.0),
        2: (locobot("ilqr", 0.5), 2.0, 0.05, 12.0),
        3: (locobot("ilqr", 1.0), 2.0, 0.05, 12.0),
    }
    for number, (errors, wheels, lidar, least) in expected.items():
        level = levels[number]
        assert level.odometry == errors
        assert level.slip == pytest.approx((0.03 * wheels, 2.0 * wheels))
        assert (level.lidar, level.color, level.redwood) == (lidar, 25.5, True)
        assert level.lengths == (least, 25.0)
