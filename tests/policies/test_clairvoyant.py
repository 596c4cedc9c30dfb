from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.conditions.beaker import Beaker
from labgym.envs.reach import robot_alone
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import Simulation
from labgym.navigation import ShortestPaths, goal_pairs
from labgym.policies.clairvoyant.motion import BODY, Motion
from labgym.policies.clairvoyant.path import clear_path, sampled, speed_limits
from labgym.policies.clairvoyant.schedule import fastest_schedule
from labgym.policies.gentle import GentleLimits

LAYOUT = island_laboratory()
PATHS = ShortestPaths(LAYOUT)
AROUND = goal_pairs(LAYOUT)[1]
LINE = sampled(np.array([[0.0, 0.0], [5.0, 0.0]]))
FAST = np.ones(len(LINE))


def nobody(time: float) -> np.ndarray:
    return np.zeros((0, 2))


def crossing(time: float) -> np.ndarray:
    """A person who crosses the line at x = 3 m, 4 s after the start."""
    return np.array([[3.0, 0.8 * (time - 4.0)]])


class World:
    def __init__(self, people=nobody) -> None:
        self.people = people

    def solids(self):
        return LAYOUT


@pytest.mark.parametrize("acceleration", [0.5, 1.0, 1.25])
def test_without_people_a_schedule_takes_the_time_of_even_acceleration_and_braking(acceleration):
    schedule = fastest_schedule(LINE, FAST, acceleration, nobody, 0.6)
    fastest = math.floor(1.0 / (0.1 * acceleration) + 1e-9) * 0.1 * acceleration
    ideal = 5.0 / fastest + fastest / acceleration
    assert ideal <= schedule.end <= ideal + 0.2
    assert schedule.places[-1] == pytest.approx(5.0)
    assert np.diff(schedule.places).min() >= -1e-9
    assert np.abs(np.diff(schedule.speeds)).max() <= 0.1 * acceleration + 1e-9
    middle = 0.05 * (schedule.speeds[1:] + schedule.speeds[:-1])
    np.testing.assert_allclose(np.diff(schedule.places), middle, atol=0.006)


def test_a_schedule_obeys_the_limits_of_speed_along_the_path():
    limits = np.where(np.abs(np.arange(len(LINE)) - 125) < 25, 0.3, 1.0)
    schedule = fastest_schedule(LINE, limits, 1.0, nobody, 0.6)
    allowed = np.interp(schedule.places, 0.02 * np.arange(len(LINE)), limits)
    assert (schedule.speeds <= allowed + 1e-6).all()
    assert schedule.end > fastest_schedule(LINE, FAST, 1.0, nobody, 0.6).end + 1.5


def test_a_schedule_touches_nobody_while_the_robot_moves_and_waits_no_longer_than_it_must():
    apart = 0.65
    free = fastest_schedule(LINE, FAST, 1.0, nobody, apart)
    schedule = fastest_schedule(LINE, FAST, 1.0, crossing, apart)
    times = 0.1 * np.arange(len(schedule.places))
    away = np.array([math.dist((x, 0.0), crossing(t)[0]) for t, x in zip(times, schedule.places, strict=True)])
    assert away[schedule.speeds > 0.0].min() >= apart - 1e-9
    unaware = np.array([math.dist((free.at(t)[0], 0.0), crossing(t)[0]) for t in times])
    assert unaware.min() < apart
    # The person leaves the line's strip after 0.65 m of the way at 0.8 m/s.
    assert free.end < schedule.end <= free.end + 2.0 * apart / 0.8 + 0.3


def test_no_schedule_leads_through_somebody_who_never_leaves():
    assert fastest_schedule(LINE, FAST, 1.0, lambda time: np.array([[3.0, 0.0]]), 0.6) is None


def test_the_path_has_clearance_where_it_costs_little():
    path = clear_path(LAYOUT, AROUND.start, AROUND.goal)
    shortest = PATHS.path(AROUND.start, AROUND.goal)
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    assert shortest.length - 1e-9 <= length <= 1.03 * shortest.length
    limits = speed_limits(path, 0.7)
    assert limits.max() == ROBOT.v_max
    assert limits.min() < 0.9


def drive(motion: Motion, steps: int = 400) -> np.ndarray:
    """Return rows (x, y, yaw, v, w) at the control steps of a robot among nothing."""
    robot, rows = Simulation(robot_alone(ROBOT)), []
    robot.place(AROUND.start)
    for k in range(steps):
        rows.append((*robot.pose, *robot.velocity))
        if motion.ended and max(map(abs, robot.velocity)) < 0.005:
            break
        robot.drive(*ROBOT.twist(*motion.action(robot.pose, robot.velocity, 0.1 * k)))
    return np.array(rows)


def test_the_motion_ends_at_rest_at_the_goal_and_its_heading_close_to_the_path():
    motion = Motion(World(), AROUND.start, AROUND.goal, heading=True)
    rows = drive(motion)
    assert motion.ended
    assert math.dist(rows[-1, :2], AROUND.goal[:2]) < 0.02
    assert abs(math.remainder(rows[-1, 2] - AROUND.goal[2], 2.0 * math.pi)) < 0.02
    assert all(PATHS.space.barriers.obstacles.nearest(rows[:, :2]) > ROBOT.chassis_radius)


def test_the_motion_keeps_off_people_whose_future_it_knows():
    path = clear_path(LAYOUT, AROUND.start, AROUND.goal)
    middle, step = path[len(path) // 2], path[len(path) // 2 + 5] - path[len(path) // 2]
    across = np.array([-step[1], step[0]]) / np.linalg.norm(step)

    def people(time: float) -> np.ndarray:
        return (middle + across * 0.9 * (time - 5.0))[None]

    rows = drive(Motion(World(people), AROUND.start, AROUND.goal))
    away = np.array([np.linalg.norm(people(0.1 * k)[0] - row[:2]) for k, row in enumerate(rows)])
    assert math.dist(rows[-1, :2], AROUND.goal[:2]) < 0.02
    assert away[np.abs(rows[:, 3]) > 0.05].min() > ROBOT.chassis_radius + BODY


def test_with_a_beaker_the_motion_keeps_to_its_limits():
    beaker = Beaker()
    rows = drive(Motion(World(), AROUND.start, AROUND.goal, beaker=beaker))
    limits = GentleLimits.of(beaker)
    assert math.dist(rows[-1, :2], AROUND.goal[:2]) < 0.02
    assert np.abs(np.diff(rows[:, 3])).max() <= 0.1 * limits.acceleration + 0.005
    assert np.abs(rows[:, 3] * rows[:, 4]).max() <= 1.2 * limits.lateral
