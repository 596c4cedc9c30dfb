from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.errors import LabgymError
from labgym.eval.driving.assignments import assignment_between
from labgym.eval.driving.drive import drive_episodes
from labgym.geometry import OrientedBox
from labgym.layouts import Door, Layout, Placement, Room
from labgym.layouts.placement import Size
from labgym.navigation import occupancy
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.grid_planner import GridPlanner
from labgym.suites import suite_of


def observation(bearing: float, distance: float = 3.0) -> dict[str, np.ndarray]:
    return {
        "goal": np.array([distance, math.cos(bearing), math.sin(bearing)], dtype=np.float32),
        "velocity": np.zeros(2, dtype=np.float32),
        "odometry": np.zeros(3),
    }


def start(seed: int = 0) -> EpisodeStart:
    return EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(seed))


def test_straight_drives_at_a_goal_ahead():
    policy = make_policy("straight")
    policy.reset(start())
    assert policy.act(observation(0.0)) == pytest.approx([1.0, 0.0])


@pytest.mark.parametrize("bearing", [0.2, 1.0, 3.0, -0.2, -1.0, -3.0])
def test_straight_turns_in_place_towards_a_goal_that_is_far_off_its_heading(bearing):
    policy = make_policy("straight")
    policy.reset(start())
    forward, turn = policy.act(observation(bearing))
    assert math.copysign(1.0, turn) == math.copysign(1.0, bearing)
    assert bool(forward == 0.0) is (abs(bearing) > 0.5)


def test_random_actions_fill_the_action_space_evenly():
    policy = make_policy("random")
    policy.reset(start())
    actions = np.array([policy.act(observation(0.0)) for _ in range(4000)])
    assert actions.shape == (4000, 2)
    assert np.abs(actions).max() <= 1.0
    np.testing.assert_allclose(actions.mean(axis=0), 0.0, atol=0.04)
    np.testing.assert_allclose(actions.var(axis=0), 1.0 / 3.0, atol=0.03)


def test_random_actions_repeat_with_the_episodes_seed_alone():
    policy = make_policy("random")
    policy.reset(start(5))
    first = [policy.act(observation(0.0)).tolist() for _ in range(5)]
    policy.reset(start(6))
    assert policy.act(observation(0.0)).tolist() != first[0]
    policy.reset(start(5))
    assert [policy.act(observation(1.0)).tolist() for _ in range(5)] == first


def test_astar_without_the_map_says_so():
    with pytest.raises(LabgymError, match="map"):
        make_policy("astar").reset(start())


def test_astar_takes_a_passage_that_its_grid_refuses_by_an_exact_path(monkeypatch):
    rows = (OrientedBox(5.0, 1.59, 0.75, 3.18), OrientedBox(5.0, 5.42, 0.75, 3.16))
    layout = Layout(
        id="passage",
        protocols=(),
        floor=Room(width=10.0, depth=7.0, doors=(Door(wall="front", offset=2.0),)).floor,
        placements=tuple(
            Placement(
                id=f"LabBench1800_{k}",
                asset="LabBench1800",
                position=(box.x, box.y, 0.0),
                size=Size(width=box.width, depth=box.depth, height=0.9),
            )
            for k, box in enumerate(rows, 1)
        ),
    )
    start, goal = (2.0, 3.51, 0.0), (8.0, 3.51, 0.0)
    assert GridPlanner(occupancy(layout)).plan(start[:2], goal[:2]) is None
    episode = assignment_between(layout, 0, start, goal)
    (drive,) = drive_episodes(make_policy("astar"), layout, [episode], suite_of([layout]), "astar", 0)
    assert drive.row.success
    assert drive.row.contacts == 0
    assert drive.row.spl > 0.99
    monkeypatch.setattr("labgym.policies.astar._or_exact", lambda path, truth: path)
    (drive,) = drive_episodes(make_policy("astar"), layout, [episode], suite_of([layout]), "astar", 0)
    assert not drive.row.success
