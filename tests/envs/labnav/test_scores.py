"""The scores against closed forms and bounds."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError

import gymnasium as gym
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.envs.labnav.task import LegResult, Level, Result, register, timed
from labgym.envs.labnav.tasks import FIGURE_TASKS, TASKS, task_of
from labgym.envs.labnav.tasks.carry import carry
from labgym.envs.labnav.tasks.dock import dock
from labgym.envs.labnav.tasks.moved import effort, moved
from labgym.envs.labnav.tasks.people import people
from labgym.envs.presets import labnav_id
from labgym.envs.robot import ROBOT
from labgym.errors import UnknownNameError

LENGTH = st.floats(0.1, 100.0)
TIME = st.floats(0.1, 1000.0)
WAY = st.floats(0.0, 1000.0)


def shift(legs, goals):
    return task_of("shift").score(Result(False, 0.0, 0.0, 0.0, 0.0, 0.0, tuple(legs), goals), {}, {})


@settings(max_examples=60, deadline=None)
@given(LENGTH, TIME, WAY, WAY, st.floats(0.0, 0.1), st.booleans())
def test_every_score_is_a_share_and_0_without_success(length, time, driven, near, rise, success):
    pushes = [(8.0, near)]
    every = [
        timed(success, length, time),
        moved(success, length, driven, pushes),
        people(success, length, time, near),
        dock(success, near / 1000.0, rise),
        carry(success, length, time, rise, 0.01),
        shift([LegResult(success, rise < 0.05, length, driven)], 3),
    ]
    assert all(0.0 <= one <= 1.0 for one in every)
    assert success or every == [0.0] * 6


def test_a_robot_at_full_speed_all_the_way_scores_1_and_half_of_it_in_twice_the_time():
    assert timed(True, 12.0, 12.0) == 1.0
    assert timed(True, 12.0, 10.0) == 1.0
    assert timed(True, 12.0, 24.0) == 0.5
    assert timed(True, 2.0, 16.0) == timed(True, 2.0, 100.0) == pytest.approx(0.125)


def test_pushing_the_own_mass_over_the_own_way_halves_the_effort():
    assert effort(10.0, [(40.0, 10.0)], mass=40.0) == 0.5
    assert effort(10.0, [(20.0, 10.0), (10.0, 20.0)], mass=40.0) == 0.5
    assert moved(True, 10.0, 20.0, [(40.0, 10.0)]) == pytest.approx(0.5 * effort(10.0, [(40.0, 10.0)]))
    assert effort(10.0, []) == 1.0


def test_people_weigh_success_time_and_distance():
    assert people(True, 10.0, 10.0, 0.0) == pytest.approx(1.0)
    assert people(True, 10.0, 20.0, 0.0) == pytest.approx(0.4 + 0.15 + 0.3)
    assert people(True, 10.0, 20.0, 5.0) == pytest.approx(0.4 + 0.15 + 0.15)
    assert people(True, 10.0, 1e9, 60.0) == pytest.approx(0.4)


def test_docking_scores_by_the_decades_of_the_error():
    assert dock(True, 0.10, 0.0) == 0.0
    assert dock(True, 0.01, 0.0) == dock(True, 0.0, 0.0) == dock(True, 0.001, -0.001) == 1.0
    assert dock(True, 0.05, 0.0) == pytest.approx(math.log10(2.0))
    assert dock(True, 0.0, -0.05) == pytest.approx(math.log10(2.0))
    # 20 mm are 0.2 of 0.10 m, and 1.5 degrees 0.262 of 0.10 rad: the larger error counts, -log10(0.262).
    assert dock(True, 0.020, math.radians(1.5)) == pytest.approx(0.58, abs=0.01)


def test_the_liquid_may_rise_to_the_freeboard_and_counts_nothing_at_twice_of_it():
    assert carry(True, 10.0, 20.0, 0.010, 0.010) == 0.5
    assert carry(True, 10.0, 20.0, 0.015, 0.010) == pytest.approx(0.25)
    assert carry(True, 10.0, 20.0, 0.020, 0.010) == 0.0


def test_a_shift_is_the_mean_over_all_legs_also_those_never_begun():
    whole, half = LegResult(True, True, 5.0, 5.0), LegResult(True, False, 5.0, 10.0)
    assert shift([whole, half], 5) == pytest.approx((1.0 + 0.25) / 5)
    assert shift([whole] * 5, 5) == 1.0
    assert shift([LegResult(True, True, 0.0, driven) for driven in (0.0, 0.3)], 2) == 0.0


def test_every_task_of_the_figure_scores_its_results():
    result = Result(
        success=True, shortest=10.0, path_length=20.0, time=20.0, final_distance=0.05, final_heading=0.0,
        legs=(LegResult(True, True, 5.0, 10.0),), goals=2,
    )  # fmt: skip
    outcomes = {"changes": {"pushed": {}}, "people": {"close_seconds": 5.0}, "payload": {"highest": 0.015}}
    beaker = {"radius": 0.04, "depth": 0.1, "freeboard": 0.01, "damping": 0.005}
    expected = {
        "aisle": 0.5, "moved": 0.5, "people": 0.7, "odometry": 0.5, "dock": math.log10(2.0), "glass": 0.5,
        "carry": 0.25, "shift": 0.25,
    }  # fmt: skip
    assert tuple(TASKS)[:8] == FIGURE_TASKS
    for name, score in expected.items():
        assert task_of(name).score(result, outcomes, {"payload": beaker}) == pytest.approx(score), name


def test_the_properties_that_policies_are_told_are_those_of_the_level():
    told = {name: task_of(name).announced(2) for name in FIGURE_TASKS}
    assert all(each.rests for each in told.values())
    expected = {
        "drift": {"moved", "odometry", "shift"},
        "noise": {"odometry", "shift"},
        "people": {"people", "carry", "shift"},
        "glass": {"glass"},
        "mounting": {"dock"},
    }
    for name, tasks in expected.items():
        assert {task for task, each in told.items() if getattr(each, name)} == tasks
    assert {task: each.dock_slack for task, each in told.items() if each.dock_slack} == {"shift": 0.07}
    weights = {task: (each.weights.time, each.weights.people, each.weights.length) for task, each in told.items()}
    special = {"people": (0.3, 0.3, 0.0), "carry": (1.0, 0.0, 0.0), "shift": (0.1, 0.0, 1.0)}
    assert weights == dict.fromkeys(FIGURE_TASKS, (1.0, 0.1, 0.0)) | special
    peopled = {name: [number for number in (1, 2, 3) if task_of(name).announced(number).people] for name in TASKS}
    assert {name: levels for name, levels in peopled.items() if levels} == {
        "aisle": [3], "people": [1, 2, 3], "carry": [1, 2, 3], "shift": [2, 3],
    }  # fmt: skip


def test_the_environment_of_each_task_is_registered_with_its_time_limit():
    for name in FIGURE_TASKS:
        spec = gym.spec(labnav_id(name))
        assert spec.max_episode_steps == round(task_of(name).seconds / ROBOT.control_dt)


def test_without_a_beaker_carrying_is_a_drive_in_time():
    result = Result(True, 10.0, 12.0, 25.0, 0.0, 0.0)
    assert task_of("carry").score(result, {}, {}) == timed(True, 10.0, 25.0) == 0.4


def test_the_levels_of_carrying_leave_2_or_1_centimeter_of_freeboard_and_the_third_errs():
    beakers = [task_of("carry").level(number).conditions[0]["beaker"]["freeboard"] for number in (1, 2, 3)]
    assert beakers == [0.020, 0.010, 0.010]
    assert [bool(task_of("carry").level(number).odometry) for number in (1, 2, 3)] == [False, False, True]
    assert len({str(task_of("carry").level(number).conditions[1]) for number in (1, 2, 3)}) == 1


def test_an_episode_that_says_nothing_else_has_one_goal_in_one_room_8_to_25_meters_away():
    level = Level()
    assert (level.goals, level.rooms, level.lengths, level.detour, level.slip) == (
        (1, 1), (1, 1), (8.0, 25.0), 1.0, (0.02, 1.0)
    )  # fmt: skip
    assert {name: task_of(name).seconds for name in ("aisle", "shift")} == {"aisle": 120.0, "shift": 1200.0}


def test_registering_a_task_returns_it_and_results_do_not_change():
    assert register(TASKS["aisle"]) is TASKS["aisle"]
    with pytest.raises(FrozenInstanceError):
        LegResult(True, True, 1.0, 1.0).success = False


def test_the_sensors_of_a_level_have_its_errors():
    quiet, noisy = Level(), Level(lidar=0.03, color=25.5, redwood=True, odometry={"along": 0.01})
    for observation, kinds in (("lidar", ["gaussian"]), ("depth", ["redwood"]), ("rgbd", ["gaussian", "redwood"])):
        assert [noise for sensor in quiet.sensors(observation) for noise in sensor.noise] == []
        sensors = noisy.sensors(observation)
        assert [noise.kind for sensor in sensors for noise in sensor.noise] == kinds
        assert (sensors[0].along, sensors[2].kind) == (0.01, "odometry_velocity")
        assert quiet.sensors(observation)[2].kind == "velocity"
    with pytest.raises(UnknownNameError, match="observation"):
        quiet.sensors("sound")
