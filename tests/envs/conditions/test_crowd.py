"""A crowd over time: published episodes depend on every bit of its motion."""

from __future__ import annotations

import hashlib
import itertools
import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import Crowd
from labgym.envs.conditions.intentions import COLUMNS, POINTS, STALLED, STOP, TO_GO, PeopleMotion, _watch, distance
from labgym.envs.conditions.orca import Disc
from labgym.envs.world import world_of
from labgym.layouts import load_published

WORLD = world_of(island_laboratory())


def people(rng, count, model):
    """Return people at free places, some of whom overlap; half yield, and some walk in pairs."""
    places = []
    while len(places) < count:
        place = rng.uniform((0.4, 0.4), (7.6, 5.6)).tolist()
        if WORLD.paths.free(*place):
            places.append(place)
    roles = [
        {
            "start": place,
            "yields": bool(number % 2),
            "group": number // 2 if count % 2 else number,
            "stops": [[*places[k], 0.3, 0.5] for k in rng.integers(0, count, 3)] if number else [],
        }
        for number, place in enumerate(places)
    ]
    return cast_of({"people": roles, "model": model, "speed": 1.0 if count % 3 else 1.4})


def robot_over_time(rng, steps):
    """Return the robot and its time at rest at each step: it drives and rests in turns."""
    x, y, rest = 4.0, 1.0, 0.0
    for step in range(steps):
        moves = step % 40 >= 15
        vx, vy = rng.normal(0.0, 0.5, 2).tolist() if moves else (0.0, 0.0)
        x, y, rest = min(max(x + 0.1 * vx, 0.4), 7.6), min(max(y + 0.1 * vy, 0.4), 5.6), 0.0 if moves else rest + 0.1
        yield Disc(x, y, vx, vy, 0.27), rest


@pytest.mark.parametrize(
    ("model", "count", "digest"),
    [
        ("orca", 5, "01a121dfd30e2778"),
        ("orca", 16, "baaea4d3176b1dd0"),
        ("social_force", 5, "1add14cd85b509fd"),
        ("social_force", 16, "e795e37004377ffb"),
    ],
)
def test_people_walk_as_in_the_published_episodes_to_the_bit(model, count, digest):
    layout = load_published("floors-val", "floors-val-0003")
    rng, track = np.random.default_rng(count), hashlib.sha256()
    furniture = np.array([one.position[:2] for one in layout.placements if one.support == "floor"])
    roles = [
        {
            "start": start.tolist(),
            "yields": bool(number % 2),
            "group": number,
            "stops": [[*stop, 0.3, 0.5] for stop in furniture[rng.integers(0, len(furniture), 3)].tolist()],
        }
        for number, start in enumerate(furniture.mean(axis=0) + rng.normal(0.0, 1.0, (count, 2)))
    ]
    crowd = Crowd(world_of(layout), cast_of({"people": roles, "model": model, "speed": 1.2}))
    for robot, rest in robot_over_time(rng, 200):
        crowd.step(robot, rest)
        track.update(np.column_stack([crowd.centers, crowd.velocities, crowd.yaws, crowd.walked]).tobytes())
    assert track.hexdigest()[:16] == digest


def test_a_copy_goes_on_as_the_crowd_would_and_leaves_it_as_it_is():
    rng = np.random.default_rng(4)
    crowd = Crowd(WORLD, people(rng, 9, "orca"))
    robots = list(robot_over_time(rng, 120))
    for robot, rest in robots[:60]:
        crowd.step(robot, rest)
    before, other = crowd.centers, crowd.copy()
    for robot, rest in robots[60:]:
        other.step(robot, rest)
    assert crowd.centers.tobytes() == before.tobytes()
    for robot, rest in robots[60:]:
        crowd.step(robot, rest)
    assert crowd.centers.tobytes() == other.centers.tobytes() != before.tobytes()


@pytest.mark.parametrize("scale", [1e-300, 1e-3, 1.0, 20.0])
def test_the_distance_is_that_of_python(scale):
    ends = np.random.default_rng(0).normal(0.0, scale, (2000, 4)).tolist()
    ends += [[1.0, 2.0, 1.0, 2.0], [0.0, 0.0, 3.0, 4.0], [1.0, 0.0, 1.0, -7.5]]
    assert [distance(*each) for each in ends] == [math.dist(each[:2], each[2:]) for each in ends]


