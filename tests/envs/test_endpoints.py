"""Starts and goals anywhere on the floor, passed as options of `reset`."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from gymnasium.utils.env_checker import check_env
from laboratories import put
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from labgym.envs import LabPointNavEnv
from labgym.envs import world as worlds
from labgym.envs.world import World
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS, goal_pairs

START, GOAL = (1.3, 1.0, 0.5), (6.6, 4.2)
"""Two points on either side of the island."""


def visibility_length(layout: Layout, start: tuple[float, ...], goal: tuple[float, ...]) -> float:
    """Length of the shortest path by shapely: obstacles buffered by polygons, visibility graph, Dijkstra."""
    room = layout.room
    floor = shapely.box(0, 0, room.width, room.depth).buffer(-PLANNING_RADIUS)
    obstacles = shapely.union_all(
        [
            shapely.Polygon(box.corners()).buffer(PLANNING_RADIUS, quad_segs=12)
            for box in layout.obstacles(OBSTACLE_HEIGHT)
        ]
    )
    free = floor.difference(obstacles)
    corners = shapely.get_coordinates(free)
    points = np.concatenate([[start[:2], goal[:2]], corners])
    first, second = np.triu_indices(len(points), 1)
    segments = shapely.linestrings(np.stack([points[first], points[second]], axis=1))
    loose = free.buffer(1e-6)
    shapely.prepare(loose)
    seen = shapely.covers(loose, segments)
    lengths = np.linalg.norm(points[first] - points[second], axis=1)
    graph = csr_matrix((lengths[seen], (first[seen], second[seen])), shape=(len(points), len(points)))
    return float(dijkstra(graph, directed=False, indices=0)[1])


def free_points(layout: Layout, count: int, seed: int = 0) -> np.ndarray:
    """Points of the floor that are at least 0.32 m from obstacles and walls."""
    room, rng = layout.room, np.random.default_rng(seed)
    boxes = shapely.union_all([shapely.Polygon(box.corners()) for box in layout.obstacles(OBSTACLE_HEIGHT)])
    free = shapely.box(0, 0, room.width, room.depth).buffer(-0.32).difference(boxes.buffer(0.32))
    points: list[np.ndarray] = []
    while len(points) < count:
        point = rng.uniform((0, 0), (room.width, room.depth))
        if free.covers(shapely.Point(point)):
            points.append(point)
    return np.array(points)


def test_the_shortest_length_between_any_two_points_is_that_of_a_visibility_graph(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    points = free_points(layout, 12)
    for start, goal in zip(points[:6], points[6:], strict=True):
        _, info = env.reset(options={"start": (*start, 1.0), "goal": goal})
        expected = visibility_length(layout, start, goal)
        assert info["shortest_path_length"] == pytest.approx(expected, rel=2e-3)
        assert info["distance"] == pytest.approx(math.dist(start, goal))


def test_the_episode_begins_at_the_start_and_ends_at_the_goal(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    observation, info = env.reset(options={"start": START, "goal": GOAL})
    assert info["pose"] == pytest.approx(START)
    assert info["goal"] == pytest.approx((*GOAL, 0.0))
    assert info["pair"] == -1
    distance, cosine, sine = observation["goal"].astype(float)
    bearing = math.atan2(GOAL[1] - START[1], GOAL[0] - START[0]) - START[2]
    assert (distance, cosine, sine) == pytest.approx(
        (math.dist(START[:2], GOAL), math.cos(bearing), math.sin(bearing)), abs=1e-5
    )
    near = (GOAL[0] - 0.6, GOAL[1], 0.0)
    env.reset(options={"start": near, "goal": GOAL})
    ended = [env.step(np.array([1.0, 0.0], np.float32))[2] for _ in range(5)]
    assert ended[-1]
    assert not ended[0]


def test_the_other_end_comes_from_the_pair(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    pair = goal_pairs(layout)[1]
    _, info = env.reset(options={"pair": 1, "start": START})
    assert info["pose"] == pytest.approx(START)
    assert info["goal"] == pytest.approx(pair.goal)
    assert info["pair"] == 1
    _, info = env.reset(options={"pair": 1, "goal": (*GOAL, 1.5)})
    assert info["pose"] == pytest.approx(pair.start)
    assert info["goal"] == pytest.approx((*GOAL, 1.5))


def test_progress_adds_up_to_the_length_of_the_way(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    _, info = env.reset(options={"start": (1.3, 1.0, 0.0), "goal": (6.6, 1.0)})
    total = 0.0
    for _ in range(40):
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0], np.float32))
        total += info["reward_terms"]["progress"]
        if terminated:
            break
    assert total == pytest.approx(info["path_length"], rel=0.02, abs=0.02)


def test_the_ends_of_a_pair_passed_as_options_give_the_same_episode_to_the_last_bit(layout: Layout) -> None:
    env = LabPointNavEnv(layout=layout)
    pair = goal_pairs(layout)[2]
    traces = []
    for options in ({"pair": 2}, {"pair": 2, "start": pair.start}, {"start": pair.start, "goal": pair.goal}):
        observation, info = env.reset(seed=5, options=options)
        trace = [observation["lidar"].tobytes(), info["shortest_path_length"]]
        rng = np.random.default_rng(1)
        for _ in range(20):
            observation, reward, *_, info = env.step(rng.uniform(-1, 1, 2).astype(np.float32))
            trace += [observation["lidar"].tobytes(), observation["goal"].tobytes(), reward, info["pose"].tobytes()]
        traces.append(trace)
    assert traces[0] == traces[1] == traces[2]


def test_a_layout_without_a_protocol_can_be_driven_between_two_points(empty_room: Layout) -> None:
    _, info = LabPointNavEnv(layout=empty_room).reset(seed=0, options={"start": START, "goal": GOAL})
    assert info["protocol"] == ""
    assert info["shortest_path_length"] == pytest.approx(math.dist(START[:2], GOAL))
    with pytest.raises(OptionError, match="has no protocol"):
        LabPointNavEnv(layout=empty_room).reset(seed=0, options={"start": START})


class Anywhere(LabPointNavEnv):
    """The environment with every episode between two points."""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        return super().reset(seed=seed, options={**(options or {}), "start": START, "goal": GOAL})


@pytest.mark.parametrize("observation", ["lidar", "depth", "rgbd"])
def test_gymnasiums_checker_accepts_episodes_between_two_points(layout: Layout, observation: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = Anywhere(layout=layout, observation=observation)
        check_env(env, skip_render_check=True)
        env.close()


BAD = {
    "text": "1,2,3",
    "a number": 1.0,
    "two numbers": (1.0, 1.0),
    "four numbers": (1.0, 1.0, 0.0, 0.0),
    "not a number": (math.nan, 1.0, 0.0),
    "infinite": (1.0, 1.0, math.inf),
    "huge": (10**400, 1.0, 0.0),
    "truth values": (True, True, False),
    "words": ("1", "1", "0"),
    "complex": (1j, 1.0, 0.0),
    "nested": ((1.0, 1.0, 0.0),),
    "a mapping": {"x": 1.0, "y": 1.0, "yaw": 0.0},
    "a matrix": np.ones((3, 1)),
    "a long list": [0.0] * 1_000_000,
    "lines": ["a\nb"],
}


@pytest.mark.parametrize("value", BAD.values(), ids=BAD.keys())
def test_what_is_not_a_pose_is_refused_in_one_line(layout: Layout, value: object) -> None:
    with pytest.raises(OptionError, match=r"^start is .*expected \(x, y, yaw\)") as caught:
        LabPointNavEnv(layout=layout).reset(options={"start": value, "pair": 0})
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"goal": (1.0,)}, r"goal is \(1.0,\), expected \(x, y\) or \(x, y, yaw\)"),
        ({"start": (-0.1, 1.0, 0.0)}, r"start \(-0.1, 1\) is in none of the floor's spaces \(laboratory\)"),
        ({"goal": (4.0, 6.5)}, "goal .* is in none of the floor's spaces"),
        ({"start": (4.0, 2.5, 0.0)}, "start .* would touch an obstacle"),
        ({"start": (0.26, 0.6, 0.0)}, "start .* would touch an obstacle"),
        ({"start": (0.285, 0.6, 0.0)}, r"start .* a disc of 0.30 m, .* does not fit there; .* at least 0.30 m"),
        ({"start": START, "goal": (4.0, 2.5)}, r"goal \(4, 2.5\): a disc of 0.30 m, .* does not fit there"),
        ({"start": START, "goal": START}, "coincide"),
    ],
)
def test_ends_between_which_the_robot_cannot_drive_are_refused(
    layout: Layout, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(OptionError, match=message) as caught:
        LabPointNavEnv(layout=layout).reset(options={"pair": 0, **options})
    assert "\n" not in str(caught.value)


def test_a_wall_of_benches_leaves_no_path(empty_room: Layout) -> None:
    benches = [put(f"B{k}", "IslandBench1800", 0.9 + 1.8 * k, 3.0) for k in range(4)]
    blocked = empty_room.replace(placements=(*benches, put("B4", "IslandBench1800", 7.1, 3.0)))
    with pytest.raises(OptionError, match=r"no path from start \(4, 1, 0\) to goal \(4, 5\)"):
        LabPointNavEnv(layout=blocked).reset(options={"start": (4.0, 1.0, 0.0), "goal": (4.0, 5.0)})


def test_an_unknown_option_lists_start_and_goal(layout: Layout) -> None:
    with pytest.raises(UnknownNameError, match=r"goal, .*start"):
        LabPointNavEnv(layout=layout).reset(options={"begin": START})


def test_a_world_keeps_a_bounded_number_of_goals(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worlds, "FIELDS", 5)
    monkeypatch.setattr(worlds, "LENGTHS", 5)
    here = World(layout)
    pair = goal_pairs(layout)[0]
    first = here.to_go(pair.goal)
    for k, point in enumerate(free_points(layout, 8)):
        here.to_go((*point, 0.0))
        if k % 2:
            assert here.to_go(pair.goal) is first
    assert len(here._fields) == 5
    for point in free_points(layout, 8):
        here.shortest_length(replace(pair, start=(*point, 0.0)))
    assert len(here._lengths) == 5
