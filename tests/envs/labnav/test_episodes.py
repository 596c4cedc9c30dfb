"""Episodes: what the document refuses, what a draw promises, and necks against shapely."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from laboratories import island_laboratory
from shapely import affinity
from shapely.geometry import LineString, Point, box
from shapely.ops import unary_union

from labgym.envs.conditions.parked import things_of, with_things
from labgym.envs.drive_source import task_source
from labgym.envs.labnav.drawing import Drawer, draw_floor
from labgym.envs.labnav.episodes import EpisodeTasks, LabNavEpisodes, published_episodes
from labgym.envs.labnav.necks import has_neck
from labgym.envs.labnav.tasks import TASKS, config_of, task_of
from labgym.envs.world import world_of
from labgym.errors import LabgymError, UnknownNameError
from labgym.eval.labnav.suites import is_in_files
from labgym.layouts import load_published
from labgym.navigation import goal_pairs

FLOOR = load_published("floors-val", "floors-val-0001")
"""A floor with walls, furniture and clutter."""


@pytest.fixture(scope="module")
def aisle():
    return draw_floor(FLOOR, "aisle", 2, 2, 14, attempts=300)


@pytest.fixture(scope="module")
def odometry():
    return draw_floor(FLOOR, "odometry", 2, 3, 14, attempts=100)


def document(drawn, **changes):
    data = {
        "schema": LabNavEpisodes.SCHEMA,
        "task": "odometry",
        "level": 2,
        "split": "floors-val",
        "seed": 14,
        "episodes": [each.model_dump(mode="json") for each in drawn],
    }
    return {**data, **changes}


def free(layout, radius):
    """The free positions of a disc, by shapely: the region of the floor's rooms less the dilated obstacles."""
    solids = [*layout.obstacles(1.4), *layout.floor.solids]
    shapes = [
        affinity.translate(
            affinity.rotate(box(-s.width / 2, -s.depth / 2, s.width / 2, s.depth / 2), s.yaw, (0, 0), use_radians=True),
            s.x,
            s.y,
        )
        for s in solids
        if s.z0 < 1.4
    ]
    low_x, low_y, high_x, high_y = layout.floor.bounds
    return box(low_x, low_y, high_x, high_y).difference(unary_union(shapes).buffer(radius, quad_segs=64))


def connected(region, start, goal):
    parts = getattr(region, "geoms", [region])
    return any(part.contains(Point(start[:2])) and part.contains(Point(goal[:2])) for part in parts)


def test_a_neck_lets_the_first_disc_through_and_not_the_second(aisle):
    episodes, draws = aisle
    assert draws.accepted == len(episodes) > 0
    assert draws.drawn >= draws.accepted
    for one in episodes:
        layout = with_things(FLOOR, things_of(one.conditions["parked"]))
        assert connected(free(layout, 0.345), one.start, one.goal)
        assert not connected(free(layout, 0.405), one.start, one.goal)
        assert has_neck(layout, one.pair, (0.35, 0.40))
        assert one.length >= 1.3 * math.dist(one.start[:2], one.goal[:2])


def test_parked_things_stand_clear_of_everything(aisle):
    for one in aisle[0]:
        things = things_of(one.conditions["parked"])
        for index, thing in enumerate(things):
            layout = with_things(FLOOR, things)
            mine = layout.box(f"parked-{index + 1}")
            others = [each for each in layout.obstacles(1.4) if (each.x, each.y) != (mine.x, mine.y)]
            shape = LineString([*mine.corners().tolist(), mine.corners()[0].tolist()])
            assert min(shape.distance(Point(each.x, each.y)) for each in others) > 0.1
            assert world_of(layout).clear_at(one.start)
            assert thing.asset


def test_lengths_are_those_of_the_task_and_of_the_true_floor(odometry):
    episodes, draws = odometry
    assert len(episodes) == 3
    assert draws.drawn <= 100
    for one in episodes:
        assert 8.0 <= one.length <= 25.0
        assert one.length == pytest.approx(world_of(FLOOR).length_to_disc(one.pair, 0.36), abs=1e-5)
        assert world_of(FLOOR).clear_at(one.start)


def test_equal_draws_are_equal_and_another_seed_draws_others(odometry):
    assert draw_floor(FLOOR, "odometry", 2, 3, 14, attempts=100) == odometry
    assert draw_floor(FLOOR, "odometry", 2, 3, 15, attempts=100)[0] != odometry[0]


def test_a_document_is_the_same_after_saving(odometry, tmp_path):
    episodes = LabNavEpisodes.parse(document(odometry[0]))
    assert LabNavEpisodes.load(episodes.save(tmp_path / "x.json")) == episodes
    assert episodes.hash == LabNavEpisodes.parse(json.loads(json.dumps(episodes.to_json()))).hash
    assert episodes.layout(FLOOR.id) == FLOOR
    assert episodes.first(1, 2).episodes == odometry[0][:2]


def test_a_suite_of_more_than_a_million_values_is_read(tmp_path):
    published = published_episodes("people", 3)
    many = [published.episodes[k % len(published.episodes)].model_copy(update={"number": k}) for k in range(3000)]
    suite = published.model_copy(update={"episodes": tuple(many)})
    path = suite.save(tmp_path / "people-3.json")
    assert sum(map(path.read_bytes().count, (b",", b"[", b"{"))) > 1_200_000
    assert is_in_files(str(path))
    assert LabNavEpisodes.load(path) == suite


