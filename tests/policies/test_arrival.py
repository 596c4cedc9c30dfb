from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory
from map_drives import drive

from labgym.envs import LabPointNavEnv
from labgym.envs.labnav.task import TRANSITION, TaskProperties
from labgym.envs.labnav.tasks import task_of
from labgym.navigation import goal_pairs
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.arrival import GoalArrival, shortened
from labgym.policies.reckoning import DeadReckoning

LAYOUT = island_laboratory()
PAIRS = goal_pairs(LAYOUT)
AROUND, DIRECT = PAIRS[1], PAIRS[2]
AISLE = task_of("aisle").announced(2)


@pytest.fixture(scope="module")
def env():
    made = LabPointNavEnv(layout=LAYOUT, observation="lidar")
    yield made
    made.close()


def start(heading: float | None = None, task: TaskProperties = AISLE) -> EpisodeStart:
    return EpisodeStart(goal=(2.0, 0.0), rng=np.random.default_rng(0), task=task, heading=heading)


@pytest.mark.parametrize("name", ["astar", "blind", "bug2", "dwa"])
def test_policies_stop_at_rest_inside_the_goals_disc(name, env):
    driven = drive(make_policy(name), LAYOUT, AROUND.start, AROUND.goal, env=env, steps=300)
    assert driven.stopped
    assert driven.contacts == 0
    assert driven.error(AROUND.goal)[0] <= 0.36
    assert math.dist(driven.poses[-1][:2], driven.poses[-2][:2]) < 0.003


@pytest.mark.parametrize("name", ["astar", "blind", "bug2", "straight"])
def test_policies_turn_to_the_heading_of_a_goal(name, env):
    driven = drive(make_policy(name), LAYOUT, DIRECT.start, DIRECT.goal, env=env, steps=300, docking=True)
    assert driven.stopped
    distance, angle = driven.error(DIRECT.goal)
    assert distance < 0.03
    assert angle < 0.02


def test_still_neither_moves_nor_stops(env):
    driven = drive(make_policy("still"), LAYOUT, DIRECT.start, DIRECT.goal, env=env, steps=20)
    assert not driven.stopped
    assert driven.length == 0.0


def test_blind_drives_the_same_way_whatever_the_odometry_says(env):
    drives = [
        drive(make_policy("blind"), LAYOUT, DIRECT.start, DIRECT.goal, env=env, steps=80, drift=drift)
        for drift in (0.0, 5.0)
    ]
    assert drives[0].poses == drives[1].poses
    assert drives[0].stopped


def test_dead_reckoning_is_the_motion_of_the_robot_without_contact(env):
    _, info = env.reset(options={"start": DIRECT.start, "goal": DIRECT.goal})
    reckoning, rng = DeadReckoning(), np.random.default_rng(3)
    begin = info["pose"]
    for _ in range(15):
        action = rng.uniform((-0.2, -1.0), (0.6, 1.0))
        _, _, _, _, info = env.step(action)
        reckoning.drive(np.float32(action))
    dx, dy = info["pose"][0] - begin[0], info["pose"][1] - begin[1]
    c, s = math.cos(begin[2]), math.sin(begin[2])
    assert reckoning.pose[:2] == pytest.approx((c * dx + s * dy, c * dy - s * dx), abs=0.01)
    assert reckoning.pose[2] == pytest.approx(math.remainder(info["pose"][2] - begin[2], 2.0 * math.pi), abs=0.01)


def test_outside_of_tasks_an_arrival_changes_nothing_and_never_stops():
    arrival = GoalArrival(start(task=TRANSITION))
    action = np.array([1.0, 0.3])
    assert arrival.limited(action, (1.99, 0.0, 0.0)) is action
    assert not arrival.reached((2.0, 0.0, 0.0), np.zeros(2))


def test_an_arrival_is_reached_at_rest_within_the_disc_and_at_the_heading_only():
    free = GoalArrival(start())
    assert not free.reached((1.5, 0.0, 0.0), np.zeros(2))
    assert not free.reached((1.9, 0.0, 0.0), np.array([0.3, 0.0]))
    assert free.reached((1.7, 0.0, 0.0), np.zeros(2))
    docked = GoalArrival(start(heading=1.0))
    assert not any(docked.reached((1.95, 0.0, 0.8), np.zeros(2)) for _ in range(30))
    assert [docked.reached((1.95, 0.0, 1.05), np.zeros(2)) for _ in range(11)] == [False] * 9 + [True] * 2


def test_a_shortened_path_lacks_its_last_part():
    path = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert shortened(path, 0.25) == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.75]]))
    assert shortened(path, 1.5) == pytest.approx(np.array([[0.0, 0.0], [0.5, 0.0]]))
    assert shortened(path, 5.0) == pytest.approx(np.array([[0.0, 0.0]]))


def test_bug2_leaves_an_obstacle_where_it_meets_the_line_nearer_to_the_goal(env):
    driven = drive(make_policy("bug2"), LAYOUT, AROUND.start, AROUND.goal, env=env, steps=300)
    track = np.array(driven.poses)[:, :2]
    ends = np.array([AROUND.start[:2], AROUND.goal[:2]])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    off = np.abs((track - ends[0]) @ np.array([-along[1], along[0]]))
    left = np.flatnonzero(off > 0.2)
    assert len(left)
    before, after = track[left[0]], track[left[-1]]
    assert np.linalg.norm(ends[1] - after) < np.linalg.norm(ends[1] - before)
