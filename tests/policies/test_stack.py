from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory, put
from map_drives import drive

from labgym.envs import LabPointNavEnv
from labgym.envs.conditions.beaker import Beaker
from labgym.envs.labnav.tasks import task_of
from labgym.errors import LabgymError
from labgym.navigation import GoalPair, goal_pairs, shortest_path
from labgym.policies import EpisodeStart, GroundTruth, make_policy
from labgym.policies.gentle import GentleLimits

LAYOUT = island_laboratory()
AROUND = goal_pairs(LAYOUT)[1]


@pytest.fixture(scope="module")
def env():
    made = LabPointNavEnv(layout=LAYOUT, observation="lidar")
    yield made
    made.close()


def test_it_needs_the_map():
    with pytest.raises(LabgymError, match="map"):
        make_policy("stack").reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))


def test_it_drives_with_drifting_odometry_and_stops_in_the_disc(env):
    driven = drive(
        make_policy("stack"), LAYOUT, AROUND.start, AROUND.goal, env=env, task="odometry", drift=2.0, lidar_sigma=0.03
    )
    assert driven.stopped
    assert driven.contacts == 0
    assert driven.error(AROUND.goal)[0] < 0.32
    shortest = shortest_path(LAYOUT, AROUND.start, AROUND.goal)
    assert shortest is not None
    assert driven.length < 1.1 * shortest.length


def test_it_passes_an_obstacle_that_the_map_lacks():
    path = shortest_path(LAYOUT, AROUND.start, AROUND.goal)
    assert path is not None
    x, y = path.points[len(path.points) // 2]
    true = LAYOUT.replace(placements=(*LAYOUT.placements, put("LabStool_9", "LabStool", float(x), float(y) + 0.1)))
    driven = drive(make_policy("stack"), true, AROUND.start, AROUND.goal, old=LAYOUT, task="moved")
    assert driven.stopped
    assert driven.contacts == 0
    assert driven.error(AROUND.goal)[0] < 0.32


def test_it_docks_at_a_station_that_stands_off_the_map():
    hood = LAYOUT.placement("FumeHood_1")
    dx, dy, turn = 0.05, -0.06, math.radians(-4.0)
    x, y, z = hood.position
    shifted = hood.model_copy(update={"position": (x + dx, y + dy, z), "yaw": hood.yaw + turn})
    true = LAYOUT.replace(
        placements=tuple(shifted if placement.id == hood.id else placement for placement in LAYOUT.placements)
    )
    box = true.box("FumeHood_1")
    front, reach = box.front, box.depth / 2.0 + 0.6
    goal = (box.x + reach * front[0], box.y + reach * front[1], math.atan2(-front[1], -front[0]))
    before = LAYOUT.box("FumeHood_1")
    mapped = (before.x, before.y - before.depth / 2.0 - 0.6, math.pi / 2.0)
    driven = drive(
        make_policy("stack"), true, (6.5, 3.8, 3.0), goal, old=LAYOUT, mapped_goal=mapped, task="dock", docking=True
    )
    assert driven.stopped
    assert driven.contacts == 0
    distance, angle = driven.error(goal)
    assert distance < 0.02
    assert angle < 0.02


def test_with_a_beaker_its_commands_keep_to_the_limits(env):
    beaker = Beaker()
    driven = drive(make_policy("stack"), LAYOUT, AROUND.start, AROUND.goal, env=env, task="carry", beaker=beaker)
    assert driven.stopped
    limits = GentleLimits.of(beaker)
    v = np.array([0.0, *(command[0] for command in driven.commands)])
    assert np.abs(np.diff(v)).max() <= 0.1 * limits.acceleration + 1e-9
    variation = np.abs(np.diff([0.0, *limits.weights, 0.0])).sum()
    assert np.abs(np.diff(v, 2)).max() <= 0.1 * limits.acceleration * variation + 1e-9
    lateral = np.abs([command[0] * command[1] for command in driven.commands])
    assert lateral.max() <= 1.15 * limits.lateral


def test_the_same_drive_is_driven_the_same_way_again(env):
    drives = [drive(make_policy("stack"), LAYOUT, AROUND.start, AROUND.goal, env=env, steps=30) for _ in range(2)]
    assert drives[0].poses == drives[1].poses


def test_the_next_goal_keeps_the_map_and_the_estimated_pose():
    policy = make_policy("stack")

    def start(goal, at):
        pair = GoalPair(0, at, goal, "anywhere", "anywhere")
        return EpisodeStart(
            goal=(1.0, 0.0),
            rng=np.random.default_rng(0),
            task=task_of("shift").announced(2),
            truth=GroundTruth(LAYOUT, pair, at),
        )

    policy.reset(start(AROUND.goal, AROUND.start))
    policy._costmap.evidence[20, 20] = 5
    estimate = (AROUND.start[0] + 0.2, AROUND.start[1] + 0.1, 0.5)
    policy._localizer.pose = estimate
    policy.next_goal(start(AROUND.start, (3.0, 1.0, 0.0)))
    assert policy.pose == estimate
    assert policy._costmap.evidence[20, 20] == 5
    policy.reset(start(AROUND.goal, AROUND.start))
    assert policy.pose == AROUND.start
