"""Latency, parking and the failure taxonomy."""

from __future__ import annotations

import math

import pytest

from labgym.envs.labnav.tasks import TASKS
from labgym.envs.parts.braking import Parking
from labgym.eval.labnav.rules import Finish, delay_of, ending_of, is_slow


@pytest.mark.parametrize(
    ("latency", "steps"), [(0.0, 0), (0.001, 1), (0.1, 1), (0.1000001, 2), (0.3, 3), (0.25, 3), (1.0, 10)]
)
def test_an_action_comes_late_by_whole_control_steps(latency, steps):
    assert delay_of(latency) == steps


def test_a_policy_is_slow_beyond_its_declaration_and_a_control_step():
    assert [is_slow(0.09, 0.0), is_slow(0.11, 0.0), is_slow(0.29, 0.3), is_slow(0.31, 0.3)] == [False, True] * 2


def test_the_evaluator_brakes_within_seven_tenths_of_the_radius():
    assert TASKS["aisle"].braking_distance == pytest.approx(0.252)


def test_parking_brakes_turns_and_stays():
    parking = Parking(heading=0.0, stay=3)
    assert parking.action((0.0, 0.0, 1.0), (0.5, 0.0)).tolist() == [0.0, 0.0]
    turn = parking.action((0.0, 0.0, 1.0), (0.0, 0.0))
    assert turn[0] == 0.0
    assert turn[1] < 0.0
    assert [parking.action((0.0, 0.0, 0.001), (0.0, 0.0)) is None for _ in range(4)] == [False, False, False, True]


def test_parking_without_a_heading_ends_at_rest():
    parking = Parking()
    assert parking.action((0.0, 0.0, 1.0), (0.0, 0.3)).tolist() == [0.0, 0.0]
    assert parking.action((0.0, 0.0, 1.0), (0.0, 0.0)) is None


def test_a_turn_that_never_ends_is_given_up():
    parking = Parking(heading=math.pi / 2.0)
    steps = 0
    while parking.action((0.0, 0.0, 0.0), (0.0, 0.0)) is not None:
        steps += 1
        assert steps < 200
    assert steps == 80


REACHED = Finish(rule="", parked=True, inside=True, believed=True)


@pytest.mark.parametrize(
    ("changes", "ending"),
    [
        ({}, "success"),
        ({"error": "RuntimeError"}, "error"),
        ({"rule": "contact", "parked": False}, "contact"),
        ({"rule": "stuck", "parked": False}, "stuck"),
        ({"inside": False}, "lost"),
        ({"inside": False, "believed": False}, "wrong place"),
        ({"parked": False, "waited": 40.0}, "frozen"),
        ({"parked": False, "waited": 5.0}, "time"),
        ({"parked": False, "inside": True}, "time"),
        ({"docked": False}, "undocked"),
        ({"spilt": True}, "spilt"),
    ],
)
def test_every_way_to_fail_has_a_name(changes, ending):
    from dataclasses import replace

    assert ending_of(replace(REACHED, **changes)) == ending
