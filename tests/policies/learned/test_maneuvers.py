from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.policies.learned.maneuvers import (
    FaceGoal,
    PathCommitment,
    StuckDetector,
    TurnInPlace,
    free_side,
    goal_bearing,
    goal_point,
)


def test_a_goal_in_polar_form_is_a_point_and_a_bearing() -> None:
    observation = {"goal": np.array([2.0, math.cos(0.7), math.sin(0.7)])}
    assert goal_bearing(observation) == pytest.approx(0.7)
    assert goal_point(observation) == pytest.approx((2.0 * math.cos(0.7), 2.0 * math.sin(0.7)))


@pytest.mark.parametrize("bearing, nearer_left, side", [(0.2, True, -1.0), (0.2, False, 1.0), (1.5, True, 1.0)])
def test_the_robot_turns_to_the_freer_side_or_to_a_goal_abeam(bearing: float, nearer_left: bool, side: float) -> None:
    depth = np.full(IMAGE_SHAPE, 5.0)
    half = np.s_[:, :64] if nearer_left else np.s_[:, 64:]
    depth[half] = 1.0
    assert free_side(depth, bearing) == side


def test_the_goal_is_faced_once() -> None:
    facing = FaceGoal(0.5)
    assert [facing.turning(bearing) for bearing in (2.0, -0.6, 0.4, 3.0)] == [True, True, False, False]


def test_a_robot_is_stuck_if_it_moved_less_than_the_distance_over_the_last_steps() -> None:
    detector = StuckDetector(steps=3, distance=0.1)
    states = []
    for x in (0.0, 0.2, 0.2, 0.25, 0.29, 0.5):
        detector.add(np.array([x, 0.0]))
        states.append(detector.stuck)
    assert states == [False, False, False, True, True, False]
    detector.clear()
    assert not detector.stuck


def test_a_path_is_kept_for_a_distance_or_a_number_of_steps() -> None:
    commitment = PathCommitment(distance=0.5, patience=4)
    commitment.begin(10, np.array([1.0, 0.0]))
    assert not commitment.over(11, np.array([1.4, 0.0]))
    assert commitment.over(11, np.array([1.6, 0.0]))
    assert commitment.over(14, np.array([1.0, 0.0]))
    commitment.begin(20, np.zeros(2), distance=2.0)
    assert not commitment.over(21, np.array([1.9, 0.0]))


def test_a_turn_ends_after_its_angle_across_the_wrap() -> None:
    turn = TurnInPlace(1.0, yaw=3.0, angle=0.5)
    assert [turn.over(yaw) for yaw in (3.1, -3.1, -2.7)] == [False, False, True]
    assert turn.action(ROBOT)[0] == 0.0
    assert turn.action(ROBOT)[1] > 0.0


def test_swept_and_net_angles_differ_where_the_robot_first_turns_the_other_way() -> None:
    swept, net = (TurnInPlace(1.0, 0.0, 0.5, measure) for measure in ("swept", "net"))
    headings = (-0.2, 0.0, 0.15)
    assert [swept.over(yaw) for yaw in headings] == [False, False, True]
    assert [net.over(yaw) for yaw in headings] == [False, False, False]


def test_a_blocked_turn_ends_after_its_patience() -> None:
    turn = TurnInPlace(-1.0, 0.0, 0.5, patience=3)
    assert [turn.over(0.0) for _ in range(3)] == [False, False, True]
