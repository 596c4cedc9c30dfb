"""Changes against the map: where they are drawn (checked with shapely), what the data may hold, episodes among them."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from condition_tasks import Fixed
from floor_shapes import two_rooms
from laboratories import island_laboratory, put
from shapely import LineString, Polygon

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.conditions.change_list import changed, changes_of
from labgym.envs.conditions.changes import UNSEEN_FROM, Changes
from labgym.envs.tasks import Task
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.floor import Opening
from labgym.navigation import GoalPair, ShortestPaths, goal_pairs

LAYOUT = island_laboratory()
PAIRS = goal_pairs(LAYOUT)
LONG = GoalPair(-1, (1.3, 0.6, 0.0), (6.7, 4.4, 0.0), "anywhere", "anywhere")
START = (1.2, 1.0, 0.0)
TROLLEY = {"kind": "added", "id": "trolley", "asset": "ServiceTrolley", "pose": [2.4, 1.0, 0.0], "mass": 30.0}


def task(layout=LAYOUT, pair=LONG, **fields):
    return Task(layout, layout.protocol, pair, **fields)


def footprints(layout, names, below=9.0):
    """Return the outlines of the boxes of placements, and of their open parts, whose bottom is below a height."""
    boxes = (box for name in names for box in (layout.box(name), *layout.open_parts(name)))
    return [Polygon(box.corners()) for box in boxes if box.z0 < below]


def connected_rooms(doors=2):
    """Two rooms with one or two open doors between them."""
    floor = two_rooms(position=1.2)
    wall = floor.walls[-1]
    openings = (*wall.openings, Opening(position=3.8, width=1.0, state="open"))[:doors]
    walls = (*floor.walls[:-1], wall.model_copy(update={"openings": openings}))
    return Layout(id="rooms", floor=floor.model_copy(update={"walls": walls}), placements=())


@pytest.mark.parametrize("seed", range(8))
def test_changes_stand_free_on_the_route_and_leave_a_way_round(seed):
    condition, before = Changes(spacing=2.0), task()
    data = condition.draw(before, np.random.default_rng(seed))
    assert data == condition.draw(before, np.random.default_rng(seed))
    assert json.loads(json.dumps(data)) == data
    after = condition.prepare(before, json.loads(json.dumps(data)))
    route = LineString(ShortestPaths(LAYOUT).path(LONG.start, LONG.goal).points)
    assert 1 <= len(data) <= round(route.length / 2.0)
    for change in data:
        if change["kind"] == "opened":
            shapes = [Polygon(box.corners()) for box in after.layout.open_parts(change["placement"])]
        else:
            name = change["id"]
            (shape,) = shapes = footprints(after.layout, [name])
            others = [placement.id for placement in after.layout.placements if placement.id != name]
            top = after.layout.box(name).z1
            assert all(shape.distance(other) > 0.02 for other in footprints(after.layout, others, top))
            assert Polygon([(0, 0), (8, 0), (8, 6), (0, 6)]).contains(shape)
            assert change.get("mass") in (None, 4.0, 8.0, 30.0)
        assert min(shape.distance(route) for shape in shapes) < 0.30 + 1e-3
        ends = [LineString([pose[:2], pose[:2]]) for pose in (LONG.start, LONG.goal)]
        assert min(shape.distance(end) for shape in shapes for end in ends) > 0.599
    around = ShortestPaths(after.layout).path(LONG.start, LONG.goal)
    assert around is not None
    assert route.length - 1e-9 <= around.length <= 3.0 * route.length
    assert after.old_map is LAYOUT
    assert set(after.pushable) == {change["id"] for change in data if "mass" in change}


def test_all_kinds_of_changes_are_drawn():
    kinds = set()
    for seed in range(30):
        for change in Changes(spacing=2.0).draw(task(), np.random.default_rng(seed)):
            kinds.add(change.get("asset", change["kind"]))
    assert kinds >= {"LabStool", "ServiceTrolley", "opened"}
    assert kinds & {"Carton", "SmallCarton"}


def test_things_of_the_map_are_moved():
    layout = LAYOUT.replace(placements=(*LAYOUT.placements, put("stool", "LabStool", 0.5, 5.4)))
    drawn = [
        change
        for seed in range(12)
        for change in Changes(kinds=("stool",)).draw(task(layout), np.random.default_rng(seed))
    ]
    assert {change["kind"] for change in drawn} == {"added", "moved"}
    moved = next(change for change in drawn if change["kind"] == "moved")
    after = Changes().prepare(task(layout), [moved])
    assert after.layout.placement("stool").position[:2] == tuple(moved["pose"][:2])
    assert after.pushable == {"stool": 8.0}
    assert after.old_map.placement("stool").position[:2] == (0.5, 5.4)


def test_a_door_is_shut_only_where_another_way_leads_round():
    pair = GoalPair(-1, (4.5, 1.2, 0.0), (7.5, 1.2, 0.0), "anywhere", "anywhere")
    rooms = connected_rooms()
    condition = Changes(kinds=("door",), detour=10.0)
    (change,) = condition.draw(task(rooms, pair), np.random.default_rng(0))
    assert change == {"kind": "door", "wall": 4, "opening": 0, "state": "closed"}
    after = condition.prepare(task(rooms, pair), [change])
    assert after.layout.floor.walls[4].openings[0].state == "closed"
    before, around = (ShortestPaths(each).path(pair.start, pair.goal).length for each in (rooms, after.layout))
    assert around > before + 1.0
    one = connected_rooms(1)
    assert condition.draw(task(one, pair), np.random.default_rng(0)) == []
    with pytest.raises(OptionError, match="no way round"):
        condition.prepare(task(one, pair), [change])


HOSTILE = {
    "changes": [3, {"kind": "added"}, "x", None],
    "kind": [[{"kind": "removed", "id": "a"}]],
    "finite": [[{**TROLLEY, "pose": [math.nan, 1.0, 0.0]}], [{**TROLLEY, "pose": [1e9, 1.0, 0.0]}]],
    "at most 64": [[{**TROLLEY, "id": f"t{k}"} for k in range(65)]],
    "greater than 0": [[{**TROLLEY, "mass": 0.0}], [{**TROLLEY, "mass": -1.0}]],
    "extra": [[{**TROLLEY, "color": "red"}]],
    "asset 'Nothing'": [[{**TROLLEY, "asset": "Nothing"}]],
    "too firmly": [[{**TROLLEY, "asset": "LabStoolLegs"}], [{**TROLLEY, "asset": "FumeHood"}]],
    "in no room": [[{**TROLLEY, "pose": [30.0, 1.0, 0.0]}]],
    "is taken": [[{**TROLLEY, "id": "FumeHood_1"}]],
    "placement 'x'": [[{"kind": "moved", "placement": "x", "pose": [2.4, 1.0, 0.0]}]],
    "moving part": [[{"kind": "opened", "placement": "FumeHood_1", "state": {"drawer_99": 1.0}}]],
    "less than or equal to 1": [[{"kind": "opened", "placement": "FumeHood_1", "state": {"sash": 3.0}}]],
    "no door between rooms": [[{"kind": "door", "wall": 0, "opening": 0, "state": "closed"}]],
    "at its start": [[{**TROLLEY, "pose": [1.3, 0.6, 0.0]}]],
    "no way round": [[{**TROLLEY, "pose": [6.7, 4.4, 0.0]}]],
}


@pytest.mark.parametrize(("match", "data"), [(match, data) for match, each in HOSTILE.items() for data in each])
def test_hostile_data_is_one_clear_error(match, data):
    with pytest.raises(OptionError) as error:
        Changes().prepare(task(), data)
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 400
    if match not in ("changes", "kind", "finite", "extra"):
        assert match in message


def test_options_out_of_range_are_refused():
    for options in ({"spacing": 0.0}, {"most": 0}, {"detour": -1.0}, {"kinds": ()}, {"late": 1}, {"pushable": None}):
        with pytest.raises(OptionError):
            Changes(**options)
    with pytest.raises(UnknownNameError):
        Changes(kinds=("elephant",))


def environment(data, pose=START, layout=LAYOUT, **options):
    options = {"tasks": Fixed("changes", data, layout, pose), "conditions": ["changes"], "endings": (), **options}
    measures = ("pose", "contacts", "outcomes", "touched", "conditions")
    return gym.make("LabFloorNav-v0", disable_env_checker=True, measures=measures, **options).unwrapped


def test_a_push_is_no_contact_and_its_way_and_mass_are_reported():
    env = environment([TROLLEY])
    env.reset(seed=0)
    for _ in range(30):
        *_, info = env.step([0.5, 0.0])
    assert info["contacts"] == 0
    assert info["touched"] == ()
    outcome = info["outcomes"]["changes"]
    physics = env.state.moving.simulation
    moved = math.dist(physics.poses[0, :2], TROLLEY["pose"][:2])
    assert outcome["appeared"] == {}
    assert outcome["pushed"]["trolley"] == {"mass": 30.0, "way": pytest.approx(moved, rel=0.02), "touched": True}
    assert moved > 0.5
    assert info["conditions"]["changes"] == [TROLLEY]
    assert env.state.task.old_map is LAYOUT


def test_a_fixed_thing_is_a_contact_and_is_named():
    env = environment([{**TROLLEY, "mass": None}])
    env.reset(seed=0)
    for _ in range(20):
        *_, info = env.step([0.5, 0.0])
    assert info["contacts"] > 5
    assert info["touched"] == ("trolley",)
    assert info["outcomes"]["changes"] == {"pushed": {}, "appeared": {}}


def test_the_planar_kernel_takes_fixed_changes_only():
    pytest.importorskip("numba")
    env = environment([{**TROLLEY, "mass": None}], physics="planar")
    env.reset(seed=0)
    for _ in range(20):
        *_, info = env.step([0.5, 0.0])
    assert info["contacts"] > 5
    with pytest.raises(OptionError, match="physics='mujoco'"):
        environment([TROLLEY], physics="planar").reset(seed=0)


def test_a_late_thing_comes_where_the_robot_is_far_and_does_not_see_it():
    """The robot drives along the front of the island; behind it a carton appears once it has driven 0.5 m."""
    carton = {"kind": "added", "id": "late", "asset": "SmallCarton", "pose": [4.6, 3.7, 0.0], "mass": 4.0, "after": 0.5}
    env = environment([carton], pose=(1.3, 0.7, 0.0))
    env.reset(seed=0)
    physics = env.state.moving.simulation
    came = None
    for step in range(40):
        there = "late" not in physics.absent
        assert there == any(body.name == "late" for body in env.state.moving.bodies())
        *_, info = env.step([1.0, 0.0])
        if came is None and "late" not in physics.absent:
            came = step
            assert env.state.path_length >= 0.5
            assert math.dist(env.state.pose[:2], (4.6, 3.7)) >= UNSEEN_FROM
            sight = LineString([env.state.pose[:2], (4.6, 3.7)])
            assert sight.intersects(footprints(LAYOUT, ["IslandBench1800_1"])[0])
    assert came is not None
    assert info["outcomes"]["changes"]["appeared"] == {"late": pytest.approx((came + 1) * 0.1)}
    seen = {**carton, "id": "seen", "pose": [6.5, 0.7, 0.0], "after": 0.0}
    env = environment([seen], pose=(1.3, 0.7, 0.0))
    env.reset(seed=0)
    for _ in range(20):
        *_, info = env.step([1.0, 0.0])
    assert info["outcomes"]["changes"]["appeared"] == {}
    with pytest.raises(OptionError, match="give its mass"):
        environment([{**carton, "mass": None}]).reset(seed=0)


def test_late_things_are_drawn_on_request():
    drawn = [
        change
        for seed in range(10)
        for change in Changes(spacing=2.0, late=True).draw(task(), np.random.default_rng(seed))
    ]
    late = [change for change in drawn if "after" in change]
    assert 0 < len(late) <= len(drawn) // 2
    assert all("mass" in change for change in late)


@pytest.mark.parametrize("make", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("steps", [3, 18])
def test_a_copy_in_the_middle_of_an_episode_goes_on_to_the_bit(make, steps):
    carton = {"kind": "added", "id": "late", "asset": "SmallCarton", "pose": [4.6, 3.7, 0.0], "mass": 4.0, "after": 1.0}
    env = environment([TROLLEY, carton])
    env.reset(seed=0)
    for _ in range(steps):
        env.step([0.6, 0.0])
    other = make(env)
    for _ in range(10):
        mine, theirs = env.step([0.6, 0.2]), other.step([0.6, 0.2])
        for name, reading in mine[0].items():
            np.testing.assert_array_equal(reading, theirs[0][name])
        assert repr(mine[4]) == repr(theirs[4])
    assert mine[4]["outcomes"]["changes"]["pushed"]["trolley"]["way"] > 0.0


def digest() -> str:
    """The digest of the data and the observations of drives among drawn changes."""
    env = gym.make(
        "LabFloorNav-v0", layout=LAYOUT, conditions=[{"kind": "changes", "spacing": 2.0}], disable_env_checker=True,
        measures=("pose", "conditions", "outcomes"), exact=True,
    )  # fmt: skip
    result = hashlib.sha256()
    for seed in range(2):
        _, info = env.reset(seed=seed)
        result.update(repr(info).encode())
        for k in range(15):
            observation, *_, info = env.step(np.array([0.8, math.sin(k)], np.float32))
            result.update(observation["lidar"].tobytes() + repr(info["outcomes"]).encode())
    return result.hexdigest()


@pytest.mark.slow
def test_equal_seeds_give_equal_bytes_in_another_process():
    code = "from test_changes import digest; print(digest())"
    other = "1" if os.environ.get("PYTHONHASHSEED") == "0" else "0"
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = {**os.environ, "PYTHONHASHSEED": other, "PYTHONPATH": paths}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split()[-1] == digest()


def test_an_opened_part_is_solid():
    data = [{"kind": "opened", "placement": "IslandBench1800_1", "state": {"front_drawer_1": 1.0}}]
    after = changed(LAYOUT, changes_of(data))
    (drawer,) = after.open_parts("IslandBench1800_1")
    assert drawer in list(after.obstacles(1.4))
    assert drawer not in list(LAYOUT.obstacles(1.4))


def test_conditions_combine_and_glass_shows_things_where_they_were_pushed():
    """A pane to the right of the robot, a trolley ahead, a beaker on the deck: the lidar sees the trolley move on."""
    pane = {"x": 2.0, "y": 0.4, "yaw": 0.0, "width": 0.9, "framed": True}
    tasks = Fixed("changes", [TROLLEY], LAYOUT, START)
    glass = {"panes": [pane], "void": 0.0, "true": 1.0, "steel": 0.0, "seed": 1}
    object.__setattr__(tasks.task, "conditions", {"changes": [TROLLEY], "glass": glass})
    both, plain = (
        gym.make("LabFloorNav-v0", tasks=each, conditions=names, endings=(), measures=("outcomes",)).unwrapped
        for each, names in (
            (tasks, ["changes", "glass", "payload"]),
            (Fixed("changes", [TROLLEY], LAYOUT, START), ["changes"]),
        )
    )
    both.reset(seed=0)
    plain.reset(seed=0)
    assert [placement.id for placement in both.state.fixtures.layout.placements][-1] != "trolley"
    for _ in range(25):
        there, *_, info = both.step([0.5, 0.0])
        expected, *_ = plain.step([0.5, 0.0])
    assert info["outcomes"]["changes"]["pushed"]["trolley"]["way"] > 0.4
    assert info["outcomes"]["payload"]["highest"] > 0.0
    np.testing.assert_allclose(there["lidar"][85:96], expected["lidar"][85:96], atol=1e-5)
    assert expected["lidar"][90] < 0.35


def test_pictures_show_things_where_they_are():
    """Without the carton another picture; where it comes back, the first one."""
    carton = {**TROLLEY, "asset": "Carton", "mass": 8.0}
    env = environment([carton], render_mode="rgb_array", width=160, height=120)
    env.reset(seed=0)
    try:
        there = env.render().astype(int)
    except LabgymError as error:
        pytest.skip(str(error))
    physics = env.state.moving.simulation
    physics.remove("trolley")
    away = env.render().astype(int)
    assert (np.abs(there - away).max(axis=2) > 20).mean() > 0.003
    physics.put_back("trolley")
    assert (np.abs(there - env.render()).max(axis=2) <= 2).all()
    env.close()


def test_without_pushing_a_late_thing_is_there_from_the_start_and_stands_fast():
    env = environment([{**TROLLEY, "after": 5.0}], conditions=[{"kind": "changes", "late": True, "pushable": False}])
    env.reset(seed=0)
    for _ in range(30):
        *_, info = env.step([0.5, 0.0])
    assert "trolley" in info["touched"] or info["contacts"] > 0
    assert info["outcomes"]["changes"] == {"pushed": {}, "appeared": {}}
    env.close()
