"""A crowd over time: published episodes depend on every bit of its motion."""

from __future__ import annotations

import hashlib
import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import Crowd
from labgym.envs.conditions.intentions import distance
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
        ("orca", 5, "776749e2c0a9d115"),
        ("orca", 16, "5f71dc8dd09e7d46"),
        ("social_force", 5, "a1b2d6e79faf977f"),
        ("social_force", 16, "c20abe0f3be6967c"),
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
