from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.robot import ROBOT
from labgym.eval import evaluate
from labgym.layouts import Layout
from labgym.navigation import OccupancyGrid
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.blockage import BlockageDetector
from labgym.policies.online_map import frontier

NOTHING = np.full((72, 128, 1), 10.0, dtype=np.float32)


def start(goal: tuple[float, float]) -> EpisodeStart:
    return EpisodeStart(goal=goal, rng=np.random.default_rng(0))


def observation_of(depth: np.ndarray, pose: tuple[float, float, float] = (0.0, 0.0, 0.0), v: float = 0.0):
    return {"depth": depth, "odometry": np.array(pose), "velocity": np.array([v, 0.0], dtype=np.float32)}


def turned(policy, depth: np.ndarray, steps: int = 60) -> list[np.ndarray]:
    """Actions of a robot that turns in place exactly as commanded."""
    yaw, actions = 0.0, []
    for _ in range(steps):
        actions.append(policy.act(observation_of(depth, (0.0, 0.0, math.remainder(yaw, 2.0 * math.pi)))))
        if actions[-1][0] != 0.0:
            break
        yaw += 0.1 * ROBOT.twist(*actions[-1])[1]
    return actions


@pytest.fixture(scope="module")
def layout() -> Layout:
    return island_laboratory()


@pytest.fixture(scope="module")
def report(layout):
    return evaluate("online_map", [layout], progress=False)


def test_a_course_is_driven_without_contact_and_close_to_the_shortest_path(report):
    assert report["success"] == 1.0
    assert report["contacts_per_meter"] == 0.0
    assert report["spl"] > 0.9
    assert not report.summary.privileged


def test_the_same_course_is_driven_the_same_way_again(layout, report):
    again = evaluate("online_map", [layout], progress=False)
    assert again.routes == report.routes


def test_an_open_way_ahead_is_taken_at_once():
    policy = make_policy("online_map")
    policy.reset(start((4.0, 0.0)))
    actions = turned(policy, NOTHING)
    assert len(actions) == 1
    assert actions[0][0] > 0.0


@pytest.mark.parametrize("goal, sense", [((0.0, 4.0), 1.0), ((-2.0, -3.0), -1.0)])
def test_it_looks_towards_the_goal_first_and_drives_once_the_way_is_seen(goal, sense):
    policy = make_policy("online_map")
    policy.reset(start(goal))
    actions = turned(policy, NOTHING)
    turns = np.array(actions)[:-1, 1]
    assert (turns * sense > 0.0).all()
    bearing = abs(math.atan2(goal[1], goal[0]))
    assert 0.1 * ROBOT.w_max * len(turns) < bearing + 1.2
    assert actions[-1][0] > 0.0


def test_walled_in_it_goes_as_near_to_the_goal_as_it_can():
    policy = make_policy("online_map")
    policy.reset(start((6.0, 0.0)))
    turned(policy, np.full((72, 128), 2.0))
    end = policy.planned_path()[-1]
    assert 1.4 < end[0] < 2.2 - 0.27
    assert abs(end[1]) < 0.3


def test_stopped_by_an_unseen_obstacle_it_backs_off_and_drives_around_it():
    policy = make_policy("online_map")
    policy.reset(start((4.0, 0.0)))
    turned(policy, NOTHING)
    actions = [policy.act(observation_of(NOTHING, (1.0, 0.0, 0.0), v=0.0)) for _ in range(14)]
    forward = [ROBOT.twist(*action)[0] for action in actions]
    assert min(forward) == pytest.approx(ROBOT.v_min)
    backing = max(k for k, v in enumerate(forward) if v < 0.0)
    v, w = ROBOT.twist(*actions[backing + 1])
    assert abs(w) > 0.3
    assert v >= 0.0


def test_an_accelerating_robot_is_not_blocked():
    blockage = BlockageDetector()
    v = 0.0
    for _ in range(12):
        assert not blockage.blocked(v)
        blockage.note(1.0)
        v = min(1.0, v + ROBOT.acceleration * ROBOT.control_dt)


def test_a_robot_that_is_stopped_is_blocked_and_backs_off_for_a_while():
    blockage = BlockageDetector(patience=4, retreat=6)
    blockage.note(0.5)
    assert [blockage.blocked(0.01) for _ in range(4)] == [False, False, False, True]
    steps = 0
    while blockage.backing:
        assert ROBOT.twist(*blockage.back_off())[0] == pytest.approx(ROBOT.v_min)
        assert not blockage.blocked(-0.3)
        steps += 1
    assert steps == 6


def test_a_robot_that_turns_in_place_is_not_blocked():
    blockage = BlockageDetector()
    for _ in range(20):
        blockage.note(0.0)
        assert not blockage.blocked(0.0)


def floor_with_a_wall() -> OccupancyGrid:
    """A 4 m x 4 m floor on a 0.1 m grid with a wall along x = 2 m from side to side."""
    occupied = np.zeros((40, 40), dtype=bool)
    occupied[:, 20] = True
    return OccupancyGrid(occupied, 0.1)


def test_the_frontier_is_the_unseen_cell_with_the_shortest_way_through_it():
    free = floor_with_a_wall()
    unknown = np.zeros((40, 40), dtype=bool)
    unknown[5, 5] = unknown[35, 15] = unknown[20, 30] = True
    here, goal = (1.05, 2.05), (3.5, 3.5)
    assert frontier(free, unknown, here, goal) == pytest.approx(free.centre_of(35, 15))
    assert frontier(free, unknown, here, (0.0, 0.0)) == pytest.approx(free.centre_of(5, 5))


def test_if_all_reachable_floor_is_seen_the_frontier_is_the_cell_nearest_to_the_goal():
    free = floor_with_a_wall()
    cell = frontier(free, np.zeros((40, 40), dtype=bool), (0.55, 0.55), (3.0, 2.05))
    assert cell == pytest.approx(free.centre_of(20, 19))


def test_a_robot_that_does_not_fit_where_it_is_has_no_frontier():
    free = floor_with_a_wall()
    assert frontier(free, np.ones((40, 40), dtype=bool), (2.05, 1.0), (3.0, 2.0)) is None
