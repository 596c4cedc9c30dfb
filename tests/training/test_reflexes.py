"""The command that touches nothing in the next second: judged by drives that are stepped apart from it."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("numba")

from labgym.envs.robot import ROBOT
from labgym.training.reflexes import nearest_safe

NOBODY = np.empty((0, 4))
NOTHING = np.empty((0, 2))


def drive(points, people, forward, turn, steps=60):
    """Return the least clearances from points and, while it moves, from people; and where a robot ends."""
    x = y = yaw = v = w = 0.0
    least, nearest = math.inf, math.inf
    people = people.copy()
    for _ in range(steps):
        axes = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        around = (points - (x, y)) @ axes
        others = np.hstack([(people[:, :2] - (x, y)) @ axes, people[:, 2:] @ axes])
        speed, rate = nearest_safe(around, others, (v, w), forward, turn)
        for _ in range(20):
            v += float(np.clip(speed * ROBOT.v_max - v, -0.005 * ROBOT.acceleration, 0.005 * ROBOT.acceleration))
            w += float(
                np.clip(rate * ROBOT.w_max - w, -0.005 * ROBOT.turn_acceleration, 0.005 * ROBOT.turn_acceleration)
            )
            yaw, x, y = yaw + 0.005 * w, x + 0.005 * v * math.cos(yaw), y + 0.005 * v * math.sin(yaw)
            people[:, :2] += 0.005 * people[:, 2:]
            if len(points):
                least = min(least, float(np.hypot(*(points - (x, y)).T).min()) - ROBOT.chassis_radius)
            if len(people) and v > 0.02:
                nearest = min(nearest, float(np.hypot(*(people[:, :2] - (x, y)).T).min()) - ROBOT.chassis_radius - 0.3)
    return least, nearest, (x, y)


def test_with_nothing_around_the_wanted_action_comes_back():
    for forward, turn in ((1.0, 0.0), (0.3, -0.9), (0.0, 1.0)):
        assert nearest_safe(NOTHING, NOBODY, (0.5, 0.0), forward, turn) == (forward, turn)


@pytest.mark.parametrize("seed", range(6))
def test_it_touches_nothing_that_stands(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-4.0, 4.0, (40, 2))
    points = points[np.hypot(*points.T) > 0.5]
    straight = np.hypot(points[:, 1], np.maximum(0.0, -points[:, 0])) - ROBOT.chassis_radius
    least, _, (x, y) = drive(points, NOBODY, 1.0, 0.0)
    assert least > 0.0
    assert math.hypot(x, y) > 0.3 or straight.min() < 0.1


def test_it_stops_before_a_wall_from_full_speed():
    wall = np.column_stack([np.full(81, 2.0), np.linspace(-4.0, 4.0, 81)])
    least, _, (x, _) = drive(wall, NOBODY, 1.0, 0.0, steps=25)
    assert 0.0 < least < 0.5
    assert x > 1.0


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.6, 2.4])
def test_it_rests_or_gives_way_when_somebody_comes(angle):
    person = np.array([[3.0 * math.cos(angle), 3.0 * math.sin(angle), -math.cos(angle), -math.sin(angle)]])
    person[0, :2] += (0.3, 0.1)
    _, nearest, _ = drive(NOTHING, person, 0.8, 0.0, steps=50)
    assert nearest > 0.0


def test_it_waits_while_somebody_stands_against_it():
    behind = np.array([[-0.58, 0.0, 0.0, 0.0]])
    assert nearest_safe(NOTHING, behind, (0.0, 0.0), 1.0, 0.0)[0] == 0.0
    away = np.array([[-0.58, 0.0, -1.0, 0.0]])
    assert nearest_safe(NOTHING, away, (0.0, 0.0), 1.0, 0.0)[0] > 0.5