@pytest.mark.parametrize(
    "change",
    [
        {"episodes": []},
        {"level": 4},
        {"task": "../x"},
        {"split": "floors-train"},
        {"seed": -1},
        {"extra": 1},
        {"draws": {"a": {"drawn": -1, "accepted": 0}}},
    ],
)
def test_a_broken_document_is_refused_in_one_line(odometry, change):
    with pytest.raises(LabgymError) as caught:
        LabNavEpisodes.parse(document(odometry[0], **change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change", [{"length": 0.0}, {"start": [0, 0]}, {"start": [0, 0, 99.0]}, {"goal": [1e4, 0, 0]}, {"floor_hash": "x"}]
)
def test_a_broken_episode_is_refused(odometry, change):
    data = document(odometry[0])
    data["episodes"][0] |= change
    with pytest.raises(LabgymError):
        LabNavEpisodes.parse(data)


def test_an_episode_twice_is_refused(odometry):
    with pytest.raises(LabgymError, match="same floor and number"):
        LabNavEpisodes.parse(document([odometry[0][0]] * 2))


def test_episode_tasks_have_the_drives_of_the_document(odometry):
    tasks = EpisodeTasks(FLOOR, odometry[0])
    assert tasks.draw(np.random.default_rng(0), {"episode": 1}, True).pair == odometry[0][1].pair
    with pytest.raises(UnknownNameError):
        tasks.draw(np.random.default_rng(0), {"episode": 7}, True)
    with pytest.raises(UnknownNameError):
        tasks.draw(np.random.default_rng(0), {"pair": 0}, True)


@pytest.mark.parametrize("data", ["x", [1], [{"asset": "SteelDrum"}], [{"asset": "Nothing", "x": 1, "y": 1}]])
def test_parked_things_that_are_none_are_refused(data):
    with pytest.raises(LabgymError) as caught:
        with_things(FLOOR, things_of(data))
    assert "\n" not in str(caught.value)


def test_too_many_parked_things_are_refused():
    with pytest.raises(LabgymError, match="at most 64"):
        things_of([{"asset": "SteelDrum", "x": 1.0, "y": 1.0}] * 65)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("level", [1, 2, 3])
@pytest.mark.parametrize("observation", ["lidar", "depth", "rgbd"])
def test_every_task_has_an_environment_at_every_level(task, level, observation):
    config = config_of(task, level, observation)
    assert [sensor.name for sensor in config.sensors[:3]] == ["odometry", "goal", "velocity"]


def test_odometry_has_the_published_errors_of_an_action():
    """RoboTHOR's 5 mm and 0.5 degrees, and those of the LoCoBot under "ilqr" in Habitat, halved."""
    one, two = task_of("odometry").level(1).odometry, task_of("odometry").level(2).odometry
    assert one["along"] * math.sqrt(0.25) == pytest.approx(0.005)
    assert one["heading"] * math.sqrt(0.25) == pytest.approx(0.5)
    assert one["turning"] * math.sqrt(30.0 / 360.0) == pytest.approx(0.5)
    assert two["along"] ** 2 * 0.25 == pytest.approx(0.25 * 0.006)
    assert math.radians(two["heading"]) ** 2 * 0.25 == pytest.approx(0.25 * 0.004)
    assert math.radians(two["turning"]) ** 2 * 30.0 / 360.0 == pytest.approx(0.25 * 0.012)
    assert two["stretch"] * 0.25 == pytest.approx(0.007)
    assert math.radians(two["veer"]) * 0.25 == pytest.approx(0.004)
    assert two["overturn"] * math.pi / 6.0 == pytest.approx(0.0115)


def test_an_unfiltered_draw_accepts_every_drive_with_a_path():
    episodes, draws = draw_floor(FLOOR, "aisle", 2, 8, 14, attempts=100, filtered=False)
    assert len(episodes) == 8
    assert draws.drawn < 30
    assert any(each.length < 8.0 for each in episodes)
    assert all(each.conditions["parked"] == [] for each in episodes)
    for each in episodes:
        assert each.length == pytest.approx(world_of(FLOOR).length_to_disc(each.pair, 0.36), abs=1e-5)


def test_a_task_that_does_not_exist_is_refused():
    with pytest.raises(UnknownNameError):
        config_of("fly")
    with pytest.raises(UnknownNameError):
        config_of("aisle", 4)
    with pytest.raises(UnknownNameError):
        config_of("aisle", 2, "sonar")


def test_training_draws_drives_of_the_task_and_of_the_layout_where_it_has_none():
    config = config_of("odometry", split="floors-val", layout=FLOOR, drives="labnav-odometry-2")
    tasks = task_source(config)
    drawn = tasks.draw(np.random.default_rng(0), {}, True)
    assert world_of(FLOOR).length_to_disc(drawn.pair, 0.36) >= 8.0
    room = island_laboratory()
    small = task_source(config_of("aisle", layout=room, drives="labnav-aisle-2"))
    assert small.draw(np.random.default_rng(0), {}, True).pair in goal_pairs(room)


def test_all_drawn_places_fit_the_robot():
    drawer = Drawer(FLOOR, "odometry", 1)
    rng = np.random.default_rng(1)
    drawn = [one for one in (drawer.draw(rng) for _ in range(40)) if one is not None]
    assert drawn
    assert all(world_of(FLOOR).clear_at(one.task.pair.start) for one in drawn)
