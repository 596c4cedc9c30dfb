"""The expert that plans on what the lidar has seen: its grid, its prices, and its ways."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory
from scipy.ndimage import distance_transform_edt

pytest.importorskip("stable_baselines3")

from labgym.envs.conditions.panes import GlassPane, with_panes
from labgym.training.explorer import (
    ANGLES,
    AVERSION,
    CELL_M,
    CLEAR_M,
    COMFORT_M,
    FREE,
    OCCUPIED,
    STANDING,
    UNSEEN,
    Explorer,
    in_sight,
    priced,
    remember,
)

SIDE = 60
CENTER = np.array([3.05, 3.05, 0.4])
ORIGIN = np.zeros(2)


def square(half: float, yaw: float) -> np.ndarray:
    """Ranges from the middle of a square room."""
    angles = ANGLES + yaw
    return half / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))


def empty() -> tuple[np.ndarray, np.ndarray]:
    return np.full((SIDE, SIDE), UNSEEN, np.uint8), np.zeros((SIDE, SIDE), np.uint8)


def test_rays_free_the_floor_and_end_at_the_walls():
    cells, returns = empty()
    remember(cells, returns, ORIGIN, CENTER, square(2.0, CENTER[2]))
    rows, columns = np.indices(cells.shape)
    centers = (np.stack([columns, rows], axis=-1) + 0.5) * CELL_M
    reach = np.abs(centers - CENTER[:2]).max(axis=-1)
    assert (cells[reach > 2.2] == UNSEEN).all()
    assert (cells[reach < 1.5] == FREE).mean() > 0.99
    assert not (cells[reach < 1.8] == OCCUPIED).any()
    # 180 rays meet 160 cells of the walls, some of them twice.
    assert (cells == OCCUPIED).sum() > 120


def test_what_stands_stays_when_a_ray_passes_and_what_left_does_not():
    near, far = square(1.0, CENTER[2]), square(2.0, CENTER[2])
    for scans, stays in ((STANDING, True), (STANDING - 1, False)):
        cells, returns = empty()
        for _ in range(scans):
            remember(cells, returns, ORIGIN, CENTER, near)
        met = returns >= scans
        assert met.sum() > 60
        remember(cells, returns, ORIGIN, CENTER, far)
        assert (cells[met] == OCCUPIED).all() == stays


def test_prices_follow_the_distance_to_what_is_occupied():
    rng = np.random.default_rng(3)
    cells = np.where(rng.random((SIDE, SIDE)) < 0.01, OCCUPIED, FREE).astype(np.uint8)
    cells[:12, :12], cells[-12:, -12:] = FREE, FREE
    source, target = 2 * SIDE + 2, (SIDE - 3) * SIDE + SIDE - 3
    blocked, prices = (each.reshape(cells.shape) for each in priced(cells, source, target))
    distance = CELL_M * distance_transform_edt(cells != OCCUPIED)
    away = np.ones(cells.shape, bool)
    away[:6, :6] = away[-6:, -6:] = away[0] = away[-1] = away[:, 0] = away[:, -1] = False
    np.testing.assert_array_equal(blocked[away], distance[away] < CLEAR_M)
    lack = np.clip((COMFORT_M - distance) / (COMFORT_M - CLEAR_M), 0.0, 1.0)
    priced_here = away & ~blocked
    np.testing.assert_allclose(prices[priced_here], (1.0 + AVERSION * lack**2)[priced_here])


def test_it_turns_away_from_a_wall_between_it_and_the_goal():
    # A wall ahead from 2 m on the right to 0.5 m on the left, and the goal behind it.
    angles = ANGLES[np.abs(ANGLES) < 1.4]
    ranges = np.full(180, 10.0)
    ahead = 1.0 / np.cos(angles)
    left = ahead * np.sin(angles)
    ranges[np.abs(ANGLES) < 1.4] = np.where((left > -2.0) & (left < 0.5), ahead, 10.0)
    layout = island_laboratory()
    x0, y0, x1, y1 = layout.floor.bounds
    pose = ((x0 + x1) / 2.0 - 1.0, (y0 + y1) / 2.0, 0.0)
    expert = Explorer()
    rest, goal = (0.0, 0.0), np.array([2.0, 1.0, 0.0])
    forward, turn = expert.action(layout, pose, rest, goal, ranges)
    assert turn > 0.3
    expert.restart()
    assert expert.action(layout, pose, (0.0, 0.0), np.array([2.0, 1.0, 0.0]), np.full(180, 10.0))[1] == pytest.approx(
        0.0, abs=0.2
    )
    assert forward < 1.0


@pytest.mark.parametrize("goal", [50.0, 0.0])
def test_a_goal_outside_of_the_floor_or_under_the_robot_gives_an_action(goal):
    layout = island_laboratory()
    x0, y0, x1, y1 = layout.floor.bounds
    pose = ((x0 + x1) / 2.0, (y0 + y1) / 2.0, 1.0)
    action = Explorer().action(
        layout, pose, (0.0, 0.0), np.array([goal, math.cos(0.3), math.sin(0.3)]), np.full(180, 3.0)
    )
    assert all(-1.0 <= each <= 1.0 for each in action)
    assert (action == (0.0, 0.0)) == (goal == 0.0)


def test_a_pane_counts_as_a_whole_once_the_scan_has_its_return():
    layout = island_laboratory()
    x0, y0, x1, y1 = layout.floor.bounds
    x, y = (x0 + x1) / 2.0, (y0 + y1) / 2.0
    layout = with_panes(layout, [GlassPane(x + 0.9, y, math.pi / 2.0, width=1.6)])
    goal, pose = np.array([2.5, 1.0, 0.0]), (x, y, 0.0)
    through, along = np.full(180, 10.0), np.full(180, 10.0)
    along[89:92] = 0.9
    expert = Explorer()
    forward, turn = expert.action(layout, pose, (0.0, 0.0), goal, through)
    assert forward > 0.5
    assert turn == pytest.approx(0.0, abs=0.2)
    expert.action(layout, pose, (0.0, 0.0), goal, along)
    _, turn = expert.action(layout, pose, (0.0, 0.0), goal, through)
    assert abs(turn) > 0.5


def test_people_in_sight_are_those_whom_no_wall_hides():
    people = np.array([[2.0, 0.0, 0.0, 1.0], [0.0, 2.0, 1.0, 0.0], [-2.0, 0.0, 1.0, 0.0]])
    ranges = np.full(180, 10.0)
    ranges[130:140] = 1.0
    seen = in_sight(people + np.array([1.0, 1.0, 0.0, 0.0]), (1.0, 1.0, 0.0), ranges)
    np.testing.assert_allclose(seen, people[[0, 2]], atol=1e-12)
    turned = in_sight(people[:1], (0.0, 0.0, math.pi / 2.0), np.full(180, 10.0))
    np.testing.assert_allclose(turned, [[0.0, -2.0, 1.0, 0.0]], atol=1e-12)
