"""Docking stations off their place: the goal in closed form, what a move may touch (shapely), errors at rest."""

from __future__ import annotations

import copy
import math
import pickle

import gymnasium as gym
import numpy as np
import pytest
from condition_tasks import Fixed
from laboratories import island_laboratory, put
from shapely import Polygon

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.conditions.station import Station, station_of
from labgym.envs.tasks import Task
from labgym.errors import OptionError
from labgym.geometry import wrap_angle
from labgym.layouts import Door, Layout, Room
from labgym.navigation import GoalPair, goal_pairs, goal_pose

BASE = island_laboratory()
LAYOUT = BASE.replace(
    placements=(
        *BASE.placements,
        put(
            "beaker",
            "Beaker",
            7.4,
            2.9,
            BASE.asset("ValidationPlatform_1").surfaces[0].z,
            on="ValidationPlatform_1",
            slot=0,
        ),
    )
)
PAIR = next(pair for pair in goal_pairs(LAYOUT) if pair.goal_location == "ValidationPlatform")
DATA = {"station": "ValidationPlatform_1", "shift": [-0.06, 0.03, 0.08]}
SHIFT = (-0.06, 0.03, 0.08)


def task(layout=LAYOUT, pair=PAIR):
    return Task(layout, layout.protocol, pair)


def test_the_goal_is_that_of_the_moved_furniture_and_the_map_is_of_before():
    after = Station().prepare(task(), DATA)
    box, before = after.layout.box("ValidationPlatform_1"), LAYOUT.box("ValidationPlatform_1")
    assert (box.x - before.x, box.y - before.y) == pytest.approx(SHIFT[:2])
    assert wrap_angle(box.yaw - before.yaw) == pytest.approx(SHIFT[2])
    assert after.pair.goal == pytest.approx(goal_pose(box), abs=1e-9)
    assert after.announced is PAIR
    assert after.old_map is LAYOUT
    assert math.dist(after.pair.goal[:2], PAIR.goal[:2]) > 0.05


def test_what_stands_on_the_station_moves_with_it():
    after = Station().prepare(task(), DATA).layout
    place = [
        layout.box("ValidationPlatform_1").to_local(*layout.placement("beaker").position[:2])
        for layout in (LAYOUT, after)
    ]
    assert place[0] == pytest.approx(place[1], abs=1e-9)
    assert after.placement("beaker").position[2] == LAYOUT.placement("beaker").position[2]


def test_moves_fill_the_disc_and_the_turns_and_overlap_nothing():
    station = Station()
    drawn = [station.draw(task(), np.random.default_rng(seed)) for seed in range(60)]
    assert {each["station"] for each in drawn} == {"ValidationPlatform_1"}
    shifts = np.array([each["shift"] for each in drawn])
    radii, turns = np.hypot(shifts[:, 0], shifts[:, 1]), shifts[:, 2]
    assert radii.max() <= 0.1001
    assert np.abs(turns).max() <= math.radians(6.0) + 1e-4
    assert np.median(radii) > 0.05
    assert (turns > 0.03).any()
    assert (turns < -0.03).any()
    assert station.draw(task(), np.random.default_rng(3)) == drawn[3]
    room = Polygon([(0, 0), (8, 0), (8, 6), (0, 6)])
    for each in drawn[:20]:
        after = station.prepare(task(), each).layout
        shape = Polygon(after.box("ValidationPlatform_1").corners())
        assert shape.difference(room).area < 2e-3
        assert all(
            shape.disjoint(Polygon(box.corners())) for name, box in boxes(after) if name != "ValidationPlatform_1"
        )


def boxes(layout):
    return [(each.id, layout.box(each.id)) for each in layout.placements if each.support == "floor"]


def row():
    """Three benches side by side without gaps, against a wall."""
    room = Room(width=8.0, depth=6.0, doors=(Door(wall="left", offset=4.5),))
    benches = tuple(put(f"bench_{k}", "LabBench1200", 2.0 + 1.2 * k, 0.375) for k in range(3))
    layout = Layout(id="row", floor=room.floor, placements=benches)
    return layout, GoalPair(-1, (1.0, 4.5, 0.0), goal_pose(layout.box("bench_1")), "anywhere", "anywhere")


def test_furniture_between_neighbors_moves_straight_out_of_its_row():
    layout, pair = row()
    for seed in range(5):
        data = Station(tries=30).draw(task(layout, pair), np.random.default_rng(seed))
        dx, dy, turn = data["shift"]
        assert data["station"] == "bench_1"
        assert (dx, turn) == (0.0, 0.0)
        assert 0.0 <= dy <= 0.1
    assert station_of(task(layout, pair)) == "bench_1"


def test_a_goal_without_furniture_is_refused():
    pair = GoalPair(-1, (1.0, 4.3, 0.0), (6.0, 1.0, 0.0), "anywhere", "anywhere")
    with pytest.raises(OptionError, match="at no piece of furniture"):
        Station().draw(task(pair=pair), np.random.default_rng(0))


@pytest.mark.parametrize(
    "data",
    [
        None,
        [1, 2],
        {"station": "ValidationPlatform_1"},
        {**DATA, "more": 1},
        {**DATA, "station": 3},
        {**DATA, "station": "x" * 1000},
        {**DATA, "station": "beaker"},
        {**DATA, "shift": [0.0, 0.0]},
        {**DATA, "shift": "abc"},
        {**DATA, "shift": [math.nan, 0.0, 0.0]},
        {**DATA, "shift": [5.0, 0.0, 0.0]},
        {**DATA, "shift": [0.0, True, 0.0]},
    ],
)
def test_hostile_data_is_one_clear_error(data):
    with pytest.raises(OptionError) as error:
        Station().prepare(task(), data)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 200


def test_a_dock_that_is_blocked_is_refused():
    layout = LAYOUT.replace(placements=(*LAYOUT.placements, put("carton", "Carton", 6.1, 2.5)))
    with pytest.raises(OptionError, match="would touch something"):
        Station().prepare(task(layout), DATA)


def environment():
    tasks = Fixed("station", DATA, LAYOUT)
    pair = GoalPair(-1, (PAIR.goal[0] - 1.0, PAIR.goal[1], 0.0), PAIR.goal, "anywhere", "anywhere")
    object.__setattr__(tasks.task, "pair", pair)
    measures = ("pose", "outcomes", "goal")
    return gym.make("LabFloorNav-v0", tasks=tasks, conditions=["station"], measures=measures, endings=()).unwrapped


def test_the_errors_are_those_to_the_true_pose_and_count_at_rest():
    env = environment()
    _, info = env.reset(seed=0)
    goal = Station().prepare(task(), DATA).pair.goal
    assert info["goal"] == pytest.approx(goal)
    for step in range(1, 30):
        forward = 0.5 if step <= 10 else 0.0
        *_, info = env.step([forward, 0.0])
        outcome = info["outcomes"]["station"]
        x, y, yaw = info["pose"]
        assert outcome["position"] == pytest.approx(math.hypot(x - goal[0], y - goal[1]))
        assert outcome["heading"] == pytest.approx(abs(wrap_angle(yaw - goal[2])))
        if step <= 20:
            assert outcome["docked"] is False
    assert outcome["docked"] is True


@pytest.mark.parametrize("make", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_to_the_bit(make):
    env = environment()
    env.reset(seed=0)
    for _ in range(5):
        env.step([0.3, 0.1])
    other = make(env)
    for _ in range(12):
        assert repr(env.step([0.0, 0.0])) == repr(other.step([0.0, 0.0]))
    assert env.step([0.0, 0.0])[4]["outcomes"]["station"]["docked"] is True