@pytest.mark.parametrize("model", ["orca", "social_force"])
def test_one_who_does_not_yield_notices_a_robot_only_from_its_rest_on(model):
    role = {"start": [1.6, 1.0], "yields": False, "group": 0, "stops": [[6.4, 1.0, 0.3, 1.0]]}

    def track(robot, rest):
        crowd = Crowd(WORLD, cast_of({"people": [role], "model": model, "speed": 1.0}))
        places = []
        for _ in range(40):
            crowd.step(robot, rest)
            places.extend(crowd.places)
        return places

    robot = Disc(4.0, 1.0, 0.0, 0.0, 0.27)
    assert track(robot, 0.0) == track(None, 0.0)
    at_rest = track(robot, 0.1)
    assert min(math.dist(place, (4.0, 1.0)) for place in track(robot, 0.0)) < 0.1
    assert min(math.dist(place, (4.0, 1.0)) for place in at_rest) >= 0.3 + 0.27 + 0.01 - 1e-6


def walker(start, *stops, speed=1.0):
    role = {"start": list(start), "yields": False, "group": 0, "stops": [[*stop, 0.3, 2.0] for stop in stops]}
    return Crowd(WORLD, cast_of({"people": [role], "model": "orca", "speed": speed}))


@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_one_alone_walks_the_shortest_path_at_their_speed_and_stands_for_the_time_of_the_stop(speed):
    start, stop = (1.6, 1.0), (6.4, 4.2)
    path, crowd, seconds = WORLD.paths.path(start, stop), walker(start, stop, (1.6, 1.0), speed=speed), 0.0
    length = sum(math.dist(a, b) for a, b in itertools.pairwise(path.points.tolist()))
    assert length > math.dist(start, stop) + 0.1
    while math.dist(crowd.places[0], stop) > 0.12 and seconds < 20.0:
        crowd.step(None, 0.0)
        seconds += 0.1
    assert crowd.walked[0] == pytest.approx(length, rel=0.04)
    assert length / speed - 0.3 < seconds < length / speed + 0.9  # the last half meter takes longer
    stood = 0
    while np.hypot(*crowd.velocities[0]) > 0.0 or not stood:
        crowd.step(None, 0.0)
        stood += 1
    for _ in range(18):
        crowd.step(None, 0.0)
        assert np.hypot(*crowd.velocities[0]) == 0.0
    assert crowd.yaws[0] == 0.3
    for _ in range(6):
        crowd.step(None, 0.0)
    assert np.hypot(*crowd.velocities[0]) == pytest.approx(speed, rel=0.01)


def test_a_stop_without_a_way_is_passed_over():
    island = WORLD.layout.box("IslandBench1800_1")
    crowd = walker((1.6, 1.0), (island.x, island.y), (1.6, 4.2))
    for _ in range(45):
        crowd.step(None, 0.0)
    assert math.dist(crowd.places[0], (1.6, 4.2)) < 0.13


def test_without_progress_a_way_is_planned_anew_after_one_and_a_half_seconds_and_given_up_after_four():
    walkers, marks = np.zeros((1, COLUMNS)), np.array([[0, 0, 1, 5]])
    walkers[0, TO_GO] = 3.0
    people = PeopleMotion(
        walkers, marks, np.zeros((1, 8, 3)), np.zeros((1, 2, 3)), np.array([2]), np.zeros(1, dtype=np.int64)
    )
    planned, stops = [], []
    for _ in range(40):
        _watch(0, 2.901, people)
        planned.append(int(marks[0, POINTS]))
        stops.append(int(marks[0, STOP]))
        marks[0, POINTS] = 5
    assert (planned.index(0), planned.count(0)) == (14, 2)
    assert stops == [0] * 39 + [1]
    assert walkers[0, TO_GO] == math.inf
    walkers[0, TO_GO] = 3.0
    for k in range(1, 20):
        _watch(0, 3.0 - 0.101 * k, people)
        assert walkers[0, STALLED] == 0.0
        assert walkers[0, TO_GO] == 3.0 - 0.101 * k


def test_a_stop_where_somebody_stands_is_awaited_a_meter_away():
    standing = {"start": [4.0, 1.0], "yields": False, "group": 0, "stops": []}
    comes = {"start": [1.6, 1.0], "yields": False, "group": 1, "stops": [[4.1, 1.0, 0.3, 30.0]]}
    crowd = Crowd(WORLD, cast_of({"people": [standing, comes], "model": "orca", "speed": 1.0}))
    for _ in range(40):
        crowd.step(None, 0.0)
    assert math.dist(crowd.places[0], (4.0, 1.0)) < 0.1
    assert 0.85 < math.dist(crowd.places[1], (4.1, 1.0)) < 1.0
    assert np.hypot(*crowd.velocities[1]) == 0.0
