"""The scores against closed forms and bounds."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.eval.labnav import scores
from labgym.eval.labnav.scores import Leg

LENGTH = st.floats(0.1, 100.0)
TIME = st.floats(0.1, 1000.0)
WAY = st.floats(0.0, 1000.0)


@settings(max_examples=60, deadline=None)
@given(LENGTH, TIME, WAY, WAY, st.floats(0.0, 0.1), st.booleans())
def test_every_score_is_a_share_and_0_without_success(length, time, driven, near, rise, success):
    pushes = [(8.0, near)]
    every = [
        scores.timed(success, length, time),
        scores.moved(success, length, driven, pushes),
        scores.people(success, length, time, near),
        scores.dock(success, near / 1000.0, rise),
        scores.carry(success, length, time, rise, 0.01),
        scores.shift([Leg(success, rise < 0.05, length, driven)], 3),
    ]
    assert all(0.0 <= one <= 1.0 for one in every)
    assert success or every == [0.0] * 6


def test_a_robot_at_full_speed_all_the_way_scores_1_and_half_of_it_in_twice_the_time():
    assert scores.timed(True, 12.0, 12.0) == 1.0
    assert scores.timed(True, 12.0, 10.0) == 1.0
    assert scores.timed(True, 12.0, 24.0) == 0.5
    assert scores.timed(True, 2.0, 16.0) == scores.timed(True, 2.0, 100.0) == pytest.approx(0.125)


def test_pushing_the_own_mass_over_the_own_way_halves_the_effort():
    assert scores.effort(10.0, [(40.0, 10.0)], mass=40.0) == 0.5
    assert scores.effort(10.0, [(20.0, 10.0), (10.0, 20.0)], mass=40.0) == 0.5
    assert scores.moved(True, 10.0, 20.0, [(40.0, 10.0)]) == pytest.approx(0.5 * scores.effort(10.0, [(40.0, 10.0)]))
    assert scores.effort(10.0, []) == 1.0


def test_people_weigh_success_time_and_distance():
    assert scores.people(True, 10.0, 10.0, 0.0) == pytest.approx(1.0)
    assert scores.people(True, 10.0, 20.0, 0.0) == pytest.approx(0.4 + 0.15 + 0.3)
    assert scores.people(True, 10.0, 20.0, 5.0) == pytest.approx(0.4 + 0.15 + 0.15)
    assert scores.people(True, 10.0, 1e9, 60.0) == pytest.approx(0.4)


def test_docking_scores_by_the_decades_of_the_error():
    assert scores.dock(True, 0.10, 0.0) == 0.0
    assert scores.dock(True, 0.01, 0.0) == scores.dock(True, 0.0, 0.0) == scores.dock(True, 0.001, -0.001) == 1.0
    assert scores.dock(True, 0.05, 0.0) == pytest.approx(math.log10(2.0))
    assert scores.dock(True, 0.0, -0.05) == pytest.approx(math.log10(2.0))
    # 20 mm are 0.2 of 0.10 m, and 1.5 degrees 0.262 of 0.10 rad: the larger error counts, -log10(0.262).
    assert scores.dock(True, 0.020, math.radians(1.5)) == pytest.approx(0.58, abs=0.01)


def test_the_liquid_may_rise_to_the_freeboard_and_counts_nothing_at_twice_of_it():
    assert scores.carry(True, 10.0, 20.0, 0.010, 0.010) == 0.5
    assert scores.carry(True, 10.0, 20.0, 0.015, 0.010) == pytest.approx(0.25)
    assert scores.carry(True, 10.0, 20.0, 0.020, 0.010) == 0.0


def test_a_shift_is_the_mean_over_all_legs_also_those_never_begun():
    whole, half = Leg(True, True, 5.0, 5.0), Leg(True, False, 5.0, 10.0)
    assert scores.shift([whole, half], 5) == pytest.approx((1.0 + 0.25) / 5)
    assert scores.shift([whole] * 5, 5) == 1.0
    assert scores.shift([Leg(True, True, 0.0, driven) for driven in (0.0, 0.3)], 2) == 0.0
